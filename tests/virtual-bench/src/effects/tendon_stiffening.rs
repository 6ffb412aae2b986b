//! A rope that gets stiffer as its strands settle under load.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// Stiffness that depends on stretch: `k·(1 + s·e/sqrt(e² + e0²))`, e the stretch beyond pretension.
///
/// Integrated over e it adds `k·s·(sqrt(e² + e0²) − e0)` to the tension; e0 is the stretch of `knee_n` at stiffness k.
#[derive(Debug, Clone, PartialEq)]
pub struct TendonStiffening {
    /// Relative change of stiffness far above pretension, s, 0 to 0.9 \[1\].
    pub excess: f64,
    /// Change of tension within which the stiffness turns over \[N\].
    pub knee_n: f64,
}

impl Describe for TendonStiffening {
    const COMPONENT: Component = Component::Transmission;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { excess: (0.45 * strength * draw.uniform(0.85, 1.2)).min(0.9), knee_n: draw.uniform(8.0, 15.0) }
    }

    fn resize(&mut self, size: &Size) {
        self.knee_n *= size.force;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("excess", self.excess.into()), ("knee_n", self.knee_n.into())]
    }
}

impl TendonStiffening {
    /// Tension beyond the linear element's \[N\], for stiffness `k` \[N/m\] and stretch `e` \[m\].
    #[inline]
    pub(crate) fn extra_n(&self, k: f64, e: f64) -> f64 {
        self.excess * ((k * e).hypot(self.knee_n) - self.knee_n)
    }
}
