//! Lock-free ways between the control tick and everything else; each has one writer and one reader.

use bowden_control::tick::Command;
use bowden_link::{FaultRecord, Sample};
use heapless::spsc::{Consumer, Producer, Queue};
use static_cell::StaticCell;

/// Commands that wait for a tick.
const COMMANDS: usize = 5;

/// Points of the reference stream: 256 ms at 1 kHz.
const STREAM: usize = 257;

/// Samples for telemetry: 51 ms at 10 kHz, so that a busy thread loses none.
const SAMPLES: usize = 513;

/// Faults to be logged.
const FAULTS: usize = 3;

/// Ends of the queues.
pub struct Queues {
    /// For the tick.
    pub tick: TickEnds,
    /// For the requests of the host.
    pub host: HostEnds,
    /// For telemetry.
    pub samples: Consumer<'static, (u32, Sample)>,
}

/// What the tick reads and writes.
pub struct TickEnds {
    /// Commands.
    pub commands: Consumer<'static, Command>,
    /// Points of the reference stream.
    pub stream: Consumer<'static, i32>,
    /// Samples.
    pub samples: Producer<'static, (u32, Sample)>,
    /// Faults.
    pub faults: Producer<'static, FaultRecord>,
}

/// What the requests of the host read and write.
pub struct HostEnds {
    /// Commands.
    pub commands: Producer<'static, Command>,
    /// Points of the reference stream.
    pub stream: Producer<'static, i32>,
    /// Faults.
    pub faults: Consumer<'static, FaultRecord>,
}

/// Hands the ends out; to be called once.
pub fn split() -> Queues {
    static COMMAND: StaticCell<Queue<Command, COMMANDS>> = StaticCell::new();
    static POINT: StaticCell<Queue<i32, STREAM>> = StaticCell::new();
    static SAMPLE: StaticCell<Queue<(u32, Sample), SAMPLES>> = StaticCell::new();
    static FAULT: StaticCell<Queue<FaultRecord, FAULTS>> = StaticCell::new();
    let (command_in, command_out) = COMMAND.init(Queue::new()).split();
    let (point_in, point_out) = POINT.init(Queue::new()).split();
    let (sample_in, sample_out) = SAMPLE.init(Queue::new()).split();
    let (fault_in, fault_out) = FAULT.init(Queue::new()).split();
    Queues {
        tick: TickEnds { commands: command_out, stream: point_out, samples: sample_in, faults: fault_in },
        host: HostEnds { commands: command_in, stream: point_in, faults: fault_out },
        samples: sample_out,
    }
}
