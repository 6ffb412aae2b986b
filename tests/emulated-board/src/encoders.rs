//! Absolute encoders as SPI slaves: AMT22 (12 bits) and AS5045, with their timing limits and faults.
//!
//! The angle is sampled when chip select falls. A master that is too fast or in the wrong clock mode is a broken design
//! and ends the run; the minimum time of an AMT22 between two readings is not checked.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use crate::peripherals::spi::ClockMode;

/// Counts of a turn of both parts.
pub const COUNTS_PER_TURN: u32 = 4096;
/// AMT22: from chip select to the first clock, and from the last clock to its release \[s\].
const AMT22_SELECT_S: f64 = 3.0e-6;
/// AMT22: from the end of a byte to the start of the next \[s\].
const AMT22_BETWEEN_BYTES_S: f64 = 2.5e-6;
/// AMT22: highest clock \[Hz\].
const AMT22_CLOCK_HZ: f64 = 2.0e6;
/// AS5045: from chip select to the first clock \[s\].
const AS5045_SELECT_S: f64 = 0.5e-6;
/// AS5045: highest clock \[Hz\].
const AS5045_CLOCK_HZ: f64 = 1.0e6;
/// Allowance for times that the firmware counts in whole cycles.
const TIME_SLACK_S: f64 = 5.0e-9;

/// Type of an absolute encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EncoderPart {
    /// Same Sky AMT22, 12 bits: 16-bit frame with two check bits, SPI mode 0, at most 2 MHz.
    Amt22,
    /// ams AS5045: 18-bit frame with status and even parity, at most 1 MHz. The clock idles high; its first falling edge
    /// latches, while the data line is high, and each rising edge shifts the next bit out (data sheet, synchronous serial
    /// interface). The first bit that a master takes in is that high level, and it takes bits in at falling edges.
    As5045,
}

/// How an encoder is mounted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EncoderMounting {
    /// The part.
    pub part: EncoderPart,
    /// Count at angle 0 of the bench.
    pub count_at_zero: u32,
    /// Whether the count falls as the angle grows.
    pub reversed: bool,
}

/// What a test does to an encoder.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct EncoderFault {
    /// Always this count.
    pub stuck_at: Option<u32>,
    /// Added to the count.
    pub jump: i32,
    /// Probability of a wrong bit, for each bit.
    pub bit_error: f64,
    /// Largest error of the count, uniform.
    pub noise_counts: u32,
    /// The last bit of each frame is wrong.
    pub last_bit: bool,
    /// Nothing drives the line: it reads ones.
    pub silent: bool,
    /// Probability of a frame without an answer.
    pub lost: f64,
    /// AS5045: magnet out of range (status bits), field lost.
    pub magnet_lost: bool,
}

/// Count at `angle_rad` for `mounting`.
pub(crate) fn count_at(mounting: EncoderMounting, angle_rad: f64) -> u32 {
    let counts = (angle_rad / TAU * f64::from(COUNTS_PER_TURN)).round() as i64;
    let counts = if mounting.reversed { -counts } else { counts };
    (i64::from(mounting.count_at_zero) + counts).rem_euclid(i64::from(COUNTS_PER_TURN)) as u32
}

/// Frame of an AMT22: check bits K1 and K0 make the ones of the odd and of the even bits odd in number.
pub(crate) fn amt22_frame(count: u32) -> u16 {
    let position = (count << 2) as u16 & 0x3fff;
    let odd_ones = (position & 0xaaaa).count_ones();
    let even_ones = (position & 0x5555).count_ones();
    position | u16::from(odd_ones.is_multiple_of(2)) << 15 | u16::from(even_ones.is_multiple_of(2)) << 14
}

/// Frame of an AS5045, 18 bits: count, OCF, COF, LIN, `MagINC`, `MagDEC`, even parity.
pub(crate) fn as5045_frame(count: u32, magnet_lost: bool) -> u32 {
    let status = if magnet_lost { 0b1_0111 } else { 0b1_0000 };
    let word = (count & 0xfff) << 6 | status << 1;
    word | (word.count_ones() & 1)
}

