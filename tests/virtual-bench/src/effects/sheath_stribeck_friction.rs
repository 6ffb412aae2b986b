//! Sheath friction that falls with speed.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// Stribeck curve of the sheath contact: `mu · (1 + (ratio − 1)/(1 + (v/stribeck)²))`, rational, not the usual exponential.
#[derive(Debug, Clone, PartialEq)]
pub struct SheathStribeckFriction {
    /// Friction coefficient at standstill over that at speed \[1\].
    pub static_ratio: f64,
    /// Speed at which half of the excess is gone \[m/s\].
    pub stribeck_m_per_s: f64,
}

impl Describe for SheathStribeckFriction {
    const COMPONENT: Component = Component::Transmission;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { static_ratio: 1.0 + 0.8 * strength * draw.uniform(0.85, 1.2), stribeck_m_per_s: draw.uniform(1.5e-3, 4e-3) }
    }

    fn resize(&mut self, size: &Size) {
        self.stribeck_m_per_s *= size.radius;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("static_ratio", self.static_ratio.into()), ("stribeck_m_per_s", self.stribeck_m_per_s.into())]
    }
}

impl SheathStribeckFriction {
    /// Friction coefficient over its value at speed.
    #[inline]
    pub(crate) fn factor(&self, v: f64) -> f64 {
        let x = v / self.stribeck_m_per_s;
        1.0 + (self.static_ratio - 1.0) / (1.0 + x * x)
    }
}
