//! Frames on the wire: postcard, then CRC-32 (ISO-HDLC) little-endian, all of it COBS-stuffed, then a zero byte.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc};
use postcard::ser_flavors::{Cobs, Slice};
use serde::{Deserialize, Serialize};

/// Longest frame, bytes with the closing zero.
pub const FRAME_LENGTH: usize = 1400;

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// CRC-32 (ISO-HDLC) of `bytes`, the checksum of frames and of stored tables.
#[must_use]
pub fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// Why a frame could not be written or read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// The message does not fit into the buffer.
    TooLong,
    /// The stuffing, the checksum or the message itself is wrong: bytes were lost or changed.
    Damaged,
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooLong => "message too long for a frame",
            Self::Damaged => "damaged frame",
        })
    }
}

impl core::error::Error for FrameError {}

/// Writes `message` as one frame, closing zero included, and returns it.
///
/// # Errors
/// [`FrameError::TooLong`] if `buffer` is too short; [`FRAME_LENGTH`] is enough for every message.
pub fn encode<'b, T: Serialize>(message: &T, buffer: &'b mut [u8]) -> Result<&'b mut [u8], FrameError> {
    let cobs = Cobs::try_new(Slice::new(buffer)).map_err(|_| FrameError::TooLong)?;
    let checked = postcard::ser_flavors::crc::CrcModifier::new(cobs, CRC.digest());
    postcard::serialize_with_flavor(message, checked).map_err(|_| FrameError::TooLong)
}

/// Reads a frame in place; the closing zero may be there or not.
///
/// # Errors
/// [`FrameError::Damaged`] if any byte was lost or changed, or bytes are left over.
pub fn decode<'b, T: Deserialize<'b>>(frame: &'b mut [u8]) -> Result<T, FrameError> {
    let stuffed = frame.strip_suffix(&[0]).map_or(frame.len(), <[u8]>::len);
    let length = unstuff(&mut frame[..stuffed]).ok_or(FrameError::Damaged)?;
    let frame: &'b [u8] = frame;
    let (body, sum) = frame[..length].split_last_chunk::<4>().ok_or(FrameError::Damaged)?;
    if CRC.checksum(body) != u32::from_le_bytes(*sum) {
        return Err(FrameError::Damaged);
    }
    match postcard::take_from_bytes(body) {
        Ok((message, [])) => Ok(message),
        _ => Err(FrameError::Damaged),
    }
}

/// Undoes COBS in place and returns the length; `None` for a zero inside or a code that leads beyond the end.
fn unstuff(bytes: &mut [u8]) -> Option<usize> {
    let (mut from, mut to) = (0, 0);
    while from < bytes.len() {
        let code = usize::from(bytes[from]);
        let end = from + code;
        if code == 0 || end > bytes.len() || bytes[from + 1..end].contains(&0) {
            return None;
        }
        bytes.copy_within(from + 1..end, to);
        to += code - 1;
        from = end;
        if code < 0xff && from < bytes.len() {
            bytes[to] = 0;
            to += 1;
        }
    }
    Some(to)
}

/// Cuts a stream of bytes into frames.
#[derive(Debug)]
pub struct Accumulator<const N: usize> {
    bytes: [u8; N],
    length: usize,
    overrun: bool,
}

impl<const N: usize> Default for Accumulator<N> {
    fn default() -> Self {
        Self { bytes: [0; N], length: 0, overrun: false }
    }
}

