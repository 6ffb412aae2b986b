//! The board's control and services on this machine, with [`CoarseJoint`] behind the converters and the host's own client before the
//! wire: every tick's sample goes through frames, client and session.
//!
//! The joint turns a turn and more to either side, so that both encoders cross the border of a turn again and again. It is watched from
//! the inside: true angle against the reference, true counts against those that the board has, in every tick.

use std::cell::RefCell;
use std::io;
use std::ops::ControlFlow;
use std::rc::Rc;
use std::time::{Duration, Instant};

use bowden_control::parameters::Parameters;
use bowden_control::tick::TickOutput;
use bowden_host_link::course::Course;
use bowden_host_link::sim::SimBoard;
use bowden_host_link::{Client, RunEnd, Session, Transport};
use bowden_link::message::{Mode, Reference, Shape};
use bowden_link::{FaultRecord, Sample, State};

use super::check::Check;
use super::drift::{self, Drift, Span};
use super::joint::{ADDED_INERTIA, COUNTS_PER_TURN, CoarseJoint, LOAD_KG, Truth};
use super::ledger::Ledger;
use super::memory::resident_kib;
use crate::trial::STEPS_PER_UNIT;
use crate::{Failure, Outcome};

/// Ticks a second.
const RATE_HZ: u64 = 10_000;
/// Period of the reference \[s\].
const PERIOD_S: u64 = 20;
/// Ticks of a period.
const PERIOD_TICKS: u64 = PERIOD_S * RATE_HZ;
/// Periods of an hour.
pub const PARTS_AN_HOUR: usize = 3600 / PERIOD_S as usize;
/// Amplitude of the reference: over the border of a turn at either encoder \[rad\].
const AMPLITUDE_RAD: f32 = 7.0;
/// Parameters that the run sets.
const SET: [(&str, f32); 5] = [
    ("load.mass", LOAD_KG as f32),
    ("load.inertia", ADDED_INERTIA as f32),
    ("limits.angle_minimum", -8.0),
    ("limits.angle_maximum", 8.0),
    ("supervisor.homing_speed", 1.0),
];
/// Time for an answer.
const TIMEOUT: Duration = Duration::from_millis(500);
/// Time in which the load comes to rest: it swings with the bridge off, half as far every 0.4 s.
const REST: Duration = Duration::from_secs(10);
/// Memory that the process may take in from the end of the first span on \[KiB\]: less than a byte in 1000 ticks of a day.
const GROWTH_KIB: u64 = 512;

/// How far the counters are when a run begins.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counters {
    /// Control ticks.
    pub ticks: u32,
    /// Time since the board was switched on.
    pub now: Duration,
    /// Number of the board's next frame.
    pub frame: u16,
    /// Requests that the host has sent.
    pub requests: u16,
}

impl Counters {
    /// All of them pass their end while the joint is driven: milliseconds some 35 s behind its start, ticks and frames 50 s, requests
    /// 55 s.
    pub const SHORTLY_BEFORE_THEIR_ENDS: Self = Self {
        ticks: u32::MAX - 600_000,
        now: Duration::from_millis((1 << 32) - 45_000),
        frame: 45_000,
        requests: 64_500,
    };
}

/// How long a run is.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Spans that are compared with each other.
    pub spans: usize,
    /// Periods of the reference in a span.
    pub parts: usize,
    /// Where the counters begin.
    pub start: Counters,
}

impl Plan {
    /// A run of 100 s in which all counters pass their ends.
    pub const WRAP: Self = Self { spans: 2, parts: 2, start: Counters::SHORTLY_BEFORE_THEIR_ENDS };

    /// So many hours in spans of one hour; quarters, if it is less than two.
    pub fn hours(hours: f64) -> Self {
        let parts = (hours * PARTS_AN_HOUR as f64).round() as usize;
        let a_span = if parts < 2 * PARTS_AN_HOUR { (parts / 4).max(1) } else { PARTS_AN_HOUR };
        Self { spans: (parts / a_span).max(1), parts: a_span, start: Counters::default() }
    }

