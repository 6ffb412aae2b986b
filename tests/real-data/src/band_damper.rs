//! A band wrapped on a drum, moved back and forth: friction, backlash and the loads of both band ends.
//!
//! The displacement drives the simulation; it predicts the friction force and the force of each band end. To the forces
//! the bench is two cables that turn a joint with dry friction: one band end pulls at a time, between the two lies free
//! play, and the drum slips at some force. Stiffness and play come from the other recordings. The slip force differs
//! from recording to recording and is the one number that each recording gives itself.

use std::path::Path;

use bowden_core::joint_model::JointModel;
use bowden_core::outcome::Failure;
use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Target};
use bowden_model::effects::find;
use rayon::prelude::*;

use super::joint_fit::{Knob, Run, adapted, leave_out, rmse_of};
use super::late::late;
use super::study::{RealStudy, answers};
use super::{
    Mark, RigFile, Table, columns, listed_recordings, mean, rig_file, root_mean_square, standard_deviation,
};

/// Folder of the data set.
pub const FOLDER: &str = "band-friction-damper";

/// Largest error of the friction force with the slip force of the recording itself, all else held out, N.
pub const LIMIT_N: f64 = 2000.0;

/// Largest error of the friction force as a lever of the band ends, N.
pub const LEVER_LIMIT_N: f64 = 800.0;

/// Largest error of the friction force that the diagnosis may leave on seconds held out, N: what the reference fit leaves.
pub const DIAGNOSED_LIMIT_N: f64 = 1790.0;

const RIG: RigFile = rig_file!("../../host-tools/studies/band-friction-damper/damper.toml");

/// N·m of the rig per newton of the recording.
pub const TORQUE_NM_PER_N: f64 = 5e-4;

/// Newtons of a cable of the rig per newton of a band end.
const CABLE_N_PER_N: f64 = 0.2;

/// Friction force that counts as 1 in the fit, N.
const SCALE_N: f64 = 1000.0;

/// Samples of the recording per sample of the fit: 1024 Hz to 128 Hz. Scores are taken at 1024 Hz.
const EVERY: usize = 8;

/// Simulation step of the fit, s.
const FIT_STEP_S: f64 = 1.0 / 128.0;

/// Difference step of the fit.
const STEPS: [f64; 1] = [0.02];

/// Evaluations per coordinate.
const PATIENCE: usize = 4;

/// Newtons in a pound of force, for the band tension in the names of the recordings.
const N_PER_LB: f64 = 4.448_221_6;

/// The physics that is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Physics {
    /// Dry friction of a rigid band.
    Rigid,
    /// Elastic bands without play.
    Elastic,
    /// Elastic bands with free play between them.
    ElasticLoose,
    /// The same, and band-end forces that are shown late.
    ElasticLooseLate,
}

impl Physics {
    /// All, in the order of a table.
    pub const ALL: [Self; 4] = [Self::Rigid, Self::Elastic, Self::ElasticLoose, Self::ElasticLooseLate];

    /// Name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rigid => "dry friction, rigid band",
            Self::Elastic => "dry friction, elastic band",
            Self::ElasticLoose => "dry friction, elastic band, play",
            Self::ElasticLooseLate => "the same, band ends shown late",
        }
    }

    const fn has_play(self) -> bool {
        matches!(self, Self::ElasticLoose | Self::ElasticLooseLate)
    }
}

/// What the others may tell about the slip force of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slip {
    /// One slip force for all: their geometric mean.
    Shared,
    /// In proportion to the force of band end 1 at rest: the capstan law with one friction coefficient.
    AsAtRest,
}

/// Band tension in the name of a recording, N; `None` for one that does not tell.
#[must_use]
pub fn named_tension_n(name: &str) -> Option<f64> {
    // d1__char__0.5Hz20lbtension
    let before = name.split("lbtension").next().filter(|before| *before != name)?;
    before.rsplit("Hz").next()?.parse::<f64>().ok().map(|pounds| pounds * N_PER_LB)
}

/// The recordings, prepared; the joints are as the rig states them.
#[derive(Clone, Debug)]
pub struct Recordings {
    /// At the recorded rate: scores come from these.
    pub full: Vec<Run>,
    /// The same in the same order at the rate of the fit.
    pub thinned: Vec<Run>,
    /// What the recordings show without any model.
    pub shown: Vec<Shown>,
    /// Friction force against band ends, each from the other recordings.
    pub levers: Vec<Lever>,
}

