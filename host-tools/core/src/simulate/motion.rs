//! Built-in references of the input pulley. Each begins and ends at rest at 0.
//!
//! What each is for: a slow sine shows friction loops, a multisine dynamics, ramps the dependence on speed and
//! reversals at many amplitudes, a staircase rest after motion and creep. `lab` has all of them in turn.

use std::f64::consts::{PI, TAU};

use rand_distr::{Distribution, Uniform};
use rand_pcg::Pcg64;

/// Largest angle of the built-in motions, rad.
pub const AMPLITUDE_RAD: f64 = 0.75;

/// Period of the slow sine, s; shortened so that a whole number of periods fits.
const SINE_PERIOD_S: f64 = 10.0;

/// Tones of the multisine and the range they span in equal ratios, Hz.
const TONES: usize = 7;
const TONES_HZ: [f64; 2] = [0.15, 1.3];

/// Slowest and fastest ramp, rad/s, and range of their turning points as a share of the amplitude.
const RAMP_RAD_S: [f64; 2] = [0.15, 1.5];
const RAMP_PEAK: [f64; 2] = [0.2, 0.95];

/// Time of a stair's rise, s, and range of the time that a level is held, s.
const RISE_S: f64 = 0.35;
const HOLD_S: [f64; 2] = [0.7, 1.4];

/// Time over which a motion fades in and out, s; at most a quarter of the motion.
const FADE_S: f64 = 0.7;

/// A built-in motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Rest, slow sine, multisine, ramps and staircase, one after the other
    Lab,
    /// Slow sine
    Sine,
    /// Ramps of constant, random speed between random turning points
    Triangle,
    /// Tones between 0.15 and 1.3 Hz with random phases
    Multisine,
    /// Random levels, each reached smoothly and held
    Staircase,
    /// No motion
    Rest,
}

impl Motion {
    /// Reference angle, rad, one value a sample; equal arguments give equal values.
    #[must_use]
    pub fn reference_rad(self, seconds: f64, rate_hz: f64, seed: u64) -> Vec<f64> {
        // Motions of the same seed share nothing with the sensors' noise: another stream of the generator.
        let mut random = Random(Pcg64::new(u128::from(seed), 0x6d6f_7469_6f6e));
        let samples = ((seconds * rate_hz).round() as usize).max(1);
        let parts: &[(Self, f64)] = match self {
            Self::Lab => &[
                (Self::Rest, 0.03),
                (Self::Sine, 0.25),
                (Self::Multisine, 0.27),
                (Self::Triangle, 0.25),
                (Self::Staircase, 0.20),
            ],
            _ => &[(self, 1.0)],
        };
        let mut reference = vec![0.0; samples];
        let (mut from, mut share) = (0, 0.0);
        for (part, length) in parts {
            share += length;
            let to = ((share * samples as f64).round() as usize).clamp(from, samples);
            part.fill(&mut reference[from..to], rate_hz, &mut random);
            from = to;
        }
        reference
    }

    fn fill(self, out: &mut [f64], rate_hz: f64, random: &mut Random) {
        let seconds = out.len() as f64 / rate_hz;
        match self {
            Self::Rest | Self::Lab => {}
            Self::Sine => {
                let periods = (seconds / SINE_PERIOD_S).ceil();
                let peak = AMPLITUDE_RAD * random.between([0.75, 1.0]);
                let per_sample = TAU * periods / out.len() as f64;
                for (k, value) in out.iter_mut().enumerate() {
                    *value = peak * (per_sample * k as f64).sin();
                }
            }
            Self::Multisine => multisine(out, rate_hz, random),
            Self::Triangle => ramps(out, rate_hz, random),
            Self::Staircase => staircase(out, rate_hz, random),
        }
    }
}

/// Random draws of a motion.
struct Random(Pcg64);

impl Random {
    fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        // Only an empty range is refused, and every range here is a constant.
        Uniform::new(low, high).map_or(low, |range| range.sample(&mut self.0))
    }
}

/// 0 to 1 without a jump of speed, over `share` 0 to 1.
fn smooth(share: f64) -> f64 {
    0.5 - 0.5 * (PI * share.clamp(0.0, 1.0)).cos()
}

fn fade(out: &mut [f64], rate_hz: f64) {
    let samples = out.len();
    let over = (FADE_S * rate_hz).min(0.25 * samples as f64).max(1.0);
    for (k, value) in out.iter_mut().enumerate() {
        *value *= smooth(k as f64 / over) * smooth((samples - 1 - k) as f64 / over);
    }
}

