//! What somebody's hands do to a bench: tendons taken off and fitted, shafts turned, load cells pulled.

use crate::plant::Shaft;

/// Stiffness of a hand that holds a shaft \[Nm/rad\].
const STIFFNESS_NM_PER_RAD: f64 = 2.0;
/// Damping of that hand \[Nm s/rad\]: nearly critical with the rotor of the default bench behind its gear.
const DAMPING_NM_S_PER_RAD: f64 = 0.15;

/// Hands at a bench; none by default.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Hands {
    /// The tendons are off their pulleys.
    pub tendons_off: bool,
    /// Angle at which a hand holds the shaft of the input pulley \[rad\].
    pub input_rad: Option<f64>,
    /// Angle at which a hand holds the arm \[rad\].
    pub arm_rad: Option<f64>,
}

/// Torque of a hand on a shaft \[Nm\]; 0 without a hand.
#[inline]
pub(crate) fn torque_nm(held_rad: Option<f64>, shaft: Shaft) -> f64 {
    held_rad.map_or(0.0, |held_rad| {
        STIFFNESS_NM_PER_RAD * (held_rad - shaft.angle_rad) - DAMPING_NM_S_PER_RAD * shaft.omega_rad_per_s
    })
}
