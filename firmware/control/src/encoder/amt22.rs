//! AMT22 of Same Sky (formerly CUI Devices), 12-bit type, SPI.
//!
//! A frame has 16 bits `K1 K0 P11 ... P0 0 0`: two check bits, the position and two bits that this type leaves zero
//! (AMT22 data sheet, section on the serial interface). Each check bit makes the number of ones odd over every second
//! bit, itself included: K1 over bits 15, 13, ... 1 and K0 over bits 14, 12, ... 0. One wrong bit is always found, and a
//! line that is stuck at either level fails both checks.

use core::fmt;

use super::{CountRaw, FrameDecoder, Reading};

/// Bits of a frame.
pub const FRAME_BITS: u8 = 16;

/// Bits below the position.
const BELOW_POSITION: u32 = 2;

/// What is wrong with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A check bit does not match: the frame was disturbed, or no encoder drives the line.
    Check {
        /// The frame.
        frame_raw: u16,
        /// Whether K1 matches.
        k1_holds: bool,
        /// Whether K0 matches.
        k0_holds: bool,
    },
    /// The bits below a 12-bit position are not zero: the encoder is of the 14-bit type.
    Resolution {
        /// The frame.
        frame_raw: u16,
    },
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Check { frame_raw, k1_holds: false, k0_holds: false } => {
                write!(
                    f,
                    "AMT22 frame {frame_raw:#06x}: both check bits are wrong; look for a cut wire or no supply"
                )
            }
            Self::Check { frame_raw, k1_holds, .. } => {
                let bit = if *k1_holds { "K0" } else { "K1" };
                write!(
                    f,
                    "AMT22 frame {frame_raw:#06x}: check bit {bit} is wrong; shield the line or slow the clock"
                )
            }
            Self::Resolution { frame_raw } => {
                write!(
                    f,
                    "AMT22 frame {frame_raw:#06x}: 14 bits of position, expected the 12-bit type; exchange it"
                )
            }
        }
    }
}

/// Position in a frame.
///
/// # Errors
/// [`Fault`] when a check bit does not match or the frame is not one of the 12-bit type.
pub const fn decode(frame_raw: u16) -> Result<CountRaw, Fault> {
    // Folded by halves: bit 1 is left with the parity of what K1 checks, bit 0 with that of K0.
    let mut folded = frame_raw as u32;
    folded ^= folded >> 8;
    folded ^= folded >> 4;
    folded ^= folded >> 2;
    if folded & 3 != 3 {
        let (k1_holds, k0_holds) = (folded & 2 != 0, folded & 1 != 0);
        return Err(Fault::Check { frame_raw, k1_holds, k0_holds });
    }
    if frame_raw.trailing_zeros() < BELOW_POSITION {
        return Err(Fault::Resolution { frame_raw });
    }
    Ok(CountRaw::from_low_bits((frame_raw >> BELOW_POSITION) as u32))
}

/// The decoder.
#[derive(Clone, Copy, Debug)]
pub struct Amt22;

impl FrameDecoder for Amt22 {
    type Fault = Fault;

    const FRAME_BITS: u8 = FRAME_BITS;

    /// This type tells nothing beside its position.
    fn decode(frame_raw: u32) -> Result<Reading, Fault> {
        decode((frame_raw & 0xffff) as u16).map(|count_raw| Reading { count_raw, marginal: false })
    }
}

impl From<Fault> for bowden_link::Fault {
    /// A 14-bit encoder in place of a 12-bit one counts as its status: it works and its angle does not hold.
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::Check { .. } => Self::EncoderCheck,
            Fault::Resolution { .. } => Self::EncoderStatus,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frame of a 14-bit field, bit by bit as the equations of the data sheet go:
    /// `K1 = !(H5^H3^H1^L7^L5^L3^L1)`, `K0 = !(H4^H2^H0^L6^L4^L2^L0)`.
    fn frame(field: u16) -> u16 {
        let bit = |n: u16| field >> n & 1 == 1;
        let k1 = !(bit(13) ^ bit(11) ^ bit(9) ^ bit(7) ^ bit(5) ^ bit(3) ^ bit(1));
        let k0 = !(bit(12) ^ bit(10) ^ bit(8) ^ bit(6) ^ bit(4) ^ bit(2) ^ bit(0));
        u16::from(k1) << 15 | u16::from(k0) << 14 | field
    }

    #[test]
    fn every_position_comes_back() {
        for count in 0..4096 {
            assert_eq!(decode(frame(count << 2)).map(CountRaw::get), Ok(count));
        }
    }

    #[test]
    fn a_frame_worked_by_hand() {
        // 0xabc << 2 = 10 1010 1111 0000: ones at 13, 11, 9, 7, 5 (odd, so K1 = 0) and at 6, 4 (even, so K0 = 1).
        assert_eq!(decode(0x6af0).map(CountRaw::get), Ok(0xabc));
    }

    #[test]
    fn every_single_wrong_bit_is_found_and_named() {
        for count in 0..4096 {
            for bit in 0..16 {
                let wrong = frame(count << 2) ^ 1 << bit;
                let of_k1 = bit % 2 == 1;
                let expected = Fault::Check { frame_raw: wrong, k1_holds: !of_k1, k0_holds: of_k1 };
                assert_eq!(decode(wrong), Err(expected), "count {count}, bit {bit}");
            }
        }
    }

    #[test]
    fn a_stuck_line_fails_both_checks() {
        for frame_raw in [0x0000, 0xffff] {
            let expected = Fault::Check { frame_raw, k1_holds: false, k0_holds: false };
            assert_eq!(decode(frame_raw), Err(expected));
        }
    }

    #[test]
    fn a_position_of_fourteen_bits_is_not_taken_for_one_of_twelve() {
        // The example of the data sheet, 0x61ab, is a frame of the 14-bit type.
        assert_eq!(decode(0x61ab), Err(Fault::Resolution { frame_raw: 0x61ab }));
        let accepted = (0..1 << 14).filter(|field| decode(frame(*field)).is_ok()).count();
        assert_eq!(accepted, 4096);
    }

    #[test]
    fn bits_above_the_frame_are_not_looked_at() {
        assert_eq!(Amt22::decode(0xdead_6af0).map(|reading| reading.count_raw.get()), Ok(0xabc));
        let fault = Amt22::decode(0x6af1).unwrap_err();
        assert_eq!(bowden_link::Fault::from(fault), bowden_link::Fault::EncoderCheck);
        let fault = Amt22::decode(0x61ab).unwrap_err();
        assert_eq!(bowden_link::Fault::from(fault), bowden_link::Fault::EncoderStatus);
    }
}
