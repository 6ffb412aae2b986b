//! Bridge, winding and rotor of the geared DC motor, seen at the input pulley.
//!
//! `L di/dt = d V - R i - k_t N ω` and `J N² dω/dt = k_t N i - b ω - τ_load - friction`, with duty `d`, supply `V`,
//! gear ratio `N` and pulley speed `ω`. Torques and inertias are referred to the input pulley.

use crate::effect::Component;
use crate::effect::DrivePort;
use crate::effect_set::{EffectSet, EffectStates};
use crate::parameters::MotorParameters;

/// What the bridge does during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BridgeInput {
    /// Duty, -1 to 1.
    pub duty: f64,
    /// Supply, V.
    pub bus_v: f64,
    /// Off means an open circuit: no current flows.
    pub enabled: bool,
}

/// Torque constant referred to the input pulley, `k_t N`, N·m/A.
#[must_use]
pub fn pulley_torque_constant_nm_per_a(motor: &MotorParameters) -> f64 {
    motor.torque_constant_nm_per_a * motor.gear_ratio
}

/// Stall torque at the input pulley, `k N V / R`, N·m.
#[must_use]
pub fn pulley_stall_torque_nm(motor: &MotorParameters) -> f64 {
    pulley_torque_constant_nm_per_a(motor) * motor.supply_v / motor.resistance_ohm
}

/// Rotor inertia referred to the input pulley, `J N²`, kg·m².
#[must_use]
pub fn pulley_inertia_kg_m2(motor: &MotorParameters) -> f64 {
    motor.rotor_inertia_kg_m2 * motor.gear_ratio * motor.gear_ratio
}

/// Current after a step of `dt_s`, A, at the pulley speed `omega_rad_s`.
///
/// Implicit Euler: stable for every step, and for steps far above L/R it gives the stationary current.
#[must_use]
pub fn current_after_a(
    motor: &MotorParameters,
    effects: &EffectSet,
    states: &mut EffectStates,
    bridge: BridgeInput,
    (t_s, dt_s): (f64, f64),
    current_a: f64,
    omega_rad_s: f64,
) -> f64 {
    if !bridge.enabled {
        return 0.0;
    }
    let mut port =
        DrivePort { t_s, dt_s, current_a, duty: bridge.duty, resistance_ohm: motor.resistance_ohm };
    if effects.touches(Component::Motor) {
        effects.drive(states, &mut port);
    }
    let back_emf_v = pulley_torque_constant_nm_per_a(motor) * omega_rad_s;
    let per_henry = dt_s / motor.inductance_h.max(1e-9);
    // A step waits for what follows from the state, and a product takes a third of a division's time.
    let decay = (1.0 + per_henry * port.resistance_ohm).recip();
    (current_a + per_henry * (port.duty * bridge.bus_v - back_emf_v)) * decay
}

/// Speed after dry friction acted for `dt_s` on `inertia_kg_m2`, which builds up to `level_nm` over a turn of `travel_rad` > 0
/// (Prandtl's element, solved with the speed at the end of the step). `presliding` is the part of the level that acts, -1 to 1.
#[must_use]
pub fn after_elastic_friction_rad_s(
    presliding: &mut f64,
    omega_rad_s: f64,
    [level_nm, travel_rad]: [f64; 2],
    inertia_kg_m2: f64,
    dt_s: f64,
) -> f64 {
    let loss = level_nm * dt_s / inertia_kg_m2;
    let per_speed = dt_s / travel_rad;
    let sticking_rad_s = (omega_rad_s - loss * *presliding) * (1.0 + loss * per_speed).recip();
    *presliding = (*presliding + per_speed * sticking_rad_s).clamp(-1.0, 1.0);
    omega_rad_s - loss * *presliding
}
