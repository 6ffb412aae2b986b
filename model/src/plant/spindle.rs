//! Stage 2, rotor to input pulley: the spindle behind the gear, with its play, and what the cables hand back to the motor.

use super::motor;
use super::step_input::Step;
use crate::effect::MotorPort;
use crate::effect_set::EffectStates;
use crate::parameters::MotorParameters;
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
    /// How far the rotor leads, rad.
    gear_offset_rad: f64,
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
            gear_offset_rad: 0.0,
            presliding: 0.0,
        }
    }

    /// Torque of the cables on the rotor, N·m: none inside the play.
    #[inline]
    pub fn load_nm(&self, cables: &Transmission, parts: &TransmissionConfig, omega_out_rad_s: f64) -> f64 {
        if self.inside_gear_play {
            0.0
        } else {
            -cables.torque_in_nm(parts)
                - parts.rope_loss_nm(self.omega_rad_s, omega_out_rad_s) * parts.pulley_ratio()
        }
    }

    /// Turns with a rotor that has turned by `delta_rad` to `theta_motor_rad`, as far as the play lets it.
    #[inline]
    pub fn turn_with_rotor(
        &mut self,
        step: &Step,
        (cables, parts): (&mut Transmission, &TransmissionConfig),
        motor: &MotorParameters,
        port: &MotorPort,
        [theta_motor_rad, delta_rad]: [f64; 2],
    ) {
        cables.turn_input(parts, delta_rad);
        if port.gear_play_rad > 0.0 || self.gear_offset_rad != 0.0 {
            let drag = motor.viscous_nm_s_per_rad * port.drag_behind_play / step.dt_s;
            let loose = Outside {
                torque_nm: step.input.loose_pulley.torque_nm - drag * delta_rad,
                stiffness_nm_per_rad: step.input.loose_pulley.stiffness_nm_per_rad + drag,
            };
            self.gear_offset_rad =
                cables.relax_play(parts, End::Input, loose, self.gear_offset_rad, port.gear_play_rad);
        }
        self.inside_gear_play = self.gear_offset_rad.abs() < 0.5 * port.gear_play_rad;
        let before = self.theta_rad;
        self.theta_rad = theta_motor_rad - self.gear_offset_rad;
        self.omega_rad_s = (self.theta_rad - before) / step.dt_s;
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
        self.presliding = (self.presliding + delta_rad / port.presliding_rad).clamp(-1.0, 1.0);
        self.friction_nm = port.coulomb_nm * self.presliding - port.torque_nm;
    }
}
