//! The bench's geared motor.

use bowden_model::parameters::MotorParameters;

pub const MOTOR: MotorParameters = MotorParameters {
    supply_v: 24.0,
    resistance_ohm: 2.0,
    inductance_h: 1e-3,
    torque_constant_nm_per_a: 0.03,
    gear_ratio: 30.0,
    rotor_inertia_kg_m2: 5e-6,
    viscous_nm_s_per_rad: 0.02,
};

/// Torque constant at the pulley, `k_t` N, N·m/A.
pub const PULLEY_NM_PER_A: f64 = 0.9;

/// Rotor inertia at the pulley, J N², kg·m².
pub const PULLEY_INERTIA_KG_M2: f64 = 4.5e-3;
