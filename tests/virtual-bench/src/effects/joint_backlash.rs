//! Play between the output pulley and the arm, before the joint encoder.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;

/// Play of the arm on the output pulley. The joint encoder sits on the arm.
#[derive(Debug, Clone, PartialEq)]
pub struct JointBacklash {
    /// Whole gap from flank to flank, seen at the pulley \[rad\].
    pub gap_rad: f64,
}

impl Describe for JointBacklash {
    const COMPONENT: Component = Component::Joint;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { gap_rad: 0.025 * strength * draw.uniform(0.85, 1.2) }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("gap_rad", self.gap_rad.into())]
    }
}
