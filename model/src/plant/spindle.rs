//! Stage 2, rotor to input pulley: the spindle behind the gear, with its play, and what the cables hand back to the motor.

use super::motor::{self, Load};
use super::step_input::Step;
use crate::effect::MotorPort;
use crate::effect_set::EffectStates;
use crate::play::Play;
use crate::sheath::End;
use crate::transmission::{Outside, Transmission, TransmissionConfig};

/// Input pulley on its spindle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spindle {
    /// Angle, rad.
    pub theta_rad: f64,
    /// Speed, rad/s.
    pub omega_rad_s: f64,
    /// Whether the pulley is inside a play of the gear, where the rotor does not touch it.
    pub inside_gear_play: bool,
    /// Friction in the bearings of a spindle that is turned from outside, N·m.
    pub friction_nm: f64,
    /// Of the rotor before the pulley.
    gear_play: Play,
    /// Part of that friction that acts, -1 to 1.
    presliding: f64,
}

impl Spindle {
    /// At rest in the middle of the play.
    pub const fn at_rest(theta_rad: f64) -> Self {
        Self {
            theta_rad,
            omega_rad_s: 0.0,
            inside_gear_play: false,
            friction_nm: 0.0,
            gear_play: Play::CENTRED,
            presliding: 0.0,
        }
    }

    /// Torque of the cables on the rotor and one from outside: of the cables none inside a play of gear or pulley.
    #[inline]
    pub fn load(
        &self,
        cables: &Transmission,
        parts: &TransmissionConfig,
        omega_out_rad_s: f64,
        outside_nm: f64,
    ) -> Load {
        if self.inside_gear_play || cables.inside_play() {
            return Load { outside_nm, ..Load::NOTHING };
        }
        let ratio = parts.pulley_ratio();
        let loss = ratio * parts.rope_loss_nm_s_per_rad();
        Load {
            cables_nm: loss * omega_out_rad_s - cables.torque_in_nm(parts),
            drag_nm_s_per_rad: loss * ratio,
            outside_nm,
        }
    }

    /// Turns with a rotor that has turned by `delta_rad` to `theta_motor_rad`, as far as the play lets it.
    #[inline]
    pub fn turn_with_rotor(
        &mut self,
        step: &Step,
        (cables, parts): (&mut Transmission, &TransmissionConfig),
        play_rad: f64,
        [theta_motor_rad, delta_rad]: [f64; 2],
    ) {
        let turn_rad = self.gear_play.turn(delta_rad, play_rad);
        cables.turn_input(parts, turn_rad);
        self.theta_rad = theta_motor_rad - self.gear_play.lead_rad;
        if !self.inside_gear_play {
            self.omega_rad_s = turn_rad / step.dt_s;
        }
    }

    /// Lets the pulley, which stood at `before_rad`, move inside a play of the gear, once rotor and joint have turned.
    #[inline]
    pub fn close_gear_play(
        &mut self,
        step: &Step,
        (cables, parts): (&mut Transmission, &TransmissionConfig),
        port: &MotorPort,
        before_rad: f64,
    ) {
        if !self.gear_play.is_there(port.gear_play_rad) {
            return;
        }
        let viscous = step.config.parameters().motor.map_or(0.0, |motor| motor.viscous_nm_s_per_rad);
        let drag_nm_per_rad = viscous * port.drag_behind_play / step.dt_s;
        let turned_rad = self.theta_rad - before_rad;
        let loose = Outside {
            torque_nm: step.input.loose_pulley.torque_nm - drag_nm_per_rad * turned_rad,
            stiffness_nm_per_rad: step.input.loose_pulley.stiffness_nm_per_rad + drag_nm_per_rad,
        };
        let before = self.gear_play;
        self.gear_play = cables.relax_play(parts, End::Input, loose, before, port.gear_play_rad);
        self.inside_gear_play = self.gear_play.is_open(port.gear_play_rad);
        self.theta_rad -= self.gear_play.lead_rad - before.lead_rad;
        self.omega_rad_s = (self.theta_rad - before_rad) / step.dt_s;
    }

    /// Turns as prescribed; returns by how much, rad.
    #[inline]
    pub fn turn_as_prescribed(
        &mut self,
        step: &Step,
        cables: &mut Transmission,
        parts: &TransmissionConfig,
    ) -> f64 {
        let delta_rad = step.input.theta_in_rad - self.theta_rad;
        self.theta_rad = step.input.theta_in_rad;
        self.omega_rad_s = delta_rad / step.dt_s;
        cables.turn_input(parts, delta_rad);
        delta_rad
    }

    /// Friction between a spindle that is turned from outside by `delta_rad`, without a motor, and its bearings.
    #[inline]
    pub fn rub(&mut self, step: &Step, states: &mut EffectStates, cables_nm: f64, delta_rad: f64) {
        let load_nm = -cables_nm;
        let at = [self.theta_rad, self.omega_rad_s];
        let port = motor::port(step, states, at, [0.0, load_nm, load_nm.abs()]);
        let friction = port.dry_friction();
        self.presliding = friction.acting(self.presliding, delta_rad);
        self.friction_nm = friction.level_nm * self.presliding - port.torque_nm;
    }
}
