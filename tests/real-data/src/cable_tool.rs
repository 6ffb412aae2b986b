//! One jaw of a surgical instrument, driven by cables between two torque sensors: da Vinci Maryland tools.
//!
//! The input angle and the torque of the load drive the simulation; it predicts the jaw angle and the input torque. The
//! zero of each is arbitrary in every recording and removed as the mean difference. Cables, guides and bearings are
//! taken to be the same in all tools; ratio of the pulleys and looseness of the cables belong to the tool.

use std::path::Path;

use bowden_core::joint_model::JointModel;
use bowden_core::outcome::Failure;
use bowden_core::recording::ColumnSource;
use bowden_model::channel::Channel;

use super::joint_fit::{Fitted, Knob, Run, fit, leave_out, rmse_of};
use super::study::{RealStudy, answers};
use super::{Mark, Table, listed_recordings, root_mean_square, with_values};

/// Folder of the data set.
pub const FOLDER: &str = "davinci-cable-tool";

/// Largest error of the jaw angle of recordings held out, rad.
pub const LIMIT_RAD: f64 = 0.48 * std::f64::consts::PI / 180.0;

/// Largest error of the input torque of recordings held out, N·m: an earlier quick fit.
pub const LIMIT_NM: f64 = 0.0119;

/// Largest error of the jaw angle that the diagnosis may leave on recordings held out, rad: published for a neural network on the same tools.
pub const DIAGNOSED_LIMIT_RAD: f64 = 0.37 * std::f64::consts::PI / 180.0;

/// Largest error of the input torque that the diagnosis may leave on recordings held out, N·m.
pub const DIAGNOSED_LIMIT_NM: f64 = 0.010;

/// Benches of the study, in its order. Roll and pitch are wrist poses of one tool, which a fit cannot tell from `T4L_4`.
const TOOLS: [&str; 4] = ["T4L_2", "T4L_4", "T4R_5", "T5L_3"];

/// Effects that people chose, with the values where fits start.
const EFFECTS: [(&str, &[(&str, f64)]); 3] = [
    ("motor_coulomb_friction", &[("torque_nm", 0.02)]),
    ("tendon_slack", &[("looseness_m", 6e-5)]),
    ("joint_coulomb_friction", &[("torque_nm", 0.02)]),
];

/// Start-up transient that the source advises to drop, s.
const LEAD_IN_S: f64 = 1.0;

/// Samples of the recording per sample of the fit: 1 kHz to 25 Hz. Scores are taken at 1 kHz.
const EVERY: usize = 40;

/// Simulation step of the fit, s. The joint is balanced in every step; at the same values the pooled errors differ from
/// those at 1 kHz by 0.003 deg and 0.6 mN m. Fits at 50 Hz score the same within 0.002 deg and 0.1 mN m.
const FIT_STEP_S: f64 = 0.04;

/// Difference step of the fit.
const STEPS: [f64; 1] = [0.02];

/// Evaluations per coordinate.
const PATIENCE: usize = 2;

/// Torque of the load motor per ampere of its command, N·m/A: mean of the recorded output torques over the commands.
const LOAD_NM_PER_A: f64 = 0.118;

/// What drives the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Load {
    /// The recorded output torque.
    Recorded,
    /// The constant command of the load motor.
    Commanded,
}

/// The physics that is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Physics {
    /// Stiff cables without friction, viscous friction at the input.
    GainAndViscous,
    /// Cables that push instead of going slack.
    NoSlack,
    /// Cables that go slack, mounted without looseness.
    NoLooseness,
    /// No friction that grows with the tension.
    NoCapstan,
    /// No dry friction in the jaw.
    NoJointFriction,
    /// No dry friction at the input spindle.
    NoSpindleFriction,
    /// Everything, and a spring at the jaw.
    WithSpring,
    /// Capstan friction, slack and loose cables, dry friction at both ends.
    All,
}

impl Physics {
    /// All, in the order of a table.
    pub const ALL: [Self; 8] = [
        Self::GainAndViscous,
        Self::NoSlack,
        Self::NoLooseness,
        Self::NoCapstan,
        Self::NoJointFriction,
        Self::NoSpindleFriction,
        Self::WithSpring,
        Self::All,
    ];

