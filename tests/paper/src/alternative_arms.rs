//! Other arms and tendons with which section 5.2 fits without compensation, and what the compensator does with them.

use rayon::prelude::*;

use crate::disturbed_tracking::{SETUP, TrackingSetup, track};
use crate::error::ExperimentError;
use crate::tracking_methods::{LOADS, compensated, uncompensated};

/// Arm l \[m\], tendon L \[m\], and amplitude A \[rad\] with which the error without compensation is the paper's.
pub const ARMS: [[f64; 3]; 4] = [
    [0.17, 2.0, 0.0607],
    [0.10, 3.0, 0.0910],
    [SETUP.arm_m, SETUP.tendon_length_m, SETUP.amplitude_rad],
    [0.06, 4.0, 0.1170],
];

/// Motion of the sheaths: one of those that constants were fixed on.
const SEED: u64 = 1;

/// Average torque tracking errors with one arm \[%\], at both loads in the order of [`LOADS`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmErrors {
    /// Arm, tendon and amplitude as in [`ARMS`].
    pub arm: [f64; 3],
    /// Without compensation \[%\].
    pub uncompensated_percent: [f64; 2],
    /// With the paper's compensator \[%\].
    pub compensated_percent: [f64; 2],
}

/// Errors with each of [`ARMS`].
///
/// # Errors
/// That of the first run that fails.
pub fn errors() -> Result<Vec<ArmErrors>, ExperimentError> {
    ARMS.par_iter().map(errors_of).collect()
}

fn errors_of(arm: &[f64; 3]) -> Result<ArmErrors, ExperimentError> {
    let [arm_m, tendon_length_m, amplitude_rad] = *arm;
    let setup = TrackingSetup { arm_m, tendon_length_m, amplitude_rad, ..SETUP };
    let mut errors = ArmErrors { arm: *arm, uncompensated_percent: [0.0; 2], compensated_percent: [0.0; 2] };
    for (n, load) in LOADS.iter().enumerate() {
        let percent =
            |method| track(&setup, load.mass_kg, &method, SEED).map(|run| run.errors.torque_percent);
        errors.uncompensated_percent[n] = percent(uncompensated(&setup, load))?;
        errors.compensated_percent[n] = percent(compensated(&setup, load))?;
    }
    Ok(errors)
}
