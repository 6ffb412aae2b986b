//! Absolute encoders: what a frame says, whether it can be believed, and the angle over more than one turn.
//!
//! A driver consists of a [`FrameBus`], which a board implements for its pins, and of a decoder that uses every error
//! bit of the frame: [`amt22`] and [`as5045`]. Counts stay raw integers here; radians belong to the edge of the program.

pub mod amt22;
pub mod as5045;
pub mod multi_turn;

use core::fmt;

/// Position within one turn of a 12-bit encoder, counts from 0 to 4095.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CountRaw(u16);

impl CountRaw {
    /// Counts of one turn.
    pub const PER_TURN: u16 = 4096;

    /// The count; `None` from one whole turn on.
    #[must_use]
    pub const fn new(count_raw: u16) -> Option<Self> {
        if count_raw < Self::PER_TURN { Some(Self(count_raw)) } else { None }
    }

    /// The count whose bits are the lowest twelve of `bits_raw`; the others are dropped.
    const fn from_low_bits(bits_raw: u32) -> Self {
        Self((bits_raw & 0xfff) as u16)
    }

    /// Counts from 0 to 4095.
    #[must_use]
    pub const fn get(self) -> u16 {
        self.0
    }
}

/// Serial transfer of one frame, most significant bit first.
///
/// # Contract
/// One call is one chip-select cycle with exactly `bits` clocks and the pauses that the encoder's data sheet asks for.
/// The frame is returned right-aligned with all higher bits zero. Nothing is sent to the encoder but zeros.
pub trait FrameBus {
    /// Why a transfer failed.
    type Error;

    /// Transfers one frame of `bits` bits, at most 32.
    ///
    /// # Errors
    /// When the peripheral reports one, or the transfer does not end in time.
    fn transfer(&mut self, bits: u8) -> Result<u32, Self::Error>;
}

/// An encoder that knows its angle within a turn.
pub trait AbsoluteEncoder {
    /// What an encoder tells beside its count.
    type Health;
    /// What is wrong with a frame.
    type Fault;
    /// Why a transfer failed.
    type BusError;

    /// Reads the present position.
    ///
    /// # Errors
    /// When the transfer failed, or any check of the frame did: no count of a doubtful frame is ever returned.
    fn read(&mut self) -> ReadResult<Self>;
}

/// What reading an encoder gives.
pub type ReadResult<E> = Result<
    Reading<<E as AbsoluteEncoder>::Health>,
    ReadError<<E as AbsoluteEncoder>::Fault, <E as AbsoluteEncoder>::BusError>,
>;

/// A position that passed all checks of its frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading<H> {
    /// Position within the turn.
    pub count_raw: CountRaw,
    /// What the encoder says on itself.
    pub health: H,
}

/// Why there is no position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadError<F, B> {
    /// A frame came and does not hold.
    Frame(F),
    /// No frame came.
    Bus(B),
}

impl<F: fmt::Display, B: fmt::Display> fmt::Display for ReadError<F, B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frame(fault) => fault.fmt(f),
            Self::Bus(error) => write!(f, "encoder bus: {error}"),
        }
    }
}
