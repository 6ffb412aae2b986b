//! Outside the catalogue: a damaged spot of the sheath that a rough spot of cable a passes.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;

/// Extra normal force on cable a while its rough spot is within `half_width_m` of the kink at displacement `position_m`:
/// `force_n · (1 − ((u − position)/half_width)²)²`, at the middle of the sheath.
#[derive(Debug, Clone, PartialEq)]
pub struct KinkSpot {
    /// Largest extra normal force \[N\].
    pub force_n: f64,
    /// Cable displacement at which the spot sits in the kink \[m\].
    pub position_m: f64,
    /// Reach of the kink \[m\].
    pub half_width_m: f64,
}

impl Describe for KinkSpot {
    const COMPONENT: Component = Component::Transmission;
    const OUTSIDE_CATALOGUE: bool = true;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self {
            force_n: 30.0 * strength * draw.uniform(0.85, 1.2),
            position_m: draw.uniform(-4e-3, 4e-3),
            half_width_m: draw.uniform(1e-3, 2e-3),
        }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("force_n", self.force_n.into()), ("position_m", self.position_m.into()), ("half_width_m", self.half_width_m.into())]
    }
}

impl KinkSpot {
    /// Extra normal force on node `node` of `nodes`, displaced by `u` \[N\].
    #[inline]
    pub(crate) fn normal_n(&self, node: usize, nodes: usize, u: f64) -> f64 {
        let x = (u - self.position_m) / self.half_width_m;
        if node == nodes / 2 && x.abs() < 1.0 { self.force_n * (1.0 - x * x).powi(2) } else { 0.0 }
    }
}
