//! A tendon that cannot push.

use serde_json::Value;

use super::{Component, Describe};
use crate::config::BenchConfig;
use crate::draw::Draw;
use crate::size::Size;

/// Tension stays at 0 when the tendon is longer than its path; the kink between is a parabola within `±softness_n`.
///
/// It shows only where the pretension is low, so [`super::ConcealedEffect::prepare`] lowers the nominal one.
#[derive(Debug, Clone, PartialEq)]
pub struct TendonSlack {
    /// Half width of the kink, above 0 \[N\].
    pub softness_n: f64,
    /// Pretension the rig is set to \[N\].
    pub nominal_pretension_n: f64,
}

impl Describe for TendonSlack {
    const COMPONENT: Component = Component::Transmission;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { softness_n: draw.uniform(0.3, 0.8), nominal_pretension_n: 30.0 / (1.0 + 2.0 * strength * draw.uniform(0.85, 1.2)) }
    }

    fn resize(&mut self, size: &Size) {
        self.softness_n *= size.force;
        self.nominal_pretension_n *= size.force;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("softness_n", self.softness_n.into()), ("nominal_pretension_n", self.nominal_pretension_n.into())]
    }

    fn prepare(&self, nominal: &mut BenchConfig) {
        nominal.pretension_n = nominal.pretension_n.min(self.nominal_pretension_n);
    }
}

impl TendonSlack {
    /// Tension of an element whose spring asks for `spring_n` \[N\].
    #[inline]
    pub(crate) fn tension_n(&self, spring_n: f64) -> f64 {
        let w = self.softness_n;
        if spring_n > w {
            spring_n
        } else if spring_n < -w {
            0.0
        } else {
            (spring_n + w).powi(2) / (4.0 * w)
        }
    }
}
