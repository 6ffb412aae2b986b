//! Stage 4, cables to arm: the joint under the torque of the cables, its weight, friction, play and what acts from outside.

use super::config::{OutputBoundary, PlantConfig};
use super::step_input::Step;
use crate::drive::Response;
use crate::dry_friction::{BuildUp, DryFriction};
use crate::effect::{Component, JointPort, PRESLIDING_RAD};
use crate::effect_set::EffectStates;
use crate::load::{inertia_kg_m2, weight_nm};
use crate::parameters::LoadParameters;
use crate::play::Play;
use crate::sheath::End;
use crate::transmission::{Outside, Transmission, TransmissionConfig};

/// Joint with its load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Joint {
    /// Angle, rad.
    pub theta_rad: f64,
    /// Speed in the middle of the last step, rad/s.
    pub omega_rad_s: f64,
    /// Change of the speed by that step, rad/s; zero without inertia.
    gained_rad_s: f64,
    /// Part of the dry friction that acts, -1 to 1.
    pub presliding: f64,
    /// Of the output pulley before the arm.
    play: Play,
}

impl Joint {
    /// At rest in the middle of the play.
    pub const fn at_rest(theta_rad: f64) -> Self {
        Self { theta_rad, omega_rad_s: 0.0, gained_rad_s: 0.0, presliding: 0.0, play: Play::CENTRED }
    }

    /// Speed at the end of the last step, rad/s, extrapolated.
    #[inline]
    pub fn omega_now_rad_s(&self) -> f64 {
        self.omega_rad_s + 0.5 * self.gained_rad_s
    }

    /// What effects say of the joint.
    #[inline]
    pub fn port(&self, step: &Step, states: &mut EffectStates, mass_kg: f64) -> JointPort {
        let mut port = JointPort {
            t_s: step.t_s,
            dt_s: step.dt_s,
            theta_rad: self.theta_rad,
            omega_rad_s: self.omega_rad_s,
            mass_kg,
            torque_nm: 0.0,
            coulomb_nm: 0.0,
            presliding_rad: PRESLIDING_RAD,
            build_up: BuildUp::Linear,
            play_rad: 0.0,
        };
        if step.config.effects.touches(Component::Joint) {
            step.config.effects.joint(states, &mut port);
        }
        port
    }

    /// Advances by one step, under the torque `cable_nm` that the cables had before the input pulley moved.
    #[inline]
    pub fn step(
        &mut self,
        step: &Step,
        states: &mut EffectStates,
        (cables, parts): (&mut Transmission, &TransmissionConfig),
        cable_nm: f64,
        omega_in_rad_s: f64,
    ) {
        let Step { config, input, dt_s, kick_s, .. } = *step;
        let before_rad_s = self.omega_rad_s;
        if config.output == OutputBoundary::Angle {
            let delta_rad = input.theta_out_rad - self.theta_rad;
            self.theta_rad = input.theta_out_rad;
            self.omega_rad_s = delta_rad / dt_s;
            self.gained_rad_s = self.omega_rad_s - before_rad_s;
            cables.turn_output(parts, delta_rad);
            cables.close_play(parts);
            return;
        }
        let load = config.parameters.load.unwrap_or(LoadParameters::NONE);
        let port = self.port(step, states, load.mass_kg);
        let inside_play = self.play.is_open(port.play_rad) || cables.inside_play();
        // A joint without inertia cannot ring; there the speed of the last correction would only feed back into the next.
        let loss = if inside_play || config.output == OutputBoundary::Torque {
            0.0
        } else {
            parts.rope_loss_nm_s_per_rad()
        };
        let loss_nm = loss * parts.pulley_ratio() * omega_in_rad_s;
        let outside_nm = loss_nm + input.external_torque_nm + port.torque_nm;
        if config.output == OutputBoundary::Arm {
            let torque_nm = cable_nm + outside_nm;
            let inertia = inertia_kg_m2(&load, port.mass_kg);
            let weight_nm = weight_nm(&load, port.mass_kg, self.theta_rad);
            let response = Response::new(inertia, [load.viscous_nm_s_per_rad + loss, 0.0], kick_s);
            self.omega_rad_s = port.dry_friction().after_rad_s(
                &mut self.presliding,
                response.after_rad_s(before_rad_s, torque_nm + weight_nm),
                response.rad_s_per_nm,
                kick_s,
            );
            self.gained_rad_s = self.omega_rad_s - before_rad_s;
            let delta_rad = dt_s * self.omega_rad_s;
            self.theta_rad += delta_rad;
            // An arm that goes back lets the pulley lead. The pulley has no inertia, so that the arm loses no speed where the play
            // closes; what a rebound loses goes into sheaths and ropes.
            cables.turn_output(parts, -self.play.turn(-delta_rad, port.play_rad));
        } else {
            // What is balanced are cables whose input end has settled.
            cables.close_play(parts);
            let before_rad = self.theta_rad;
            let drag_nm_per_rad = load.viscous_nm_s_per_rad / dt_s;
            self.balance(cables, parts, outside_nm, port.dry_friction(), drag_nm_per_rad);
            self.omega_rad_s = (self.theta_rad - before_rad) / dt_s;
        }
        cables.close_play(parts);
        self.play = cables.relax_play(parts, End::Output, Outside::NOTHING, self.play, port.play_rad);
    }

