//! More viscous friction at the motor than the rig file says.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// Extra viscous friction at the input shaft: `torque = coefficient · omega`.
#[derive(Debug, Clone, PartialEq)]
pub struct MotorViscousFriction {
    /// Added to the nominal coefficient \[Nm s/rad\].
    pub coefficient_nm_s_per_rad: f64,
}

impl Describe for MotorViscousFriction {
    const COMPONENT: Component = Component::Motor;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { coefficient_nm_s_per_rad: 0.08 * strength * draw.uniform(0.85, 1.2) }
    }

    fn resize(&mut self, size: &Size) {
        self.coefficient_nm_s_per_rad *= size.torque;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("coefficient_nm_s_per_rad", self.coefficient_nm_s_per_rad.into())]
    }
}
