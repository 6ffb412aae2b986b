//! The release image on the emulated board, the virtual bench behind it, telemetry of every tick.

use bowden_board::Board;
use bowden_link::message::{Reference, Shape};
use bowden_link::{State, ToBoard};

use super::check::Check;
use super::drift::{self, Drift, Span};
use super::memory::resident_kib;
use crate::Outcome;
use crate::course::{ARRIVAL_S, errors_rad};
use crate::host::Host;
use crate::ticks::{CYCLES_PER_US, Range};

/// Period of the reference \[s\], and its amplitude \[rad\].
const PERIOD_S: f64 = 1.0;
const AMPLITUDE_RAD: f32 = 0.3;
/// Time from the start of the motion to the first part \[s\].
const SETTLE_S: f64 = 3.0;
/// Cycles of a control period.
const PERIOD_CYCLES: u64 = 17_000;
/// How much longer the longest tick of a later span may be than that of the first one \[cycles\]: a hundredth of the period, for rare
/// coincidences of what a tick may have to do.
const LONGER_CYCLES: u64 = PERIOD_CYCLES / 100;
/// How much deeper the stack may be than after the first span \[bytes\]: one nested exception with its floating point registers.
const DEEPER_BYTES: u32 = 256;
/// Memory that this process may take in from the end of the first span on \[KiB\].
const GROWTH_KIB: u64 = 1024;
/// Ticks that have no sample yet while the board runs: a batch of 24 that is not full, 1 ms of the board's sender, 1 ms of the wire and
/// 0.5 ms of this host.
const ON_THE_WAY: u32 = 24 + 10 + 10 + 5;

/// How long a run is.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Spans that are compared with each other.
    pub spans: usize,
    /// Parts of a span, one period of the reference each.
    pub parts: usize,
}

impl Plan {
    /// So many seconds in spans of a minute; quarters, if it is less than two.
    pub fn seconds(seconds: usize) -> Self {
        let a_span = if seconds < 120 { (seconds / 4).max(1) } else { 60 };
        Self { spans: (seconds / a_span).max(1), parts: a_span }
    }
}

/// What board and host were like at the end of a span.
#[derive(Debug, Clone, Copy)]
pub struct Upkeep {
    /// From the beginning of a tick to its end \[cycles\].
    pub busy: Range,
    /// From one beginning to the next \[cycles\].
    pub period: Range,
    /// Deepest stack since boot \[bytes\].
    pub stack_bytes: u32,
    /// Memory of this process in RAM \[KiB\].
    pub memory_kib: u64,
}

/// What a run came to.
#[derive(Debug, Clone)]
pub struct EmulatedRun {
    /// Samples received.
    pub samples: u64,
    /// Error of the joint's angle.
    pub spans: Vec<Span>,
    /// What else there was at the end of each span.
    pub upkeep: Vec<Upkeep>,
    /// What has to hold.
    pub checks: Vec<Check>,
    /// The same of the memory of this process, which other work in it takes as well.
    pub memory: Check,
}

impl EmulatedRun {
    /// All that has to hold in a process that does nothing else.
    pub fn all_checks(&self) -> Vec<Check> {
        self.checks.iter().chain([&self.memory]).cloned().collect()
    }
}

