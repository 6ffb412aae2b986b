//! A cable harness or seal that pulls the joint back.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// Spring at the joint: `−k·d·(1 + hardening·d²)`, d = `theta_out` − rest.
#[derive(Debug, Clone, PartialEq)]
pub struct JointSpring {
    /// Stiffness at rest, k \[Nm/rad\].
    pub stiffness_nm_per_rad: f64,
    /// Cubic part over linear part \[1/rad²\].
    pub hardening_per_rad2: f64,
    /// Angle without torque \[rad\].
    pub rest_rad: f64,
}

impl Describe for JointSpring {
    const COMPONENT: Component = Component::Joint;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self {
            stiffness_nm_per_rad: 0.35 * strength * draw.uniform(0.85, 1.2),
            hardening_per_rad2: draw.uniform(0.0, 0.4),
            rest_rad: draw.uniform(-0.05, 0.05),
        }
    }

    fn resize(&mut self, size: &Size) {
        self.stiffness_nm_per_rad *= size.torque;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("stiffness_nm_per_rad", self.stiffness_nm_per_rad.into()), ("hardening_per_rad2", self.hardening_per_rad2.into()), ("rest_rad", self.rest_rad.into())]
    }
}

impl JointSpring {
    /// Torque on the arm \[Nm\].
    pub(crate) fn torque_nm(&self, theta_rad: f64) -> f64 {
        let d = theta_rad - self.rest_rad;
        -self.stiffness_nm_per_rad * d * (1.0 + self.hardening_per_rad2 * d * d)
    }
}