/// Prepares the recordings.
///
/// # Errors
/// When a file of the data set is missing or unusable.
pub fn load(data: &Path) -> Result<Recordings, Failure> {
    let folder = data.join(FOLDER);
    let rig = RIG.parse()?;
    let compared = [
        (Channel::TorqueIn, SCALE_N * TORQUE_NM_PER_N),
        (Channel::F1, 0.5 * SCALE_N * CABLE_N_PER_N),
        (Channel::F3, 0.5 * SCALE_N * CABLE_N_PER_N),
    ];
    let full: Result<Vec<Run>, Failure> = listed_recordings(&folder)?
        .into_iter()
        .enumerate()
        .map(|(group, name)| Run::load(&rig, &folder, name, group, &compared))
        .collect();
    let full = full?;
    let thinned = full.iter().map(|run| run.thinned(EVERY, FIT_STEP_S)).collect();
    let shown = shown(data)?;
    let levers = levers(&shown);
    Ok(Recordings { full, thinned, shown, levers })
}

/// Round guesses from which every fit starts.
fn prepare(run: &mut Run, physics: Physics, lag_s: f64) {
    if let Some(tendon) = &mut run.model.parameters.tendon {
        tendon.axial_stiffness_n = if physics == Physics::Rigid { 1e8 } else { 4e5 };
    }
    let looseness_m = if physics.has_play() { 1e-3 } else { 0.0 };
    for active in &mut run.model.effects {
        *active = match active.descriptor().id {
            "tendon_slack" => active.with("looseness_m", looseness_m),
            "joint_coulomb_friction" => active.with("torque_nm", 5.0),
            _ => *active,
        };
    }
    if physics == Physics::ElasticLooseLate
        && lag_s > 0.0
        && let Some(effect) = find("sensor_lag")
    {
        let lag = ActiveEffect { target: Target::Tensions, ..ActiveEffect::with_defaults(effect) };
        run.model.effects.push(lag.with("time_constant_s", lag_s));
    }
}

fn slip_force(model: &JointModel) -> Vec<Knob> {
    Knob::effect(model, "joint_coulomb_friction", "torque_nm").into_iter().collect()
}

fn knobs(model: &JointModel, physics: Physics) -> Vec<Knob> {
    /// Slip forces of two recordings differ by a factor.
    const SLIP_SPREAD: f64 = 1.0;
    let stiffness = Knob::nominal(model, "tendon", "axial_stiffness_n").filter(|_| physics != Physics::Rigid);
    let play = Knob::effect(model, "tendon_slack", "looseness_m").filter(|_| physics.has_play());
    let slip = slip_force(model).into_iter().map(|knob| knob.per_group(SLIP_SPREAD));
    slip.chain(stiffness).chain(play).collect()
}

/// Errors of one run, root mean square, N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Score {
    /// Friction force.
    pub friction_n: f64,
    /// Force of the band ends, both together.
    pub ends_n: f64,
}

/// Joints of all runs, stiffness and play from the other recordings, slip force from the recording itself.
///
/// # Errors
/// When a model cannot be driven.
pub fn held_out(recordings: &Recordings, physics: Physics) -> Result<Vec<JointModel>, Failure> {
    let mut runs = recordings.thinned.clone();
    for (run, lever) in runs.iter_mut().zip(&recordings.levers) {
        prepare(run, physics, lever.lag_s);
    }
    let Some(first) = runs.first() else { return Ok(Vec::new()) };
    let knobs = knobs(&first.model, physics);
    let models = leave_out(&runs, &knobs, &STEPS, PATIENCE, |run| run.name.clone())?;
    let own = |(run, model): (&Run, JointModel)| adapted(run, &model, slip_force, &STEPS, PATIENCE);
    runs.par_iter().zip(models).map(own).collect()
}

/// The same joints with a slip force that the other recordings tell.
#[must_use]
pub fn with_slip_of_others(recordings: &Recordings, models: &[JointModel], slip: Slip) -> Vec<JointModel> {
    let own_nm = |model: &JointModel| slip_force(model).first().map_or(f64::NAN, |knob| knob.free.start());
    let unit = |place: usize| match slip {
        Slip::Shared => 1.0,
        Slip::AsAtRest => recordings.shown[place].rest_n[1],
    };
    let told = |(place, model): (usize, &JointModel)| {
        let others = models.iter().enumerate().filter(|(other, _)| *other != place);
        let ratio = mean(others.map(|(other, model)| (own_nm(model) / unit(other)).ln())).exp();
        let mut model = model.clone();
        for active in &mut model.effects {
            if active.descriptor().id == "joint_coulomb_friction" {
                *active = active.with("torque_nm", ratio * unit(place));
            }
        }
        model
    };
    models.iter().enumerate().map(told).collect()
}

