//! What to record next: the motion on which two explanations differ most.
//!
//! Each motion of a list is run forward with the named physics, as the bench would, and the run is replayed with either
//! explanation, as the next diagnosis would. The difference of the two losses tells how far they part; a motion that
//! asks more of the bench than the recordings have shown it to bear is left out.

use bowden_model::channel::Channel;
use rayon::prelude::*;

use super::Allowed;
use super::afterwards::afterwards;
use super::selection::{Chosen, Tried};
use crate::fit::objective::{Objective, Part, Series};
use crate::joint_model::JointModel;
use crate::recording::Recording;
use crate::rig::Rig;
use crate::simulate::{Reference, RunOptions, run};

/// Length of an experiment, s.
pub const SECONDS: f64 = 12.0;

/// Samples a second of its reference.
const RATE_HZ: f64 = 1000.0;

/// Seed of the sensors' noise in the forward runs.
const SEED: u64 = 1;

/// Most that an experiment may ask beyond what the recordings have shown, as a factor.
const MARGIN: f64 = 1.1;

/// Difference of mean losses below which two explanations are taken to look the same.
const TELLING: f64 = 0.1;

/// A motion that parts two explanations.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// Name of its file in the folder of the diagnosis.
    pub file: String,
    /// The motion, in words.
    pub words: String,
    /// Its reference: `theta_ref_rad` over time.
    pub reference: Recording,
    /// Difference of the mean losses of the two explanations; 1 is what sensor noise and an ordinary bench leave.
    pub separation: f64,
}

/// What a bench has been shown to bear.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown {
    angle_rad: [f64; 2],
    tension_n: f64,
    current_a: f64,
}

impl Shown {
    /// The extremes of all recordings; where a channel was not recorded, nothing is known and nothing forbidden.
    pub(super) fn by(recordings: &[&Recording]) -> Self {
        let extremes = |channels: &[Channel]| {
            let values = recordings.iter().flat_map(|r| channels.iter().filter_map(|c| r.channel(*c)));
            values.flatten().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
                [low.min(*value), high.max(*value)]
            })
        };
        let largest = |channels: &[Channel]| {
            let [low, high] = extremes(channels);
            if low <= high { low.abs().max(high.abs()) } else { f64::INFINITY }
        };
        let mut angle_rad = extremes(&[Channel::ThetaIn]);
        if angle_rad[0] > angle_rad[1] {
            angle_rad = extremes(&[Channel::ThetaOut]);
        }
        Self {
            angle_rad,
            tension_n: largest(&Channel::TENSIONS),
            current_a: largest(&[Channel::MotorCurrent]),
        }
    }

    fn allows(&self, run: &Recording) -> bool {
        let asked = Self::by(&[run]);
        let within = |asked: f64, shown: f64| !asked.is_finite() || asked <= MARGIN * shown;
        within(asked.tension_n, self.tension_n) && within(asked.current_a, self.current_a)
    }
}

/// Motions that may be asked of a bench.
pub(super) struct Bearable<'a> {
    /// What it has been shown to bear: nothing beyond is asked.
    pub shown: Shown,
    /// What its user allows: preferred.
    pub allowed: Allowed<'a>,
    /// Scales of the recordings so far. A small motion would have small ones of its own, in which every difference is large;
    /// the next diagnosis compares it together with the others.
    pub scales: &'a [(Series, f64)],
}

/// A way to move between two angles.
#[derive(Clone, Copy, Debug)]
enum Course {
    /// Constant speed up and down, rad/s.
    Triangle(f64),
    /// One sine, Hz.
    Sine(f64),
    /// Steps with a rest after each, number of levels.
    Stairs(usize),
}

const COURSES: [Course; 7] = [
    Course::Triangle(0.03),
    Course::Triangle(0.15),
    Course::Triangle(0.8),
    Course::Sine(0.25),
    Course::Sine(1.0),
    Course::Stairs(5),
    Course::Stairs(2),
];

