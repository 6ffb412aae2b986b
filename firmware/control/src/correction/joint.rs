//! Dry friction and a spring at the joint: the cables have to carry `T = s τ_c + k (θ - θ_0)`, N·m at the joint, besides what
//! moves the load.
//!
//! In torque mode `T` is added to the torque that is asked for, with the measured angle. In position mode the compensator sees
//! the torque of the cables behind a low-pass; `T` of the desired motion goes round it, so that the stretch of the tendons is
//! there when the torque is: `theta_c += c T`, `c` the stretch at the input pulley a torque of Eq. (20).

use super::shape::SmoothSign;
use crate::compensator::{LagAngles, Source};
use crate::parameters::Parameters;
use crate::scale::{Angle, Gain, Quantity, Share, Speed, Torque};

/// Dry friction of the joint, `s τ_c`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointFriction {
    /// 0 while it is switched off.
    level: Torque,
}

impl JointFriction {
    fn new(parameters: &Parameters) -> Self {
        let own = &parameters.correction.joint_friction;
        Self { level: Torque::from_f32(own.enable * own.coulomb.min(own.limit)) }
    }
}

/// A spring that pulls the joint to a rest angle, `k (θ - θ_0)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSpring {
    stiffness: Gain<Angle, Torque>,
    rest: Angle,
    /// 0 while it is switched off.
    limit: Torque,
}

impl JointSpring {
    fn new(parameters: &Parameters) -> Option<Self> {
        let own = &parameters.correction.joint_spring;
        Some(Self {
            stiffness: Gain::new(own.stiffness)?,
            rest: Angle::from_f32(own.rest),
            limit: Torque::from_f32(own.enable * own.limit),
        })
    }
}

/// What the joint takes besides its load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointCorrection {
    /// Smooth sign of the desired speed of the joint.
    pub direction: SmoothSign<Speed>,
    friction: JointFriction,
    spring: JointSpring,
    /// Stretch at the input pulley; 0 where the compensator does not use the torque.
    stretch: Gain<Torque, Angle>,
}

impl JointCorrection {
    /// The correction of these parameters; `None` if a value is beyond what fixed point holds.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Option<Self> {
        let angles = LagAngles::new(parameters);
        let from_torque = Source::of(parameters) == Source::Torque;
        Some(Self {
            direction: SmoothSign::new(parameters.correction.reversal_speed / angles.ratio)?,
            friction: JointFriction::new(parameters),
            spring: JointSpring::new(parameters)?,
            stretch: if from_torque { Gain::new(angles.stretch_rad_per_nm)? } else { Gain::ZERO },
        })
    }

    /// Torque for the joint's own friction and spring, in a direction and at an angle.
    #[must_use]
    #[inline]
    pub fn torque(&self, direction: Share, theta_out: Angle) -> Torque {
        let friction = direction.of(self.friction.level);
        if self.spring.limit == Torque::ZERO {
            return friction;
        }
        let turned = self.spring.stiffness.apply(theta_out.minus(self.spring.rest));
        friction.plus(turned.limited(self.spring.limit))
    }

    /// The same in the direction of a speed.
    #[must_use]
    #[inline]
    pub fn torque_along(&self, speed: Speed, theta_out: Angle) -> Torque {
        if self.friction.level == Torque::ZERO && self.spring.limit == Torque::ZERO {
            return Torque::ZERO;
        }
        self.torque(self.direction.of(speed), theta_out)
    }

    /// Angle by which the input pulley has to lead for that torque.
    #[must_use]
    #[inline]
    pub fn stretch(&self, torque: Torque) -> Angle {
        if torque == Torque::ZERO { Angle::ZERO } else { self.stretch.apply(torque) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters() -> Parameters {
        let mut parameters = Parameters::default();
        let friction = &mut parameters.correction.joint_friction;
        (friction.enable, friction.coulomb, friction.limit) = (1.0, 0.08, 0.1);
        let spring = &mut parameters.correction.joint_spring;
        (spring.enable, spring.stiffness, spring.rest, spring.limit) = (1.0, 0.5, -0.2, 0.3);
        parameters
    }

    #[test]
    fn torque_by_hand() {
        let mut parameters = parameters();
        let joint = JointCorrection::new(&parameters).unwrap();
        let torque = |joint: &JointCorrection, direction: f32, angle: f32| {
            joint.torque(Share::from_f32(direction), Angle::from_f32(angle)).to_f32()
        };
        // 0.08 + 0.5 (0.3 + 0.2); at 0.6 rad the spring would be 0.4 N·m, of which 0.3 are allowed.
        for (direction, angle, expected) in
            [(1.0, 0.3, 0.33), (-1.0, 0.3, 0.17), (0.25, -0.2, 0.02), (1.0, 0.6, 0.38), (0.0, -1.0, -0.3)]
        {
            assert!((torque(&joint, direction, angle) - expected).abs() < 3e-6, "{direction} {angle}");
        }
        parameters.correction.joint_friction.limit = 0.05;
        parameters.correction.joint_spring.enable = 0.0;
        let joint = JointCorrection::new(&parameters).unwrap();
        assert!((torque(&joint, 1.0, 0.6) - 0.05).abs() < 2e-6);
        parameters.correction.joint_friction.enable = 0.0;
        assert_eq!(torque(&JointCorrection::new(&parameters).unwrap(), 1.0, 0.6), 0.0);
    }

    #[test]
    fn stretch_by_hand() {
        // L tanh(a/2)/a / (EA r1 r2), a = 0.377: tanh(0.1885)/0.377 = 0.49417; / (72900 · 0.000225) = 0.030128 rad/(N·m).
        let mut parameters = parameters();
        let joint = JointCorrection::new(&parameters).unwrap();
        assert!((joint.stretch(Torque::from_f32(0.5)).to_f32() - 0.015_064).abs() < 3e-6);
        parameters.compensator.source = 2.0;
        assert_eq!(JointCorrection::new(&parameters).unwrap().stretch(Torque::from_f32(0.5)), Angle::ZERO);
    }
}
