//! Friction from the tendon's bending stiffness, there even without tension.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// Tension-independent part of the sheath friction: the tendon presses on the bends because it is stiff.
///
/// The pressing force is spread with the square of the local bend angle and scaled so that `mu · sum(force)` is `force_n`.
#[derive(Debug, Clone, PartialEq)]
pub struct BendingFriction {
    /// Friction of one whole tendon without tension, at the bench's own mu \[N\].
    pub force_n: f64,
}

impl Describe for BendingFriction {
    const COMPONENT: Component = Component::Transmission;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { force_n: 2.0 * strength * draw.uniform(0.85, 1.2) }
    }

    fn resize(&mut self, size: &Size) {
        self.force_n *= size.force;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("force_n", self.force_n.into())]
    }
}

impl BendingFriction {
    /// Normal force of each node \[N\] for nodes that bend by `bend_rad`.
    pub(crate) fn preload_n(&self, bend_rad: &[f64], friction_coefficient: f64) -> Vec<f64> {
        let total: f64 = bend_rad.iter().map(|bend| bend * bend).sum();
        let scale = self.force_n / (total * friction_coefficient);
        let scale = if scale.is_finite() { scale } else { 0.0 };
        bend_rad.iter().map(|bend| scale * bend * bend).collect()
    }
}
