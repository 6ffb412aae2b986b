//! Messages of both directions.

use core::fmt;

use heapless::{String, Vec};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::codes::{FaultRecord, Limits, State};
use crate::sample::{Batch, RawBatch, Sample};

/// Reference points that one message carries at most.
pub const STREAM_LENGTH: usize = 32;

/// Points of a ripple table, over one period.
pub const TABLE_POINTS: usize = 256;

/// Points of a ripple table that one message carries at most.
pub const TABLE_CHUNK: usize = 32;

/// A request with its number; the answer repeats the number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Request {
    /// Counts up by one a request, wrapping.
    pub sequence: u16,
    /// What is asked.
    pub message: ToBoard,
}

/// Something the board says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Answer {
    /// Counts up by one a frame, wrapping; a gap is a lost frame.
    pub sequence: u16,
    /// The request that is answered; none for telemetry.
    pub answers: Option<u16>,
    /// What is said.
    pub message: FromBoard,
}

/// What the host asks. Every request gets one answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum ToBoard {
    /// Asks for the [`Greeting`].
    Hello,
    /// The host is there; any other request says so too.
    Alive,
    /// Asks for the parameter with this index.
    ReadParameter(u16),
    /// Sets a parameter; it acts at once, or the answer says why not.
    WriteParameter {
        /// Index of the parameter.
        index: u16,
        /// New value in the parameter's unit.
        value: f32,
    },
    /// Sets every parameter to its default.
    DefaultParameters,
    /// Writes the parameters to flash.
    StoreParameters,
    /// Asks for another state.
    Enter(Goal),
    /// Sets the reference of the running joint.
    SetReference(Reference),
    /// Appends to the stream of references.
    StreamPoints(Vec<f32, STREAM_LENGTH>),
    /// Switches telemetry; off ends [`ToBoard::RawTelemetry`] as well.
    Telemetry(bool),
    /// Asks for the [`Status`].
    ReadStatus,
    /// Asks for a sample of the snapshot, 0 the oldest.
    ReadSnapshot(u8),
    /// Asks for the panic text of the run before this one.
    ReadPanicText,
    /// Provokes a failure, to see that the motor stops; the parameter `supervisor.allow_provoke` has to be 1.
    Provoke(Provocation),
    /// Fills a part of the table that is being sent; what acts stays as it is until [`ToBoard::ActivateTable`].
    WriteTablePoints {
        /// Index of the first point.
        first: u16,
        /// The points, as in [`TableHead::full_scale_nm`].
        points_raw: Vec<i16, TABLE_CHUNK>,
    },
    /// The table that was sent acts from now on, if it is whole by its checksum.
    ActivateTable(TableHead),
    /// Asks for the [`TableReport`].
    ReadTable,
    /// Asks for the points of the table from this index on.
    ReadTablePoints(u16),
    /// Forgets the table.
    ClearTable,
    /// Leaves the firmware for the processor's own boot loader, which takes a new image over USB; with the bridge off only.
    EnterBootLoader,
    /// Switches telemetry on, every tick with all that went into it.
    RawTelemetry,
    /// Brings the control law into the state behind power-on, but for parameters, ripple table, the count of ticks and the positions
    /// of the encoders; in state off only. From the tick that takes this up, raw telemetry says all that the outputs follow from.
    ResetControl,
}

/// What the board says.
// A batch is by far the largest and by far the most frequent one.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum FromBoard {
    /// Who it is.
    Greeting(Greeting),
    /// The request was carried out.
    Done,
    /// The request was not carried out.
    Refused(Refusal),
    /// A parameter.
    Parameter(Parameter),
    /// State, fault and counters.
    Status(Status),
    /// A sample of the snapshot that was taken at the fault.
    SnapshotSample {
        /// Its tick.
        tick: u32,
        /// Its signals.
        sample: Sample,
    },
    /// Text of the panic that ended the run before this one; empty if none did.
    PanicText(String<128>),
    /// How many reference points the stream takes still.
    StreamFree(u16),
    /// Samples of control ticks.
    Telemetry(Batch),
    /// The ripple table.
    Table(TableReport),
    /// Points of the ripple table, as in [`TableHead::full_scale_nm`].
    TablePoints(Vec<i16, TABLE_CHUNK>),
    /// Complete control ticks.
    RawTelemetry(RawBatch),
}

