//! Outside the catalogue: a torque on the arm that no listed effect gives, of a kind that the seed draws.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// Speed over which a torque against the motion changes its sign \[rad/s\].
const TURNING_RAD_PER_S: f64 = 1e-2;

/// What acts on the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointLaw {
    /// Against the motion, with the square of speed: a paddle in oil.
    SquareDrag,
    /// Against the motion, with the root of speed: a shear-thinning grease.
    RootDrag,
    /// Against the motion, with the speed, in positive direction alone: a damper with a check valve.
    OneWayDrag,
    /// Back to zero, with the cube of the angle: a rubber boot.
    CubicSpring,
    /// A dry friction within a short range of the angle: a lip that rubs.
    RubbingRange,
    /// A triangle wave along the angle: the teeth of a cogged seal.
    TriangleRipple,
    /// An oscillation in time: a fan on the arm.
    Shaker,
}

/// A torque on the arm of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct UnlistedJoint {
    /// Kind.
    pub law: JointLaw,
    /// Size \[Nm\]: at 1 rad/s, at 1 rad, or the largest.
    pub size_nm: f64,
    /// Place \[rad\], periods a turn \[1\] or frequency \[Hz\], where the kind has one.
    pub place: f64,
}

impl Describe for UnlistedJoint {
    const COMPONENT: Component = Component::Joint;
    const OUTSIDE_CATALOGUE: bool = true;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        let law = draw.one_of(&[
            JointLaw::SquareDrag,
            JointLaw::RootDrag,
            JointLaw::OneWayDrag,
            JointLaw::CubicSpring,
            JointLaw::RubbingRange,
            JointLaw::TriangleRipple,
            JointLaw::Shaker,
        ]);
        let (size_nm, place) = match law {
            JointLaw::SquareDrag => (0.08, 0.0),
            JointLaw::RootDrag => (0.12, 0.0),
            JointLaw::OneWayDrag => (0.15, 0.0),
            JointLaw::CubicSpring => (0.5, 0.0),
            JointLaw::RubbingRange => (0.15, draw.sign() * draw.uniform(0.1, 0.4)),
            JointLaw::TriangleRipple => (0.12, draw.one_of(&[9.0, 14.0, 22.0])),
            JointLaw::Shaker => (0.08, draw.uniform(3.0, 18.0)),
        };
        Self { law, size_nm: strength * size_nm * draw.uniform(0.85, 1.2), place }
    }

    fn resize(&mut self, size: &Size) {
        self.size_nm *= size.torque;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("law", format!("{:?}", self.law).into()),
            ("size_nm", self.size_nm.into()),
            ("place", self.place.into()),
        ]
    }
}

impl UnlistedJoint {
    /// Torque on the arm \[Nm\].
    pub(crate) fn torque_nm(&self, theta_rad: f64, omega_rad_per_s: f64, clock_s: f64) -> f64 {
        let against = -(omega_rad_per_s / TURNING_RAD_PER_S).tanh();
        let shape = match self.law {
            JointLaw::SquareDrag => -omega_rad_per_s * omega_rad_per_s.abs(),
            JointLaw::RootDrag => against * omega_rad_per_s.abs().sqrt(),
            JointLaw::OneWayDrag => -omega_rad_per_s.max(0.0),
            JointLaw::CubicSpring => -theta_rad.powi(3),
            JointLaw::RubbingRange => against / (1.0 + ((theta_rad - self.place) / 0.08).powi(6)),
            JointLaw::TriangleRipple => {
                let turns = self.place * theta_rad / std::f64::consts::TAU;
                4.0 * (turns - (turns + 0.5).floor()).abs() - 1.0
            }
            JointLaw::Shaker => (std::f64::consts::TAU * self.place * clock_s).sin(),
        };
        self.size_nm * shape
    }
}
