//! The whole joint: motor, input pulley, both tendons, output pulley and arm, stepped in time.
//!
//! Each end can be free or prescribed, so that one piece of code serves the forward run (motor to arm), the replay
//! (recorded input angle to arm) and the analysis of one component between measured boundaries.
//!
//! One step takes the torque from the bridge to the arm, stage by stage; each has its state and its step:
//!
//! | stage | file | state | gives the next |
//! |---|---|---|---|
//! | 1 drive and motor | `plant/motor.rs`, equations in [`crate::drive`] | current, rotor | turn of the rotor |
//! | 2 input spindle | `plant/spindle.rs` | input pulley, play of the gear | turn of the input pulley |
//! | 3 transmission | [`crate::transmission`], [`crate::sheath`] | both tendons | tensions, torque on the joint |
//! | 4 joint and load | `plant/joint.rs`, weight and inertia in [`crate::load`] | arm, play of the joint | |
//!
//! Without tendons `plant/direct.rs` turns rotor, spindle and joint as one.
//!
//! Integration is the leapfrog (Störmer and Verlet; section 11 of `docs/derivation.md`): angles, tensions and the current are those at the ends of
//! the steps, speeds those in their middle. Torques at the start of a step change the speed from the middle of the step before to the middle of
//! this one; the first step changes it for half a step. The motor torque is the mean over that time, and drag acts at the mean speed. Second
//! order in the step without dry friction and play, first order with them; no numerical damping; stable while
//! `step · sqrt(stiffness / inertia) < 2` ([`PlantConfig::stable_step_s`]).

mod config;
mod direct;
mod joint;
mod motor;
mod spindle;
mod step_input;

use crate::channel::Channel;
use crate::effect::{Component, MotorPort};
use crate::effect_set::{EffectStates, FRESH_STATES};
use crate::transmission::{PulleyMotion, Transmission, TransmissionConfig};

pub use config::{InputBoundary, OutputBoundary, PlantConfig, PlantError};
use joint::Joint;
use motor::Motor;
use spindle::Spindle;
use step_input::Step;
pub use step_input::StepInput;

/// State of the joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plant {
    t_s: f64,
    /// Length of the previous step, s; zero at the start.
    last_dt_s: f64,
    motor: Motor,
    spindle: Spindle,
    transmission: Option<Transmission>,
    joint: Joint,
    states: EffectStates,
}

impl Plant {
    /// Joint at rest with both pulleys at the given angles and both tendons at the pretension.
    #[must_use]
    pub fn at_rest(config: &PlantConfig, theta_in_rad: f64, theta_out_rad: f64) -> Self {
        let direct = config.transmission().is_none();
        Self {
            t_s: 0.0,
            last_dt_s: 0.0,
            motor: Motor::at_rest(theta_in_rad),
            spindle: Spindle::at_rest(theta_in_rad),
            transmission: config.transmission().map(Transmission::at_rest),
            joint: Joint::at_rest(if direct { theta_in_rad } else { theta_out_rad }),
            states: FRESH_STATES,
        }
    }

    /// Gives the joint a speed, rad/s, before the first step of a run that does not start at rest.
    pub fn set_speed_rad_s(&mut self, omega_rad_s: f64) {
        self.motor.omega_rad_s = omega_rad_s;
        self.spindle.omega_rad_s = omega_rad_s;
        self.joint.omega_rad_s = omega_rad_s;
    }

    /// Sets the clock, s, for runs that do not start at zero; effects with an onset read it.
    pub fn set_time_s(&mut self, t_s: f64) {
        self.t_s = t_s;
    }

    /// Time since the start, s.
    #[must_use]
    pub const fn t_s(&self) -> f64 {
        self.t_s
    }

    /// Motor current, A.
    #[must_use]
    pub const fn current_a(&self) -> f64 {
        self.motor.current_a
    }

    /// Rotor, in input-pulley radians.
    #[must_use]
    pub const fn theta_motor_rad(&self) -> f64 {
        self.motor.theta_rad
    }

