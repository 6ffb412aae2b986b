//! A look at all sensors over some ticks with the bridge off.

use bowden_link::Fault;

use super::{Situation, SupervisorConfig};
use crate::detection::Detection;
use crate::scale::{Quantity, Tension};

/// Counts by which an encoder may move in a look: noise of its last bit.
const STILL_COUNTS: u32 = 2;

/// Sums of a look.
#[derive(Clone, Copy, Debug, Default)]
pub struct RestLook {
    ticks: u16,
    first_raw: [u16; 4],
    sum_raw: [i32; 4],
    squares_raw: [u64; 4],
    tension_bits: [i64; 4],
    current_bits: i64,
    /// Least and largest count of either encoder.
    lowest: [i32; 2],
    highest: [i32; 2],
}

/// What a look showed.
#[derive(Clone, Copy, Debug)]
pub struct RestVerdict {
    /// The first sensor that is not as it should be at rest: 0 to 3 for f1 to f4, 4 and 5 for the encoders at the input
    /// pulley and the joint, 6 for the current.
    pub restless: Option<usize>,
    tension_bits: [i64; 4],
    ticks: u16,
}

impl RestLook {
    /// Takes a tick; the verdict with the last one of the look.
    pub fn look(&mut self, config: &SupervisorConfig, situation: &Situation) -> Option<RestVerdict> {
        if self.ticks == 0 {
            self.first_raw = situation.tension_raw;
            self.lowest = situation.counts;
            self.highest = situation.counts;
        }
        self.ticks += 1;
        for n in 0..4 {
            let deviation = i32::from(situation.tension_raw[n]) - i32::from(self.first_raw[n]);
            self.sum_raw[n] = self.sum_raw[n].saturating_add(deviation);
            self.squares_raw[n] += u64::from(deviation.unsigned_abs()) * u64::from(deviation.unsigned_abs());
            self.tension_bits[n] += i64::from(situation.tensions[n].to_bits());
        }
        for n in 0..2 {
            self.lowest[n] = self.lowest[n].min(situation.counts[n]);
            self.highest[n] = self.highest[n].max(situation.counts[n]);
        }
        self.current_bits += i64::from(situation.current.to_bits());
        (self.ticks >= config.rest_ticks).then(|| RestVerdict {
            restless: self.restless(config),
            tension_bits: self.tension_bits,
            ticks: self.ticks,
        })
    }

    fn restless(&self, config: &SupervisorConfig) -> Option<usize> {
        let ticks = u64::from(self.ticks);
        for n in (0..4).filter(|n| config.fitted.has(*n)) {
            // n² times the variance: n Σd² − (Σd)². A look has 20 000 ticks at most and a code 12 bits: below 2^53.
            let sum = u64::from(self.sum_raw[n].unsigned_abs());
            let spread = (ticks * self.squares_raw[n]).saturating_sub(sum * sum);
            let limit = (ticks * ticks * u64::from(config.noise_limit[n])) >> 8;
            if spread == 0 || spread > limit {
                return Some(n);
            }
        }
        for n in 0..2 {
            if self.highest[n].abs_diff(self.lowest[n]) > STILL_COUNTS {
                return Some(4 + n);
            }
        }
        let limit = i64::from(config.rest_current.to_bits()) * i64::from(self.ticks);
        (self.current_bits.abs() > limit).then_some(6)
    }
}

impl RestVerdict {
    /// Whether the mean over all tensions that are measured, which stretch and friction leave at F0 (within 2 % at mu K = 0.4), is not
    /// the pretension. The channel named is the one that is farthest off.
    #[must_use]
    pub fn pretension_off(&self, config: &SupervisorConfig) -> Option<Detection> {
        let ticks = i64::from(self.ticks);
        let there = || (0..4).filter(|n| config.fitted.has(*n));
        let channels: i64 = there().map(|_| 1).sum();
        if channels == 0 {
            return None;
        }
        let sum: i64 = there().map(|n| self.tension_bits[n]).sum();
        let wanted = i64::from(config.pretension.to_bits());
        let band = i64::from(config.pretension_band.to_bits()) * channels * ticks;
        let excess = sum - wanted * channels * ticks;
        if excess.abs() <= band {
            return None;
        }
        let distance = |n: &usize| (self.tension_bits[*n] - wanted * ticks).abs();
        let farthest = there().max_by_key(distance).unwrap_or(0);
        let limit = if excess < 0 {
            config.pretension.minus(config.pretension_band)
        } else {
            config.pretension.plus(config.pretension_band)
        };
        // A look is 1 s at most, 20 000 ticks, so the mean fits.
        let mean = Tension::from_bits((sum / (channels * ticks.max(1))) as i32);
        Some(Detection::new(Fault::PretensionOff, farthest, mean.to_f32(), limit.to_f32()))
    }
}
