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
    let mut truth = Vec::new();
    let looks = (seconds / LOOK_S).round() as usize;
    for _ in 0..looks {
        host.run(LOOK_S)?;
        // The tick that began last is the newest one with a reference.
        truth.push((host.ticks.begun.wrapping_sub(1), host.board.bench().theta_out_rad()));
    }
    // What is still on its way.
    host.run(20.0 * LOOK_S)?;
    let samples = host.telemetry.take();
    let (mut squares, mut largest, mut found) = (0.0, 0.0_f64, 0);
    for (tick, angle_rad) in truth {
        if let Ok(at) = samples.binary_search_by_key(&tick, |(tick, _)| *tick) {
            let reference_rad = f64::from(samples[at].1.reference_raw) / STEPS_PER_UNIT;
            let error_rad = angle_rad - reference_rad;
            squares += error_rad * error_rad;
            largest = largest.max(error_rad.abs());
            found += 1;
        }
    }
    let rms_rad = (squares / f64::from(found.max(1))).sqrt();
    Ok(LoopError { rms_rad, largest_rad: largest, looks: found as usize })
}
