//! One run of the joint, once with the image on the emulated board and once with the same control code natively.
//!
//! Both sides have the same bench, parameters, seed and reference. They differ in what stands between control code and bench:
//! converters, encoder frames, PWM and timing of the board, against the bare quantisation of
//! [`bowden_paper::driven_joint::DrivenJoint`].

use bowden_board::Board;
use bowden_control::parameters::Parameters;
use bowden_link::message::{Goal, Mode, Reference, Shape};
use bowden_link::{State, ToBoard};
use bowden_paper::driven_joint::{DrivenJoint, parameters_of};
use bowden_paper::sheath_motion::SheathMotion;
use virtual_bench::{BenchConfig, ConcealedEffect, LiveBench};

use crate::host::Host;
use crate::{Failure, Outcome};

/// Time between two moments of a course \[s\].
const LOOK_S: f64 = 1e-3;
/// Time in which homing has to end \[s\].
const HOMING_S: f64 = 10.0;
/// Steps of a reference in telemetry: 2⁻²⁰ rad or N·m.
pub(crate) const STEPS_PER_UNIT: f64 = 1_048_576.0;

/// How the sheaths are moved.
#[derive(Debug, Clone)]
pub enum SheathCourse {
    /// Wrap angles of both sheaths \[rad\] over the time since the run began \[s\].
    Along(fn(f64) -> [f64; 2]),
    /// At random, as in section 5.2 of the paper.
    Random(Box<SheathMotion>),
}

impl SheathCourse {
    /// Wrap angles of both sheaths \[rad\] at `t_s` since the run began \[s\].
    fn at(&self, t_s: f64) -> [f64; 2] {
        match self {
            Self::Along(course) => course(t_s),
            Self::Random(motion) => motion.wrap_angle_rad(t_s),
        }
    }
}

/// What is run.
#[derive(Debug, Clone)]
pub struct Trial {
    /// The bench.
    pub bench: BenchConfig,
    /// What it conceals.
    pub effects: Vec<ConcealedEffect>,
    /// Parameters of the board.
    pub parameters: Parameters,
    /// Seed of the sensor noise.
    pub seed: u64,
    /// Whether the joint homes first.
    pub homes: bool,
    /// What is controlled.
    pub mode: Mode,
    /// Reference that is followed.
    pub reference: Reference,
    /// How the sheaths are moved; `None` leaves them.
    pub sheaths: Option<SheathCourse>,
    /// Time that is left out at the start \[s\].
    pub settle_s: f64,
    /// Time that is recorded \[s\].
    pub measured_s: f64,
}

/// A moment of a course, a thousand a second; everything but the reference is the bench's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Time since the run began \[s\].
    pub t_s: f64,
    /// Reference of the newest control tick \[rad or N·m\].
    pub reference: f64,
    /// Angle of the input pulley \[rad\].
    pub theta_in_rad: f64,
    /// Angle of the joint \[rad\].
    pub theta_out_rad: f64,
    /// Speed of the joint \[rad/s\].
    pub omega_out_rad_per_s: f64,
    /// Tensions F1 to F4 \[N\].
    pub tensions_n: [f64; 4],
    /// Torque at the joint, (F2 - F4) r2 \[N·m\].
    pub torque_out_nm: f64,
}

/// Error of a course.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CourseError {
    /// Root of the mean square, in the unit of the error.
    pub rms: f64,
    /// Largest magnitude.
    pub largest: f64,
}

/// A sine around zero.
pub fn sine(amplitude: f32, frequency_hz: f32) -> Reference {
    Reference::Generated { shape: Shape::Sine, amplitude, offset: 0.0, frequency_hz }
}

/// Error of the true joint angle \[rad\].
pub fn angle_error(moment: &Moment) -> f64 {
    moment.theta_out_rad - moment.reference
}

/// Error of the true output torque \[N·m\].
pub fn torque_error(moment: &Moment) -> f64 {
    moment.torque_out_nm - moment.reference
}

/// Error over a course.
pub fn error_of(course: &[Moment], error: fn(&Moment) -> f64) -> CourseError {
    let squares: f64 = course.iter().map(|moment| error(moment).powi(2)).sum();
    let largest = course.iter().map(|moment| error(moment).abs()).fold(0.0, f64::max);
    CourseError { rms: (squares / course.len().max(1) as f64).sqrt(), largest }
}

impl Moment {
    fn of(bench: &LiveBench, t_s: f64, reference: f64) -> Self {
        let tensions_n = bench.tensions_n();
        Self {
            t_s,
            reference,
            theta_in_rad: bench.theta_in_rad(),
            theta_out_rad: bench.theta_out_rad(),
            omega_out_rad_per_s: bench.omega_out_rad_per_s(),
            tensions_n,
            torque_out_nm: (tensions_n[1] - tensions_n[3]) * bench.config().output_radius_m,
        }
    }
}

