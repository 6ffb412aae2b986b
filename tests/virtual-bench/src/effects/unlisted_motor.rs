//! Outside the catalogue: a torque on the rotor that no listed effect gives, of a kind that the seed draws.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// Speed over which a torque against the motion changes its sign \[rad/s\].
const TURNING_RAD_PER_S: f64 = 1e-2;

/// What acts on the rotor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MotorLaw {
    /// Against the motion, with the square of speed: a fan on the shaft.
    FanDrag,
    /// A dry friction within a short range of the angle: a gear with a damaged sector.
    DamagedSector,
    /// An oscillation in time: the current controller's limit cycle.
    Shaker,
}

/// A torque on the rotor of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct UnlistedMotor {
    /// Kind.
    pub law: MotorLaw,
    /// Size \[Nm at the input pulley\]: at 1 rad/s, or the largest.
    pub size_nm: f64,
    /// Place \[rad\] or frequency \[Hz\], where the kind has one.
    pub place: f64,
}

impl Describe for UnlistedMotor {
    const COMPONENT: Component = Component::Motor;
    const OUTSIDE_CATALOGUE: bool = true;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        let law = draw.one_of(&[MotorLaw::FanDrag, MotorLaw::DamagedSector, MotorLaw::Shaker]);
        let (size_nm, place) = match law {
            MotorLaw::FanDrag => (0.08, 0.0),
            MotorLaw::DamagedSector => (0.15, draw.sign() * draw.uniform(0.1, 0.4)),
            MotorLaw::Shaker => (0.1, draw.uniform(3.0, 18.0)),
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

impl UnlistedMotor {
    /// Torque on the rotor \[Nm\], seen at the input pulley.
    pub(crate) fn torque_nm(&self, theta_rad: f64, omega_rad_per_s: f64, clock_s: f64) -> f64 {
        let against = -(omega_rad_per_s / TURNING_RAD_PER_S).tanh();
        let shape = match self.law {
            MotorLaw::FanDrag => -omega_rad_per_s * omega_rad_per_s.abs(),
            MotorLaw::DamagedSector => against / (1.0 + ((theta_rad - self.place) / 0.08).powi(6)),
            MotorLaw::Shaker => (std::f64::consts::TAU * self.place * clock_s).sin(),
        };
        self.size_nm * shape
    }
}
