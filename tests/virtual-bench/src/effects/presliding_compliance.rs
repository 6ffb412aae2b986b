//! A soft liner: the contact gives way before it slides.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;

/// Bristles softer than normal, so that friction builds up over a longer presliding distance.
#[derive(Debug, Clone, PartialEq)]
pub struct PreslidingCompliance {
    /// Bristle stiffness over the normal one, above 0 \[1\].
    pub stiffness_ratio: f64,
}

impl Describe for PreslidingCompliance {
    const COMPONENT: Component = Component::Transmission;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { stiffness_ratio: 1.0 / (1.0 + 14.0 * strength * draw.uniform(0.85, 1.2)) }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("stiffness_ratio", self.stiffness_ratio.into())]
    }
}
