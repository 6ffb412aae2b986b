//! Random references: all forms, amplitudes, frequencies and offsets, holds, and streams with steps.

use bowden_control::parameters::{Parameters, Quantity, check_reference};
use bowden_link::message::{Mode, Reference, Shape};

/// Xorshift generator.
pub struct Random(pub u64);

impl Random {
    /// 0 to 1.
    pub fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Evenly in the logarithm.
    fn spread(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.uniform())
    }
}

/// A reference, and the points of a stream.
pub struct Case {
    pub reference: Reference,
    pub points: Vec<f32>,
    /// Whether the reference that was drawn at first was refused; this one is the largest that is not.
    pub refused: bool,
}

/// A reference that the joint can do: as drawn, or with the largest amplitude that is not refused; `None` for one that is
/// refused for another reason.
pub fn draw(random: &mut Random, parameters: &Parameters, mode: Mode, seconds: f64) -> Option<Case> {
    /// Well beyond what any joint here can do.
    const LARGEST: f64 = 1.5;
    let shape =
        [Shape::Sine, Shape::Triangle, Shape::Multisine, Shape::Staircase][(random.uniform() * 4.0) as usize];
    let amplitude = random.spread(0.01, LARGEST) as f32;
    let offset = random.between(-LARGEST, LARGEST) as f32;
    let frequency_hz = random.spread(0.05, 150.0) as f32;
    let generated = |offset| Reference::Generated { shape, amplitude, offset, frequency_hz };
    let mut points = Vec::new();
    let mut reference = match (random.uniform() * 8.0) as u32 {
        0 => Reference::Hold(offset),
        1 => {
            points = stream(random, parameters, LARGEST, seconds);
            Reference::Stream
        }
        2..=4 => generated(0.0),
        _ => generated(0.6 * offset),
    };
    let refused = check_reference(parameters, mode, reference);
    if let Err(unreachable) = refused {
        let (Quantity::Amplitude, Reference::Generated { amplitude, .. }) =
            (unreachable.quantity, &mut reference)
        else {
            return None;
        };
        assert!(amplitude.abs() > unreachable.maximum);
        *amplitude = unreachable.maximum;
        assert_eq!(check_reference(parameters, mode, reference), Ok(()));
    }
    Some(Case { reference, points, refused: refused.is_err() })
}

/// Steps, slopes and rests, also beyond the range.
fn stream(random: &mut Random, parameters: &Parameters, largest: f64, seconds: f64) -> Vec<f32> {
    let rate_hz = f64::from(parameters.reference.stream_rate);
    let (mut value, mut slope) = (0.0, 0.0);
    let mut next = || {
        match (random.uniform() * 1000.0) as u32 {
            0..=3 => value = random.between(-largest, largest),
            4..=7 => slope = random.between(-10.0, 10.0) / rate_hz,
            8..=11 => slope = 0.0,
            _ => {}
        }
        value = f64::clamp(value + slope, -largest, largest);
        value as f32
    };
    (0..(seconds * rate_hz) as usize).map(|_| next()).collect()
}
