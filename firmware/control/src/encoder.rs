//! Absolute encoders: what a frame says, whether it can be believed, and the angle over more than one turn.
//!
//! A part is a [`FrameDecoder`] that uses every error bit of its frame: [`amt22`] and [`as5045`], chosen at run time by
//! [`Part`]. [`channel`] follows one encoder from tick to tick, [`stuck`] compares the two.

pub mod amt22;
pub mod as5045;
pub mod channel;
pub mod multi_turn;
pub mod stuck;

use bowden_link::Fault;

pub use channel::{EncoderChannel, EncoderConfig, Observation};

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

/// A position that passed all checks of its frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// Position within the turn.
    pub count_raw: CountRaw,
    /// The encoder says that its magnet is at the edge of its range.
    pub marginal: bool,
}

/// A kind of encoder.
pub trait FrameDecoder {
    /// What is wrong with a frame.
    type Fault: Into<Fault>;

    /// Clocks of a frame.
    const FRAME_BITS: u8;

    /// Position in a frame, right-aligned; bits above [`Self::FRAME_BITS`] are not looked at.
    ///
    /// # Errors
    /// When any check of the frame fails: no count of a doubtful frame is ever returned.
    fn decode(frame_raw: u32) -> Result<Reading, Self::Fault>;
}

/// The parts that can be chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Part {
    /// AMT22, 12-bit type, SPI.
    #[default]
    Amt22,
    /// AS5045, SSI.
    As5045,
}

impl Part {
    /// Clocks of a frame.
    #[must_use]
    pub const fn frame_bits(self) -> u8 {
        match self {
            Self::Amt22 => amt22::Amt22::FRAME_BITS,
            Self::As5045 => as5045::As5045::FRAME_BITS,
        }
    }

    /// Position in a frame of this part.
    ///
    /// # Errors
    /// [`Fault::EncoderCheck`], [`Fault::EncoderParity`] or [`Fault::EncoderStatus`].
    pub fn decode(self, frame_raw: u32) -> Result<Reading, Fault> {
        match self {
            Self::Amt22 => amt22::Amt22::decode(frame_raw).map_err(Into::into),
            Self::As5045 => as5045::As5045::decode(frame_raw).map_err(Into::into),
        }
    }
}
