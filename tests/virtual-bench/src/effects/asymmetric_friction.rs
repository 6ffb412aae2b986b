//! Two sheaths that are not alike.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;

/// Friction of cable a is `mu · (1 + excess)`, of cable b `mu · (1 − excess)`.
#[derive(Debug, Clone, PartialEq)]
pub struct AsymmetricFriction {
    /// Relative excess of cable a, −1 to 1 \[1\].
    pub excess: f64,
}

impl Describe for AsymmetricFriction {
    const COMPONENT: Component = Component::Transmission;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { excess: (0.3 * strength * draw.uniform(0.85, 1.2)).min(0.95) * draw.sign() }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("excess", self.excess.into())]
    }
}

impl AsymmetricFriction {
    /// Factors on mu of cable a and b.
    pub(crate) fn factors(&self) -> [f64; 2] {
        [1.0 + self.excess, 1.0 - self.excess]
    }
}
