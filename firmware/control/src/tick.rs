//! What goes into a control tick and what comes out.

use bowden_link::message::Goal;
use bowden_link::{Fault, FaultRecord, Sample};

use crate::correction::ripple_table::RippleTable;

pub use crate::parameters::{ReferenceConfig, TickConfig};

/// An encoder as the board read it last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EncoderWord {
    /// Frame as received, right-aligned.
    pub frame_raw: u32,
    /// Counts the transfers and wraps; unchanged means that no frame came since the last tick.
    pub sequence: u8,
    /// The bus reports that the transfer failed.
    pub bus_error: bool,
}

/// Everything that the hardware measured for one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickInput {
    /// Input pulley and joint.
    pub encoder: [EncoderWord; 2],
    /// ADC codes of f1 to f4.
    pub tension_raw: [u16; 4],
    /// ADC code of the motor current.
    pub current_raw: u16,
    /// ADC code of the bus voltage.
    pub bus_raw: u16,
    /// The bridge reports a fault or its output was switched off by hardware.
    pub bridge_fault: bool,
}

/// What the hardware has to do after a tick, and what is told about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickOutput {
    /// Duty of the bridge, 1/32767; 0 while the bridge is off.
    pub duty_raw: i16,
    /// Whether the bridge is on.
    pub bridge_on: bool,
    /// Whether its gate driver is to be awake; it is long before the bridge goes on.
    pub driver_on: bool,
    /// All signals of this tick.
    pub sample: Sample,
    /// The fault, in the tick of its detection only; the bridge is off in that tick already.
    pub tripped: Option<FaultRecord>,
}

/// An order to the control tick.
// The queue holds few of them, and a configuration is moved into the controller at once: a box would need memory.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Use this configuration from now on.
    Configure(TickConfig),
    /// Change the state; ignored where [`crate::supervisor::allows`] says no.
    Enter(Goal),
    /// Use this ripple table from now on, or none.
    Table(Option<RippleTable>),
    /// Follow this reference, from the present one on, smoothly.
    SetReference(ReferenceConfig),
    /// Begin anew, as behind power-on, but for configuration, ripple table, count of ticks and the positions of the encoders; ignored
    /// unless off.
    Reset,
    /// Stop: something outside the tick went wrong. Fault, channel as in [`FaultRecord::channel`], what was measured,
    /// what is allowed. Acts in every state; the first fault is kept.
    Trip(Fault, u8, f32, f32),
}

/// Queues into the tick: free of locks on the board, plain queues elsewhere.
pub trait Inbox {
    /// Has `act` carry out the next command where it lies, a copy being half a tick's work, and takes it out; at most one
    /// a tick.
    fn command<R>(&mut self, act: impl FnOnce(&Command) -> R) -> Option<R>;
    /// Next point of a streamed reference, 2⁻²⁰ rad or 2⁻²⁰ N·m.
    fn stream_point(&mut self) -> Option<i32>;
}

/// No orders.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoInbox;

impl Inbox for NoInbox {
    fn command<R>(&mut self, _: impl FnOnce(&Command) -> R) -> Option<R> {
        None
    }

    fn stream_point(&mut self) -> Option<i32> {
        None
    }
}

/// Growing queues, for benches and simulations (feature `alloc`).
#[cfg(feature = "alloc")]
#[derive(Clone, Debug, Default)]
pub struct Queues {
    /// Commands; the first one is carried out first.
    pub commands: alloc::collections::VecDeque<Command>,
    /// Points of a streamed reference, 2⁻²⁰ rad or 2⁻²⁰ N·m.
    pub points: alloc::collections::VecDeque<i32>,
}

#[cfg(feature = "alloc")]
impl Inbox for Queues {
    fn command<R>(&mut self, act: impl FnOnce(&Command) -> R) -> Option<R> {
        self.commands.pop_front().map(|command| act(&command))
    }

    fn stream_point(&mut self) -> Option<i32> {
        self.points.pop_front()
    }
}
