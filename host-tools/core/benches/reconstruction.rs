//! What reconstructing the input angle gains: `cargo bench -p bowden-core --bench reconstruction`.
//!
//! A recording of a bench that conceals nothing is replayed in four ways. Each way recalibrates the rig for itself on
//! the training recording; the table shows the differences on the other one.

use std::f64::consts::{PI, SQRT_2};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bowden_core::fit::objective::{Objective, Part, Series};
use bowden_core::fit::recalibrated::recalibrated;
use bowden_core::fit::solver::solve;
use bowden_core::joint_model::JointModel;
use bowden_core::outcome::Failure;
use bowden_core::recording::Recording;
use bowden_core::rig::Rig;
use bowden_model::channel::Channel;

/// Corner of the low-pass, Hz.
const CORNER_HZ: f64 = 20.0;

/// Ripple that keeps a replay from taking counts for counts: a fraction of 1/15000 of a 12-bit count.
const RIPPLE_RAD: f64 = 1e-7;

/// Angle as a replay is to see it, from the recorded one and the sampling rate in Hz.
type Preparation = fn(&[f64], f64) -> Vec<f64>;

fn main() -> ExitCode {
    let folder: PathBuf =
        [env!("CARGO_MANIFEST_DIR"), "..", "..", "..", "shared", "concealed-examples", "example-7"]
            .iter()
            .collect();
    if !folder.is_dir() {
        println!("skipped: {} is not there", folder.display());
        return ExitCode::SUCCESS;
    }
    match compare(&folder) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("{failure}");
            ExitCode::FAILURE
        }
    }
}

fn compare(folder: &Path) -> Result<(), Failure> {
    let rig = Rig::load(&folder.join("rig.toml"))?;
    let training = rig.load_recording(&folder.join("train.csv.gz"))?;
    let heldout = rig.load_recording(&folder.join("heldout.csv.gz"))?;
    let prescribed = {
        let mut rig = rig.clone();
        rig.replay_inputs = Some(vec![Channel::ThetaIn]);
        rig.replay_outputs = Some([vec![Channel::ThetaOut], Channel::TENSIONS.to_vec()].concat());
        rig
    };
    println!("RMS difference on held-out data            f1_n      f2_n      f3_n      f4_n  theta_out_rad");
    let ways: [(&str, &Rig, Preparation); 4] = [
        ("counts prescribed as they are", &prescribed, rippled),
        ("zero-phase 20 Hz low-pass prescribed", &prescribed, low_passed),
        ("reconstruction prescribed", &prescribed, untouched),
        ("motor, guided to the reconstruction", &rig, untouched),
    ];
    for (name, rig, prepare) in ways {
        let of = |recording: &Recording| {
            let rate_hz = 1.0 / recording.median_step_s().unwrap_or(1e-3);
            let theta = prepare(recording.channel(Channel::ThetaIn).unwrap_or_default(), rate_hz);
            recording.clone().with(Channel::ThetaIn, theta)
        };
        let (training, heldout) = (of(&training), of(&heldout));
        let model = JointModel::from_rig(rig, &training)?;
        let objective = Objective::new(&model, &[training], &[heldout], false)?;
        let solution = solve(&objective, &model, &recalibrated(&model), 10)?;
        let predictions = objective.predict(&solution.model)?;
        let rmse = |channel| objective.rmse(&predictions, Series::Channel(channel), Part::HeldOut);
        let [f1, f2, f3, f4] = Channel::TENSIONS.map(rmse);
        let theta = rmse(Channel::ThetaOut);
        println!("{name:<37}{f1:>10.4}{f2:>10.4}{f3:>10.4}{f4:>10.4}{theta:>15.5}");
    }
    Ok(())
}

fn untouched(theta: &[f64], _rate_hz: f64) -> Vec<f64> {
    theta.to_vec()
}

fn rippled(theta: &[f64], _rate_hz: f64) -> Vec<f64> {
    theta
        .iter()
        .enumerate()
        .map(|(k, value)| value + if k % 2 == 0 { RIPPLE_RAD } else { -RIPPLE_RAD })
        .collect()
}

/// Second-order Butterworth filter, forwards and backwards.
fn low_passed(theta: &[f64], rate_hz: f64) -> Vec<f64> {
    let c = 1.0 / (PI * CORNER_HZ / rate_hz).tan();
    let scale = 1.0 / (1.0 + SQRT_2 * c + c * c);
    let (a1, a2) = (2.0 * scale * (1.0 - c * c), scale * (1.0 - SQRT_2 * c + c * c));
    let pass = |values: Vec<f64>| -> Vec<f64> {
        let start = values.first().copied().unwrap_or(0.0);
        let (mut x, mut y) = ([start; 2], [start; 2]);
        values
            .into_iter()
            .map(|value| {
                let out = scale * (value + 2.0 * x[0] + x[1]) - a1 * y[0] - a2 * y[1];
                (x, y) = ([value, x[0]], [out, y[0]]);
                out
            })
            .collect()
    };
    let mut backwards = pass(rippled(theta, rate_hz));
    backwards.reverse();
    let mut filtered = pass(backwards);
    filtered.reverse();
    filtered
}