    /// Ticks that are driven: a period to settle, then the spans.
    pub fn ticks(&self) -> u64 {
        (1 + (self.spans * self.parts) as u64) * PERIOD_TICKS
    }
}

/// What a run came to.
#[derive(Debug, Clone)]
pub struct NativeRun {
    /// Ticks that were driven.
    pub ticks: u64,
    /// Time that one took here, with everything \[ns\].
    pub tick_ns: f64,
    /// Error of the joint's angle.
    pub spans: Vec<Span>,
    /// Memory in RAM at the end of each span \[KiB\].
    pub memory_kib: Vec<u64>,
    /// Borders of a turn that both encoders crossed.
    pub borders: u64,
    /// What has to hold.
    pub checks: Vec<Check>,
    /// The same of the memory of this process, which other work in it takes as well.
    pub memory: Check,
}

impl NativeRun {
    /// All that has to hold in a process that does nothing else.
    pub fn all_checks(&self) -> Vec<Check> {
        self.checks.iter().chain([&self.memory]).cloned().collect()
    }
}

/// What is seen of the board from the inside.
#[derive(Debug, Default)]
struct Watch {
    plan_ticks: u64,
    parts: u64,
    sent: Ledger,
    drift: Drift,
    memory_kib: Vec<u64>,
    /// Counts that the board has less the true ones, last and largest.
    count_error: [i64; 2],
    largest_count_error: u64,
    turns: [i64; 2],
    borders: u64,
    fault: Option<FaultRecord>,
    trouble: Option<String>,
}

impl Watch {
    fn take(&mut self, tick: u32, output: &TickOutput, truth: Truth) {
        self.fault = self.fault.or(output.tripped);
        let sample = &output.sample;
        for (which, (counted, true_counts)) in sample.encoder_count_raw.iter().zip(truth.counts).enumerate() {
            self.count_error[which] = i64::from(*counted) - true_counts;
            self.largest_count_error = self.largest_count_error.max(self.count_error[which].unsigned_abs());
            let turn = true_counts.div_euclid(COUNTS_PER_TURN as i64);
            self.borders += turn.abs_diff(self.turns[which]);
            self.turns[which] = turn;
        }
        if sample.state == State::Run && self.sent.count < self.plan_ticks {
            self.sent.take(tick, sample);
            self.compare(sample, truth);
        }
    }

    /// Adds a driven tick to its part and its span.
    fn compare(&mut self, sample: &Sample, truth: Truth) {
        if self.sent.count <= PERIOD_TICKS {
            return;
        }
        self.drift.add(truth.theta_out_rad - f64::from(sample.reference_raw) / STEPS_PER_UNIT);
        if !self.sent.count.is_multiple_of(PERIOD_TICKS) {
            return;
        }
        self.drift.end_part();
        if (self.sent.count / PERIOD_TICKS - 1).is_multiple_of(self.parts) {
            self.drift.end_span();
            match resident_kib() {
                Ok(kib) => self.memory_kib.push(kib),
                Err(Failure(reason)) => self.trouble = Some(reason),
            }
        }
    }
}

/// Board, joint and who watches them.
struct Line {
    board: SimBoard<CoarseJoint>,
    watch: Watch,
    /// Frames of the board, and of the host.
    frames: [u64; 2],
}

impl Line {
    fn tick(&mut self) {
        let tick = self.board.tick_count();
        let output = self.board.tick();
        let truth = self.board.joint().truth();
        self.watch.take(tick, &output, truth);
    }
}

/// The host's way to the board; time passes as on the one to the simulated board of the host tools.
struct Wire(Rc<RefCell<Line>>);

/// Frames that end in these bytes.
fn frames(bytes: &[u8]) -> u64 {
    bytes.split(|byte| *byte == 0).count() as u64 - 1
}

impl Transport for Wire {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let mut line = self.0.borrow_mut();
        let end = line.board.now() + timeout;
        while line.board.is_silent() && line.board.now() < end {
            line.tick();
        }
        let read = line.board.send_into(buffer);
        line.frames[0] += frames(&buffer[..read]);
        Ok(read)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut line = self.0.borrow_mut();
        line.tick();
        line.frames[1] += frames(bytes);
        line.board.receive(bytes);
        Ok(())
    }

    fn now(&self) -> Duration {
        self.0.borrow().board.now()
    }
}