/// What a ripple table says beside its points.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TableHead {
    /// Angle of the input pulley over which the table repeats, rad.
    pub period_rad: f32,
    /// Torque of a point of 32768, N·m.
    pub full_scale_nm: f32,
    /// CRC-32 of the whole table, as it is stored.
    pub crc: u32,
}

/// State of the ripple table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TableReport {
    /// There is none.
    Absent,
    /// There is one, whole.
    Whole(TableHead),
    /// The stored one cannot be read; the motor stays off until it is written anew or cleared.
    Unreadable,
}

/// Who the board is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Greeting {
    /// [`crate::PROTOCOL_VERSION`] of the board.
    pub protocol_version: u16,
    /// [`crate::SCHEMA`] of the board.
    pub schema: [u8; 8],
    /// Version of the firmware.
    pub firmware: String<24>,
    /// Name of the board.
    pub board: String<24>,
    /// Commit that the firmware was built from, with `+` behind it if files differed from it.
    pub revision: String<16>,
    /// Digest of the sources of the control law: equal digests compute equal outputs.
    pub control: [u8; 8],
    /// Serial number of the processor, hexadecimal, as USB tells it; empty where there is none.
    pub serial: String<24>,
    /// Number of parameters.
    pub parameters: u16,
    /// What started the present run.
    pub boot: Boot,
    /// What the firmware found of its processor at the start.
    pub chip: Chip,
}

/// State of the processor at the start: what a board has to have right before it drives a motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Chip {
    /// Source of the control period, and so of all times.
    pub clock: ClockSource,
    /// Banks of the flash, 1 or 2. With one, erasing a page stops the control tick.
    pub flash_banks: u8,
    /// Level of the brown-out reset in the option bytes, 0 (1.7 V) to 4 (2.8 V).
    pub brown_out_level: u8,
    /// Resets by panics, faults of the processor and the watchdog since a host was there.
    pub restarts: u8,
}

impl Chip {
    /// What an image expects, and what a simulated board has.
    pub const EXPECTED: Self =
        Self { clock: ClockSource::Crystal, flash_banks: 2, brown_out_level: 4, restarts: 0 };

    /// Restarts from which on the board stays in safe mode: bridge locked, stores unread, USB only.
    pub const SAFE_RESTARTS: u8 = 3;

    /// Whether the board is in safe mode. The next reset ends it, once a host has been there.
    #[must_use]
    pub const fn is_safe(&self) -> bool {
        self.restarts >= Self::SAFE_RESTARTS
    }
}

/// Oscillator that the control period is counted with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ClockSource {
    /// Crystal: times are good to 0.01 %.
    Crystal,
    /// Oscillator of the processor, because the crystal does not run: times are good to 1 %.
    Internal,
}

/// What started the present run of the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Boot {
    /// Supply switched on.
    Power,
    /// Reset pin or debugger.
    Pin,
    /// The firmware itself, after a panic or a processor fault.
    Software,
    /// The watchdog.
    Watchdog,
}

impl fmt::Display for ClockSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Crystal => "crystal",
            Self::Internal => "internal oscillator, for the crystal does not run: times are good to 1 % only",
        })
    }
}

/// A parameter with all there is to know about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Parameter {
    /// Index, 0 to the number of parameters.
    pub index: u16,
    /// Path, as in `tendon.pretension`.
    pub name: String<40>,
    /// Unit, empty for a bare number.
    pub unit: String<12>,
    /// Present value.
    pub value: f32,
    /// Smallest value.
    pub minimum: f32,
    /// Largest value.
    pub maximum: f32,
    /// Default value.
    pub default: f32,
}

/// A state that can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Goal {
    /// Switch the bridge off.
    Off,
    /// Self test and pretension check, then ready.
    Ready,
    /// From ready: move to angle zero, then ready again.
    Home,
    /// From ready: follow the reference.
    Run(Mode),
    /// From fault: forget the fault, then off.
    ClearFault,
}

/// A failure that the board can be asked to suffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Provocation {
    /// The firmware panics.
    Panic,
    /// The processor meets an undefined instruction.
    ProcessorFault,
    /// Everything but the control tick stands still, so that the watchdog bites.
    Hang,
    /// One control tick takes longer than its period.
    LateTick,
    /// A function calls itself until the stack ends.
    StackOverflow,
}

