//! The tick under full load: telemetry of every tick, a streamed reference, requests without a pause, log.

use bowden_board::accesses::EXCEPTION;
use bowden_board::{FirmwareUse, WorstCall};
use bowden_link::message::{Goal, Mode, Reference, Shape};
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

/// Cycles of a control period at the highest rate, 20 kHz, at 170 MHz.
pub const SHORTEST_PERIOD_CYCLES: u64 = 8500;

/// Items that DMA moves at most during a tick: two encoders, receiving and sending, three bytes of the exchange under way. TIM7 starts
/// the next one, and its handler waits for the tick.
pub const DMA_ITEMS_IN_A_TICK: u64 = 2 * 2 * 3;

/// The tick with the largest upper bound of its cycles, and what it takes from the flash.
#[derive(Debug, Clone)]
pub struct WorstTick {
    /// The handler of that tick.
    pub handler: WorstCall,
    /// Items that DMA moved in a tick, at most.
    pub dma_items: u64,
    /// Code that ticks fetched from the flash: function and address of each block.
    pub fetched: Vec<String>,
    /// Words that ticks read from the flash, and who read them.
    pub read: Vec<String>,
}

impl WorstTick {
    /// Of the ticks since the measurements were taken out, on a board that counts accesses and measures the tick's handler.
    pub fn since_taken(host: &Host) -> Outcome<Self> {
        let results = host.board.measurements();
        let handler = results.iter().find(|result| result.function.contains("ADC1_2"));
        let counted = handler.and_then(|result| Some((result.worst?, result.dma_items)));
        let (handler, dma_items) =
            counted.ok_or_else(|| Failure("no tick whose accesses were counted".to_owned()))?;
        Ok(Self {
            handler,
            dma_items,
            fetched: host.board.fetched_from_flash(),
            read: host.board.read_from_flash(),
        })
    }

    /// Takes in the ticks of another stretch.
    fn include(&mut self, other: Self) {
        if other.handler.most_cycles > self.handler.most_cycles {
            self.handler = other.handler;
        }
        self.dma_items = self.dma_items.max(other.dma_items);
        self.fetched.extend(other.fetched);
        self.read.extend(other.read);
        for list in [&mut self.fetched, &mut self.read] {
            list.sort();
            list.dedup();
        }
    }

    /// Upper bound of the cycles from the request of the interrupt to the instruction behind it.
    pub fn most_cycles(&self) -> u64 {
        self.handler.most_cycles + EXCEPTION
    }
}

/// The worst ticks at 20 kHz of a board that counts accesses: while the joint drives, in every mode and under full load, and of all
/// others, which test, change the state or take new parameters.
pub fn worst_ticks(host: &mut Host) -> Outcome<[WorstTick; 2]> {
    /// Length of the run in each mode \[s\].
    const MODE_S: f64 = 0.2;
    host.order(&ToBoard::Enter(Goal::Off))?;
    host.set("control.rate_divider", 1.0)?;
    host.board.measure_symbol("ADC1_2")?;
    host.board.take_measurements();
    host.make_ready()?;
    let mut other = WorstTick::since_taken(host)?;
    under_load(host, MODE_S)?;
    let mut driving = WorstTick::since_taken(host)?;
    for mode in [Mode::Torque, Mode::Hybrid, Mode::Impedance] {
        let amplitude = if mode == Mode::Torque { 0.05 } else { 0.3 };
        let sine = Reference::Generated { shape: Shape::Sine, amplitude, offset: 0.0, frequency_hz: 1.0 };
        host.board.take_measurements();
        host.set("controller.integral_time", 0.11)?;
        host.order(&ToBoard::Enter(Goal::Off))?;
        host.make_ready()?;
        host.order(&ToBoard::SetReference(sine))?;
        host.order(&ToBoard::Enter(Goal::Run(mode)))?;
        host.reach(State::Run, 0.1)?;
        other.include(WorstTick::since_taken(host)?);
        host.board.take_measurements();
        host.run(MODE_S)?;
        driving.include(WorstTick::since_taken(host)?);
    }
    host.board.take_measurements();
    host.order(&ToBoard::Enter(Goal::Off))?;
    host.run(0.01)?;
    other.include(WorstTick::since_taken(host)?);
    Ok([driving, other])
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
    let results = host.board.measurements();
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
