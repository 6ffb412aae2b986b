//! Play between the teeth of the gear, before the input encoder.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;

/// Play in the gear: the rotor is free within the gap. The input encoder sits behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct GearBacklash {
    /// Whole gap from flank to flank, seen at the pulley \[rad\].
    pub gap_rad: f64,
}

impl Describe for GearBacklash {
    const COMPONENT: Component = Component::Motor;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { gap_rad: 0.02 * strength * draw.uniform(0.85, 1.2) }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("gap_rad", self.gap_rad.into())]
    }
}