/// Runs the image `elf` by `plan`; `progress` hears of each span that has ended.
pub fn run(elf: &[u8], plan: &Plan, progress: &mut dyn FnMut(usize, &Span, &Upkeep)) -> Outcome<EmulatedRun> {
    let mut host = Host::connect(Board::builder(elf).build()?)?;
    let restarts = host.greet()?.chip.restarts;
    let boots = host.board.counters().boots;
    host.make_ready()?;
    host.home()?;
    host.order(&ToBoard::Telemetry(true))?;
    let shape = Shape::Sine;
    let frequency_hz = (1.0 / PERIOD_S) as f32;
    host.follow(Reference::Generated { shape, amplitude: AMPLITUDE_RAD, offset: 0.0, frequency_hz })?;
    host.run(SETTLE_S)?;
    host.telemetry.take();
    let (mut drift, mut upkeep) = (Drift::default(), Vec::with_capacity(plan.spans));
    for number in 1..=plan.spans {
        host.ticks.measure_anew();
        for _ in 0..plan.parts {
            for error_rad in errors_rad(&mut host, PERIOD_S - ARRIVAL_S)? {
                drift.add(error_rad);
            }
            drift.end_part();
        }
        drift.end_span();
        let now = Upkeep {
            busy: host.ticks.busy,
            period: host.ticks.period,
            stack_bytes: host.board.firmware_use().stack_used_bytes,
            memory_kib: resident_kib()?,
        };
        upkeep.push(now);
        if let Some(span) = drift.spans().last() {
            progress(number, span, &now);
        }
    }
    // Of this moment, before more comes.
    let (begun, next_tick) = (host.ticks.begun, host.telemetry.next_tick().unwrap_or(0));
    let (received, missing) = (host.telemetry.received, host.telemetry.missing);
    let status = host.status()?;
    let fault = status.fault.map_or_else(|| "none".to_owned(), |fault| fault.to_string());
    let behind = begun.wrapping_sub(next_tick);
    let counted_behind = host.ticks.begun.abs_diff(status.tick);
    let longest_cycles = status.longest_tick_cycles;
    let mut checks = vec![
        Check::new("fault", fault, "none", status.fault.is_none()),
        Check::new("state", status.state.to_string(), "run", status.state == State::Run),
        Check::equal("resets since power-on", host.board.counters().boots - boots, 0),
        Check::equal("restarts by the firmware or the watchdog", host.greet()?.chip.restarts, restarts),
        Check::equal("samples missing between others", missing, 0),
        Check::equal("batches out of their order", host.telemetry.disordered, 0),
        Check::equal("samples that the board says it lost", status.lost, 0),
        Check::equal("frames missing or unreadable at the host", host.lost_frames + host.bad_frames, 0),
        Check::equal("frames of the host unreadable at the board", status.bad_frames, 0),
        Check::equal("exchanges with encoders that failed", status.bus_errors, 0),
        Check::at_most("ticks by their marker that have no sample yet", behind, ON_THE_WAY),
        Check::at_most(
            "ticks by their marker, and by the board's own count: difference",
            counted_behind,
            ON_THE_WAY,
        ),
        Check::new(
            "longest tick by the board's own count",
            format!("{longest_cycles} cycles, {:.1} us", f64::from(longest_cycles) / CYCLES_PER_US),
            format!("below {PERIOD_CYCLES}"),
            u64::from(longest_cycles) < PERIOD_CYCLES,
        ),
    ];
    checks.extend(drift::checks(drift.spans()));
    checks.extend(growth(&upkeep));
    let memory = memory(&upkeep);
    Ok(EmulatedRun { samples: received, spans: drift.spans().to_vec(), upkeep, checks, memory })
}

/// Memory at the end against that at the end of the first span.
fn memory(upkeep: &[Upkeep]) -> Check {
    let kib = |span: Option<&Upkeep>| span.map_or(0, |span| span.memory_kib);
    let grown = kib(upkeep.last()).saturating_sub(kib(upkeep.first()));
    Check::at_most("growth of this process in RAM since the first span, KiB", grown, GROWTH_KIB)
}

/// Whether ticks and stack of later spans are those of the first one.
fn growth(upkeep: &[Upkeep]) -> Vec<Check> {
    let (Some(first), Some(last)) = (upkeep.first(), upkeep.last()) else { return Vec::new() };
    let longest = upkeep.iter().map(|span| span.busy.max).max().unwrap_or(0);
    let jitter = upkeep.iter().map(|span| span.period.spread()).max().unwrap_or(0);
    vec![
        Check::at_most("longest tick by its marker, cycles", longest, first.busy.max + LONGER_CYCLES),
        Check::at_most("jitter of the tick, peak to peak, cycles", jitter, PERIOD_CYCLES / 50),
        Check::at_most("deepest stack, bytes", last.stack_bytes, first.stack_bytes + DEEPER_BYTES),
    ]
}