impl Trial {
    /// The default bench on this reference: seed 1, homed, 1 s to settle.
    pub fn new(mode: Mode, reference: Reference, measured_s: f64) -> Self {
        let bench = BenchConfig::default();
        Self {
            parameters: parameters_of(&bench),
            bench,
            effects: Vec::new(),
            seed: 1,
            homes: true,
            mode,
            reference,
            sheaths: None,
            settle_s: 1.0,
            measured_s,
        }
    }

    /// Runs the control code on this machine, without a board.
    pub fn natively(&self) -> Outcome<Vec<Moment>> {
        let told = |error: bowden_paper::error::ExperimentError| Failure(format!("natively: {error}"));
        let mut joint =
            DrivenJoint::concealing(&self.bench, &self.effects, self.parameters.clone(), self.seed)
                .map_err(told)?;
        joint.make_ready().map_err(told)?;
        if self.homes {
            joint.home(HOMING_S).map_err(told)?;
        }
        joint.refer(self.reference).map_err(told)?;
        joint.order(Goal::Run(self.mode));
        let rate_hz = joint.tick_rate_hz();
        let per_look = (LOOK_S * rate_hz).round() as u64;
        let [settle, all] = [self.settle_s, self.settle_s + self.measured_s]
            .map(|seconds| (seconds * rate_hz).round() as u64);
        let mut course = Vec::new();
        for tick in 0..all {
            let t_s = tick as f64 / rate_hz;
            if let Some(sheaths) = &self.sheaths {
                joint.set_wrap_angle_rad(sheaths.at(t_s)).map_err(told)?;
            }
            let reference = DrivenJoint::reference(&joint.tick().map_err(told)?);
            if tick >= settle && tick.is_multiple_of(per_look) {
                course.push(Moment::of(joint.bench(), t_s, reference));
            }
        }
        Ok(course)
    }

    /// Boots the image `elf` with these parameters, up to the state ready, homed if that is asked for.
    pub fn prepared(&self, elf: &[u8]) -> Outcome<Host> {
        let board = Board::builder(elf).bench(&self.bench, &self.effects).seed(self.seed).build()?;
        self.make_ready(Host::connect(board)?)
    }

    /// Sets the parameters of a board that has just started, and makes its joint ready, homed if that is asked for.
    pub fn make_ready(&self, mut host: Host) -> Outcome<Host> {
        host.set_all(&self.parameters)?;
        host.make_ready()?;
        if self.homes {
            host.home()?;
        }
        Ok(host)
    }

    /// Runs the image `elf` on the emulated board.
    pub fn on_image(&self, elf: &[u8]) -> Outcome<Vec<Moment>> {
        self.follow(&mut self.prepared(elf)?)
    }

    /// Runs the ready joint of a board; it goes on when this returns.
    pub fn follow(&self, host: &mut Host) -> Outcome<Vec<Moment>> {
        host.order(&ToBoard::Telemetry(true))?;
        host.order(&ToBoard::SetReference(self.reference))?;
        host.order(&ToBoard::Enter(Goal::Run(self.mode)))?;
        let start_s = host.board.time_s();
        self.pass(host, start_s, self.settle_s)?;
        host.reach(State::Run, 0.1)?;
        host.telemetry.take();
        let mut looks = Vec::new();
        for _ in 0..(self.measured_s / LOOK_S).round() as usize {
            self.pass(host, start_s, LOOK_S)?;
            // The tick that began last is the newest one with a reference.
            let tick = host.ticks.begun.wrapping_sub(1);
            looks.push((tick, Moment::of(host.board.bench(), host.board.time_s() - start_s, 0.0)));
        }
        // What is still on its way.
        self.pass(host, start_s, 20.0 * LOOK_S)?;
        host.reach(State::Run, 0.1)?;
        let samples = host.telemetry.take();
        let count = looks.len();
        let course: Vec<Moment> = looks
            .into_iter()
            .filter_map(|(tick, moment)| {
                let at = samples.binary_search_by_key(&tick, |(tick, _)| *tick).ok()?;
                let reference = f64::from(samples[at].1.reference_raw) / STEPS_PER_UNIT;
                Some(Moment { reference, ..moment })
            })
            .collect();
        // Telemetry of every tick arrives; a look may fall between a tick and its sample at either end.
        if course.len() + 10 < count {
            return Err(Failure(format!("{} of {count} moments have a sample", course.len())));
        }
        Ok(course)
    }

    /// Lets time pass, the sheaths moving.
    fn pass(&self, host: &mut Host, start_s: f64, seconds: f64) -> Outcome {
        let Some(sheaths) = &self.sheaths else { return host.run(seconds) };
        let end_s = host.board.time_s() + seconds;
        while host.board.time_s() < end_s - 1e-9 {
            let now_s = host.board.time_s();
            host.board.set_wrap_angle_rad(sheaths.at(now_s - start_s))?;
            host.run(LOOK_S.min(end_s - now_s))?;
        }
        Ok(())
    }
}