/// What a reference means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Mode {
    /// Angle of the joint, rad.
    #[default]
    Position,
    /// Torque at the joint, N·m.
    Torque,
    /// Angle of the joint, rad; yields where this takes more output torque than the parameter `limits.contact_torque`.
    Hybrid,
    /// Angle of the joint, rad, towards which it is pulled with the parameters `impedance.stiffness` and
    /// `impedance.damping`.
    Impedance,
}

impl Mode {
    /// Whether the reference is a torque, N·m; otherwise it is an angle, rad.
    #[must_use]
    pub const fn follows_torque(self) -> bool {
        matches!(self, Self::Torque)
    }
}

/// Where the reference comes from. Values are rad or N·m, after the [`Mode`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reference {
    /// Stay at this value.
    Hold(f32),
    /// Points sent by the host at the rate of the parameter `reference.stream_rate`.
    Stream,
    /// Made on the board.
    Generated {
        /// Its form.
        shape: Shape,
        /// Half of the peak-to-peak value.
        amplitude: f32,
        /// Middle.
        offset: f32,
        /// Periods a second, Hz; the lowest line of a multisine.
        frequency_hz: f32,
    },
}

/// Form of a generated reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Shape {
    /// One sine.
    Sine,
    /// Triangle, constant speed up and down.
    Triangle,
    /// Eight odd lines of equal amplitude and low crest.
    Multisine,
    /// Eight steps up and eight down a period.
    Staircase,
}

/// State, fault and counters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Status {
    /// State of the supervisor.
    pub state: State,
    /// Fault that waits to be cleared.
    pub fault: Option<FaultRecord>,
    /// Limits that act.
    pub limits: Limits,
    /// Control ticks since boot.
    pub tick: u32,
    /// Time between two ticks, ns.
    pub period_ns: u32,
    /// Longest control tick since boot, processor cycles; 0 where there is no such counter.
    pub longest_tick_cycles: u32,
    /// Samples lost since boot because the link was too slow.
    pub lost: u32,
    /// Frames of the host that could not be read.
    pub bad_frames: u32,
    /// Samples that the snapshot holds.
    pub snapshot: u8,
    /// Exchanges with an encoder that DMA or SPI failed at, since boot; each costs a frame.
    pub bus_errors: u32,
}

/// Why a request was not carried out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// There is no parameter or snapshot sample of this index.
    NoSuchIndex,
    /// The value is outside its range or not a number.
    OutOfRange {
        /// What was sent.
        got: f32,
        /// Smallest value.
        minimum: f32,
        /// Largest value.
        maximum: f32,
    },
    /// The value is good by itself, but not together with others; the index names the other one.
    Conflict(u16),
    /// This parameter, or the ripple table, can be changed with the bridge off only.
    Moving,
    /// The present state does not lead to the state asked for.
    WrongState(State),
    /// The stream of references is full.
    StreamFull,
    /// Writing the flash failed.
    Storage,
    /// The board is still busy with the request before.
    Busy,
    /// A parameter forbids it; the index names it.
    Forbidden(u16),
    /// The points on the board are not those that the checksum was made of.
    TableDiffers,
    /// The stored ripple table cannot be read.
    TableUnreadable,
    /// The board is in safe mode.
    SafeMode,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSuchIndex => f.write_str("there is nothing of this index"),
            Self::OutOfRange { got, minimum, maximum } => {
                write!(f, "{got} is out of range, expected {minimum} to {maximum}")
            }
            Self::Conflict(index) => write!(f, "the value does not go with that of parameter {index}"),
            Self::Moving => f.write_str("this changes with the bridge off only; stop first"),
            Self::WrongState(state) => write!(f, "not possible in state {state}"),
            Self::StreamFull => f.write_str("the stream of references is full; send at its rate"),
            Self::Storage => f.write_str("the flash could not be written; old values are kept"),
            Self::Forbidden(index) => write!(f, "parameter {index} forbids it; set it to 1 first"),
            Self::TableDiffers => {
                f.write_str("the points on the board do not fit the table's checksum; send the table again")
            }
            Self::TableUnreadable => {
                f.write_str("the stored ripple table cannot be read; write it anew or clear it first")
            }
            Self::SafeMode => f.write_str("the board is in safe mode; see bowden faults, then reset it"),
            Self::Busy => f.write_str("the board is busy with the request before; send it again"),
        }
    }
}
