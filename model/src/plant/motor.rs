//! Stage 1, bridge to rotor: the current of the winding, and the speed that its torque gives the rotor.

use super::step_input::Step;
use crate::drive::{
    after_elastic_friction_rad_s, current_after_a, pulley_inertia_kg_m2, pulley_torque_constant_nm_per_a,
};
use crate::effect::{Component, MotorPort, PRESLIDING_RAD};
use crate::effect_set::EffectStates;
use crate::parameters::MotorParameters;

/// Motor, seen at the input pulley.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motor {
    /// Current, A.
    pub current_a: f64,
    /// Rotor, in radians of the input pulley.
    pub theta_rad: f64,
    /// Its speed, rad/s of the input pulley.
    pub omega_rad_s: f64,
    /// Part of the dry friction that acts, -1 to 1.
    pub presliding: f64,
}

impl Motor {
    /// At rest and without current.
    pub const fn at_rest(theta_rad: f64) -> Self {
        Self { current_a: 0.0, theta_rad, omega_rad_s: 0.0, presliding: 0.0 }
    }

    /// Current after the step, from the bridge and the rotor's speed before it.
    #[inline]
    pub fn conduct(&mut self, step: &Step, states: &mut EffectStates, motor: &MotorParameters) {
        self.current_a = current_after_a(
            motor,
            &step.config.effects,
            states,
            step.input.bridge,
            (step.t_s, step.dt_s),
            self.current_a,
            self.omega_rad_s,
        );
    }

    /// Torque of the current at the input pulley, `k_t N i`, N·m.
    #[inline]
    pub fn torque_nm(&self, motor: &MotorParameters) -> f64 {
        pulley_torque_constant_nm_per_a(motor) * self.current_a
    }

    /// Speed of the rotor after the step, under the load that the spindle hands back and a torque from outside; returns what
    /// effects say of the motor.
    #[inline]
    pub fn accelerate(
        &mut self,
        step: &Step,
        states: &mut EffectStates,
        motor: &MotorParameters,
        [load_nm, outside_nm]: [f64; 2],
        inside_gear_play: bool,
    ) -> MotorPort {
        let motor_nm = self.torque_nm(motor);
        let at = [self.theta_rad, self.omega_rad_s];
        let port = port(step, states, at, [motor_nm, load_nm, load_nm.abs()]);
        let dragged = if inside_gear_play { 1.0 - port.drag_behind_play } else { 1.0 };
        let inertia = pulley_inertia_kg_m2(motor);
        let torque_nm = motor_nm + load_nm + outside_nm + port.torque_nm;
        // Viscous friction at the end of the step counts like inertia.
        let slowed = inertia + step.dt_s * dragged * motor.viscous_nm_s_per_rad;
        let driven = (inertia * self.omega_rad_s + step.dt_s * torque_nm) * slowed.recip();
        let friction = [port.coulomb_nm, port.presliding_rad];
        self.omega_rad_s =
            after_elastic_friction_rad_s(&mut self.presliding, driven, friction, slowed, step.dt_s);
        port
    }

    /// Follows a spindle at `theta_in_rad` that moves as prescribed: rigid without play, free inside a play of the gear.
    /// Returns whether the rotor is inside the play.
    #[inline]
    pub fn follow(
        &mut self,
        step: &Step,
        states: &mut EffectStates,
        motor: Option<&MotorParameters>,
        [theta_in_rad, omega_in_rad_s]: [f64; 2],
        inside_gear_play: bool,
    ) -> bool {
        let rigid = match motor {
            Some(motor) if step.config.effects.touches(Component::Motor) => {
                let play_rad =
                    self.accelerate(step, states, motor, [0.0, 0.0], inside_gear_play).gear_play_rad;
                let lead_rad = self.theta_rad + step.dt_s * self.omega_rad_s - theta_in_rad;
                self.theta_rad = theta_in_rad + lead_rad.clamp(-0.5 * play_rad, 0.5 * play_rad);
                lead_rad.abs() >= 0.5 * play_rad
            }
            _ => {
                self.theta_rad = theta_in_rad;
                true
            }
        };
        if rigid {
            self.omega_rad_s = omega_in_rad_s;
        }
        !rigid
    }
}

/// What effects say of a motor or spindle at an angle and speed, rad and rad/s, under the torques of motor, load and what the
/// gear carries, N·m.
#[inline]
pub(super) fn port(
    step: &Step,
    states: &mut EffectStates,
    [theta_rad, omega_rad_s]: [f64; 2],
    [motor_torque_nm, load_torque_nm, carried_torque_nm]: [f64; 3],
) -> MotorPort {
    let mut port = MotorPort {
        t_s: step.t_s,
        dt_s: step.dt_s,
        theta_rad,
        omega_rad_s,
        motor_torque_nm,
        load_torque_nm,
        carried_torque_nm,
        torque_nm: 0.0,
        coulomb_nm: 0.0,
        presliding_rad: PRESLIDING_RAD,
        gear_play_rad: 0.0,
        drag_behind_play: 0.0,
    };
    if step.config.effects.touches(Component::Motor) {
        step.config.effects.motor(states, &mut port);
    }
    port
}