/// An encoder on its SPI lines.
#[derive(Debug, Clone)]
pub(crate) struct Encoder {
    /// How it is mounted.
    pub mounting: EncoderMounting,
    /// What a test does to it.
    pub fault: EncoderFault,
    name: &'static str,
    /// Bits still to be shifted out, left-aligned.
    shift: u32,
    selected_at_s: Option<f64>,
    last_end_s: Option<f64>,
    random: u64,
    /// Frames by which the count is late, and the counts in between.
    late: (usize, VecDeque<u32>),
}

impl Encoder {
    /// An encoder that is not selected.
    pub(crate) fn new(name: &'static str, mounting: EncoderMounting, seed: u64) -> Self {
        Self {
            mounting,
            fault: EncoderFault::default(),
            name,
            shift: u32::MAX,
            selected_at_s: None,
            last_end_s: None,
            random: seed | 1,
            late: (0, VecDeque::new()),
        }
    }

    /// Name for messages.
    pub(crate) fn name(&self) -> &'static str {
        self.name
    }

    /// Whether chip select is low.
    pub(crate) fn selected(&self) -> bool {
        self.selected_at_s.is_some()
    }

    /// Uniform in 0..1 (xorshift64*).
    fn uniform(&mut self) -> f64 {
        self.random ^= self.random >> 12;
        self.random ^= self.random << 25;
        self.random ^= self.random >> 27;
        (self.random.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Lets the count be late by this many frames.
    pub(crate) fn set_late(&mut self, frames: u32) {
        self.late = (frames as usize, VecDeque::new());
    }

    /// The bits that answer a frame, left-aligned.
    fn word(&self, count: u32, magnet_lost: bool) -> u32 {
        match self.mounting.part {
            EncoderPart::Amt22 => u32::from(amt22_frame(count)) << 16 | 0xffff,
            EncoderPart::As5045 => 1 << 31 | as5045_frame(count, magnet_lost) << 13 | 0x1fff,
        }
    }

    /// Chip select falls: the angle is sampled, count `own`; an injection elsewhere may have it show `shown`.
    ///
    /// Returns whether the frame differs from what it would be without a fault.
    pub(crate) fn select(&mut self, at_s: f64, own: u32, shown: u32) -> bool {
        self.selected_at_s = Some(at_s);
        self.last_end_s = None;
        let mut count = i64::from(shown) + i64::from(self.fault.jump);
        if self.fault.noise_counts > 0 {
            let span = f64::from(2 * self.fault.noise_counts + 1);
            count += (self.uniform() * span).floor() as i64 - i64::from(self.fault.noise_counts);
        }
        let mut count = count.rem_euclid(i64::from(COUNTS_PER_TURN)) as u32;
        let (frames, counts) = &mut self.late;
        if *frames > 0 {
            counts.push_back(count);
            if counts.len() > *frames + 1 {
                counts.pop_front();
            }
            count = counts.front().copied().unwrap_or(count);
        }
        let count = self.fault.stuck_at.unwrap_or(count) % COUNTS_PER_TURN;
        self.shift = self.word(count, self.fault.magnet_lost);
        if self.fault.bit_error > 0.0 {
            for bit in 0..32 {
                if self.uniform() < self.fault.bit_error {
                    self.shift ^= 1 << bit;
                }
            }
        }
        if self.fault.last_bit {
            self.shift ^= match self.mounting.part {
                EncoderPart::Amt22 => 1 << 16,
                EncoderPart::As5045 => 1 << 13,
            };
        }
        if self.fault.silent || self.fault.lost > 0.0 && self.uniform() < self.fault.lost {
            self.shift = u32::MAX;
        }
        // The bits that the part sends: behind them the line idles.
        let sent = match self.mounting.part {
            EncoderPart::Amt22 => 16,
            EncoderPart::As5045 => 19,
        };
        (self.shift ^ self.word(own, false)) >> (32 - sent) != 0
    }

    /// Chip select rises.
    pub(crate) fn deselect(&mut self, at_s: f64) -> Result<(), String> {
        let last = self.last_end_s.take();
        self.selected_at_s = None;
        if let (EncoderPart::Amt22, Some(last)) = (self.mounting.part, last) {
            Self::wait("from the last clock to the release of chip select", at_s - last, AMT22_SELECT_S)?;
        }
        Ok(())
    }

    fn wait(what: &str, got_s: f64, least_s: f64) -> Result<(), String> {
        if got_s + TIME_SLACK_S < least_s {
            return Err(format!("{what}: {:.3} us, expected at least {} us", 1e6 * got_s, 1e6 * least_s));
        }
        Ok(())
    }

    /// Answers `bits` clocks that began at `start_s` and ended at `end_s`.
    pub(crate) fn exchange(
        &mut self,
        bits: u32,
        start_s: f64,
        end_s: f64,
        clock: ClockMode,
    ) -> Result<u16, String> {
        let ones = 0xffff >> (16 - bits);
        let Some(selected_s) = self.selected_at_s else { return Ok(ones) };
        let clock_hz = f64::from(bits) / (end_s - start_s);
        let (highest_hz, select_s, idle_high) = match self.mounting.part {
            EncoderPart::Amt22 => (AMT22_CLOCK_HZ, AMT22_SELECT_S, false),
            EncoderPart::As5045 => (AS5045_CLOCK_HZ, AS5045_SELECT_S, true),
        };
        if clock_hz > highest_hz * 1.001 {
            return Err(format!(
                "clocked at {:.3} MHz, expected at most {:.1} MHz",
                1e-6 * clock_hz,
                1e-6 * highest_hz
            ));
        }
        // Both parts are read at the first edge: a rising one of an AMT22, a falling one of an AS5045.
        if clock.idle_high != idle_high || clock.second_edge {
            return Err(format!(
                "clock mode CPOL {} CPHA {}, expected CPOL {} CPHA 0",
                u8::from(clock.idle_high),
                u8::from(clock.second_edge),
                u8::from(idle_high)
            ));
        }
        match self.last_end_s {
            None => Self::wait("from chip select to the first clock", start_s - selected_s, select_s)?,
            Some(last) if self.mounting.part == EncoderPart::Amt22 => {
                Self::wait("between two bytes", start_s - last, AMT22_BETWEEN_BYTES_S)?;
            }
            Some(_) => {}
        }
        self.last_end_s = Some(end_s);
        let answer = (self.shift >> (32 - bits)) as u16;
        // Behind its last bit the line idles high, as a broken one does.
        self.shift = (u64::from(self.shift) << bits | u64::from(ones)) as u32;
        Ok(answer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODE0: ClockMode = ClockMode { idle_high: false, second_edge: false, cycles_per_bit: 128 };

    fn amt22(count_at_zero: u32) -> Encoder {
        let mounting = EncoderMounting { part: EncoderPart::Amt22, count_at_zero, reversed: false };
        Encoder::new("joint encoder", mounting, 1)
    }

    /// Selects the encoder at this angle.
    fn sample(encoder: &mut Encoder, angle_rad: f64) -> bool {
        let count = count_at(encoder.mounting, angle_rad);
        encoder.select(0.0, count, count)
    }

    #[test]
    fn frames_worked_by_hand() {
        // 0xabc << 2 = 10 1010 1111 0000: ones at 13 11 9 7 5, five, so K1 = 0; at 6 4, two, so K0 = 1.
        assert_eq!(amt22_frame(0xabc), 0x6af0);
        assert_eq!(amt22_frame(0), 0xc000);
        // 0x123 = 0001 0010 0011, OCF = 1, no other status: five ones, parity 1.
        assert_eq!(as5045_frame(0x123, false), 0b00_0100_1000_1110_0001);
        assert_eq!(as5045_frame(0, false), 0b00_0000_0000_0010_0001);
    }

    #[test]
    fn a_quarter_turn_is_1024_counts_and_wraps() {
        let mut mounting = EncoderMounting { part: EncoderPart::Amt22, count_at_zero: 3500, reversed: false };
        assert_eq!(count_at(mounting, TAU / 4.0), (3500 + 1024) % 4096);
        mounting.reversed = true;
        assert_eq!(count_at(mounting, TAU / 4.0), 3500 - 1024);
        assert_eq!(count_at(mounting, -3.0 * TAU), 3500);
    }

    #[test]
    fn two_bytes_make_a_frame_and_short_waits_are_errors() {
        let mut encoder = amt22(0xabc);
        sample(&mut encoder, 0.0);
        assert_eq!(encoder.exchange(8, 3.0e-6, 9.0e-6, MODE0), Ok(0x6a));
        assert_eq!(encoder.exchange(8, 11.5e-6, 17.5e-6, MODE0), Ok(0xf0));
        assert_eq!(encoder.deselect(20.5e-6), Ok(()));
        sample(&mut encoder, 0.0);
        assert!(encoder.exchange(8, 2.9e-6, 9.0e-6, MODE0).is_err(), "2.9 us behind chip select");
        sample(&mut encoder, 0.0);
        encoder.exchange(8, 3.0e-6, 9.0e-6, MODE0).expect("first byte");
        assert!(encoder.exchange(8, 11.4e-6, 17.4e-6, MODE0).is_err(), "2.4 us between bytes");
        assert!(encoder.deselect(11.9e-6).is_err(), "2.9 us to the release");
        sample(&mut encoder, 0.0);
        assert!(encoder.exchange(8, 3.0e-6, 6.0e-6, MODE0).is_err(), "2.67 MHz");
        sample(&mut encoder, 0.0);
        let mode1 = ClockMode { second_edge: true, ..MODE0 };
        assert!(encoder.exchange(8, 3.0e-6, 9.0e-6, mode1).is_err());
    }

    #[test]
    fn three_bytes_of_an_as5045_hold_its_frame_behind_a_leading_one() {
        let mounting = EncoderMounting { part: EncoderPart::As5045, count_at_zero: 0x123, reversed: false };
        let mut encoder = Encoder::new("joint encoder", mounting, 1);
        let mode2 = ClockMode { idle_high: true, ..MODE0 };
        sample(&mut encoder, 0.0);
        let bytes: Vec<u16> = (0..3)
            .map(|k| {
                let start = 1e-6 + 13e-6 * f64::from(k);
                encoder.exchange(8, start, start + 12e-6, mode2).expect("in time")
            })
            .collect();
        // 1, then 0001 0010 0011 10 0001 of the frame, then ones: the line idles high.
        assert_eq!(bytes, [0b1000_1001, 0b0001_1100, 0b0011_1111]);
        sample(&mut encoder, 0.0);
        for wrong in
            [MODE0, ClockMode { second_edge: true, ..MODE0 }, ClockMode { second_edge: true, ..mode2 }]
        {
            assert!(encoder.exchange(8, 1e-6, 13e-6, wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn faults_change_the_frame() {
        let mut encoder = amt22(0);
        encoder.fault.stuck_at = Some(77);
        sample(&mut encoder, 1.0);
        assert_eq!(encoder.shift >> 16, u32::from(amt22_frame(77)));
        encoder.fault = EncoderFault { jump: 5, ..EncoderFault::default() };
        sample(&mut encoder, 0.0);
        assert_eq!(encoder.shift >> 16, u32::from(amt22_frame(5)));
        encoder.fault = EncoderFault { silent: true, ..EncoderFault::default() };
        sample(&mut encoder, 0.0);
        assert_eq!(encoder.exchange(8, 3.0e-6, 9.0e-6, MODE0), Ok(0xff));
        encoder.fault = EncoderFault { last_bit: true, ..EncoderFault::default() };
        sample(&mut encoder, 0.0);
        assert_eq!(encoder.shift >> 16, u32::from(amt22_frame(0)) ^ 1);
        encoder.fault = EncoderFault { bit_error: 0.5, ..EncoderFault::default() };
        sample(&mut encoder, 0.0);
        assert_ne!(encoder.shift >> 16, u32::from(amt22_frame(0)));
    }

    #[test]
    fn a_frame_counts_as_altered_where_its_bits_differ() {
        let mut encoder = amt22(100);
        assert!(!sample(&mut encoder, 0.3));
        encoder.fault.stuck_at = Some(100);
        assert!(!sample(&mut encoder, 0.0), "it stands where it is");
        assert!(sample(&mut encoder, 0.3));
        encoder.fault = EncoderFault { lost: 0.5, ..EncoderFault::default() };
        let lost = (0..1000).filter(|_| sample(&mut encoder, 0.3)).count();
        // Half of them, with a standard deviation of 16.
        assert!((420..580).contains(&lost), "{lost}");
    }

    #[test]
    fn a_late_count_is_that_of_so_many_frames_before() {
        let mut encoder = amt22(0);
        encoder.set_late(2);
        let mut shown = Vec::new();
        for count in 10..16 {
            encoder.select(0.0, count, count);
            shown.push(encoder.shift >> 18 & 0xfff);
        }
        assert_eq!(shown, [10, 10, 10, 11, 12, 13]);
    }
}
