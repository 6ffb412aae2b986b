//! A hobby servo that swings a weight: Dynamixel XL330, four trajectories under four firmware gains.
//!
//! The joint is simulated from the goal alone, six seconds without any feedback from the recording, as the source of the
//! data scores it; the score of a recording is the mean absolute angle error.

use std::path::Path;

use bowden_core::joint_model::JointModel;
use bowden_core::outcome::Failure;
use bowden_model::channel::Channel;

use super::joint_fit::{Knob, Run, fit, leave_out};
use super::study::{RealStudy, answers};
use super::{Mark, Table, listed_recordings, mean, with_values};

/// Folder of the data set.
pub const FOLDER: &str = "bam-xl330-pendulum";

/// Largest mean absolute angle error of recordings held out, rad: an earlier quick fit.
pub const LIMIT_RAD: f64 = 0.0399;

/// Largest mean absolute angle error that the diagnosis may leave on recordings held out, rad: what the reference fit leaves.
pub const DIAGNOSED_LIMIT_RAD: f64 = 0.0353;

/// Firmware gains, as the recordings name them.
const GAINS: [&str; 4] = ["kp100", "kp200", "kp400", "kp800"];

/// Effects that people chose, with the values where fits start.
const EFFECTS: [(&str, &[(&str, f64)]); 2] = [
    ("motor_coulomb_friction", &[("torque_nm", 0.02)]),
    ("gear_load_friction", &[("coefficient", 0.5), ("exponent", 2.0)]),
];

/// Angle error that counts as 1 in the fit, rad.
const SCALE_RAD: f64 = 0.05;

/// Difference steps of the fit: swings that stick a little earlier or later make the error rough below some percent.
const STEPS: [f64; 2] = [0.05, 0.01];

/// Evaluations per coordinate and round.
const PATIENCE: usize = 8;

/// The physics that is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Physics {
    /// Motor with viscous friction: what a rig without effects contains.
    Viscous,
    /// Constant dry friction and viscous friction.
    DryAndViscous,
    /// Constant dry friction, and gear friction in proportion to the torque carried.
    ProportionalGearFriction,
    /// Gear friction that grows with the square of the torque carried, without constant dry friction.
    NoDryFriction,
    /// Everything but the inertia of rotor and gear.
    NoRotorInertia,
    /// Constant dry friction, and gear friction that grows with the square of the torque carried.
    All,
}

impl Physics {
    /// All, in the order of a table.
    pub const ALL: [Self; 6] = [
        Self::Viscous,
        Self::DryAndViscous,
        Self::ProportionalGearFriction,
        Self::NoDryFriction,
        Self::NoRotorInertia,
        Self::All,
    ];