/// Errors of all runs.
///
/// # Errors
/// When a model cannot be driven.
pub fn scores(recordings: &Recordings, models: &[JointModel]) -> Result<Vec<Score>, Failure> {
    let score = |(run, errors): (&Run, Vec<f64>)| match errors.as_slice() {
        [torque_nm, f1_n, f3_n] => Ok(Score {
            friction_n: torque_nm / TORQUE_NM_PER_N,
            ends_n: root_mean_square([*f1_n, *f3_n]) / CABLE_N_PER_N,
        }),
        _ => Err(Failure::failed(format!("{}: expected friction force and both band ends", run.name))),
    };
    recordings.full.iter().zip(rmse_of(&recordings.full, models)?).map(score).collect()
}

/// Root mean square over runs.
#[must_use]
pub fn pooled(scores: &[Score]) -> Score {
    Score {
        friction_n: root_mean_square(scores.iter().map(|score| score.friction_n)),
        ends_n: root_mean_square(scores.iter().map(|score| score.ends_n)),
    }
}

/// What a recording shows while the drum slips one way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sliding {
    /// Friction force, N, median.
    pub friction_n: f64,
    /// Its largest value, N.
    pub peak_n: f64,
    /// Band end that pulls, N, median.
    pub tight_n: f64,
    /// The other one.
    pub slack_n: f64,
}

/// What a recording shows without any model.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Name of the recording.
    pub name: String,
    /// Friction force and force of end 1 and 2 before the motion, N.
    pub rest_n: [f64; 3],
    /// Change of the three until the end of the recording, N.
    pub drift_n: [f64; 3],
    /// Sliding towards positive and negative displacement; `None` where the recording does not slide for long.
    pub sliding: [Option<Sliding>; 2],
    samples: [Vec<f64>; 3],
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// What the recordings show without any model.
///
/// # Errors
/// When a file of the data set is missing or unusable.
pub fn shown(data: &Path) -> Result<Vec<Shown>, Failure> {
    /// Samples before the motion and after it, s / 1024.
    const REST: usize = 100;
    /// Fewest samples that count as sliding.
    const FEWEST: usize = 50;
    let folder = data.join(FOLDER);
    let names = ["time_s", "friction_force_n", "actuator_force_1_n", "actuator_force_2_n", "velocity_m_s"];
    let of = |name: String| -> Result<Shown, Failure> {
        let [t_s, friction_n, one_n, two_n, speed_m_s] = columns(&folder.join(format!("{name}.csv")), names)?;
        let all = [&friction_n, &one_n, &two_n];
        let rest_n = all.map(|values| mean(values.iter().take(REST).copied()));
        let end_n = all.map(|values| mean(values.iter().rev().take(REST).copied()));
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let fast_m_s = 0.3 * largest(&speed_m_s);
        let sliding = |sign: f64| {
            let peak_n = friction_n.iter().fold(0.0_f64, |peak, force| peak.max(sign * force));
            let slides: Vec<usize> = (0..speed_m_s.len())
                .filter(|k| sign * speed_m_s[*k] > fast_m_s && sign * friction_n[*k] > 0.4 * peak_n)
                .collect();
            let middle = |values: &[f64]| median(slides.iter().map(|k| values[*k]).collect());
            let (tight, slack) = if sign > 0.0 { (&two_n, &one_n) } else { (&one_n, &two_n) };
            let found = Sliding {
                friction_n: middle(&friction_n)?,
                peak_n: sign * peak_n,
                tight_n: middle(tight)?,
                slack_n: middle(slack)?,
            };
            (slides.len() >= FEWEST).then_some(found)
        };
        let sliding = [sliding(1.0), sliding(-1.0)];
        let difference_n: Vec<f64> = two_n.iter().zip(&one_n).map(|(two, one)| two - one).collect();
        let drift_n = [0, 1, 2].map(|k| end_n[k] - rest_n[k]);
        Ok(Shown { name, rest_n, drift_n, sliding, samples: [t_s, difference_n, friction_n] })
    };
    listed_recordings(&folder)?.into_iter().map(of).collect()
}