/// Values of the counters, without wrapping.
#[derive(Debug, Clone, Copy)]
struct Counted {
    ticks: u64,
    milliseconds: u64,
    frames: u64,
    requests: u64,
}

impl Counted {
    fn of(line: &Line, start: &Counters) -> Self {
        let now = line.board.now();
        let passed_ns = now.saturating_sub(start.now).as_nanos() as u64;
        Self {
            ticks: u64::from(start.ticks) + passed_ns / (1_000_000_000 / RATE_HZ),
            milliseconds: now.as_millis() as u64,
            frames: u64::from(start.frame) + line.frames[0],
            requests: line.frames[1],
        }
    }

    /// How often each counter of so many bits began anew since `before`.
    fn wraps_since(&self, before: &Self) -> [(&'static str, u64); 4] {
        let wraps = |bits: u32, of: fn(&Self) -> u64| (of(self) >> bits) - (of(before) >> bits);
        [
            ("ticks, 32 bits", wraps(32, |counted| counted.ticks)),
            ("milliseconds, 32 bits", wraps(32, |counted| counted.milliseconds)),
            ("frames of the board, 16 bits", wraps(16, |counted| counted.frames)),
            ("requests of the host, 16 bits", wraps(16, |counted| counted.requests)),
        ]
    }
}

/// What host tools say went wrong, in words.
fn words(error: impl std::fmt::Display) -> Failure {
    Failure(error.to_string())
}

/// Drives the joint by `plan`; `progress` hears of each span that has ended.
pub fn run(plan: &Plan, progress: &mut dyn FnMut(usize, &Span)) -> Outcome<NativeRun> {
    let start = &plan.start;
    let board = SimBoard::new(CoarseJoint::default()).in_service(start.ticks, start.now, start.frame);
    let watch = Watch { plan_ticks: plan.ticks(), parts: plan.parts as u64, ..Watch::default() };
    let line = Rc::new(RefCell::new(Line { board, watch, frames: [0; 2] }));
    let mut client = Client::connect(Box::new(Wire(Rc::clone(&line))), "native", TIMEOUT).map_err(words)?;
    for number in 0..start.requests {
        client.alive().map_err(words)?;
        if number % 16 == 0 {
            client.listen(Duration::ZERO).map_err(words)?;
        }
    }
    let mut session = Session::new(client).map_err(words)?;
    let set = SET.map(|(name, value)| (Parameters::index_of(name).unwrap_or(u16::MAX), value));
    session.replace_parameters(&set).map_err(words)?;
    session.ready(&|| false).map_err(words)?;
    let before = Counted::of(&line.borrow(), start);
    let begun = Instant::now();
    let (received, unwrapped, end) = drive(&mut session, plan, &line, progress)?;
    let tick_ns = begun.elapsed().as_nanos() as f64 / plan.ticks() as f64;
    let after = Counted::of(&line.borrow(), start);
    let mut checks = vec![
        Check::new("end of the run", format!("{end:?}"), "Complete", end == RunEnd::Complete),
        Check::equal("ticks received", received.count, plan.ticks()),
        Check::equal("their numbers without wrapping, last less first", unwrapped + 1, plan.ticks()),
        Check::equal("samples out of their order, modulo 2³²", received.out_of_order, 0),
    ];
    // A run that ends here is worth its other checks.
    checks.extend(rest(&mut session, &line).unwrap_or_else(|Failure(reason)| {
        vec![Check::new("joint at rest behind the run", reason, "homed", false)]
    }));
    let line = line.borrow();
    let watch = &line.watch;
    let same = received.is_same_content(&watch.sent) && received.first_tick == watch.sent.first_tick;
    let fault = watch.fault.map_or_else(|| "none".to_owned(), |fault| fault.to_string());
    checks.extend([
        Check::new(
            "content of all samples, sent and received",
            if same { "the same" } else { "differs" },
            "the same",
            same,
        ),
        Check::new("fault", fault, "none", watch.fault.is_none()),
        Check::equal("largest error of a count in any tick", watch.largest_count_error, 0),
    ]);
    let losses = session.client().losses();
    let lost =
        [losses.frames, losses.damaged_frames, losses.samples, losses.dropped_by_board, losses.late_batches];
    checks.push(Check::equal(
        "frames and samples lost, damaged or late, by the host",
        lost.iter().sum(),
        0_u64,
    ));
    checks.extend(drift::checks(watch.drift.spans()));
    let wrapped = after.wraps_since(&before);
    for (counter, wraps) in wrapped {
        // A run that is made for it has to have them all.
        let needed = u64::from(start.ticks > 0);
        checks.push(Check::new(
            format!("{counter}: passes of the end while driven"),
            wraps.to_string(),
            format!("{needed} at least"),
            wraps >= needed,
        ));
    }
    Ok(NativeRun {
        ticks: plan.ticks(),
        tick_ns,
        spans: watch.drift.spans().to_vec(),
        memory_kib: watch.memory_kib.clone(),
        borders: watch.borders,
        checks,
        memory: growth(watch, plan),
    })
}

/// From ready: the whole run. What was received, the last tick less the first one without wrapping, and how it ended.
fn drive(
    session: &mut Session,
    plan: &Plan,
    line: &Rc<RefCell<Line>>,
    progress: &mut dyn FnMut(usize, &Span),
) -> Outcome<(Ledger, u64, RunEnd)> {
    let frequency_hz = 1.0 / PERIOD_S as f32;
    let sine =
        Reference::Generated { shape: Shape::Sine, amplitude: AMPLITUDE_RAD, offset: 0.0, frequency_hz };
    let (mut received, limit, mut told) = (Ledger::default(), plan.ticks(), 0);
    let mut unwrapped: Option<(u64, u64)> = None;
    let end = session.run(Mode::Position, &Course::OnBoard(sine), &|| false, &mut |tick| {
        received.take(tick.tick as u32, &tick.sample);
        unwrapped = Some((unwrapped.map_or(tick.tick, |(first, _)| first), tick.tick));
        if received.count.is_multiple_of(PERIOD_TICKS) {
            let spans = line.borrow().watch.drift.spans().to_vec();
            for (number, span) in (1..).zip(&spans).skip(told) {
                progress(number, span);
            }
            told = spans.len();
        }
        if received.count == limit { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let (first, last) = unwrapped.unwrap_or_default();
    Ok((received, last - first, end.map_err(words)?))
}

/// Behind the run: home, and the counts of a joint at rest.
fn rest(session: &mut Session, line: &Rc<RefCell<Line>>) -> Outcome<Vec<Check>> {
    wait(session, REST)?;
    session.ready(&|| false).map_err(words)?;
    session.home(&|| false).map_err(words)?;
    wait(session, REST)?;
    let line = line.borrow();
    let [input, joint] = line.watch.count_error;
    Ok(vec![
        Check::equal("error of the count at rest, input pulley", input, 0),
        Check::equal("error of the count at rest, joint", joint, 0),
    ])
}

/// Lets board time pass.
fn wait(session: &mut Session, time: Duration) -> Outcome {
    let end = session.client().now() + time;
    while session.client().now() < end {
        session.idle(time).map_err(words)?;
    }
    Ok(())
}

/// Memory at the end against that at the end of the first span.
fn growth(watch: &Watch, plan: &Plan) -> Check {
    let what = "growth of memory in RAM since the first span, KiB";
    match (watch.memory_kib.first(), watch.memory_kib.last(), &watch.trouble) {
        (Some(first), Some(last), None) if watch.memory_kib.len() == plan.spans => {
            Check::at_most(what, last.saturating_sub(*first), GROWTH_KIB)
        }
        (.., trouble) => {
            Check::new(what, trouble.as_deref().unwrap_or("spans are missing"), "measured", false)
        }
    }
}