impl<const N: usize> Accumulator<N> {
    /// Takes one byte; after the closing byte of a frame its message, or why there is none. Empty frames are skipped.
    pub fn push<T: for<'b> Deserialize<'b>>(&mut self, byte: u8) -> Option<Result<T, FrameError>> {
        if byte != 0 {
            match self.bytes.get_mut(self.length) {
                Some(place) => {
                    *place = byte;
                    self.length += 1;
                }
                None => self.overrun = true,
            }
            return None;
        }
        let (length, overrun) = (self.length, self.overrun);
        (self.length, self.overrun) = (0, false);
        match (overrun, length) {
            (true, _) => Some(Err(FrameError::TooLong)),
            (false, 0) => None,
            (false, _) => Some(decode(&mut self.bytes[..length])),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::vec::Vec;

    use super::*;
    use crate::message::{FromBoard, Goal, Mode, Request, ToBoard};
    use crate::sample::{
        BATCH_LENGTH, Batch, Inputs, Order, RAW_BATCH_LENGTH, RawBatch, RawTick, Sample, WordRaw,
    };
    use crate::{Answer, Fault, FaultRecord, Limits, State};

    /// CRC-32 bit by bit from its polynomial (reflected 0x04c11db7).
    fn crc_by_hand(bytes: &[u8]) -> u32 {
        let mut crc = !0_u32;
        for byte in bytes {
            crc ^= u32::from(*byte);
            for _ in 0..8 {
                crc = if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
            }
        }
        !crc
    }

    /// COBS as Cheshire and Baker describe it, over the whole packet.
    fn cobs_by_hand(bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        let mut blocks: Vec<&[u8]> = Vec::new();
        for run in bytes.split(|byte| *byte == 0) {
            let mut rest = run;
            while rest.len() >= 254 {
                blocks.push(&rest[..254]);
                rest = &rest[254..];
            }
            blocks.push(rest);
        }
        for block in blocks {
            out.push(block.len() as u8 + 1);
            out.extend(block);
        }
        out.push(0);
        out
    }

    #[test]
    fn golden_bytes() {
        let request = Request { sequence: 5, message: ToBoard::Enter(Goal::Run(Mode::Torque)) };
        // Sequence 5; variants Enter 6, Run 3, Torque 1.
        let mut body = std::vec![5, 6, 3, 1];
        body.extend(crc_by_hand(&body).to_le_bytes());
        let mut buffer = [0; 64];
        assert_eq!(*encode(&request, &mut buffer).unwrap(), cobs_by_hand(&body));
    }

    #[test]
    fn golden_telemetry() {
        let sample = Sample {
            encoder_count_raw: [1000, -3],
            tension_raw: [620, 0, 300, 4095],
            current_raw: 2047,
            bus_raw: 2708,
            duty_raw: -2,
            reference_raw: 64,
            command_raw: -65,
            state: State::Run,
            limits: Limits(1),
        };
        let mut batch = Batch { first_tick: 0, period_ns: 100_000, lost: 0, samples: heapless::Vec::new() };
        batch.samples.push(sample).unwrap();
        let answer = Answer { sequence: 300, answers: None, message: FromBoard::Telemetry(batch) };
        // Varints of seven bits, low first; signed numbers as zigzag (2n, or -2n - 1 below zero).
        let mut body = std::vec![
            0xac, 0x02, 0, 8, 0, 0xa0, 0x8d, 0x06, 0, 1, 0xd0, 0x0f, 5, 0xec, 0x04, 0, 0xac, 0x02, 0xff,
            0x1f, 0xff, 0x0f, 0x94, 0x15, 3, 0x80, 0x01, 0x81, 0x01, 5, 1
        ];
        body.extend(crc_by_hand(&body).to_le_bytes());
        let mut buffer = [0; 128];
        assert_eq!(*encode(&answer, &mut buffer).unwrap(), cobs_by_hand(&body));
    }

    /// The longest telemetry fits, and comes back.
    #[test]
    fn the_longest_message_fits() {
        let sample = Sample {
            encoder_count_raw: [i32::MIN; 2],
            tension_raw: [u16::MAX; 4],
            current_raw: u16::MAX,
            bus_raw: u16::MAX,
            duty_raw: i16::MIN,
            reference_raw: i32::MIN,
            command_raw: i32::MIN,
            state: State::Fault,
            limits: Limits(u16::MAX),
        };
        let samples = core::iter::repeat_n(sample, BATCH_LENGTH).collect();
        let batch = Batch { first_tick: u32::MAX, period_ns: u32::MAX, lost: u32::MAX, samples };
        let answer = Answer { sequence: u16::MAX, answers: None, message: FromBoard::Telemetry(batch) };
        let mut buffer = [0; FRAME_LENGTH];
        let frame = encode(&answer, &mut buffer).unwrap();
        assert_eq!(decode::<Answer>(frame), Ok(answer));
    }

    /// The longest complete ticks fit, and come back.
    #[test]
    fn the_longest_raw_telemetry_fits() {
        let sample = Sample {
            encoder_count_raw: [i32::MIN; 2],
            tension_raw: [u16::MAX; 4],
            current_raw: u16::MAX,
            bus_raw: u16::MAX,
            duty_raw: i16::MIN,
            reference_raw: i32::MIN,
            command_raw: i32::MIN,
            state: State::Fault,
            limits: Limits(u16::MAX),
        };
        let record =
            FaultRecord { fault: Fault::RestartLoop, channel: 255, tick: u32::MAX, got: 1.5, limit: 2.5 };
        let inputs = Inputs {
            encoder_word_raw: [WordRaw::new(u32::MAX, u8::MAX, true); 2],
            bridge_fault: true,
            order: Order::Request(u16::MAX),
            point_raw: Some(i32::MIN),
            tripped: Some(record),
        };
        let ticks = core::iter::repeat_n(RawTick { sample, inputs }, RAW_BATCH_LENGTH).collect();
        let batch = RawBatch { first_tick: u32::MAX, period_ns: u32::MAX, lost: u32::MAX, ticks };
        let answer = Answer { sequence: u16::MAX, answers: None, message: FromBoard::RawTelemetry(batch) };
        let mut buffer = [0; FRAME_LENGTH];
        let frame = encode(&answer, &mut buffer).unwrap();
        assert_eq!(decode::<Answer>(frame), Ok(answer));
    }

    #[test]
    fn every_changed_byte_is_noticed() {
        let request = Request { sequence: 1, message: ToBoard::WriteParameter { index: 3, value: 0.125 } };
        let mut buffer = [0; 64];
        let frame = encode(&request, &mut buffer).unwrap().to_vec();
        for place in 0..frame.len() {
            for bit in 0..8 {
                let mut wrong = frame.clone();
                wrong[place] ^= 1 << bit;
                if place == frame.len() - 1 {
                    // The closing zero is the accumulator's business; here it becomes one more byte.
                    assert_eq!(decode::<Request>(&mut wrong), Err(FrameError::Damaged));
                } else {
                    assert_ne!(decode::<Request>(&mut wrong), Ok(request.clone()), "byte {place} bit {bit}");
                }
            }
        }
    }

    #[test]
    fn the_accumulator_finds_its_way_back() {
        let request = Request { sequence: 9, message: ToBoard::Hello };
        let mut buffer = [0; 64];
        let frame = encode(&request, &mut buffer).unwrap().to_vec();
        let mut stream = frame[3..].to_vec();
        stream.extend(core::iter::repeat_n(7, 100));
        stream.push(0);
        stream.extend(&frame);
        let mut accumulator = Accumulator::<32>::default();
        let got: Vec<_> = stream.iter().filter_map(|byte| accumulator.push::<Request>(*byte)).collect();
        assert_eq!(got, [Err(FrameError::Damaged), Err(FrameError::TooLong), Ok(request)]);
    }

    /// A change of any message changes the schema; whoever does that on purpose writes the new hash here and counts
    /// the version up if meanings changed.
    #[test]
    fn the_schema_is_frozen() {
        assert_eq!(crate::SCHEMA, [246, 115, 24, 98, 146, 226, 130, 196]);
    }
}
