//! Dry friction of motor and gear: `τ = s (τ_c + 0.75 τ_e f(ω))`, N·m at the input pulley, added to the torque of the motor.
//!
//! `s` is the smooth sign of the speed, `f` the fade of the excess at low speed with exponent 2. Positive speed asks for a
//! positive torque. Of the excess only three quarters are made up for: it falls off as soon as the pulley moves, and all of
//! it would throw the pulley to and fro in slow motion.

use super::shape::Fade;
use crate::parameters::Parameters;
use crate::scale::{Quantity, Share, Speed, Torque};

/// Dry friction of motor and gear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorFriction {
    coulomb: Torque,
    excess: Torque,
    fade: Fade,
    /// 0 while it is switched off.
    limit: Torque,
}

impl MotorFriction {
    /// The friction of these parameters; `None` if a value is beyond what fixed point holds.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Option<Self> {
        /// Exponent of the fade.
        const EXPONENT: f32 = 2.0;
        /// Part of the excess that is made up for.
        const PART: f32 = 0.75;
        let own = &parameters.correction.motor_friction;
        Some(Self {
            coulomb: Torque::from_f32(own.coulomb),
            excess: Torque::from_f32(PART * own.excess),
            fade: Fade::new(own.speed, EXPONENT)?,
            limit: Torque::from_f32(own.enable * own.limit),
        })
    }

    /// Torque that makes up for the friction in a direction and at a speed.
    #[must_use]
    #[inline]
    pub fn torque(&self, direction: Share, speed: Speed) -> Torque {
        if self.limit == Torque::ZERO {
            return Torque::ZERO;
        }
        let level = self.coulomb.plus(self.fade.of(speed).of(self.excess));
        direction.of(level).limited(self.limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_by_hand() {
        let mut parameters = Parameters::default();
        let own = &mut parameters.correction.motor_friction;
        (own.enable, own.coulomb, own.excess, own.speed, own.limit) = (1.0, 0.1, 0.06, 0.2, 0.14);
        let friction = MotorFriction::new(&parameters).unwrap();
        let torque = |direction: f32, speed: f32| {
            friction.torque(Share::from_f32(direction), Speed::from_f32(speed)).to_f32()
        };
        // At 0.2 rad/s 37 % of the excess is left: 0.1 + 0.75 · 0.022073.
        assert!((torque(1.0, 0.2) - 0.116_555).abs() < 6e-6);
        assert!((torque(-0.5, -0.2) + 0.058_277).abs() < 4e-6);
        // At speed e^{-16} of it.
        assert!((torque(1.0, 1.0) - 0.1).abs() < 4e-6);
        // 0.145 N·m at standstill, of which 0.14 are allowed.
        assert_eq!(torque(1.0, 0.0), Torque::from_f32(0.14).to_f32());
        parameters.correction.motor_friction.enable = 0.0;
        let off = MotorFriction::new(&parameters).unwrap();
        assert_eq!(off.torque(Share::ONE, Speed::ZERO), Torque::ZERO);
    }
}