    /// Name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::GainAndViscous => "plain gain, viscous friction",
            Self::NoSlack => "all, but cables push",
            Self::NoLooseness => "all, but not loose",
            Self::NoCapstan => "all, but no capstan friction",
            Self::NoJointFriction => "all, but no jaw friction",
            Self::NoSpindleFriction => "all, but no spindle friction",
            Self::WithSpring => "all, and a spring at the jaw",
            Self::All => "all",
        }
    }

    /// Adds the effects of this physics to a rig of the study, with loose cables; all at round guesses, the same for all tools.
    fn prepare(self, model: &mut JointModel) {
        let parameters = &mut model.parameters;
        if let (Some(pulleys), Some(tendon), Some(sheath)) =
            (&mut parameters.pulleys, &mut parameters.tendon, &mut parameters.sheath)
        {
            pulleys.input_radius_m = 0.9 * pulleys.output_radius_m;
            tendon.pretension_n = 0.01;
            // 1.5 N·m/rad of one cable at the jaw.
            tendon.axial_stiffness_n = 1.5 * tendon.length_m / pulleys.output_radius_m.powi(2);
            sheath.friction_coefficient = 0.35 / sheath.wrap_angle_rad;
            match self {
                Self::GainAndViscous => {
                    tendon.axial_stiffness_n *= 100.0;
                    sheath.friction_coefficient = 0.0;
                }
                Self::NoCapstan => sheath.friction_coefficient = 0.0,
                _ => {}
            }
        }
        model.effects = with_values(&EFFECTS);
        model.effects.retain(|active| {
            self != Self::GainAndViscous
                && match active.descriptor().id {
                    "tendon_slack" => self != Self::NoSlack,
                    "joint_coulomb_friction" => self != Self::NoJointFriction,
                    "motor_coulomb_friction" => self != Self::NoSpindleFriction,
                    _ => true,
                }
        });
        for active in &mut model.effects {
            if self == Self::NoLooseness && active.descriptor().id == "tendon_slack" {
                *active = active.with("looseness_m", 0.0);
            }
        }
        let added = match self {
            Self::GainAndViscous => Some(("motor_viscous_friction", "viscous_nm_s_per_rad", 0.02)),
            Self::WithSpring => Some(("joint_spring", "stiffness_nm_per_rad", 0.007)),
            _ => None,
        };
        if let Some((id, name, value)) = added {
            model.effects.extend(with_values(&[(id, &[(name, value)])]));
        }
    }

    fn knobs(self, model: &JointModel, calibrated: Calibration) -> Vec<Knob> {
        /// Ratios of the pulleys of two tools differ by some percent, loosenesses by a factor.
        const RATIO_SPREAD: f64 = 0.05;
        const LOOSENESS_SPREAD: f64 = 1.0;
        let own = |knob: Knob, spread| match calibrated {
            Calibration::PerTool => knob.per_group(spread),
            Calibration::Shared => knob,
        };
        let effect = |id, name| Knob::effect(model, id, name);
        [
            Knob::nominal(model, "pulleys", "input_radius_m").map(|knob| own(knob, RATIO_SPREAD)),
            effect("tendon_slack", "looseness_m")
                .filter(|_| self != Self::NoLooseness)
                .map(|knob| own(knob, LOOSENESS_SPREAD)),
            Knob::nominal(model, "tendon", "axial_stiffness_n").filter(|_| self != Self::GainAndViscous),
            Knob::nominal(model, "sheath", "friction_coefficient")
                .filter(|_| !matches!(self, Self::GainAndViscous | Self::NoCapstan)),
            effect("joint_coulomb_friction", "torque_nm"),
            effect("motor_coulomb_friction", "torque_nm"),
            effect("joint_spring", "stiffness_nm_per_rad"),
            effect("motor_viscous_friction", "viscous_nm_s_per_rad"),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

/// Which tools share ratio and looseness.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calibration {
    /// Each tool has its own.
    PerTool,
    /// One for all.
    Shared,
}

/// The recordings, prepared; the joints are as the rigs state them.
#[derive(Clone, Debug)]
pub struct Recordings {
    /// At the recorded rate: scores come from these.
    pub full: Vec<Run>,
    /// The same in the same order at the rate of the fit.
    pub thinned: Vec<Run>,
}

/// Prepares the recordings.
///
/// # Errors
/// When a file of the data set is missing or unusable.
pub fn load(data: &Path, load: Load) -> Result<Recordings, Failure> {
    let folder = data.join(FOLDER);
    let study = RealStudy::load(FOLDER, &folder)?;
    let full: Result<Vec<Run>, Failure> = listed_recordings(&folder)?
        .into_iter()
        .map(|name| {
            let (group, mut rig) = study.stated(&name)?;
            if load == Load::Commanded {
                rig.columns.channels.retain(|(channel, _)| *channel != Channel::TorqueOut);
                let source =
                    ColumnSource { column: "load_command_a".to_owned(), scale: -LOAD_NM_PER_A, offset: 0.0 };
                rig.columns.channels.push((Channel::TorqueOut, source));
            }
            let compared = [(Channel::ThetaOut, LIMIT_RAD), (Channel::TorqueIn, LIMIT_NM)];
            let mut run = Run::load(&rig, &folder, name, group, &compared)?;
            let t_s = run.input.t_s();
            let from = t_s.partition_point(|at_s| at_s - t_s[0] < LEAD_IN_S);
            for compared in &mut run.compared {
                compared.from = from;
            }
            Ok(run)
        })
        .collect();
    let full = full?;
    let thinned = full.iter().map(|run| run.thinned(EVERY, FIT_STEP_S)).collect();
    Ok(Recordings { full, thinned })
}

/// Errors of one run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Score {
    /// Jaw angle, root mean square, rad.
    pub angle_rad: f64,
    /// Input torque, root mean square, N·m.
    pub torque_nm: f64,
}

