//! Lubricant drag along the sheath, independent of tension.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// Drag of a tendon in its lubricant, spread evenly over the sheath: `coefficient · v/(1 + |v|/thinning)`.
///
/// The lubricant thins with speed; far below `thinning` the drag is proportional to v.
#[derive(Debug, Clone, PartialEq)]
pub struct SheathViscousFriction {
    /// Drag of one whole tendon over speed, at low speed \[N s/m\].
    pub coefficient_ns_per_m: f64,
    /// Speed at which the drag is half of what proportionality gives \[m/s\].
    pub thinning_m_per_s: f64,
}

impl Describe for SheathViscousFriction {
    const COMPONENT: Component = Component::Transmission;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { coefficient_ns_per_m: 80.0 * strength * draw.uniform(0.85, 1.2), thinning_m_per_s: draw.uniform(0.2, 0.5) }
    }

    fn resize(&mut self, size: &Size) {
        self.coefficient_ns_per_m *= size.force / size.radius;
        self.thinning_m_per_s *= size.radius;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("coefficient_ns_per_m", self.coefficient_ns_per_m.into()), ("thinning_m_per_s", self.thinning_m_per_s.into())]
    }
}

impl SheathViscousFriction {
    /// Drag of a whole tendon that moves at `v` \[N\].
    pub(crate) fn force_n(&self, v: f64) -> f64 {
        self.coefficient_ns_per_m * v / (1.0 + v.abs() / self.thinning_m_per_s)
    }
}