    /// Turns a joint without inertia until the cables balance load and friction: dry friction, and `drag_nm_per_rad` for the turn taken.
    ///
    /// Newton steps on the torque. Along a turn the cables only soften, so that the slope of the last turn falls short
    /// rather than beyond; a turn that begins takes the slope of cables that stick everywhere, because the one from
    /// before a reversal is too soft and would throw the joint to and fro.
    fn balance(
        &mut self,
        cables: &mut Transmission,
        parts: &TransmissionConfig,
        outside_nm: f64,
        friction: DryFriction,
        drag_nm_per_rad: f64,
    ) {
        /// Newton steps at most; what is left then is taken up by the next simulation step.
        const STEPS: usize = 30;
        /// Turn below which the joint counts as balanced, rad; far below any encoder.
        const BALANCED_RAD: f64 = 1e-8;
        /// Longest single turn, rad: a step across free play.
        const LONGEST_RAD: f64 = 0.1;
        let sticking = parts.sticking_stiffness_nm_per_rad(End::Output);
        let before = self.presliding;
        let (mut turned_rad, mut last_rad) = (0.0, 0.0);
        for _ in 0..STEPS {
            self.presliding = friction.acting(before, turned_rad);
            let torque_nm = cables.torque_out_nm(parts) + outside_nm - drag_nm_per_rad * turned_rad;
            let excess_nm = torque_nm - friction.level_nm * self.presliding;
            let goes_on = excess_nm * last_rad > 0.0;
            let stiffness = if goes_on { cables.stiffness_nm_per_rad(parts, End::Output) } else { sticking };
            let rubbing_nm_per_rad = friction.stiffness_nm_per_rad(before, turned_rad, excess_nm);
            let slope = stiffness + rubbing_nm_per_rad + drag_nm_per_rad;
            let delta_rad = (excess_nm / slope).clamp(-LONGEST_RAD, LONGEST_RAD);
            last_rad = delta_rad;
            self.theta_rad += delta_rad;
            cables.turn_output(parts, delta_rad);
            turned_rad += delta_rad;
            if delta_rad.abs() < BALANCED_RAD {
                break;
            }
        }
    }

    /// Turns the joint, without inertia, to where the cables carry the weight and `external_torque_nm`.
    pub fn settle(
        &mut self,
        config: &PlantConfig,
        cables: &mut Transmission,
        parts: &TransmissionConfig,
        external_torque_nm: f64,
    ) {
        /// Half Newton steps; after them less than 2^-40 of the imbalance is left.
        const STEPS: usize = 40;
        for _ in 0..STEPS {
            let weight_nm =
                config.parameters.load.map_or(0.0, |load| weight_nm(&load, load.mass_kg, self.theta_rad));
            let excess_nm = cables.torque_out_nm(parts) + external_torque_nm + weight_nm;
            let delta_rad = 0.5 * excess_nm / cables.stiffness_nm_per_rad(parts, End::Output);
            self.theta_rad += delta_rad;
            cables.turn_output(parts, delta_rad);
        }
    }
}
