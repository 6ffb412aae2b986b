//! Reference motions of a lab session; all start and end at rest at theta = 0.

use std::f64::consts::{PI, TAU};

use crate::draw::Draw;
use crate::effects::smooth_step;
use crate::error::BenchError;

/// Shape of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotionKind {
    /// Rest, one slow sine, multisine, triangle with random reversals, staircase: what a model is fitted to.
    Lab,
    /// Rest, multisine, triangle with random reversals, one sine: what a model is tested on.
    LabHeldout,
    /// Slow sine, 0.1 Hz.
    Sine,
    /// Ramps between random reversal points at constant random speeds.
    Triangle,
    /// Random levels, reached within 0.3 s and held.
    Staircase,
    /// Eight sines between 0.15 and 1.2 Hz with random phases.
    Multisine,
    /// Stays at 0.
    Rest,
}

impl MotionKind {
    /// All kinds with their names.
    pub const NAMES: [(&'static str, Self); 7] = [
        ("lab", Self::Lab),
        ("lab-heldout", Self::LabHeldout),
        ("sine", Self::Sine),
        ("triangle", Self::Triangle),
        ("staircase", Self::Staircase),
        ("multisine", Self::Multisine),
        ("rest", Self::Rest),
    ];

    /// The kind called `name`.
    ///
    /// # Errors
    /// [`BenchError::UnknownMotion`] with all names.
    pub fn from_name(name: &str) -> Result<Self, BenchError> {
        let found = Self::NAMES.iter().find(|(known, _)| *known == name);
        found.map(|(_, kind)| *kind).ok_or_else(|| BenchError::UnknownMotion {
            got: name.to_owned(),
            expected: Self::NAMES.map(|(known, _)| known).join(", "),
        })
    }
}

/// A reference for the input pulley.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Shape.
    pub kind: MotionKind,
    /// Length of the recording \[s\].
    pub duration_s: f64,
    /// Seed of amplitudes, speeds and phases.
    pub seed: u64,
    /// Largest reference angle \[rad\].
    pub amplitude_rad: f64,
    /// Age of the bench's effects when the recording begins \[s\]: a heldout recording made after a training recording
    /// of 40 s has 40, and what had happened by then (lost pretension, changed payload, drift, creep, sensors that warm up) stays so.
    pub clock_start_s: f64,
}

impl Motion {
    /// A motion of up to 0.75 rad that begins with fresh effects.
    pub fn new(kind: MotionKind, duration_s: f64, seed: u64) -> Self {
        Self { kind, duration_s, seed, amplitude_rad: 0.75, clock_start_s: 0.0 }
    }

    /// The same motion on a bench whose effects are `clock_start_s` old.
    #[must_use]
    pub fn starting_at(self, clock_start_s: f64) -> Self {
        Self { clock_start_s, ..self }
    }

    /// Whether the motion can be recorded.
    ///
    /// # Errors
    /// [`BenchError::Parameter`] naming the field.
    pub fn validate(&self) -> Result<(), BenchError> {
        if !(self.duration_s > 0.0 && self.duration_s <= 3_600.0) {
            return Err(BenchError::parameter("duration_s", self.duration_s, "above 0 and at most 3600 s"));
        }
        if !(self.amplitude_rad >= 0.0 && self.amplitude_rad <= PI) {
            return Err(BenchError::parameter("amplitude_rad", self.amplitude_rad, "0 to pi"));
        }
        if !(self.clock_start_s >= 0.0 && self.clock_start_s.is_finite()) {
            return Err(BenchError::parameter("clock_start_s", self.clock_start_s, "0 s or more"));
        }
        Ok(())
    }

    /// Reference angle \[rad\], one value a sample.
    pub fn reference_rad(&self, sample_rate_hz: f64) -> Vec<f64> {
        let samples = (self.duration_s * sample_rate_hz).round() as usize;
        let parts: &[(f64, Part)] = match self.kind {
            MotionKind::Lab => &[
                (0.04, Part::Rest),
                (0.31, Part::Sine { periods: 1.0 }),
                (0.58, Part::Multisine),
                (0.78, Part::Triangle),
                (1.0, Part::Staircase),
            ],
            MotionKind::LabHeldout => &[
                (0.05, Part::Rest),
                (0.40, Part::Multisine),
                (0.70, Part::Triangle),
                (1.0, Part::Sine { periods: 1.0 }),
            ],
            MotionKind::Sine => {
                let periods = (0.1 * self.duration_s).round().max(1.0);
                return self.fill(samples, sample_rate_hz, &[(1.0, Part::Sine { periods })]);
            }
            MotionKind::Triangle => &[(1.0, Part::Triangle)],
            MotionKind::Staircase => &[(1.0, Part::Staircase)],
            MotionKind::Multisine => &[(1.0, Part::Multisine)],
            MotionKind::Rest => &[(1.0, Part::Rest)],
        };
        self.fill(samples, sample_rate_hz, parts)
    }

    fn fill(&self, samples: usize, sample_rate_hz: f64, parts: &[(f64, Part)]) -> Vec<f64> {
        let mut reference = vec![0.0; samples];
        let mut draw = Draw::new(self.seed, "motion");
        let mut from = 0;
        for (end_share, part) in parts {
            let to = ((end_share * samples as f64).round() as usize).clamp(from, samples);
            part.write(&mut reference[from..to], sample_rate_hz, self.amplitude_rad, &mut draw);
            from = to;
        }
        reference
    }
}

