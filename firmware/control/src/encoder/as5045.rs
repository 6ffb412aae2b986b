//! AS5045 of ams, synchronous serial interface.
//!
//! A frame has 18 bits `D11 ... D0 OCF COF LIN INC DEC P` (AS5045 data sheet, section "Data Content"): the position, five
//! bits of status and a parity that makes the number of ones even.
//!
//! | bit | meaning | here |
//! |---|---|---|
//! | OCF | offset compensation finished | 0: not ready, no position |
//! | COF | range of the angle computation left | 1: no position |
//! | LIN | linearity alarm | 1: no position, it may be wrong |
//! | INC, DEC | magnet comes closer, goes away; both: field outside the recommended range | told as [`Field`] |

use core::fmt;

use super::{CountRaw, FrameDecoder, Reading};

/// Bits of a frame.
pub const FRAME_BITS: u8 = 18;

const FRAME: u32 = (1 << FRAME_BITS) - 1;
const BELOW_POSITION: u32 = 6;
const COMPENSATION_FINISHED: u32 = 1 << 5;
const COMPUTATION_OVERFLOW: u32 = 1 << 4;
const LINEARITY_ALARM: u32 = 1 << 3;
const MAGNET_INCREASE: u32 = 1 << 2;
const MAGNET_DECREASE: u32 = 1 << 1;

/// Field of the magnet at the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// In its range and not changing.
    Steady,
    /// In its range and growing: the magnet comes closer.
    Growing,
    /// In its range and falling: the magnet goes away.
    Falling,
    /// Outside the recommended range; the position holds with less accuracy. Adjust the magnet.
    Marginal,
}

/// What is wrong with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The number of ones is odd: the frame was disturbed.
    Parity {
        /// The frame.
        frame_raw: u32,
    },
    /// The encoder has just been switched on, or no encoder drives the line low.
    NotReady,
    /// The field is so far out of range that no angle could be computed.
    Overflow,
    /// The field is so far out of range that the angle may be wrong.
    Linearity,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parity { frame_raw } => {
                write!(f, "AS5045 frame {frame_raw:#07x}: parity is wrong; shield the line or slow the clock")
            }
            Self::NotReady => f.write_str(
                "AS5045: offset compensation is not finished; wait 20 ms, then look for a cut wire",
            ),
            Self::Overflow => {
                f.write_str("AS5045: no angle, overflow; centre the magnet and check its distance")
            }
            Self::Linearity => {
                f.write_str("AS5045: linearity alarm; centre the magnet and check its distance")
            }
        }
    }
}

/// Position and field in a frame; bits above the 18th are not looked at.
///
/// # Errors
/// [`Fault`] when the parity or one of the status bits says that the position does not hold.
pub const fn decode(frame_raw: u32) -> Result<(CountRaw, Field), Fault> {
    let frame_raw = frame_raw & FRAME;
    if frame_raw.count_ones() % 2 == 1 {
        return Err(Fault::Parity { frame_raw });
    }
    if frame_raw & COMPENSATION_FINISHED == 0 {
        return Err(Fault::NotReady);
    }
    if frame_raw & COMPUTATION_OVERFLOW != 0 {
        return Err(Fault::Overflow);
    }
    if frame_raw & LINEARITY_ALARM != 0 {
        return Err(Fault::Linearity);
    }
    let health = match (frame_raw & MAGNET_INCREASE != 0, frame_raw & MAGNET_DECREASE != 0) {
        (false, false) => Field::Steady,
        (true, false) => Field::Growing,
        (false, true) => Field::Falling,
        (true, true) => Field::Marginal,
    };
    Ok((CountRaw::from_low_bits(frame_raw >> BELOW_POSITION), health))
}

/// The decoder.
#[derive(Clone, Copy, Debug)]
pub struct As5045;

impl FrameDecoder for As5045 {
    type Fault = Fault;

    const FRAME_BITS: u8 = FRAME_BITS;