/// Parts of the shown range that are used.
const SPANS: [f64; 2] = [0.25, 0.9];

impl Course {
    fn words(self, low_rad: f64, high_rad: f64) -> String {
        let between = format!("between {low_rad:.2} and {high_rad:.2} rad");
        match self {
            Self::Triangle(speed) => format!("a triangle {between} at {speed} rad/s"),
            Self::Sine(frequency) => format!("a sine {between} at {frequency} Hz"),
            Self::Stairs(levels) => format!("a staircase of {levels} levels {between}"),
        }
    }

    /// Angle at `t_s`, starting in the middle at rest.
    fn angle_rad(self, t_s: f64, low_rad: f64, high_rad: f64) -> f64 {
        let (middle, half) = (0.5 * (low_rad + high_rad), 0.5 * (high_rad - low_rad));
        let unit = match self {
            Self::Triangle(speed) => {
                let quarter = (t_s * speed / half.max(1e-9)).rem_euclid(4.0);
                if quarter < 1.0 {
                    quarter
                } else if quarter < 3.0 {
                    2.0 - quarter
                } else {
                    quarter - 4.0
                }
            }
            Self::Sine(frequency) => {
                // Grows over a second, so that it starts without a jump of speed.
                t_s.min(1.0) * (std::f64::consts::TAU * frequency * t_s).sin()
            }
            Self::Stairs(levels) => {
                let steps = 2 * levels.max(2);
                let slot_s = SECONDS / steps as f64;
                let slot = (t_s / slot_s) as usize;
                let level = |slot: usize| {
                    let place = slot % (2 * (levels - 1));
                    let up = place.min(2 * (levels - 1) - place);
                    2.0 * up as f64 / (levels - 1) as f64 - 1.0
                };
                let from = if slot == 0 { 0.0 } else { level(slot - 1) };
                let share = ((t_s - slot as f64 * slot_s) / (0.4 * slot_s)).min(1.0);
                from + (level(slot) - from) * (3.0 - 2.0 * share) * share * share
            }
        };
        middle + half * unit
    }

    fn reference(self, low_rad: f64, high_rad: f64) -> Recording {
        let samples = (SECONDS * RATE_HZ) as usize;
        let t_s: Vec<f64> = (0..samples).map(|k| k as f64 / RATE_HZ).collect();
        let angles = t_s.iter().map(|t_s| self.angle_rad(*t_s, low_rad, high_rad)).collect();
        Recording::new("experiment", t_s).with(Channel::ThetaRef, angles)
    }
}

impl Experiment {
    /// What a report says about it.
    #[must_use]
    pub fn in_words(&self) -> String {
        let Self { words, file, separation, .. } = self;
        format!(
            "{words} ({file}); there the two differ by {separation:.1} times what sensor noise and an ordinary bench leave"
        )
    }
}

/// The motion on which the chosen effect and another one part most, an allowed one where one parts them; `None` where no
/// bearable motion does, or no forward run is possible.
pub(super) fn separating(
    rig: &Rig,
    chosen: &Chosen,
    rival: &Tried,
    bearable: &Bearable,
    clock_s: f64,
) -> Option<Experiment> {
    let own = rig.effects.len();
    let bench_index = chosen.effect.bench.or(rival.effect.bench).unwrap_or(0);
    let [named, other] = [&chosen.model, &rival.model].map(|model| {
        let mut model = model.clone();
        model.effects.retain(|effect| effect.is_on(bench_index));
        afterwards(&model, own, clock_s)
    });
    let Bearable { shown, allowed, scales } = bearable;
    let [low, high] = shown.angle_rad;
    let middle = 0.5 * (low + high);
    let bench = Rig { joint: named.parameters, effects: named.effects.clone(), ..rig.clone() };
    let options = RunOptions { seconds: SECONDS, rate_hz: RATE_HZ, seed: SEED };
    let courses: Vec<(Course, f64)> =
        COURSES.into_iter().flat_map(|course| SPANS.map(|span| (course, span))).collect();
    courses
        .par_iter()
        .filter_map(|(course, span)| {
            let (from, to) = (middle + span * (low - middle), middle + span * (high - middle));
            let reference = course.reference(from, to);
            let followed = Reference::of_recording(&reference).ok()?;
            let run = run(&bench, &followed, options).ok().filter(|run| shown.allows(run))?;
            let separation = loss(&other, &run, scales)? - loss(&named, &run, scales)?;
            let [named, rival] = [&chosen.effect, &rival.effect].map(|effect| effect.descriptor().id);
            let file = format!("separate-{named}-from-{rival}.csv");
            let within = allowed(&reference);
            Some((within, Experiment { file, words: course.words(from, to), reference, separation }))
        })
        .filter(|(_, experiment)| experiment.separation > TELLING)
        // The first of equals, so that the number of threads does not matter.
        .reduce_with(|a, b| if (b.0, b.1.separation) > (a.0, a.1.separation) { b } else { a })
        .map(|(_, experiment)| experiment)
}

