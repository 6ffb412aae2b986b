//! All signals of one control tick, as the hardware gives them.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::codes::{FaultRecord, Limits, State};

/// Samples that one batch holds at most.
pub const BATCH_LENGTH: usize = 24;

/// One control tick. SI values follow from the board's parameters, see each field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Sample {
    /// Encoder counts over all turns since boot, input pulley and joint, before zero and direction:
    /// `angle = direction·(count − zero)·2π/4096`.
    pub encoder_count_raw: [i32; 2],
    /// ADC codes of f1 to f4: `tension = (code − zero)·gain`.
    pub tension_raw: [u16; 4],
    /// ADC code of the motor current: `current = (code − zero)·gain`.
    pub current_raw: u16,
    /// ADC code of the bus voltage: `voltage = code·gain`.
    pub bus_raw: u16,
    /// Duty of the bridge that this tick set, in 1/32767.
    pub duty_raw: i16,
    /// Reference of the joint: desired angle in 2⁻²⁰ rad, or desired torque in 2⁻²⁰ N·m in torque mode.
    pub reference_raw: i32,
    /// Angle that the input pulley is asked to take, 2⁻²⁰ rad.
    pub command_raw: i32,
    /// State of the supervisor.
    pub state: State,
    /// Limits that act.
    pub limits: Limits,
}

/// Complete ticks that one batch holds at most.
pub const RAW_BATCH_LENGTH: usize = 10;

/// An encoder frame with what came with it, as it goes over the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct WordRaw(pub u32);

impl WordRaw {
    const FRAME: u32 = 0x3_ffff;
    const ERROR: u32 = 1 << 18;
    const SEQUENCE: u32 = 19;

    /// Packs the lowest 18 bits of a frame, the count of transfers and whether the bus failed.
    #[must_use]
    pub const fn new(frame_raw: u32, sequence: u8, bus_error: bool) -> Self {
        let error = if bus_error { Self::ERROR } else { 0 };
        Self(frame_raw & Self::FRAME | error | (sequence as u32) << Self::SEQUENCE)
    }

    /// Frame as received, right-aligned.
    #[must_use]
    pub const fn frame_raw(self) -> u32 {
        self.0 & Self::FRAME
    }

    /// Counts the transfers and wraps.
    #[must_use]
    pub const fn sequence(self) -> u8 {
        (self.0 >> Self::SEQUENCE) as u8
    }

    /// The transfer failed.
    #[must_use]
    pub const fn bus_error(self) -> bool {
        self.0 & Self::ERROR != 0
    }
}

/// The order that a control tick took up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Order {
    /// None.
    #[default]
    None,
    /// That of the request with this number.
    Request(u16),
    /// The board's own order to stop; the fault that came of it is [`Inputs::tripped`], unless there was one already.
    Stop,
}

/// What a control tick was given beside what its [`Sample`] says, and the fault that it found: all that is needed to compute the
/// tick again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Inputs {
    /// Words of both encoders, input pulley and joint.
    pub encoder_word_raw: [WordRaw; 2],
    /// The bridge reports a fault.
    pub bridge_fault: bool,
    /// The order that was taken up.
    pub order: Order,
    /// The point of a streamed reference that was taken out, 2⁻²⁰ rad or 2⁻²⁰ N·m.
    pub point_raw: Option<i32>,
    /// The fault that this tick found.
    pub tripped: Option<FaultRecord>,
}

/// A control tick with everything that went in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct RawTick {
    /// Its signals.
    pub sample: Sample,
    /// What else went in.
    pub inputs: Inputs,
}

/// Complete consecutive control ticks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct RawBatch {
    /// First tick, counted from boot.
    pub first_tick: u32,
    /// Time between two ticks, ns.
    pub period_ns: u32,
    /// Samples lost on the board since boot because the link was too slow.
    pub lost: u32,
    /// The ticks.
    pub ticks: Vec<RawTick, RAW_BATCH_LENGTH>,
}

/// Samples of consecutive control ticks.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Batch {
    /// Tick of the first sample, counted from boot.
    pub first_tick: u32,
    /// Time between two ticks, ns.
    pub period_ns: u32,
    /// Samples lost on the board since boot because the link was too slow.
    pub lost: u32,
    /// The samples.
    pub samples: Vec<Sample, BATCH_LENGTH>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_keeps_frame_count_and_error() {
        for (frame_raw, sequence, bus_error) in [(0x3_ffff, 0, false), (0, 127, true), (0x1_2345, 85, true)] {
            let word = WordRaw::new(frame_raw, sequence, bus_error);
            assert_eq!(
                (word.frame_raw(), word.sequence(), word.bus_error()),
                (frame_raw, sequence, bus_error)
            );
        }
    }
}
