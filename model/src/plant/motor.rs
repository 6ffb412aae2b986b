//! Stage 1, bridge to rotor: the current of the winding, and the speed that its torque gives the rotor.

use super::step_input::Step;
use crate::drive::{Conduction, Response, pulley_inertia_kg_m2, pulley_torque_constant_nm_per_a};
use crate::dry_friction::BuildUp;
use crate::effect::{Component, MotorPort, PRESLIDING_RAD};
use crate::effect_set::EffectStates;
use crate::parameters::MotorParameters;

/// Motor, seen at the input pulley.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motor {
    /// Current, A.
    pub current_a: f64,
    /// Mean current over the second half of the last step, A.
    late_a: f64,
    /// Rotor, in radians of the input pulley.
    pub theta_rad: f64,
    /// Speed in the middle of the last step, rad/s of the input pulley.
    pub omega_rad_s: f64,
    /// Part of the dry friction that acts, -1 to 1.
    pub presliding: f64,
}

/// Load on the rotor, besides the torque of its current.
#[derive(Clone, Copy)]
pub(super) struct Load {
    /// Torque of the cables, N·m, without the part that depends on the rotor's speed.
    pub cables_nm: f64,
    /// Drag of the cables at the rotor's speed, N·m·s/rad.
    pub drag_nm_s_per_rad: f64,
    /// Torque from outside, N·m.
    pub outside_nm: f64,
}

impl Load {
    pub const NOTHING: Self = Self { cables_nm: 0.0, drag_nm_s_per_rad: 0.0, outside_nm: 0.0 };
}

impl Motor {
    /// At rest and without current.
    pub const fn at_rest(theta_rad: f64) -> Self {
        Self { current_a: 0.0, late_a: 0.0, theta_rad, omega_rad_s: 0.0, presliding: 0.0 }
    }

    /// Current of the winding in this step.
    #[inline]
    pub fn conduct(&self, step: &Step, states: &mut EffectStates, motor: &MotorParameters) -> Conduction {
        Conduction::new(
            motor,
            &step.config.effects,
            states,
            step.input.bridge,
            (step.t_s, step.dt_s),
            self.current_a,
        )
    }

    /// Torque of the mean current over `kick_s` at the input pulley, `k_t N i`: at standstill, N·m, and the drag of the back-EMF, N·m·s/rad.
    #[inline]
    pub fn torque_and_drag(&self, step: &Step, motor: &MotorParameters, conduction: &Conduction) -> [f64; 2] {
        let constant = pulley_torque_constant_nm_per_a(motor);
        let share = step.share_of_kick();
        let [early_a, early_a_per_v] = conduction.first_half_a();
        let current_a = self.late_a + share * (early_a - self.late_a);
        [constant * current_a, share * constant * constant * early_a_per_v]
    }

    /// Current after the step, with the back-EMF at the speed in its middle.
    #[inline]
    pub fn carry_current(&mut self, motor: &MotorParameters, conduction: &Conduction) {
        let back_emf_v = pulley_torque_constant_nm_per_a(motor) * self.omega_rad_s;
        [self.late_a, self.current_a] = conduction.second_half_a(back_emf_v);
    }

    /// Speed of the rotor after the step, under the load that the spindle hands back and a torque from outside; returns what
    /// effects say of the motor.
    #[expect(
        clippy::inline_always,
        reason = "called twice, and what it returns would go through memory: a third of a step's time"
    )]
    #[inline(always)]
    pub fn accelerate(
        &mut self,
        step: &Step,
        states: &mut EffectStates,
        motor: &MotorParameters,
        conduction: &Conduction,
        load: Load,
        inside_gear_play: bool,
    ) -> MotorPort {
        let [motor_nm, back_emf_drag] = self.torque_and_drag(step, motor, conduction);
        let load_nm = load.cables_nm - load.drag_nm_s_per_rad * self.omega_rad_s;
        let at = [self.theta_rad, self.omega_rad_s];
        let now_nm = motor_nm - back_emf_drag * self.omega_rad_s;
        let port = port(step, states, at, [now_nm, load_nm, load_nm.abs()]);
        let dragged = if inside_gear_play { 1.0 - port.drag_behind_play } else { 1.0 };
        let drag = dragged * motor.viscous_nm_s_per_rad + load.drag_nm_s_per_rad;
        let response = Response::new(pulley_inertia_kg_m2(motor), [drag, back_emf_drag], step.kick_s);
        let torque_nm = motor_nm + load.cables_nm + load.outside_nm + port.torque_nm;
        self.omega_rad_s = port.dry_friction().after_rad_s(
            &mut self.presliding,
            response.after_rad_s(self.omega_rad_s, torque_nm),
            response.rad_s_per_nm,
            step.kick_s,
        );
        port
    }

    /// Follows a spindle at `theta_in_rad` that moves as prescribed: rigid without play, free inside a play of the gear.
    /// Returns whether the rotor is inside the play.
    #[inline]
    pub fn follow(
        &mut self,
        step: &Step,
        states: &mut EffectStates,
        motor: Option<(&MotorParameters, &Conduction)>,
        [theta_in_rad, omega_in_rad_s]: [f64; 2],
        inside_gear_play: bool,
    ) -> bool {
        let rigid = match motor {
            Some((motor, conduction)) if step.config.effects.touches(Component::Motor) => {
                let port = self.accelerate(step, states, motor, conduction, Load::NOTHING, inside_gear_play);
                let play_rad = port.gear_play_rad;
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
        if let Some((motor, conduction)) = motor {
            self.carry_current(motor, conduction);
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
        standstill_excess_nm: 0.0,
        presliding_rad: PRESLIDING_RAD,
        build_up: BuildUp::Linear,
        gear_play_rad: 0.0,
        drag_behind_play: 0.0,
    };
    if step.config.effects.touches(Component::Motor) {
        step.config.effects.motor(states, &mut port);
    }
    port
}
