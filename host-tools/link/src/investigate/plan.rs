//! References of an investigation, within its limits.

use std::fmt::Write;

use bowden_control::parameters::{Parameters, Reach, check_reference};
use bowden_control::reference::oscillator::{ONE, form};
use bowden_core::outcome::Failure;
use bowden_link::message::{Mode, Reference, Shape};
use serde::Serialize;

use super::demand::{Demand, demand_of};
use super::limits::{Limits, Wishes};
use super::words;

/// Smallest amplitude that is worth a recording, rad: twenty counts of an encoder.
const LEAST_AMPLITUDE_RAD: f32 = 0.03;

/// Part of the planned lengths of what is diagnosed below which a plan is not worth anything.
const LEAST_SCALE: f64 = 0.3;

/// Length of an experiment that separates two hypotheses, s.
const EXPERIMENT_S: f64 = bowden_core::diagnose::EXPERIMENT_S;

/// Points of a period at which a reference is looked at.
const POINTS: u32 = 2048;

/// What a run is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// Recorded, and the diagnosis learns from it.
    Training,
    /// Recorded, and the diagnosis is judged by it.
    Validation,
    /// Recorded with the old and with the new parameters.
    Verification,
}

impl Purpose {
    /// Beginning of the names of its recordings.
    pub const fn prefix(self) -> &'static str {
        match self {
            Self::Training => "train",
            Self::Validation => "validate",
            Self::Verification => "verify",
        }
    }
}

/// One run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Run {
    /// What it is for.
    pub purpose: Purpose,
    /// Name of its form: `multisine`, `triangle`, `staircase`, `sine`.
    pub form: &'static str,
    #[serde(skip)]
    shape: Shape,
    /// Half of the peak-to-peak value, rad.
    pub amplitude_rad: f32,
    /// Middle, rad.
    pub offset_rad: f32,
    /// Periods a second, Hz; the lowest line of a multisine.
    pub frequency_hz: f32,
    /// Length, s.
    pub seconds: f64,
    /// Largest values that it asks for.
    pub demand: Demand,
}

impl Run {
    /// As the board takes it.
    pub fn reference(&self) -> Reference {
        let Self { shape, amplitude_rad, offset_rad, frequency_hz, .. } = *self;
        Reference::Generated { shape, amplitude: amplitude_rad, offset: offset_rad, frequency_hz }
    }

    /// The reference in words.
    pub fn in_words(&self) -> String {
        let Self { form, amplitude_rad, frequency_hz, seconds, offset_rad, .. } = self;
        let offset = if *offset_rad == 0.0 { String::new() } else { format!(" around {offset_rad:.3} rad") };
        format!("{form}, {amplitude_rad:.3} rad{offset} at {frequency_hz:.3} Hz, {seconds:.1} s")
    }
}

/// All runs of an investigation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plan {
    /// What none of them exceeds.
    pub limits: Limits,
    /// Runs in the order in which they are done; those for verification are done twice.
    pub runs: Vec<Run>,
    /// Runs that the joint cannot do within the limits, with the reason.
    pub left_out: Vec<String>,
}

/// A run as it should be.
struct Wanted {
    purpose: Purpose,
    form: &'static str,
    shape: Shape,
    /// Of the largest amplitude.
    share: f32,
    periods: f64,
    seconds: f64,
}

