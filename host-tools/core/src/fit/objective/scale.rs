//! In what a residual is measured, and how much a large one counts.

use bowden_model::channel::Channel;
use bowden_model::drive::pulley_stall_torque_nm;

use super::Series;
use super::block::moments;
use super::dataset::Dataset;
use crate::joint_model::JointModel;
use crate::reconstruct::quantum_of;

/// Share of a channel's standard deviation that counts as agreement.
const MODEL_FLOOR: f64 = 0.015;

/// Same for angles, which a transmission of a few N·m/mrad reproduces far better than its tensions.
const ANGLE_FLOOR: f64 = 0.002;

/// Residual at which the soft L1 loss bends, in scales.
const LOSS_BEND: f64 = 3.0;

/// Loss of a residual: `r²` up to the bend, growing with `|r|` beyond.
#[must_use]
pub fn loss(residual: f64) -> f64 {
    soft(residual).powi(2)
}

/// The number whose square is the soft L1 loss of `residual`.
#[must_use]
pub fn soft(residual: f64) -> f64 {
    let z = residual / LOSS_BEND;
    LOSS_BEND * (2.0 * ((1.0 + z * z).sqrt() - 1.0)).sqrt().copysign(residual)
}

/// Measured values of a series in the recordings that are fitted to; in those that only judge where no other holds it.
fn recorded(datasets: &[Dataset], series: Series) -> Vec<&[f64]> {
    let of = |fitted: bool| {
        let datasets = datasets.iter().filter(move |dataset| dataset.is_fitted() == fitted);
        datasets.flat_map(move |d| {
            d.measured.iter().filter(move |(s, _)| *s == series).map(|(_, v)| v.as_slice())
        })
    };
    let fitted: Vec<&[f64]> = of(true).collect();
    if fitted.is_empty() { of(false).collect() } else { fitted }
}

/// White noise of the sensor, and a twelfth of its step squared.
pub(super) fn noise_variance(model: &JointModel, series: Series, datasets: &[Dataset]) -> f64 {
    let Series::Channel(channel) = series else { return 0.0 };
    let sensors = &model.parameters.sensors;
    let noise = match channel {
        Channel::F1 | Channel::F2 | Channel::F3 | Channel::F4 => sensors.tension_noise_n,
        Channel::MotorCurrent => sensors.current_noise_a,
        _ => 0.0,
    };
    let quantum = recorded(datasets, series).into_iter().filter_map(quantum_of).fold(0.0, f64::max);
    noise * noise + quantum * quantum / 12.0
}

/// What a residual of a series is measured in, in its unit.
pub(super) fn scale_of(model: &JointModel, series: Series, noise_variance: f64, datasets: &[Dataset]) -> f64 {
    match series {
        Series::Guide => {
            // Of the stall torque of the motor: what a gear loses unnoticed.
            const SHARE: f64 = 0.0015;
            let Some(motor) = &model.parameters.motor else { return SHARE };
            let stall_nm = pulley_stall_torque_nm(motor);
            if model.guided_by.is_none() {
                return SHARE * stall_nm;
            }
            // A source of torque has no stall torque that means anything: of the torque that drove the joint, as of any other channel.
            let fitted = datasets.iter().filter(|dataset| dataset.is_fitted());
            let [driven_nm, noise_nm] = fitted
                .map(|dataset| [dataset.input.driven_nm().unwrap_or(0.0), dataset.input.guide_noise_nm()])
                .fold([0.0_f64; 2], |most, one| [most[0].max(one[0]), most[1].max(one[1])]);
            // A pendulum that swings by itself is driven by none.
            let floor_nm = if driven_nm > 0.0 { MODEL_FLOOR * driven_nm } else { SHARE * stall_nm };
            f64::hypot(floor_nm, noise_nm).max(f64::MIN_POSITIVE)
        }
        Series::Channel(channel) => {
            let floor = match channel {
                Channel::ThetaIn | Channel::ThetaOut | Channel::ThetaMotor => ANGLE_FLOOR,
                _ => MODEL_FLOOR,
            };
            let spread =
                recorded(datasets, series).into_iter().map(|v| moments(v).variance).fold(0.0, f64::max);
            (noise_variance + floor * floor * spread).sqrt().max(f64::MIN_POSITIVE)
        }
    }
}
