//! Sheath friction that changes all the time, by wear or running-in.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;

/// mu changes steadily: `mu · (1 + change · (1 − exp(−t/tau))/(1 − exp(−40 s/tau)))`.
///
/// With `tau` of some minutes it is almost a straight line that reaches `1 + change` after 40 s.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionDrift {
    /// Relative change after 40 s, above −1 \[1\].
    pub change_after_40_s: f64,
    /// Bend of the line, tau \[s\].
    pub time_constant_s: f64,
}

impl Describe for FrictionDrift {
    const COMPONENT: Component = Component::Transmission;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self {
            change_after_40_s: (0.4 * strength * draw.uniform(0.85, 1.2) * draw.sign()).max(-0.6),
            time_constant_s: draw.uniform(40.0, 200.0),
        }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("change_after_40_s", self.change_after_40_s.into()), ("time_constant_s", self.time_constant_s.into())]
    }
}

impl FrictionDrift {
    /// Factor on mu at `clock_s`.
    pub(crate) fn factor(&self, clock_s: f64) -> f64 {
        let progress = |t: f64| 1.0 - (-t / self.time_constant_s).exp();
        (1.0 + self.change_after_40_s * progress(clock_s) / progress(40.0)).max(0.0)
    }
}
