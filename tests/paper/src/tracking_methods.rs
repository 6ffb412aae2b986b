//! The ways to control the joint that section 5.2 is run with, and their errors over many motions of the sheaths.

use bowden_link::message::Mode;
use rayon::prelude::*;

use crate::disturbed_tracking::{Method, TrackingSetup, track};
use crate::error::ExperimentError;
use crate::tracking_error::TrackingErrors;

/// `compensator.source`: no compensation.
const SOURCE_OFF: f32 = 0.0;
/// `compensator.source`: the lag from both encoders, Eq. (22).
const SOURCE_ENCODERS: f32 = 2.0;

/// A load of section 5.2, with what the paper reports at it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperLoad {
    /// Weight at the end of the arm \[kg\].
    pub mass_kg: f64,
    /// Average torque tracking error without compensation \[%\].
    pub uncompensated_percent: f64,
    /// The same with compensation \[%\].
    pub compensated_percent: f64,
    /// Time in which the compensation follows the encoders here \[s\]: the best of 0.05, 0.07, 0.1, 0.15 and 0.2 s on
    /// seeds 1 to 3.
    pub encoder_time_s: f32,
}

/// The loads of Fig. 11 and Fig. 12.
pub const LOADS: [PaperLoad; 2] = [
    PaperLoad { mass_kg: 2.5, uncompensated_percent: 43.51, compensated_percent: 13.30, encoder_time_s: 0.1 },
    PaperLoad { mass_kg: 2.0, uncompensated_percent: 41.30, compensated_percent: 10.67, encoder_time_s: 0.1 },
];

/// Before compensation: the input pulley follows `(r2/r1) theta_d`.
#[must_use]
pub fn uncompensated(setup: &TrackingSetup, load: &PaperLoad) -> Method {
    let mut parameters = setup.parameters(load.mass_kg);
    parameters.compensator.source = SOURCE_OFF;
    Method {
        name: "without compensation",
        sensors: "input encoder, input tensions",
        mode: Mode::Position,
        parameters,
        paper_percent: Some(load.uncompensated_percent),
    }
}

/// The paper's compensator with the end encoder: Eq. (22), (25), (26).
#[must_use]
pub fn compensated(setup: &TrackingSetup, load: &PaperLoad) -> Method {
    let mut parameters = setup.parameters(load.mass_kg);
    parameters.compensator.source = SOURCE_ENCODERS;
    parameters.compensator.encoder_time = load.encoder_time_s;
    Method {
        name: "paper's compensator",
        sensors: "both encoders, input tensions",
        mode: Mode::Position,
        parameters,
        paper_percent: Some(load.compensated_percent),
    }
}

/// The firmware's torque loop on the measured output tensions, with its default part of the friction of Eq. (15)-(17)
/// fed forward or none.
#[must_use]
pub fn torque_loop(setup: &TrackingSetup, load: &PaperLoad, friction_feedforward: bool) -> Method {
    let mut parameters = setup.parameters(load.mass_kg);
    if !friction_feedforward {
        parameters.controller.friction_feedforward = 0.0;
    }
    Method {
        name: if friction_feedforward { "torque loop, friction fed forward" } else { "torque loop" },
        sensors: "input encoder, output tensions",
        mode: Mode::Torque,
        parameters,
        paper_percent: None,
    }
}

/// All methods at a load, in the order of the tables.
#[must_use]
pub fn methods(setup: &TrackingSetup, load: &PaperLoad) -> Vec<Method> {
    vec![
        uncompensated(setup, load),
        compensated(setup, load),
        torque_loop(setup, load, false),
        torque_loop(setup, load, true),
    ]
}

/// Median and range over several runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Median; of an even number of values the mean of the middle two.
    pub median: f64,
    /// Least value.
    pub least: f64,
    /// Largest value.
    pub largest: f64,
}

impl Spread {
    /// Spread of at least one value.
    ///
    /// # Errors
    /// [`ExperimentError::Evaluation`] without any value.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Result<Self, ExperimentError> {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let (Some(&least), Some(&largest)) = (values.first(), values.last()) else {
            return Err(ExperimentError::Evaluation("no run, so no median"));
        };
        let middle = values.len() / 2;
        let below = if values.len().is_multiple_of(2) { middle - 1 } else { middle };
        Ok(Self { median: f64::midpoint(values[below], values[middle]), least, largest })
    }
}

/// Errors of a method over several motions of the sheaths.
#[derive(Debug, Clone)]
pub struct MethodErrors {
    /// The method.
    pub method: Method,
    /// Weight at the end of the arm \[kg\].
    pub mass_kg: f64,
    /// Average torque tracking error \[%\].
    pub torque_percent: Spread,
    /// Root mean square position error \[rad\].
    pub angle_rms_rad: Spread,
    /// Largest position error \[rad\].
    pub angle_largest_rad: Spread,
}

/// Errors of a method with this weight over `seeds`; the runs share the processors.
///
/// # Errors
/// That of the first run that fails.
pub fn errors_over_seeds(
    setup: &TrackingSetup,
    mass_kg: f64,
    method: Method,
    seeds: &[u64],
) -> Result<MethodErrors, ExperimentError> {
    let runs: Vec<TrackingErrors> = seeds
        .par_iter()
        .map(|seed| track(setup, mass_kg, &method, *seed).map(|run| run.errors))
        .collect::<Result<_, _>>()?;
    let spread = |of: fn(&TrackingErrors) -> f64| Spread::of(runs.iter().map(of));
    Ok(MethodErrors {
        mass_kg,
        torque_percent: spread(|errors| errors.torque_percent)?,
        angle_rms_rad: spread(|errors| errors.angle_rms_rad)?,
        angle_largest_rad: spread(|errors| errors.angle_largest_rad)?,
        method,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_and_range_by_hand() {
        let odd = Spread::of([3.0, 1.0, 2.0]).expect("values");
        assert_eq!((odd.median, odd.least, odd.largest), (2.0, 1.0, 3.0));
        let even = Spread::of([4.0, 1.0, 2.0, 3.0]).expect("values");
        assert_eq!((even.median, even.least, even.largest), (2.5, 1.0, 4.0));
        assert!(Spread::of([]).is_err());
    }
}
