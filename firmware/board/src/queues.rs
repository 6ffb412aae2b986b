//! Lock-free ways between the control tick and everything else; each has one writer and one reader.

use bowden_control::tick::Command;
use bowden_link::sample::{Order, WordRaw};
use bowden_link::{FaultRecord, Inputs, Sample};
use heapless::spsc::{Consumer, Producer, Queue};
use static_cell::StaticCell;

/// Commands that wait for a tick.
const COMMANDS: usize = 5;

/// Points of the reference stream: 256 ms at 1 kHz.
const STREAM: usize = 257;

/// Samples for telemetry: 51 ms at 10 kHz, so that a busy thread loses none.
const SAMPLES: usize = 513;

/// What went into samples, while that is wanted: 26 ms at 10 kHz.
const GIVEN: usize = 257;

/// Faults to be logged, and to be told with raw telemetry.
const FAULTS: usize = 3;

/// A command and the order that raw telemetry names it by.
pub type Numbered = (Order, Command);

/// What went into a tick beside its sample; [`Inputs`] less the fault, which is rare and large.
#[derive(Clone, Copy)]
pub struct Given {
    pub words: [WordRaw; 2],
    pub point_raw: Option<i32>,
    pub order: Order,
    pub bridge_fault: bool,
}

impl Given {
    /// The same with the fault that the tick found.
    pub const fn with(self, tripped: Option<FaultRecord>) -> Inputs {
        let Self { words, point_raw, order, bridge_fault } = self;
        Inputs { encoder_word_raw: words, bridge_fault, order, point_raw, tripped }
    }
}

/// Ends of the queues.
pub struct Queues {
    /// For the tick.
    pub tick: TickEnds,
    /// For the requests of the host.
    pub host: HostEnds,
    /// For telemetry.
    pub samples: SampleEnds,
}

/// What telemetry reads.
pub struct SampleEnds {
    /// Samples.
    pub samples: Consumer<'static, (u32, Sample)>,
    /// What went into them, while that is wanted.
    pub given: Consumer<'static, (u32, Given)>,
    /// Faults that they found.
    pub faults: Consumer<'static, FaultRecord>,
}

/// What the tick reads and writes.
pub struct TickEnds {
    /// Commands.
    pub commands: Consumer<'static, Numbered>,
    /// Points of the reference stream.
    pub stream: Consumer<'static, i32>,
    /// Samples.
    pub samples: Producer<'static, (u32, Sample)>,
    /// What went into them.
    pub given: Producer<'static, (u32, Given)>,
    /// Faults.
    pub faults: Producer<'static, FaultRecord>,
    /// Faults, for telemetry.
    pub told_faults: Producer<'static, FaultRecord>,
}

/// What the requests of the host read and write.
pub struct HostEnds {
    /// Commands.
    pub commands: Producer<'static, Numbered>,
    /// Points of the reference stream.
    pub stream: Producer<'static, i32>,
    /// Faults.
    pub faults: Consumer<'static, FaultRecord>,
}

/// Hands the ends out; to be called once.
pub fn split() -> Queues {
    static COMMAND: StaticCell<Queue<Numbered, COMMANDS>> = StaticCell::new();
    static POINT: StaticCell<Queue<i32, STREAM>> = StaticCell::new();
    static SAMPLE: StaticCell<Queue<(u32, Sample), SAMPLES>> = StaticCell::new();
    static GIVEN_TICK: StaticCell<Queue<(u32, Given), GIVEN>> = StaticCell::new();
    static FAULT: StaticCell<Queue<FaultRecord, FAULTS>> = StaticCell::new();
    static TOLD_FAULT: StaticCell<Queue<FaultRecord, FAULTS>> = StaticCell::new();
    let (command_in, command_out) = COMMAND.init(Queue::new()).split();
    let (point_in, point_out) = POINT.init(Queue::new()).split();
    let (sample_in, sample_out) = SAMPLE.init(Queue::new()).split();
    let (given_in, given_out) = GIVEN_TICK.init(Queue::new()).split();
    let (fault_in, fault_out) = FAULT.init(Queue::new()).split();
    let (told_in, told_out) = TOLD_FAULT.init(Queue::new()).split();
    Queues {
        tick: TickEnds {
            commands: command_out,
            stream: point_out,
            samples: sample_in,
            given: given_in,
            faults: fault_in,
            told_faults: told_in,
        },
        host: HostEnds { commands: command_in, stream: point_in, faults: fault_out },
        samples: SampleEnds { samples: sample_out, given: given_out, faults: told_out },
    }
}
