//! Dry friction of the output bearing.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;
use crate::bristle::ShaftBristle;

/// Dry friction of the joint: a bristle whose steady torque is `torque_nm · sign(omega)`.
#[derive(Debug, Clone, PartialEq)]
pub struct JointCoulombFriction {
    /// Torque while turning \[Nm\].
    pub torque_nm: f64,
    /// Wind-up before it turns freely \[rad\].
    pub breakaway_rad: f64,
}

impl Describe for JointCoulombFriction {
    const COMPONENT: Component = Component::Joint;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { torque_nm: 0.07 * strength * draw.uniform(0.85, 1.2), breakaway_rad: draw.uniform(1e-3, 3e-3) }
    }

    fn resize(&mut self, size: &Size) {
        self.torque_nm *= size.torque;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("torque_nm", self.torque_nm.into()), ("breakaway_rad", self.breakaway_rad.into())]
    }
}

impl JointCoulombFriction {
    /// Torque against the motion \[Nm\].
    pub(crate) fn torque_nm(&self, bristle: &mut ShaftBristle, omega_rad_per_s: f64, dt: f64) -> f64 {
        bristle.friction(omega_rad_per_s, self.torque_nm, self.breakaway_rad, dt)
    }
}