fn multisine(out: &mut [f64], rate_hz: f64, random: &mut Random) {
    let [lowest, highest] = TONES_HZ;
    let ratio = (highest / lowest).powf(1.0 / (TONES - 1) as f64);
    let tones: Vec<(f64, f64)> = (0..TONES)
        .map(|tone| (TAU * lowest * ratio.powf(tone as f64) / rate_hz, random.between([0.0, TAU])))
        .collect();
    for (k, value) in out.iter_mut().enumerate() {
        *value = tones.iter().map(|(per_sample, phase)| (per_sample * k as f64 + phase).sin()).sum();
    }
    fade(out, rate_hz);
    let peak = out.iter().fold(0.0_f64, |peak, value| peak.max(value.abs()));
    let scale = AMPLITUDE_RAD * random.between([0.6, 0.95]) / peak.max(f64::MIN_POSITIVE);
    for value in out.iter_mut() {
        *value *= scale;
    }
}

fn ramps(out: &mut [f64], rate_hz: f64, random: &mut Random) {
    let mut side = 1.0;
    let mut draw = |side: f64| {
        let peak = side * AMPLITUDE_RAD * random.between(RAMP_PEAK);
        // Speeds even on a logarithmic scale: slow sliding is seen as often as fast.
        let speed = random.between(RAMP_RAD_S.map(f64::ln)).exp();
        (peak, speed / rate_hz)
    };
    let (mut peak, mut per_sample) = draw(side);
    let mut angle = 0.0;
    for value in out.iter_mut() {
        *value = angle;
        let left = peak - angle;
        if f64::abs(left) > per_sample {
            angle += per_sample * f64::signum(left);
        } else {
            angle = peak;
            side = -side;
            (peak, per_sample) = draw(side);
        }
    }
    fade(out, rate_hz);
}

fn staircase(out: &mut [f64], rate_hz: f64, random: &mut Random) {
    let (mut from, mut to) = (0.0, 0.0);
    let (mut since_s, mut level_s) = (0.0, 0.0);
    for value in out.iter_mut() {
        if since_s >= level_s {
            from = to;
            to = AMPLITUDE_RAD * random.between([-0.9, 0.9]);
            (since_s, level_s) = (0.0, RISE_S + random.between(HOLD_S));
        }
        *value = from + (to - from) * smooth(since_s / RISE_S);
        since_s += 1.0 / rate_hz;
    }
    fade(out, rate_hz);
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOVING: [Motion; 5] =
        [Motion::Lab, Motion::Sine, Motion::Triangle, Motion::Multisine, Motion::Staircase];

    #[test]
    fn every_motion_starts_and_ends_at_zero_and_uses_its_range() {
        for motion in MOVING {
            for seconds in [8.0, 40.0] {
                let reference = motion.reference_rad(seconds, 1000.0, 3);
                assert_eq!(reference.len(), (seconds * 1000.0) as usize);
                let (first, last) = (reference[0], reference[reference.len() - 1]);
                // One sample of the sine at 0.1 Hz moves by 0.75 · 2π · 0.1 / 1000 = 0.0005 rad.
                assert!(first.abs() < 1e-9 && last.abs() < 1e-3, "{motion:?}: {first} to {last}");
                let peak = reference.iter().fold(0.0_f64, |peak, value| peak.max(value.abs()));
                assert!(peak > 0.3 && peak <= AMPLITUDE_RAD, "{motion:?} reaches {peak} rad");
            }
        }
        assert!(Motion::Rest.reference_rad(2.0, 1000.0, 3).iter().all(|value| *value == 0.0));
    }

    #[test]
    fn no_motion_jumps() {
        // Fastest: a stair of 1.8 · 0.75 rad in 0.35 s peaks at π/2 times its mean speed, 6.1 rad/s.
        for motion in MOVING {
            let reference = motion.reference_rad(40.0, 1000.0, 11);
            let fastest = reference.windows(2).map(|w| (w[1] - w[0]).abs() * 1000.0).fold(0.0, f64::max);
            assert!(fastest < 6.2, "{motion:?} moves at {fastest} rad/s");
        }
    }

    #[test]
    fn the_seed_decides() {
        let reference = |seed| Motion::Lab.reference_rad(10.0, 1000.0, seed);
        assert_eq!(reference(4), reference(4));
        assert_ne!(reference(4), reference(5));
    }
}