/// Root mean square over runs.
#[must_use]
pub fn pooled(scores: &[Score]) -> Score {
    Score {
        angle_rad: root_mean_square(scores.iter().map(|score| score.angle_rad)),
        torque_nm: root_mean_square(scores.iter().map(|score| score.torque_nm)),
    }
}

/// Recordings and knobs of one physics.
fn prepared(runs: &Recordings, physics: Physics, calibration: Calibration) -> (Recordings, Vec<Knob>) {
    let mut runs = runs.clone();
    for run in runs.full.iter_mut().chain(&mut runs.thinned) {
        physics.prepare(&mut run.model);
    }
    let knobs = runs.thinned.first().map(|run| physics.knobs(&run.model, calibration)).unwrap_or_default();
    (runs, knobs)
}

/// Scores at the recorded rate.
fn scores_of(runs: &[Run], models: &[JointModel]) -> Result<Vec<Score>, Failure> {
    let score = |(run, errors): (&Run, Vec<f64>)| match errors.as_slice() {
        [angle_rad, torque_nm] => Ok(Score { angle_rad: *angle_rad, torque_nm: *torque_nm }),
        _ => Err(Failure::failed(format!("{}: expected jaw angle and input torque", run.name))),
    };
    runs.iter().zip(rmse_of(runs, models)?).map(score).collect()
}

/// Scores of all runs, each replayed with the physics fitted to the others.
///
/// # Errors
/// When a model cannot be driven.
pub fn held_out(
    runs: &Recordings,
    physics: Physics,
    calibration: Calibration,
) -> Result<Vec<Score>, Failure> {
    let (runs, knobs) = prepared(runs, physics, calibration);
    let models = leave_out(&runs.thinned, &knobs, &STEPS, PATIENCE, |run| run.name.clone())?;
    scores_of(&runs.full, &models)
}

/// Physics fitted to all runs: its scores, the fit and what was fitted.
///
/// # Errors
/// When a model cannot be driven.
pub fn in_sample(
    runs: &Recordings,
    physics: Physics,
    calibration: Calibration,
) -> Result<(Vec<Score>, Fitted, Vec<Knob>), Failure> {
    let (runs, knobs) = prepared(runs, physics, calibration);
    let fitted = fit(&runs.thinned.iter().collect::<Vec<_>>(), &knobs, None, &STEPS, PATIENCE)?;
    let models: Vec<JointModel> = runs.full.iter().map(|run| fitted.model(run, &knobs)).collect();
    Ok((scores_of(&runs.full, &models)?, fitted, knobs))
}