/// Mean loss of a replay of `run`, in these scales.
fn loss(model: &JointModel, run: &Recording, scales: &[(Series, f64)]) -> Option<f64> {
    let mut model = model.clone();
    model.inputs.retain(|channel| run.channel(*channel).is_some());
    let objective = Objective::new(&model, std::slice::from_ref(run), &[], false).ok()?.in_scales(scales);
    let residuals = objective.residuals(&model).ok()?;
    let loss = objective.mean_loss(&residuals, Part::Training);
    loss.is_finite().then_some(loss)
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::ActiveEffect;
    use bowden_model::effects::find;

    use super::*;
    use crate::test_bench;

    #[test]
    fn every_course_keeps_its_range_and_does_not_jump() {
        for course in COURSES {
            let reference = course.reference(-0.2, 0.6);
            let angles = reference.channel(Channel::ThetaRef).unwrap();
            let (low, high) = angles.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
            assert!(low >= -0.2 - 1e-9 && high <= 0.6 + 1e-9, "{course:?}: {low} to {high}");
            assert!((angles[0] - 0.2).abs() < 1e-9, "{course:?} starts at {}", angles[0]);
            // The fastest: half of 0.8 rad in 1.2 s, at most 1.5 times the mean speed; a sine of 1 Hz 2.5 rad/s.
            let fastest = angles.windows(2).map(|w| (w[1] - w[0]).abs() * RATE_HZ).fold(0.0, f64::max);
            assert!(fastest < 2.7, "{course:?} moves at {fastest} rad/s");
        }
    }

    #[test]
    fn a_triangle_turns_where_it_should() {
        let course = Course::Triangle(0.1);
        for (t_s, angle) in
            [(0.0, 0.0), (1.0, 0.1), (2.0, 0.2), (4.0, 0.0), (6.0, -0.2), (7.0, -0.1), (8.0, 0.0)]
        {
            assert!((course.angle_rad(t_s, -0.2, 0.2) - angle).abs() < 1e-9, "at {t_s} s");
        }
    }

    fn by_default(id: &str) -> ActiveEffect {
        ActiveEffect::with_defaults(find(id).unwrap())
    }

    fn with_strength(mut effect: ActiveEffect, strength: f64) -> ActiveEffect {
        effect.parameters[0] = strength;
        effect
    }

    fn parts(named: &str, rival: ActiveEffect, shown: &Shown) -> Option<Experiment> {
        parts_within(named, rival, &Bearable { shown: *shown, allowed: &|_| true, scales: &[] })
    }

    fn parts_within(named: &str, rival: ActiveEffect, bearable: &Bearable) -> Option<Experiment> {
        let rig = test_bench::rig();
        let t_s: Vec<f64> = (0..100).map(|k| f64::from(k) * 1e-3).collect();
        let every =
            [Channel::ThetaIn, Channel::ThetaOut, Channel::Duty, Channel::BusVoltage, Channel::MotorCurrent];
        let recording = every
            .iter()
            .chain(&Channel::TENSIONS)
            .fold(Recording::new("any", t_s), |recording, channel| recording.with(*channel, vec![0.0; 100]));
        let model = JointModel { elements: 8, ..JointModel::from_rig(&rig, &recording).unwrap() };
        let with = |effect| (effect, JointModel { effects: vec![effect], ..model.clone() });
        let ((effect, named), (other, rival)) = (with(by_default(named)), with(rival));
        let compared = [model.clone(), named.clone()];
        let others = Vec::new();
        let chosen = Chosen { effect, model: named, loss_before: 2.0, loss_after: 1.0, compared, others };
        let tried = Tried { effect: other, model: rival, loss: 1.1 };
        separating(&rig, &chosen, &tried, bearable, 40.0)
    }

    const ANYTHING: Shown =
        Shown { angle_rad: [-0.6, 0.6], tension_n: f64::INFINITY, current_a: f64::INFINITY };

    #[test]
    fn friction_that_grows_with_speed_parts_from_none_where_it_is_fast() {
        // At 1 Hz and 0.54 rad the speed reaches 3.4 rad/s, four times that of any other course.
        let none = by_default("motor_viscous_friction");
        let found = parts("motor_viscous_friction", with_strength(none, 0.0), &ANYTHING).unwrap();
        assert_eq!(found.words, "a sine between -0.54 and 0.54 rad at 1 Hz");
        assert!(found.separation > 1.0, "{}", found.separation);
    }

    #[test]
    fn a_motion_within_the_limits_is_preferred_and_the_best_one_named_where_none_is() {
        let none = with_strength(by_default("motor_viscous_friction"), 0.0);
        let found = |most_rad_s: f64, scales: &[(Series, f64)]| {
            let slow = |reference: &Recording| {
                let angles = reference.channel(Channel::ThetaRef).unwrap();
                angles.windows(2).all(|w| (w[1] - w[0]).abs() * RATE_HZ < most_rad_s)
            };
            let bearable = Bearable { shown: ANYTHING, allowed: &slow, scales };
            parts_within("motor_viscous_friction", none, &bearable).map(|found| found.words)
        };
        let words = |words: &str| Some(words.to_owned());
        // Of sines and triangles up to 1 rad/s those at 0.8 rad/s have the largest mean square speed, however far they go.
        let within = found(1.0, &[]).unwrap_or_default();
        assert!(within.starts_with("a triangle between") && within.ends_with("at 0.8 rad/s"), "{within}");
        assert_eq!(found(0.0, &[]), words("a sine between -0.54 and 0.54 rad at 1 Hz"));
        // Nothing separates them where the recordings so far differ by far more.
        let outputs =
            [Series::Guide, Series::Channel(Channel::MotorCurrent), Series::Channel(Channel::ThetaOut)];
        let series = outputs.into_iter().chain(Channel::TENSIONS.map(Series::Channel));
        let scales: Vec<(Series, f64)> = series.map(|series| (series, 1e6)).collect();
        assert_eq!(found(1.0, &scales), None);
    }

    #[test]
    fn dry_friction_holds_where_viscous_friction_does_not() {
        // Both act in motion; at rest only one of them carries a part of the weight.
        let found = parts("motor_viscous_friction", by_default("motor_coulomb_friction"), &ANYTHING).unwrap();
        assert!(found.words.starts_with("a staircase"), "{}", found.words);
    }

    #[test]
    fn nothing_is_asked_that_the_bench_has_not_borne() {
        // Pretension alone is 30 N.
        let weak = Shown { tension_n: 20.0, ..ANYTHING };
        assert!(parts("motor_viscous_friction", by_default("motor_coulomb_friction"), &weak).is_none());
    }

    #[test]
    fn an_effect_does_not_part_from_itself() {
        assert!(parts("joint_backlash", by_default("joint_backlash"), &ANYTHING).is_none());
    }
}
