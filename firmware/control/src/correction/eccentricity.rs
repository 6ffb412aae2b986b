//! An encoder disc off its axis: it shows `y = θ + A (sin(θ + φ) - sin φ)`, rad; the angle taken is
//! `θ = y - A (sin(y + φ) - sin φ)`.
//!
//! What is left is at most `2 A²`: 0.2 mrad for the 10 mrad of a disc that is off by a hundredth of its radius, where a count
//! is 1.5 mrad. Counts in the telemetry stay as the encoder shows them.

use super::shape::Harmonic;
use crate::parameters::{EccentricityParameters, Parameters};
use crate::scale::{Angle, Quantity};

/// Eccentricity of an encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eccentricity {
    /// 0 while it is switched off.
    amplitude: Angle,
    harmonic: Harmonic,
    /// Error at angle zero, `A sin φ`.
    at_zero: Angle,
}

impl Eccentricity {
    fn new(own: &EccentricityParameters) -> Self {
        let amplitude = Angle::from_f32(own.enable * own.amplitude.clamp(-own.limit, own.limit));
        let harmonic = Harmonic::new(1.0, own.phase);
        Self { amplitude, harmonic, at_zero: harmonic.sine(Angle::ZERO).of(amplitude) }
    }

    /// Those of the encoders at the input pulley and at the joint.
    #[must_use]
    pub fn of_both(parameters: &Parameters) -> [Self; 2] {
        let own = &parameters.correction;
        [Self::new(&own.input_encoder), Self::new(&own.joint_encoder)]
    }

    /// The angle behind the one that is shown.
    #[must_use]
    #[inline]
    pub fn corrected(&self, shown: Angle) -> Angle {
        if self.amplitude == Angle::ZERO { shown } else { self.freed(shown) }
    }

    /// Out of line: the sine is long, and most encoders are centred.
    #[inline(never)]
    fn freed(&self, shown: Angle) -> Angle {
        shown.minus(self.harmonic.sine(shown).of(self.amplitude)).plus(self.at_zero)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    #[test]
    fn the_angle_behind_the_shown_one_is_found() {
        let mut parameters = Parameters::default();
        for amplitude in [0.01_f32, -0.03] {
            let own = &mut parameters.correction.joint_encoder;
            (own.enable, own.amplitude, own.phase, own.limit) = (1.0, amplitude, 2.0, 0.05);
            let [_, eccentricity] = Eccentricity::of_both(&parameters);
            let mut worst = 0.0_f64;
            for step in -700..700 {
                let angle = 0.01 * f64::from(step);
                let shown = angle + f64::from(amplitude) * ((angle + 2.0).sin() - 2.0_f64.sin());
                let got = f64::from(eccentricity.corrected(Angle::from_f32(shown as f32)).to_f32());
                worst = worst.max((got - angle).abs());
            }
            std::println!("{amplitude}: {worst}");
            assert!(worst < 2.0 * f64::from(amplitude).powi(2) + 3e-6, "{amplitude}: {worst}");
        }
        // By hand: at shown 1 rad, 1 - 0.02 (sin 3 - sin 2) = 1 - 0.02 (0.14112 - 0.909297), the limit being 0.02.
        parameters.correction.joint_encoder.amplitude = 0.05;
        parameters.correction.joint_encoder.limit = 0.02;
        let [input, joint] = Eccentricity::of_both(&parameters);
        assert!((joint.corrected(Angle::from_f32(1.0)).to_f32() - 1.015_363_5).abs() < 3e-6);
        assert_eq!(input.corrected(Angle::from_f32(1.0)), Angle::from_f32(1.0));
    }
}
