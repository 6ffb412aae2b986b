//! One encoder from tick to tick: decodes, unwraps, repairs single bad frames, and says when it is no longer to be believed.

use bowden_link::Fault;

use super::multi_turn::{MultiTurn, StepLimit};
use super::{CountRaw, Part};
use crate::scale::{Angle, Quantity, saturated};
use crate::tick::EncoderWord;

/// An encoder and what is expected of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderConfig {
    /// Kind.
    pub part: Part,
    /// Counts grow towards -θ.
    pub reversed: bool,
    /// Count at angle zero, 0 to 4095.
    pub zero_counts: u16,
    /// Largest step a tick.
    pub step_limit: StepLimit,
    /// Bad frames in a row that are a fault, at least 1.
    pub bad_frames: u8,
    /// Speed of one count a tick, rad/s; for reports.
    pub count_rad_s: f32,
}

impl EncoderConfig {
    /// Angle at a count, rad: `direction·(count − zero)·2π/4096`, within half a step of 2⁻²⁰ plus 3e-10 of it, saturated.
    #[must_use]
    #[inline]
    pub fn angle(&self, position_counts: i32) -> Angle {
        /// Bits of [`RAD_PER_COUNT`] below 2⁻²⁰ rad.
        const EXTRA_BITS: u32 = 20;
        /// 2π/4096 in 2⁻⁴⁰ rad: 2^29 π.
        const RAD_PER_COUNT: i32 = 1_686_629_713;
        // What saturates here is far beyond the range of an angle.
        let from_zero = position_counts.saturating_sub(i32::from(self.zero_counts));
        let directed = if self.reversed { from_zero.saturating_neg() } else { from_zero };
        let fine = i64::from(directed) * i64::from(RAD_PER_COUNT) + (1 << (EXTRA_BITS - 1));
        Angle::from_bits(saturated(fine >> EXTRA_BITS))
    }
}

/// What is wrong with an encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderFault {
    /// What.
    pub fault: Fault,
    /// What was measured, in the fault's unit.
    pub got: f32,
    /// What is allowed.
    pub limit: f32,
}

/// What an encoder says in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Position over all turns, counts; the last good one where the frame was bad.
    pub position_counts: i32,
    /// Its angle.
    pub angle: Angle,
    /// The frame was bad or missing and the position is an old one.
    pub repaired: bool,
    /// The magnet is at the edge of its range.
    pub marginal: bool,
    /// Too many bad frames in a row.
    pub fault: Option<EncoderFault>,
}

/// State of an encoder.
#[derive(Clone, Copy, Debug, Default)]
pub struct EncoderChannel {
    position: Option<MultiTurn>,
    sequence: Option<u8>,
    /// Bad frames in a row, ending now.
    bad: u8,
}

/// Why a tick brought no new position.
enum Bad {
    Missing,
    Frame(Fault),
    Jump(CountRaw, i32),
}

impl EncoderChannel {
    /// A channel that goes on from a position, counts, and knows of no frame before.
    #[must_use]
    pub fn at(position_counts: i32) -> Self {
        let first = CountRaw::from_low_bits(position_counts as u32);
        Self { position: Some(MultiTurn::starting_near(first, position_counts)), ..Self::default() }
    }

    /// Forgets all but the position.
    pub const fn reset(&mut self) {
        self.sequence = None;
        self.bad = 0;
    }