/// One stretch of a motion.
#[derive(Debug, Clone, Copy)]
enum Part {
    Rest,
    Sine { periods: f64 },
    Multisine,
    Triangle,
    Staircase,
}

impl Part {
    fn write(self, out: &mut [f64], rate_hz: f64, amplitude_rad: f64, draw: &mut Draw) {
        match self {
            Self::Rest => out.fill(0.0),
            Self::Sine { periods } => {
                let peak = amplitude_rad * draw.uniform(0.73, 1.0);
                let samples = out.len() as f64;
                for (k, value) in out.iter_mut().enumerate() {
                    *value = peak * (TAU * periods * k as f64 / samples).sin();
                }
            }
            Self::Multisine => multisine(out, rate_hz, amplitude_rad, draw),
            Self::Triangle => triangle(out, rate_hz, amplitude_rad, draw),
            Self::Staircase => staircase(out, rate_hz, amplitude_rad, draw),
        }
    }
}

/// Fades the last `seconds` to 0 and, if asked, the first as well.
fn fade(out: &mut [f64], rate_hz: f64, seconds: f64, at_start: bool) {
    let samples = out.len();
    let ramp = (seconds * rate_hz).min(0.4 * samples as f64).max(1.0);
    for (k, value) in out.iter_mut().enumerate() {
        let left = (samples - k) as f64 / ramp;
        let begun = if at_start { k as f64 / ramp } else { 1.0 };
        *value *= smooth_step(left) * smooth_step(begun);
    }
}

fn multisine(out: &mut [f64], rate_hz: f64, amplitude_rad: f64, draw: &mut Draw) {
    let tones: Vec<(f64, f64, f64)> = (0..8)
        .map(|_| {
            let frequency_hz = draw.uniform(0.15, 1.2);
            (TAU * frequency_hz / rate_hz, draw.uniform(-PI, PI), draw.uniform(0.4, 1.0))
        })
        .collect();
    for (k, value) in out.iter_mut().enumerate() {
        *value = tones.iter().map(|(step, phase, weight)| weight * (step * k as f64 + phase).sin()).sum();
    }
    fade(out, rate_hz, 0.8, true);
    let peak = out.iter().fold(0.0_f64, |peak, value| peak.max(value.abs()));
    let scale = if peak > 0.0 { amplitude_rad * draw.uniform(0.5, 0.95) / peak } else { 0.0 };
    for value in out.iter_mut() {
        *value *= scale;
    }
}

fn triangle(out: &mut [f64], rate_hz: f64, amplitude_rad: f64, draw: &mut Draw) {
    let mut side = draw.sign();
    let next = |side: f64, draw: &mut Draw| {
        let target = side * amplitude_rad * draw.uniform(0.25, 0.9);
        // Speeds spread evenly on a logarithmic scale, so that slow sliding is seen as often as fast.
        let speed = draw.uniform(0.18_f64.ln(), 1.4_f64.ln()).exp();
        (target, speed / rate_hz)
    };
    let (mut target, mut step) = next(side, draw);
    let mut angle = 0.0;
    for value in out.iter_mut() {
        let left = target - angle;
        if f64::abs(left) <= step {
            angle = target;
            side = -side;
            (target, step) = next(side, draw);
        } else {
            angle += step * f64::signum(left);
        }
        *value = angle;
    }
    fade(out, rate_hz, 0.6, false);
}

fn staircase(out: &mut [f64], rate_hz: f64, amplitude_rad: f64, draw: &mut Draw) {
    let (mut from, mut to) = (0.0, 0.0);
    let (mut since_s, mut hold_s) = (1.0, 0.0);
    for value in out.iter_mut() {
        if since_s > hold_s {
            from = to;
            to = amplitude_rad * draw.uniform(-0.9, 0.9);
            hold_s = draw.uniform(0.8, 1.3);
            since_s = 0.0;
        }
        *value = from + (to - from) * 0.5 * (1.0 - (PI * f64::min(since_s / 0.3, 1.0)).cos());
        since_s += 1.0 / rate_hz;
    }
    fade(out, rate_hz, 0.6, false);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_motion_starts_and_ends_at_rest_within_its_amplitude() {
        for (name, kind) in MotionKind::NAMES {
            let reference = Motion::new(kind, 20.0, 5).reference_rad(1_000.0);
            assert_eq!(reference.len(), 20_000);
            assert!(reference[0].abs() < 2e-3, "{name} starts at {}", reference[0]);
            assert!(reference[19_999].abs() < 2e-3, "{name} ends at {}", reference[19_999]);
            assert!(reference.iter().all(|angle| angle.abs() <= 0.75), "{name} leaves its amplitude");
            let moved = reference.iter().fold(0.0_f64, |peak, angle| peak.max(angle.abs()));
            assert!(moved > 0.3 || kind == MotionKind::Rest, "{name} hardly moves: {moved} rad");
        }
    }

    #[test]
    fn the_triangle_reverses_at_differing_amplitudes() {
        let reference = Motion::new(MotionKind::Triangle, 40.0, 8).reference_rad(1_000.0);
        let turns: Vec<f64> = reference
            .windows(3)
            .filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0)
            .map(|w| w[1].abs())
            .collect();
        assert!(turns.len() >= 8, "only {} reversals", turns.len());
        let (low, high) = turns.iter().fold((9.0_f64, 0.0_f64), |(l, h), t| (l.min(*t), h.max(*t)));
        assert!(high - low > 0.2, "reversals all lie between {low} and {high} rad");
    }
}
