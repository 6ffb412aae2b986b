//! Weight and inertia of what the joint carries.

use libm::sin;

use crate::parameters::LoadParameters;

/// Standard gravity, m/s².
pub const GRAVITY_M_S2: f64 = 9.80665;

/// Inertia of a load about the joint, `m l² + I`, kg·m².
#[must_use]
pub fn inertia_kg_m2(load: &LoadParameters, mass_kg: f64) -> f64 {
    mass_kg * load.arm_m * load.arm_m + load.inertia_kg_m2
}

/// Torque of the weight on the joint, `-m g l sin θ`, N·m; 0 where the arm hangs straight down.
#[must_use]
pub fn weight_nm(load: &LoadParameters, mass_kg: f64, theta_rad: f64) -> f64 {
    -mass_kg * GRAVITY_M_S2 * load.arm_m * sin(theta_rad)
}