    /// Takes the word of this tick. A frame that fails a check, is missing, or jumps is repaired with the last good
    /// position; [`EncoderConfig::bad_frames`] of them in a row are a fault, named after the last one.
    ///
    /// After a fault by a jump the position goes on from where the encoder is, so that the counts stay those of the
    /// encoder while the bridge is off.
    #[expect(
        clippy::inline_always,
        reason = "called twice a tick; a call moves as many words as it works on"
    )]
    #[inline(always)]
    pub fn observe(&mut self, config: &EncoderConfig, word: &EncoderWord) -> Observation {
        let fresh = self.sequence.replace(word.sequence) != Some(word.sequence);
        let (repaired, marginal, fault) = match self.take(config, *word, fresh) {
            Ok(marginal) => {
                self.bad = 0;
                (false, marginal, None)
            }
            Err(bad) => (true, false, self.miss(config, &bad)),
        };
        let position_counts = self.position.map_or(0, |position| position.position_counts());
        Observation { position_counts, angle: config.angle(position_counts), repaired, marginal, fault }
    }

    #[inline]
    fn take(&mut self, config: &EncoderConfig, word: EncoderWord, fresh: bool) -> Result<bool, Bad> {
        if word.bus_error || !fresh {
            return Err(Bad::Missing);
        }
        let reading = config.part.decode(word.frame_raw).map_err(Bad::Frame)?;
        match &mut self.position {
            None => {
                self.position =
                    Some(MultiTurn::starting_near(reading.count_raw, i32::from(config.zero_counts)));
            }
            Some(position) => {
                // The shaft went on during the ticks without a good frame.
                let limit = match self.bad {
                    0 => config.step_limit,
                    bad => config.step_limit.over_ticks(u16::from(bad) + 1),
                };
                position
                    .advance(limit, reading.count_raw)
                    .map_err(|jump| Bad::Jump(reading.count_raw, jump.step_counts))?;
            }
        }
        Ok(reading.marginal)
    }

    /// Counts a bad frame.
    #[cold]
    #[inline(never)]
    fn miss(&mut self, config: &EncoderConfig, bad: &Bad) -> Option<EncoderFault> {
        self.bad = self.bad.saturating_add(1);
        (self.bad >= config.bad_frames).then(|| self.fault(config, bad))
    }

    fn fault(&mut self, config: &EncoderConfig, bad: &Bad) -> EncoderFault {
        let in_a_row =
            |fault| EncoderFault { fault, got: f32::from(self.bad), limit: f32::from(config.bad_frames) };
        match *bad {
            Bad::Missing => in_a_row(Fault::EncoderMissing),
            Bad::Frame(fault) => in_a_row(fault),
            Bad::Jump(reading, step_counts) => {
                if let Some(position) = &mut self.position {
                    position.restart(reading);
                }
                self.bad = 0;
                EncoderFault {
                    fault: Fault::EncoderJump,
                    got: step_counts as f32 * config.count_rad_s,
                    limit: f32::from(config.step_limit.counts()) * config.count_rad_s,
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::parameters::Parameters;
    use crate::tick_config;

    /// Frame of an AMT22.
    fn word(count: u32, sequence: u8) -> EncoderWord {
        let field = (count & 0xfff) << 2;
        let even = |mask: u32| u32::from((field & mask).count_ones().is_multiple_of(2));
        let frame_raw = even(0x2aaa) << 15 | even(0x1555) << 14 | field;
        EncoderWord { frame_raw, sequence, bus_error: false }
    }

    #[test]
    fn a_fast_shaft_is_followed_over_missing_frames() {
        // 6 counts a tick are allowed. At 5 a tick, the first frame after three missing ones is 20 counts on.
        let config = tick_config(&Parameters::default()).unwrap().encoder[0];
        assert_eq!(config.step_limit.counts(), 6);
        let mut channel = EncoderChannel::default();
        for n in 0..4000_u32 {
            let mut word = word(1000 + 5 * n, n as u8);
            word.bus_error = n % 7 >= 4;
            let observation = channel.observe(&config, &word);
            assert_eq!(observation.repaired, n % 7 >= 4);
            assert!(observation.fault.is_none(), "{observation:?}");
            if !observation.repaired {
                assert_eq!(observation.position_counts, 1000 + 5 * n.cast_signed());
            }
        }
        // Seven a tick are a jump.
        let mut channel = EncoderChannel::default();
        let faults = (0..10_u32).filter_map(|n| channel.observe(&config, &word(1000 + 7 * n, n as u8)).fault);
        assert!(faults.into_iter().any(|fault| fault.fault == Fault::EncoderJump));
    }

    #[test]
    fn angles_are_right_to_half_a_step() {
        let mut config = tick_config(&Parameters::default()).unwrap().encoder[0];
        for reversed in [false, true] {
            config.reversed = reversed;
            let sign = if reversed { -1.0 } else { 1.0 };
            for counts in (-1_300_000..1_300_000).step_by(7919).chain([999, 1000, 1001]) {
                let expected = sign * f64::from(counts - 1000) * std::f64::consts::TAU / 4096.0;
                let got = f64::from(config.angle(counts).to_bits()) / f64::from(1 << 20);
                // Half a step, and 3e-10 of 2000 rad, 0.6 steps.
                assert!((got - expected).abs() * f64::from(1 << 20) < 1.1, "{counts}: {got} for {expected}");
            }
        }
        assert_eq!(config.angle(i32::MIN), Angle::MAX);
        assert_eq!(config.angle(i32::MAX).to_bits(), i32::MIN);
    }
}