const fn wanted(
    purpose: Purpose,
    (form, shape): (&'static str, Shape),
    share: f32,
    periods: f64,
    seconds: f64,
) -> Wanted {
    Wanted { purpose, form, shape, share, periods, seconds }
}

const MULTISINE: (&str, Shape) = ("multisine", Shape::Multisine);
const TRIANGLE: (&str, Shape) = ("triangle", Shape::Triangle);
const STAIRCASE: (&str, Shape) = ("staircase", Shape::Staircase);
const SINE: (&str, Shape) = ("sine", Shape::Sine);

/// Whole periods, so that every run ends in the middle. A multisine moves at all speeds, a slow triangle crosses play and shows
/// friction at one speed, a staircase rests under load. Validation has other amplitudes and frequencies.
const WANTED: [Wanted; 7] = [
    wanted(Purpose::Training, MULTISINE, 0.8, 1.0, 12.0),
    wanted(Purpose::Training, TRIANGLE, 1.0, 1.0, 12.0),
    wanted(Purpose::Training, STAIRCASE, 0.9, 1.0, 12.0),
    wanted(Purpose::Validation, MULTISINE, 0.65, 1.0, 8.0),
    wanted(Purpose::Validation, SINE, 0.75, 1.0, 7.0),
    wanted(Purpose::Verification, SINE, 0.8, 1.0, 5.0),
    wanted(Purpose::Verification, MULTISINE, 0.7, 1.0, 8.0),
];

/// Time of all runs that are diagnosed, and of both verifications, where nothing is shortened, s.
fn full_length_s() -> (f64, f64) {
    let seconds = |verification: bool| -> f64 {
        let runs = WANTED.iter().filter(|run| (run.purpose == Purpose::Verification) == verification);
        runs.map(|run| run.seconds).sum()
    };
    (seconds(false), 2.0 * seconds(true))
}

impl Plan {
    /// Chooses references that a joint of these parameters can do within the limits.
    ///
    /// # Errors
    /// Exit status 2 if the limits leave no room: which one, and what would do.
    pub fn new(parameters: &Parameters, wishes: &Wishes) -> Result<Self, Failure> {
        let reach = Reach::new(parameters);
        let limits = Limits::new(wishes, &reach);
        // Only what is diagnosed is shortened: a faster verification would show other errors.
        let (diagnosed_s, verified_s) = full_length_s();
        let scale = ((limits.time_s - verified_s) / diagnosed_s).min(1.0);
        if scale < LEAST_SCALE {
            return Err(Failure::bad_input(format!(
                "--time {}: too short for an investigation, which takes {:.0} s at least; give it more",
                limits.time_s,
                (LEAST_SCALE * diagnosed_s + verified_s).ceil()
            )));
        }
        let mut plan = Self { limits, runs: Vec::new(), left_out: Vec::new() };
        for wanted in &WANTED {
            let scale = if wanted.purpose == Purpose::Verification { 1.0 } else { scale };
            match plan.choose(wanted, scale, parameters, &reach) {
                Some(run) => plan.runs.push(run),
                None => plan.left_out.push(format!(
                    "{} {}: not even {LEAST_AMPLITUDE_RAD} rad within the limits",
                    wanted.purpose.prefix(),
                    wanted.form
                )),
            }
        }
        for purpose in [Purpose::Training, Purpose::Validation, Purpose::Verification] {
            if plan.of(purpose).next().is_none() {
                return Err(Failure::bad_input(format!(
                    "the limits leave no reference for {}: {}; raise --angle, --speed, --torque or --time, or the limits of \
                     the board",
                    purpose.prefix(),
                    plan.left_out.join("; ")
                )));
            }
        }
        Ok(plan)
    }

    /// Runs for a purpose.
    pub fn of(&self, purpose: Purpose) -> impl Iterator<Item = &Run> {
        self.runs.iter().filter(move |run| run.purpose == purpose)
    }

    /// Time of all runs without experiments, s.
    pub fn seconds(&self) -> f64 {
        let twice = |run: &Run| if run.purpose == Purpose::Verification { 2.0 } else { 1.0 };
        self.runs.iter().map(|run| twice(run) * run.seconds).sum()
    }

    /// Time that is left for experiments, s.
    pub fn spare_s(&self) -> f64 {
        self.limits.time_s - self.seconds()
    }

    /// The largest amplitude up to the wanted one with which the joint can do a run within the limits.
    fn choose(&self, wanted: &Wanted, scale: f64, parameters: &Parameters, reach: &Reach) -> Option<Run> {
        let [low, high] = self.limits.angle_rad.map(|angle| angle as f32);
        let seconds = (wanted.seconds * scale * 10.0).round() / 10.0;
        let run = |amplitude_rad: f32| {
            let mut run = Run {
                purpose: wanted.purpose,
                form: wanted.form,
                shape: wanted.shape,
                amplitude_rad,
                // Homing ends at zero, which is the middle of most joints.
                offset_rad: if low < 0.0 && high > 0.0 && low == -high { 0.0 } else { 0.5 * (low + high) },
                frequency_hz: (wanted.periods / seconds) as f32,
                seconds,
                demand: Demand { angle_rad: 0.0, speed_rad_s: 0.0, torque_nm: 0.0 },
            };
            run.demand = demand(&run, parameters, reach);
            run
        };
        let can = |amplitude_rad: f32| {
            let run = run(amplitude_rad);
            check_reference(parameters, Mode::Position, run.reference()).is_ok()
                && run.demand.speed_rad_s <= self.limits.speed_rad_s
                && run.demand.torque_nm <= self.limits.torque_nm
        };
        let most = wanted.share * 0.5 * (high - low);
        if most < LEAST_AMPLITUDE_RAD || !can(LEAST_AMPLITUDE_RAD) {
            return None;
        }
        if can(most) {
            return Some(run(most));
        }
        let (mut done, mut not) = (LEAST_AMPLITUDE_RAD, most);
        for _ in 0..20 {
            let middle = 0.5 * (done + not);
            *(if can(middle) { &mut done } else { &mut not }) = middle;
        }
        Some(run(done))
    }

    /// The plan as it is shown before anything moves.
    pub fn table(&self) -> String {
        let Limits { angle_rad: [low, high], torque_nm, speed_rad_s, time_s } = self.limits;
        let mut text = format!(
            "limits of the references: angle {} to {} rad, torque {} N·m, speed {} rad/s, {time_s:.0} s in all\n",
            words::digits(low),
            words::digits(high),
            words::digits(torque_nm),
            words::digits(speed_rad_s)
        );
        let rows = self.runs.iter().map(|run| {
            let Demand { angle_rad, speed_rad_s, torque_nm } = run.demand;
            let [angle, speed, torque] = [angle_rad, speed_rad_s, torque_nm].map(words::digits);
            [run.purpose.prefix().to_owned(), run.in_words(), angle, speed, torque]
        });
        let heads = ["run", "reference", "rad", "rad/s", "N·m"].map(str::to_owned);
        text += &words::table(std::iter::once(heads).chain(rows));
        for left_out in &self.left_out {
            let _ = writeln!(text, "left out: {left_out}");
        }
        let (seconds, spare_s) = (self.seconds(), self.spare_s().max(0.0));
        let _ = write!(text, "{seconds:.0} s in all, the verification twice; ");
        let _ = if spare_s < EXPERIMENT_S {
            let (diagnosed_s, verified_s) = full_length_s();
            let enough_s = diagnosed_s + verified_s + EXPERIMENT_S;
            writeln!(
                text,
                "no time for an experiment that separates hypotheses, which takes {EXPERIMENT_S:.0} s: --time {enough_s:.0} leaves it"
            )
        } else {
            writeln!(text, "{spare_s:.0} s are left for experiments that separate hypotheses")
        };
        text
    }
}

/// What a run asks for.
fn demand(run: &Run, parameters: &Parameters, reach: &Reach) -> Demand {
    demand_of_reference(run.reference(), parameters, reach)
}

/// What a reference of angles that the board makes asks for, looked at over one period.
pub fn demand_of_reference(reference: Reference, parameters: &Parameters, reach: &Reach) -> Demand {
    let (shape, amplitude, offset, frequency_hz) = match reference {
        Reference::Generated { shape, amplitude, offset, frequency_hz } => {
            (shape, amplitude, offset, frequency_hz)
        }
        // Something that stands has any shape without an amplitude.
        Reference::Hold(offset) => (Shape::Sine, 0.0, offset, 1.0),
        Reference::Stream => (Shape::Sine, 0.0, 0.0, 1.0),
    };
    let unit = f64::from(amplitude) / f64::from(ONE);
    let offset = f64::from(offset);
    let at = |point: u32| offset + unit * f64::from(form(shape, point.wrapping_mul(u32::MAX / POINTS + 1)));
    // The first and last two points close the period.
    let angles: Vec<f64> = (0..POINTS + 2).map(at).collect();
    demand_of(&angles, 1.0 / (f64::from(frequency_hz) * f64::from(POINTS)), parameters, reach)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::limits::DEFAULT_TIME_S;
    use super::*;

    const NONE: Wishes = Wishes { angle: None, torque: None, speed: None, time: DEFAULT_TIME_S };

    #[test]
    fn the_board_takes_every_reference_of_a_plan() {
        for wishes in [
            NONE,
            Wishes { angle: Some(0.2), ..NONE },
            Wishes { time: 42.0, ..NONE },
            Wishes { speed: Some(0.3), torque: Some(0.2), ..NONE },
        ] {
            let parameters = Parameters::default();
            let plan = Plan::new(&parameters, &wishes).unwrap();
            assert!(plan.seconds() <= wishes.time + 0.5 && plan.left_out.is_empty(), "{plan:?}");
            for run in &plan.runs {
                assert_eq!(check_reference(&parameters, Mode::Position, run.reference()), Ok(()), "{run:?}");
                let Demand { angle_rad, speed_rad_s, torque_nm } = run.demand;
                assert!(angle_rad <= plan.limits.angle_rad[1] * 1.001, "{run:?}");
                assert!(
                    speed_rad_s <= plan.limits.speed_rad_s && torque_nm <= plan.limits.torque_nm,
                    "{run:?}"
                );
                let periods = run.seconds * f64::from(run.frequency_hz);
                assert!((periods - periods.round()).abs() < 1e-3, "{run:?}");
            }
        }
    }

    #[test]
    fn the_demand_of_a_sine_is_that_of_a_sine() {
        let parameters = Parameters::default();
        let plan = Plan::new(&parameters, &NONE).unwrap();
        let run = plan.of(Purpose::Verification).next().unwrap();
        let (amplitude, omega) = (f64::from(run.amplitude_rad), TAU * f64::from(run.frequency_hz));
        assert!((run.demand.speed_rad_s / (amplitude * omega) - 1.0).abs() < 1e-3, "{run:?}");
        // m g l sin θ − m l² ω² A at the turn, where both are largest.
        let torque = 2.5 * 0.03 * (9.81 * amplitude.sin() - 0.03 * omega * omega * amplitude);
        assert!((run.demand.torque_nm / torque - 1.0).abs() < 0.01, "{run:?}: {torque}");
    }

    #[test]
    fn limits_without_room_are_refused_with_a_reason() {
        let parameters = Parameters::default();
        for (wishes, expected) in [
            (Wishes { time: 5.0, ..NONE }, "--time 5: too short"),
            (Wishes { angle: Some(0.01), ..NONE }, "the limits leave no reference for train"),
            (Wishes { torque: Some(0.001), ..NONE }, "the limits leave no reference for train"),
        ] {
            let refused = Plan::new(&parameters, &wishes).unwrap_err();
            assert!(refused.message().starts_with(expected), "{refused}");
        }
    }
}
