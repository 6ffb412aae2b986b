//! Friction of the gear that grows with the torque it carries: `τ = s c |T_in|`, N·m at the input pulley, added to the torque
//! of the motor.
//!
//! `s` is the smooth sign of the speed, `T_in = (F1 - F3) r1` the measured torque of the tendons.

use crate::parameters::Parameters;
use crate::scale::{Gain, Quantity, Share, Torque};

/// Friction of the gear that grows with the torque it carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GearFriction {
    coefficient: Gain<Torque, Torque>,
    /// 0 while it is switched off.
    limit: Torque,
}

impl GearFriction {
    /// The friction of these parameters; `None` if a value is beyond what fixed point holds.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Option<Self> {
        let own = &parameters.correction.gear_friction;
        Some(Self {
            coefficient: Gain::new(own.coefficient)?,
            limit: Torque::from_f32(own.enable * own.limit),
        })
    }

    /// Torque that makes up for the friction in a direction, where the gear carries `carried`.
    #[must_use]
    #[inline]
    pub fn torque(&self, direction: Share, carried: Torque) -> Torque {
        if self.limit == Torque::ZERO {
            return Torque::ZERO;
        }
        direction.of(self.coefficient.apply(carried.magnitude())).limited(self.limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_by_hand() {
        let mut parameters = Parameters::default();
        let own = &mut parameters.correction.gear_friction;
        (own.enable, own.coefficient, own.limit) = (1.0, 0.25, 0.2);
        let friction = GearFriction::new(&parameters).unwrap();
        let torque = |direction: f32, carried: f32| {
            friction.torque(Share::from_f32(direction), Torque::from_f32(carried)).to_f32()
        };
        // Whatever the sign of the torque, friction follows that of the motion.
        for (direction, carried, expected) in [
            (1.0, 0.4, 0.1),
            (1.0, -0.4, 0.1),
            (-1.0, 0.4, -0.1),
            (0.5, 0.4, 0.05),
            (1.0, 2.0, 0.2),
            (1.0, 0.0, 0.0),
        ] {
            assert!((torque(direction, carried) - expected).abs() < 2e-6, "{direction} {carried}");
        }
        parameters.correction.gear_friction.enable = 0.0;
        let off = GearFriction::new(&parameters).unwrap();
        assert_eq!(off.torque(Share::ONE, Torque::MAX), Torque::ZERO);
    }
}