    /// Input pulley, rad.
    #[must_use]
    pub const fn theta_in_rad(&self) -> f64 {
        self.spindle.theta_rad
    }

    /// Speed of the input pulley, rad/s.
    #[must_use]
    pub const fn omega_in_rad_s(&self) -> f64 {
        self.spindle.omega_rad_s
    }

    /// Whether the input pulley is inside a play of the gear, where the rotor does not touch it.
    #[must_use]
    pub const fn inside_gear_play(&self) -> bool {
        self.spindle.inside_gear_play
    }

    /// Joint, rad.
    #[must_use]
    pub const fn theta_out_rad(&self) -> f64 {
        self.joint.theta_rad
    }

    /// Speed of the joint, rad/s.
    #[must_use]
    pub const fn omega_out_rad_s(&self) -> f64 {
        self.joint.omega_rad_s
    }

    /// Tendons, if the joint has any.
    #[must_use]
    pub const fn transmission(&self) -> Option<&Transmission> {
        self.transmission.as_ref()
    }

    /// Turns the joint, without inertia, to where the cables carry the weight at the present input angle, stretched and rubbing as the
    /// effects on them have it at the start.
    ///
    /// A recording that starts away from the hanging position starts at rest there; how it got there is not known, so
    /// the friction state is the one after a slow approach from the unloaded position.
    pub fn settle(&mut self, config: &PlantConfig, input: &StepInput) {
        if let (Some(cables), Some(parts)) = (&mut self.transmission, config.transmission()) {
            let standing = PulleyMotion {
                t_s: self.t_s,
                dt_s: 0.0,
                theta_in_rad: self.spindle.theta_rad,
                omega_in_rad_s: 0.0,
                theta_out_rad: self.joint.theta_rad,
                omega_out_rad_s: 0.0,
            };
            cables.apply_effects(parts, config.effects(), &mut self.states, standing);
            if config.output() != OutputBoundary::Angle {
                self.joint.settle(config, cables, parts, input.external_torque_nm);
            }
        }
    }

    /// Advances by `dt_s`.
    pub fn step(&mut self, config: &PlantConfig, input: &StepInput, dt_s: f64) {
        let step = Step { config, input, t_s: self.t_s, dt_s, kick_s: 0.5 * (self.last_dt_s + dt_s) };
        self.last_dt_s = dt_s;
        let Self { motor, spindle, transmission, joint, states, .. } = self;
        if let (Some(cables), Some(parts)) = (transmission, config.transmission()) {
            let motion = PulleyMotion {
                t_s: step.t_s,
                dt_s,
                theta_in_rad: spindle.theta_rad,
                omega_in_rad_s: match config.input() {
                    InputBoundary::Angle => (input.theta_in_rad - spindle.theta_rad) / dt_s,
                    InputBoundary::Motor => spindle.omega_rad_s,
                },
                theta_out_rad: joint.theta_rad,
                omega_out_rad_s: joint.omega_rad_s,
            };
            cables.apply_effects(parts, config.effects(), states, motion);
            // The arm is driven by the cables as they are before either pulley moves; a torque taken between the two
            // moves would run ahead of the arm by a step and act as negative friction.
            let cable_nm = cables.torque_out_nm(parts);
            let before_rad = spindle.theta_rad;
            let before_rad_s = spindle.omega_rad_s;
            let out_rad_s = joint.omega_now_rad_s();
            let port = step_input_side(&step, states, (motor, spindle), (cables, parts), out_rad_s);
            let in_rad_s = 0.5 * (before_rad_s + spindle.omega_rad_s);
            joint.step(&step, states, (cables, parts), cable_nm, in_rad_s);
            if let Some(port) = port {
                spindle.close_gear_play(&step, (cables, parts), &port, before_rad);
            }
        } else {
            direct::step(&step, states, motor, spindle, joint);
        }
        self.t_s += dt_s;
    }

