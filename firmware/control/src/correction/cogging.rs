//! Torque ripple that is locked to the motor: the motor makes `Σ A_k sin(n_k θ + φ_k)`, N·m at the input pulley, which is
//! taken off the torque that is asked of it.
//!
//! θ is the observed angle of the input pulley, `n_k` periods a turn of it, two harmonics.

use super::shape::Harmonic;
use crate::parameters::Parameters;
use crate::scale::{Angle, Quantity, Torque};

/// Torque ripple of the motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cogging {
    harmonics: [(Torque, Harmonic); 2],
    /// 0 while it is switched off.
    limit: Torque,
}

impl Cogging {
    /// The ripple of these parameters.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        let own = &parameters.correction.cogging;
        let harmonic =
            |amplitude, periods, phase| (Torque::from_f32(amplitude), Harmonic::new(periods, phase));
        Self {
            harmonics: [
                harmonic(own.amplitude_1, own.periods_1, own.phase_1),
                harmonic(own.amplitude_2, own.periods_2, own.phase_2),
            ],
            limit: Torque::from_f32(own.enable * own.limit),
        }
    }

    /// Torque that cancels the ripple at an angle.
    #[must_use]
    #[inline]
    pub fn torque(&self, angle: Angle) -> Torque {
        if self.limit == Torque::ZERO {
            return Torque::ZERO;
        }
        let mut ripple = Torque::ZERO;
        for (amplitude, harmonic) in self.harmonics {
            if amplitude != Torque::ZERO {
                ripple = ripple.plus(harmonic.sine(angle).of(amplitude));
            }
        }
        ripple.negated().limited(self.limit)
    }
}

#[cfg(test)]
mod tests {
    use core::f32::consts::{FRAC_PI_2, FRAC_PI_6};

    use super::*;

    #[test]
    fn torque_by_hand() {
        let mut parameters = Parameters::default();
        let own = &mut parameters.correction.cogging;
        (own.enable, own.limit) = (1.0, 0.35);
        (own.amplitude_1, own.periods_1, own.phase_1) = (0.2, 40.0, FRAC_PI_6);
        (own.amplitude_2, own.periods_2, own.phase_2) = (0.2, 80.0, FRAC_PI_2);
        let cogging = Cogging::new(&parameters);
        let torque = |angle: f32| cogging.torque(Angle::from_f32(angle)).to_f32();
        // At zero: 0.2 sin 30° + 0.2 sin 90° = 0.3. A sixth of a turn of the first on: 0.2 sin 90° + 0.2 sin 210° = 0.1.
        assert!((torque(0.0) + 0.3).abs() < 2e-6, "{}", torque(0.0));
        // The angle has steps of 2⁻²⁰ rad, of which 80 periods make 1.5e-5 N·m.
        assert!((torque(2.0 * FRAC_PI_6 / 40.0) + 0.1).abs() < 2e-5, "{}", torque(2.0 * FRAC_PI_6 / 40.0));
        // Half way both are beyond the limit: 0.2 (sin 60° + sin 150°) is 0.273; 0.2 sin 45° + 0.2 sin 120° = 0.3146.
        parameters.correction.cogging.limit = 0.25;
        assert!((Cogging::new(&parameters).torque(Angle::ZERO).to_f32() + 0.25).abs() < 2e-6);
        parameters.correction.cogging.enable = 0.0;
        assert_eq!(Cogging::new(&parameters).torque(Angle::ZERO), Torque::ZERO);
    }
}
