//! The closed loop against the truth: error of the joint's angle while it follows its reference.

use crate::Outcome;
use crate::host::Host;
use crate::trial::STEPS_PER_UNIT;

/// Error of the true joint angle against the reference of the same tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopError {
    /// Root of the mean square \[rad\].
    pub rms_rad: f64,
    /// Largest \[rad\].
    pub largest_rad: f64,
    /// Looks at the truth that had a sample.
    pub looks: usize,
}

/// Board time between two looks at the truth \[s\].
const LOOK_S: f64 = 1e-3;

/// Lets `seconds` pass with telemetry on and compares; the samples are taken out of the telemetry.
pub fn follow_truth(host: &mut Host, seconds: f64) -> Outcome<LoopError> {
    let errors_rad = errors_rad(host, seconds)?;
    let squares: f64 = errors_rad.iter().map(|error_rad| error_rad * error_rad).sum();
    let largest_rad = errors_rad.iter().fold(0.0_f64, |largest, error_rad| largest.max(error_rad.abs()));
    let rms_rad = (squares / errors_rad.len().max(1) as f64).sqrt();
    Ok(LoopError { rms_rad, largest_rad, looks: errors_rad.len() })
}

/// Board time behind the last look of [`errors_rad`], for what is still on its way \[s\].
pub const ARRIVAL_S: f64 = 20.0 * LOOK_S;

/// The errors of all looks at the truth in `seconds`, with telemetry on, and [`ARRIVAL_S`] without a look; the samples are taken out
/// of the telemetry.
pub fn errors_rad(host: &mut Host, seconds: f64) -> Outcome<Vec<f64>> {
    let looks = (seconds / LOOK_S).round() as usize;
    let mut truth = Vec::with_capacity(looks);
    for _ in 0..looks {
        host.run(LOOK_S)?;
        // The tick that began last is the newest one with a reference.
        truth.push((host.ticks.begun.wrapping_sub(1), host.board.bench().theta_out_rad()));
    }
    host.run(ARRIVAL_S)?;
    let samples = host.telemetry.take();
    let error_rad = |(tick, angle_rad): (u32, f64)| {
        let at = samples.binary_search_by_key(&tick, |(tick, _)| *tick).ok()?;
        Some(angle_rad - f64::from(samples[at].1.reference_raw) / STEPS_PER_UNIT)
    };
    Ok(truth.into_iter().filter_map(error_rad).collect())
}