    fn decode(frame_raw: u32) -> Result<Reading, Fault> {
        decode(frame_raw)
            .map(|(count_raw, field)| Reading { count_raw, marginal: matches!(field, Field::Marginal) })
    }
}

impl From<Fault> for bowden_link::Fault {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::Parity { .. } => Self::EncoderParity,
            Fault::NotReady | Fault::Overflow | Fault::Linearity => Self::EncoderStatus,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Status bits of a good frame: OCF alone.
    const GOOD: [bool; 5] = [true, false, false, false, false];

    /// Frame in the order in which its bits are clocked out.
    fn frame(count: u32, status: [bool; 5]) -> u32 {
        let mut bits = [false; 18];
        for (n, bit) in bits[..12].iter_mut().enumerate() {
            *bit = count >> (11 - n) & 1 == 1;
        }
        bits[12..17].copy_from_slice(&status);
        bits[17] = bits[..17].iter().fold(false, |parity, bit| parity ^ bit);
        bits.iter().fold(0, |frame, bit| frame << 1 | u32::from(*bit))
    }

    #[test]
    fn every_position_comes_back() {
        for count in 0..4096 {
            let (count_raw, field) = decode(frame(count, GOOD)).unwrap();
            assert_eq!((u32::from(count_raw.get()), field), (count, Field::Steady));
        }
    }

    #[test]
    fn frames_worked_by_hand() {
        // Position and OCF are ones; parity makes their number even.
        for (frame_raw, count) in [(0x21, 0), (0x60, 1), (0xe1, 3), (0x2_0020, 0x800), (0x3_ffe1, 0xfff)] {
            assert_eq!(decode(frame_raw).map(|(count_raw, _)| count_raw.get()), Ok(count), "{frame_raw:#x}");
        }
    }

    #[test]
    fn every_status_is_told() {
        for status in 0..32_u8 {
            let bits: [bool; 5] = core::array::from_fn(|n| status >> (4 - n) & 1 == 1);
            let [ready, overflow, linearity, increase, decrease] = bits;
            let told = decode(frame(0x123, bits)).map(|(_, field)| field);
            let expected = match (ready, overflow, linearity, increase, decrease) {
                (false, ..) => Err(Fault::NotReady),
                (true, true, ..) => Err(Fault::Overflow),
                (true, false, true, ..) => Err(Fault::Linearity),
                (true, false, false, false, false) => Ok(Field::Steady),
                (true, false, false, true, false) => Ok(Field::Growing),
                (true, false, false, false, true) => Ok(Field::Falling),
                (true, false, false, true, true) => Ok(Field::Marginal),
            };
            assert_eq!(told, expected, "{status:#07b}");
        }
    }

    #[test]
    fn every_single_wrong_bit_is_found() {
        for count in 0..4096 {
            for bit in 0..18 {
                let wrong = frame(count, GOOD) ^ 1 << bit;
                assert_eq!(
                    decode(wrong),
                    Err(Fault::Parity { frame_raw: wrong }),
                    "count {count}, bit {bit}"
                );
            }
        }
    }

    #[test]
    fn a_stuck_line_is_no_position() {
        assert_eq!(decode(0), Err(Fault::NotReady));
        assert_eq!(decode(0x3_ffff), Err(Fault::Overflow));
    }

    #[test]
    fn bits_above_the_frame_are_not_looked_at() {
        let marginal = As5045::decode(0xfffc_0000 | frame(7, [true, false, false, true, true]));
        assert_eq!(marginal.map(|reading| (reading.count_raw.get(), reading.marginal)), Ok((7, true)));
        assert_eq!(
            bowden_link::Fault::from(As5045::decode(0x61).unwrap_err()),
            bowden_link::Fault::EncoderParity
        );
        assert_eq!(
            bowden_link::Fault::from(As5045::decode(0).unwrap_err()),
            bowden_link::Fault::EncoderStatus
        );
    }
}