/// Least-squares slope of `y` over `x` about their means.
fn slope(x: &[f64], y: &[f64]) -> f64 {
    let (x_mean, y_mean) = (mean(x.iter().copied()), mean(y.iter().copied()));
    let product: f64 = x.iter().zip(y).map(|(x, y)| (x - x_mean) * (y - y_mean)).sum();
    let square: f64 = x.iter().map(|x| (x - x_mean) * (x - x_mean)).sum();
    product / square
}

/// Friction force as a multiple of the difference of the band ends, which may be shown late; zeros removed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lever {
    /// Friction force over difference of the band ends, mean of the other recordings of the bench.
    pub ratio: f64,
    /// Time constant by which the band ends are late, s, from the same.
    pub lag_s: f64,
    /// Error of the friction force, root mean square, N, without lag and with it.
    pub errors_n: [f64; 2],
    /// The friction force itself, about its mean, N.
    pub spread_n: f64,
}

/// Whether two recordings were taken by the same acquisition: those of data set 1, and the later ones.
fn same_bench(a: &str, b: &str) -> bool {
    a.starts_with("d1__") == b.starts_with("d1__")
}

/// Lever of each recording from the others of its bench.
#[must_use]
pub fn levers(shown: &[Shown]) -> Vec<Lever> {
    /// Time constants that are tried, ms.
    const LAGS_MS: std::ops::RangeInclusive<u32> = 0..=60;
    let late_n = |one: &Shown, lag_s: f64| late(&one.samples[0], &one.samples[2], lag_s);
    let left_n = |one: &Shown, ratio: f64, force_n: &[f64]| {
        let pairs = force_n.iter().zip(&one.samples[1]);
        standard_deviation(&pairs.map(|(force, ends)| force - ratio * ends).collect::<Vec<_>>())
    };
    let lags_s: Vec<f64> = LAGS_MS.step_by(2).map(|lag_ms| 1e-3 * f64::from(lag_ms)).collect();
    // Ratio of each recording, and what it leaves of the friction force, for every lag.
    let fits: Vec<Vec<(f64, f64)>> = shown
        .par_iter()
        .map(|one| {
            let fit = |lag_s: &f64| {
                let force_n = late_n(one, *lag_s);
                let ratio = slope(&one.samples[1], &force_n);
                (ratio, left_n(one, ratio, &force_n) / standard_deviation(&force_n))
            };
            lags_s.iter().map(fit).collect()
        })
        .collect();
    let lever = |place: usize, one: &Shown| {
        let others: Vec<usize> = (0..shown.len())
            .filter(|other| *other != place && same_bench(&shown[*other].name, &one.name))
            .collect();
        let left = |lag: usize| root_mean_square(others.iter().map(|other| fits[*other][lag].1));
        let ratio = |lag: usize| mean(others.iter().map(|other| fits[*other][lag].0));
        let best = (0..lags_s.len()).min_by(|a, b| left(*a).total_cmp(&left(*b))).unwrap_or(0);
        Lever {
            ratio: ratio(best),
            lag_s: lags_s[best],
            errors_n: [0, best].map(|lag| left_n(one, ratio(lag), &late_n(one, lags_s[lag]))),
            spread_n: standard_deviation(&one.samples[2]),
        }
    };
    shown.iter().enumerate().map(|(place, one)| lever(place, one)).collect()
}