fn cells(score: Score) -> [String; 2] {
    [format!("{:.3}", score.angle_rad.to_degrees()), format!("{:.1}", 1e3 * score.torque_nm)]
}

/// Writes the tables and returns the marks.
///
/// # Errors
/// When the data set is missing or a model cannot be driven.
pub fn report(data: &Path, mut print: impl FnMut(String)) -> Result<Vec<Mark>, Failure> {
    let runs = load(data, Load::Recorded)?;
    print(format!(
        "Cable tool ({FOLDER}): jaw angle in degrees / input torque in mN m, root mean square over recordings\n"
    ));
    let header = ["physics", "fitted to all", "", "recording out", ""];
    let mut table = Table::new(&header);
    let mut by_recording = Vec::new();
    for physics in Physics::ALL {
        let out = held_out(&runs, physics, Calibration::PerTool)?;
        let inside = pooled(&in_sample(&runs, physics, Calibration::PerTool)?.0);
        let row = [physics.name().to_owned()].into_iter().chain(cells(inside)).chain(cells(pooled(&out)));
        table.row(row);
        by_recording.push(out);
    }
    print(table.to_string());

    let mut table = Table::new(&["recording, held out", "plain gain", "", "all", ""]);
    let [plain, .., all] = by_recording.as_slice() else { return Ok(Vec::new()) };
    for ((run, plain), all) in runs.full.iter().zip(plain).zip(all) {
        table.row([run.name.clone()].into_iter().chain(cells(*plain)).chain(cells(*all)));
    }
    print(table.to_string());

    let mut table = Table::new(&["all physics, otherwise", "recording out", ""]);
    let shared = held_out(&runs, Physics::All, Calibration::Shared)?;
    table.row(
        ["ratio and looseness shared by all tools".to_owned()].into_iter().chain(cells(pooled(&shared))),
    );
    let commanded = held_out(&load(data, Load::Commanded)?, Physics::All, Calibration::PerTool)?;
    table.row(
        ["load as commanded instead of as measured".to_owned()].into_iter().chain(cells(pooled(&commanded))),
    );
    let (_, fitted, knobs) = in_sample(&runs, Physics::All, Calibration::PerTool)?;
    print(table.to_string());

    let mut table = Table::new(&[&["fitted to all", "shared"][..], &TOOLS].concat());
    let mut model = runs.full[0].model.clone();
    Physics::All.prepare(&mut model);
    for (index, knob) in knobs.iter().enumerate() {
        let own = knob.spread.map_or(0..0, |_| 0..TOOLS.len());
        let values = [None].into_iter().chain(own.map(Some));
        let values = values.map(|group| format!("{:.4e}", fitted.value(&knobs, index, group)));
        table.row([knob.free.path(&model)].into_iter().chain(values));
    }
    print(table.to_string());

    let study = RealStudy::load("davinci-cable-tool", &data.join(FOLDER))?;
    let [tools, _] = answers(&[study.clone(), study.of_benches(&["T4L_2"])?], &mut print)?;
    let total = pooled(all);
    Ok(vec![
        Mark {
            quantity: "cable tool, jaw angle held out by recording, deg",
            score: total.angle_rad.to_degrees(),
            limit: LIMIT_RAD.to_degrees(),
        },
        Mark {
            quantity: "cable tool, input torque held out by recording, mN m",
            score: 1e3 * total.torque_nm,
            limit: 1e3 * LIMIT_NM,
        },
        Mark {
            quantity: "cable tool, diagnosed, jaw angle of recordings held out, deg",
            score: tools.left(Channel::ThetaOut).to_degrees(),
            limit: DIAGNOSED_LIMIT_RAD.to_degrees(),
        },
        Mark {
            quantity: "cable tool, diagnosed, input torque of recordings held out, mN m",
            score: 1e3 * tools.left(Channel::TorqueIn),
            limit: 1e3 * DIAGNOSED_LIMIT_NM,
        },
    ])
}
