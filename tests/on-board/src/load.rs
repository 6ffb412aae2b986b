//! The tick under full load: telemetry of every tick, a streamed reference, requests without a pause, log.

use bowden_board::FirmwareUse;
use bowden_link::message::{Goal, Mode, Reference};
use bowden_link::{State, ToBoard};

use crate::cost::Cost;
use crate::host::Host;
use crate::ticks::Range;
use crate::{Failure, Outcome};

/// Points of a request; 8 ms of the stream at 1 kHz.
const POINTS: usize = 8;

/// What was measured.
#[derive(Debug, Clone)]
pub struct LoadedTick {
    /// Cycles between the beginnings of two ticks.
    pub period: Range,
    /// Cycles from the beginning of a tick to its end, a lower bound.
    pub busy: Range,
    /// The interrupt handler of the control tick.
    pub tick: Cost,
    /// The compensator in it.
    pub compensator: Cost,
    /// Memory.
    pub memory: FirmwareUse,
    /// Share of the cycles that the core slept \[1\].
    pub idle: f64,
    /// Samples received, and missing among them.
    pub samples: [u64; 2],
    /// Requests answered.
    pub requests: u64,
}

/// Runs the ready joint on a streamed reference for `seconds` under full load.
pub fn under_load(host: &mut Host, seconds: f64) -> Outcome<LoadedTick> {
    host.set("reference.stream_rate", 1000.0)?;
    host.order(&ToBoard::Telemetry(true))?;
    host.order(&ToBoard::SetReference(Reference::Stream))?;
    host.order(&ToBoard::Enter(Goal::Run(Mode::Position)))?;
    host.reach(State::Run, 0.1)?;
    host.run(0.1)?;
    host.board.measure_symbol("ADC1_2")?;
    host.board.measure_symbol("compensator::compensate")?;
    host.board.take_measurements();
    host.ticks.measure_anew();
    let (missing, received) = (host.telemetry.missing, host.telemetry.received);
    let (before, start_s) = (host.board.counters(), host.board.time_s());
    let (mut requests, mut sent_s) = (0, start_s);
    while host.board.time_s() < start_s + seconds {
        let mut points = heapless::Vec::new();
        for _ in 0..POINTS {
            let angle_rad = 0.3 * (1.0 - (std::f64::consts::TAU * 0.5 * (sent_s - start_s)).cos());
            // POINTS is less than the message holds.
            let _ = points.push(angle_rad as f32);
            sent_s += 1e-3;
        }
        host.ask(&ToBoard::StreamPoints(points))?;
        requests += 1;
        while host.board.time_s() < sent_s - 1e-3 {
            host.status()?;
            requests += 1;
        }
    }
    let after = host.board.counters();
    let results = host.board.take_measurements();
    let cost = |name: &str| {
        let found = results.iter().find(|result| result.function.contains(name));
        found.map(Cost::from).ok_or_else(|| Failure(format!("{name} was not called")))
    };
    Ok(LoadedTick {
        period: host.ticks.period,
        busy: host.ticks.busy,
        tick: cost("ADC1_2")?,
        compensator: cost("compensate")?,
        memory: host.board.firmware_use(),
        idle: (after.idle_cycles - before.idle_cycles) as f64 / (after.cycles - before.cycles) as f64,
        samples: [host.telemetry.received - received, host.telemetry.missing - missing],
        requests,
    })
}
