//! Play between the input shaft, where the encoder is, and the drum that winds the tendons.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;

/// Play of the drum on its shaft. The input encoder sits before it, both tendons behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct TransmissionBacklash {
    /// Whole gap from flank to flank, seen at the pulley \[rad\].
    pub gap_rad: f64,
}

impl Describe for TransmissionBacklash {
    const COMPONENT: Component = Component::Transmission;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { gap_rad: 0.02 * strength * draw.uniform(0.85, 1.2) }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("gap_rad", self.gap_rad.into())]
    }
}
