//! Play in front of and behind the tendons: the input pulley leads by half of each gap towards the torque that it passes on,
//! `θ = (g_t s(T_in) + (r2/r1) g_j s(T_out))/2`, rad at the input pulley.
//!
//! `s` is the smooth sign of a torque. The caller says which torque the gap is to pass on, best the one that the motion asks
//! for: a torque that is measured inside the gap is zero.

use super::shape::SmoothSign;
use crate::compensator::LagAngles;
use crate::parameters::Parameters;
use crate::scale::{Angle, Quantity, Torque};

/// Play of transmission and joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backlash {
    sign: SmoothSign<Torque>,
    /// Half of each gap at the input pulley; 0 while it is switched off.
    transmission: Angle,
    joint: Angle,
}

impl Backlash {
    /// The play of these parameters; `None` if a value is beyond what fixed point holds.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Option<Self> {
        let own = &parameters.correction.backlash;
        let half = |gap: f32| Angle::from_f32(own.enable * (0.5 * gap).min(own.limit));
        Some(Self {
            sign: SmoothSign::new(own.torque_width)?,
            transmission: half(own.transmission_gap),
            joint: half(LagAngles::new(parameters).ratio * own.joint_gap),
        })
    }

    /// Angle by which the input pulley leads, for the torques that the input pulley and the joint are to pass on.
    #[must_use]
    #[inline]
    pub fn lead(&self, torque_in: Torque, torque_out: Torque) -> Angle {
        let mut lead = Angle::ZERO;
        if self.transmission != Angle::ZERO {
            lead = self.sign.of(torque_in).of(self.transmission);
        }
        if self.joint != Angle::ZERO {
            lead = lead.plus(self.sign.of(torque_out).of(self.joint));
        }
        lead
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lead_by_hand() {
        let mut parameters = Parameters::default();
        parameters.pulley.output_radius = 0.03;
        let own = &mut parameters.correction.backlash;
        (own.enable, own.transmission_gap, own.joint_gap) = (1.0, 0.02, 0.01);
        (own.torque_width, own.limit) = (0.1, 0.05);
        let backlash = Backlash::new(&parameters).unwrap();
        let lead = |torque_in: f32, torque_out: f32| {
            backlash.lead(Torque::from_f32(torque_in), Torque::from_f32(torque_out)).to_f32()
        };
        // Half of 20 mrad, and half of 10 mrad by the ratio of the radii, 2; half of the width gives 0.6875.
        for (torque_in, torque_out, expected) in [
            (0.3, 0.3, 0.02),
            (0.3, -0.3, 0.0),
            (-0.05, 0.0, -0.006_875),
            (0.0, 0.05, 0.006_875),
            (0.0, 0.0, 0.0),
        ] {
            assert!((lead(torque_in, torque_out) - expected).abs() < 3e-6, "{torque_in} {torque_out}");
        }
        parameters.correction.backlash.limit = 0.004;
        let limited = Backlash::new(&parameters).unwrap();
        assert!((limited.lead(Torque::MAX, Torque::MAX).to_f32() - 0.008).abs() < 3e-6);
        parameters.correction.backlash.enable = 0.0;
        assert_eq!(Backlash::new(&parameters).unwrap().lead(Torque::MAX, Torque::MAX), Angle::ZERO);
    }
}