    /// Name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Viscous => "viscous friction alone",
            Self::DryAndViscous => "dry and viscous friction",
            Self::ProportionalGearFriction => "dry, and gear friction ~ load",
            Self::NoDryFriction => "gear friction ~ load^2 alone",
            Self::NoRotorInertia => "all, without rotor inertia",
            Self::All => "all: dry, and gear friction ~ load^2",
        }
    }

    /// Adds the effects of this physics to the rig of the study, at round guesses.
    fn prepare(self, model: &mut JointModel) {
        if let Some(motor) = &mut model.parameters.motor {
            // Data sheet at 5 V, to its last digit: stall torque 0.52 N·m at 1.47 A.
            motor.resistance_ohm = 5.0 / 1.47;
            motor.torque_constant_nm_per_a = 0.52 / 1.47 / motor.gear_ratio;
            motor.rotor_inertia_kg_m2 = if self == Self::NoRotorInertia { 1e-9 } else { 1e-8 };
            motor.viscous_nm_s_per_rad =
                if matches!(self, Self::Viscous | Self::DryAndViscous) { 0.02 } else { 0.0 };
        }
        model.effects = with_values(&EFFECTS);
        model.effects.retain(|active| match active.descriptor().id {
            "motor_coulomb_friction" => !matches!(self, Self::Viscous | Self::NoDryFriction),
            "gear_load_friction" => !matches!(self, Self::Viscous | Self::DryAndViscous),
            _ => true,
        });
        for active in &mut model.effects {
            if self == Self::ProportionalGearFriction && active.descriptor().id == "gear_load_friction" {
                *active = active.with("coefficient", 0.3).with("exponent", 1.0);
            }
        }
    }

    fn knobs(self, model: &JointModel) -> Vec<Knob> {
        let motor = |name| Knob::nominal(model, "motor", name);
        let has_viscous = matches!(self, Self::Viscous | Self::DryAndViscous);
        [
            motor("resistance_ohm"),
            motor("torque_constant_nm_per_a"),
            motor("rotor_inertia_kg_m2").filter(|_| self != Self::NoRotorInertia),
            motor("viscous_nm_s_per_rad").filter(|_| has_viscous),
            Knob::effect(model, "motor_coulomb_friction", "torque_nm"),
            Knob::effect(model, "gear_load_friction", "coefficient"),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

/// The study of the servo.
fn study(data: &Path) -> Result<RealStudy, Failure> {
    RealStudy::load("xl330-pendulum", &data.join(FOLDER))
}

/// The recordings, prepared; the joints are as the study states them.
///
/// # Errors
/// When a file of the data set is missing or unusable.
pub fn load(data: &Path) -> Result<Vec<Run>, Failure> {
    let folder = data.join(FOLDER);
    let study = study(data)?;
    listed_recordings(&folder)?
        .into_iter()
        .map(|name| {
            let group = GAINS.iter().position(|gain| name.contains(gain)).ok_or_else(|| {
                Failure::bad_input(format!("{name}: names no gain, expected {}", GAINS.join(" or ")))
            })?;
            let (_, rig) = study.stated(&name)?;
            Ok(Run::load(&rig, &folder, name, group, &[(Channel::ThetaOut, SCALE_RAD)])?.from_rest())
        })
        .collect()
}

/// Mean absolute angle error of a run, rad.
///
/// # Errors
/// When the model cannot be driven.
pub fn error_rad(run: &Run, model: &JointModel) -> Result<f64, Failure> {
    Ok(mean(run.differences(model)?.concat().into_iter().map(f64::abs)))
}

/// What may be left out together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// One recording.
    Recording,
    /// All recordings of one firmware gain.
    Gain,
    /// All recordings of one trajectory.
    Trajectory,
}

impl Split {
    fn part(self, run: &Run) -> String {
        // xl330_kp100_lift_and_drop_10h28m17
        match self {
            Self::Recording => run.name.clone(),
            Self::Gain => run.group.to_string(),
            Self::Trajectory => {
                let words: Vec<&str> = run.name.split('_').skip(2).collect();
                words[..words.len().saturating_sub(1)].join("_")
            }
        }
    }
}

fn prepared(runs: &[Run], physics: Physics) -> (Vec<Run>, Vec<Knob>) {
    let mut runs = runs.to_vec();
    for run in &mut runs {
        physics.prepare(&mut run.model);
    }
    let knobs = runs.first().map(|run| physics.knobs(&run.model)).unwrap_or_default();
    (runs, knobs)
}

/// Errors of all runs, rad, each replayed with the physics fitted without its part.
///
/// # Errors
/// When a model cannot be driven.
pub fn held_out(runs: &[Run], physics: Physics, split: Split) -> Result<Vec<f64>, Failure> {
    let (runs, knobs) = prepared(runs, physics);
    let models = leave_out(&runs, &knobs, &STEPS, PATIENCE, |run| split.part(run))?;
    runs.iter().zip(&models).map(|(run, model)| error_rad(run, model)).collect()
}

/// Fitted values under their names in a rig file.
pub type NamedValues = Vec<(String, f64)>;

/// Errors of all runs, rad, with the physics fitted to all of them, and the fitted values with their names.
///
/// # Errors
/// When a model cannot be driven.
pub fn in_sample(runs: &[Run], physics: Physics) -> Result<(Vec<f64>, NamedValues), Failure> {
    let (runs, knobs) = prepared(runs, physics);
    let fitted = fit(&runs.iter().collect::<Vec<_>>(), &knobs, None, &STEPS, PATIENCE)?;
    let errors: Result<Vec<f64>, Failure> =
        runs.iter().map(|run| error_rad(run, &fitted.model(run, &knobs))).collect();
    let values = knobs
        .iter()
        .enumerate()
        .map(|(index, knob)| (knob.free.path(&runs[0].model), fitted.value(&knobs, index, None)))
        .collect();
    Ok((errors?, values))
}

/// Writes the tables and returns the marks.
///
/// # Errors
/// When the data set is missing or a model cannot be driven.
pub fn report(data: &Path, mut print: impl FnMut(String)) -> Result<Vec<Mark>, Failure> {
    let runs = load(data)?;
    print(format!("Servo pendulum ({FOLDER}): mean absolute angle error, rad, simulated from the goal\n"));

    let mut table = Table::new(&["physics", "fitted to all", "recording out", "gain out", "trajectory out"]);
    let mut by_recording = Vec::new();
    for physics in Physics::ALL {
        let cell = |values: &[f64]| format!("{:.4}", mean(values.iter().copied()));
        let out = held_out(&runs, physics, Split::Recording)?;
        let wider = |split| match physics {
            Physics::Viscous | Physics::All => Ok::<_, Failure>(cell(&held_out(&runs, physics, split)?)),
            _ => Ok(String::new()),
        };
        table.row([
            physics.name().to_owned(),
            cell(&in_sample(&runs, physics)?.0),
            cell(&out),
            wider(Split::Gain)?,
            wider(Split::Trajectory)?,
        ]);
        by_recording.push(out);
    }
    print(table.to_string());

    let mut table = Table::new(&["recording, held out", "viscous", "all"]);
    let [viscous, .., all] = by_recording.as_slice() else { return Ok(Vec::new()) };
    for ((run, viscous), all) in runs.iter().zip(viscous).zip(all) {
        table.row([run.name.clone(), format!("{viscous:.4}"), format!("{all:.4}")]);
    }
    print(table.to_string());

    let mut table = Table::new(&["fitted to all", "value"]);
    for (name, value) in in_sample(&runs, Physics::All)?.1 {
        table.row([name, format!("{value:.4e}")]);
    }
    print(table.to_string());

    let [servo] = answers(&[study(data)?], &mut print)?;
    Ok(vec![
        Mark {
            quantity: "servo pendulum, mean absolute angle error held out by recording, rad",
            score: mean(all.iter().copied()),
            limit: LIMIT_RAD,
        },
        Mark {
            quantity: "servo pendulum, diagnosed, mean absolute angle error of recordings held out, rad",
            score: servo.mean_absolute_left(Channel::ThetaOut),
            limit: DIAGNOSED_LIMIT_RAD,
        },
    ])
}