/// Writes the tables and returns the marks.
///
/// # Errors
/// When the data set is missing or a model cannot be driven.
pub fn report(data: &Path, mut print: impl FnMut(String)) -> Result<Vec<Mark>, Failure> {
    let recordings = load(data)?;
    print(format!(
        "Band friction damper ({FOLDER}): friction force / force of the band ends, N, root mean square, simulated from \
         the displacement\n"
    ));
    let mut table = Table::new(&["physics, held out by recording", "slip force from", "friction", "ends"]);
    let cells = |score: Score| [format!("{:.0}", score.friction_n), format!("{:.0}", score.ends_n)];
    let mut by_recording = Vec::new();
    for physics in Physics::ALL {
        let models = held_out(&recordings, physics)?;
        let found = scores(&recordings, &models)?;
        let words = [physics.name(), "the recording"].map(str::to_owned);
        table.row(words.into_iter().chain(cells(pooled(&found))));
        by_recording.push((found, models));
    }
    let [rigid, elastic, _, (loose, models)] = by_recording.as_slice() else { return Ok(Vec::new()) };
    for (words, slip) in [("the others", Slip::Shared), ("the others ~ rest 1", Slip::AsAtRest)] {
        let told = with_slip_of_others(&recordings, models, slip);
        let first = [Physics::ElasticLooseLate.name(), words].map(str::to_owned);
        table.row(first.into_iter().chain(cells(pooled(&scores(&recordings, &told)?))));
    }
    print(table.to_string());

    let mut table = Table::new(&[
        "recording, held out but for its slip force",
        "rigid",
        "elastic",
        "with play",
        "slip N",
        "stiffness kN/mm",
        "play mm",
    ]);
    for (place, run) in recordings.full.iter().enumerate() {
        let value =
            |id, name| Knob::effect(&models[place], id, name).map_or(f64::NAN, |knob| knob.free.start());
        let stiffness =
            models[place].parameters.tendon.map_or(f64::NAN, |t| t.axial_stiffness_n / t.length_m);
        let friction = [rigid, elastic].map(|(scores, _)| scores[place].friction_n);
        table.row([
            run.name.clone(),
            format!("{:.0}", friction[0]),
            format!("{:.0}", friction[1]),
            format!("{:.0}", loose[place].friction_n),
            format!("{:.0}", value("joint_coulomb_friction", "torque_nm") / TORQUE_NM_PER_N),
            // Forces of the rig are a tenth of the real ones.
            format!("{:.2}", 10.0 * stiffness * 1e-6),
            format!("{:.2}", 2e3 * value("tendon_slack", "looseness_m")),
        ]);
    }
    print(table.to_string());

    let mut table = Table::new(&[
        "recording, no model",
        "named N",
        "rest 1",
        "rest 2",
        "friction at rest",
        "drift 1",
        "drift 2",
    ]);
    for one in &recordings.shown {
        let numbers = [one.rest_n[1], one.rest_n[2], one.rest_n[0], one.drift_n[1], one.drift_n[2]];
        let named = named_tension_n(&one.name).map_or(String::new(), |tension| format!("{tension:.0}"));
        table.row([one.name.clone(), named].into_iter().chain(numbers.map(|value| format!("{value:.0}"))));
    }
    print(table.to_string());

    let mut table = Table::new(&[
        "friction = ratio (end 2 - end 1), held out",
        "ratio",
        "ends late by ms",
        "error N",
        "without lag",
        "of",
    ]);
    for (one, lever) in recordings.shown.iter().zip(&recordings.levers) {
        let numbers = [1e3 * lever.lag_s, lever.errors_n[1], lever.errors_n[0], lever.spread_n];
        table.row(
            [one.name.clone(), format!("{:.3}", lever.ratio)]
                .into_iter()
                .chain(numbers.map(|value| format!("{value:.0}"))),
        );
    }
    print(table.to_string());

    let mut table = Table::new(&[
        "sliding towards",
        "+ friction",
        "peak",
        "tight",
        "slack",
        "ln(tight/rest 1)",
        "- friction",
        "peak",
        "tight",
        "slack",
        "ln(tight/rest 1)",
    ]);
    for one in &recordings.shown {
        let cells = one.sliding.iter().flat_map(|sliding| match sliding {
            Some(s) => [
                format!("{:.0}", s.friction_n),
                format!("{:.0}", s.peak_n),
                format!("{:.0}", s.tight_n),
                format!("{:.0}", s.slack_n),
                format!("{:.2}", (s.tight_n / one.rest_n[1]).ln()),
            ],
            None => ["", "", "", "", ""].map(str::to_owned),
        });
        table.row([one.name.clone()].into_iter().chain(cells));
    }
    print(table.to_string());

    let [damper] = answers(&[RealStudy::load(FOLDER, &data.join(FOLDER))?], &mut print)?;
    Ok(vec![
        Mark {
            quantity: "band damper, friction force held out but for the slip force, N",
            score: pooled(loose).friction_n,
            limit: LIMIT_N,
        },
        Mark {
            quantity: "band damper, friction force from the band ends held out by recording, N",
            score: root_mean_square(recordings.levers.iter().map(|lever| lever.errors_n[1])),
            limit: LEVER_LIMIT_N,
        },
        Mark {
            quantity: "band damper, diagnosed, friction force over seconds held out, N",
            score: damper.left(Channel::TorqueIn) / TORQUE_NM_PER_N,
            limit: DIAGNOSED_LIMIT_N,
        },
    ])
}