    /// True value of a channel of the joint; `None` for what comes from outside it (reference, duty, supply, enable).
    #[must_use]
    #[inline]
    pub fn channel(&self, config: &PlantConfig, channel: Channel) -> Option<f64> {
        let tension_n = |index: usize| Some(self.end_tensions_n(config)[index]);
        match channel {
            Channel::ThetaMotor => Some(self.motor.theta_rad),
            Channel::ThetaIn => Some(self.spindle.theta_rad),
            Channel::ThetaOut => Some(self.joint.theta_rad),
            Channel::F1 => tension_n(0),
            Channel::F2 => tension_n(1),
            Channel::F3 => tension_n(2),
            Channel::F4 => tension_n(3),
            Channel::TorqueIn => Some(self.driving_torque_nm(config)),
            Channel::TorqueOut => Some(self.torque_out_nm(config)),
            Channel::MotorCurrent => Some(self.motor.current_a),
            Channel::ThetaRef | Channel::Duty | Channel::BusVoltage | Channel::DriveEnable => None,
        }
    }

    /// F1 to F4, N; zero without tendons.
    #[must_use]
    pub fn end_tensions_n(&self, config: &PlantConfig) -> [f64; 4] {
        match (&self.transmission, &config.transmission) {
            (Some(state), Some(parts)) => state.end_tensions_n(parts),
            _ => [0.0; 4],
        }
    }

    /// Torque of the input pulley on the cables, N·m; zero without tendons.
    #[must_use]
    pub fn torque_in_nm(&self, config: &PlantConfig) -> f64 {
        match (&self.transmission, &config.transmission) {
            (Some(state), Some(parts)) => state.torque_in_nm(parts),
            _ => 0.0,
        }
    }

    /// Torque that turns the input pulley, N·m, as a sensor between it and what turns it shows: that of the cables and,
    /// where a prescribed angle replaces the motor, the friction of the spindle (motor effects of a joint without motor).
    #[must_use]
    pub fn driving_torque_nm(&self, config: &PlantConfig) -> f64 {
        self.torque_in_nm(config) + self.spindle.friction_nm
    }

    /// Torque of the cables on the joint, N·m; zero without tendons.
    #[must_use]
    pub fn torque_out_nm(&self, config: &PlantConfig) -> f64 {
        match (&self.transmission, &config.transmission) {
            (Some(state), Some(parts)) => state.torque_out_nm(parts),
            _ => 0.0,
        }
    }
}

/// Motor and input pulley, driven by the bridge or prescribed; returns what effects say of a motor that drives.
#[inline]
fn step_input_side(
    step: &Step,
    states: &mut EffectStates,
    (motor, spindle): (&mut Motor, &mut Spindle),
    (cables, parts): (&mut Transmission, &TransmissionConfig),
    omega_out_rad_s: f64,
) -> Option<MotorPort> {
    let parameters = step.config.parameters().motor.as_ref();
    let driven = parameters.map(|parameters| (parameters, motor.conduct(step, states, parameters)));
    match (step.config.input(), driven) {
        (InputBoundary::Motor, Some((parameters, conduction))) => {
            let load = spindle.load(cables, parts, omega_out_rad_s, step.input.input_torque_nm);
            let port =
                motor.accelerate(step, states, parameters, &conduction, load, spindle.inside_gear_play);
            motor.carry_current(parameters, &conduction);
            let delta_rad = step.dt_s * motor.omega_rad_s;
            motor.theta_rad += delta_rad;
            let turned = [motor.theta_rad, delta_rad];
            spindle.turn_with_rotor(step, (cables, parts), port.gear_play_rad, turned);
            Some(port)
        }
        (_, driven) => {
            let delta_rad = spindle.turn_as_prescribed(step, cables, parts);
            let at = [spindle.theta_rad, spindle.omega_rad_s];
            let driven = driven.as_ref().map(|(parameters, conduction)| (*parameters, conduction));
            spindle.inside_gear_play = motor.follow(step, states, driven, at, spindle.inside_gear_play);
            if parameters.is_none() && step.config.effects().touches(Component::Motor) {
                spindle.rub(step, states, cables.torque_in_nm(parts), delta_rad);
            }
            None
        }
    }
}
