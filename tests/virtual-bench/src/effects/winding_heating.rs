//! Winding resistance that rises with copper loss.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// Temperature coefficient of copper's resistance \[1/K\].
const COPPER_PER_K: f64 = 0.0039;

/// Copper that warms up: `C dT/dt = i²·R − T/R_th`, `R = R_cold · (1 + 0.0039 · T)`, T above ambient.
///
/// It starts cold. `C` follows from the time constant, `C = tau/R_th`.
#[derive(Debug, Clone, PartialEq)]
pub struct WindingHeating {
    /// Winding to ambient, `R_th` \[K/W\].
    pub thermal_resistance_k_per_w: f64,
    /// Warm-up time constant, tau \[s\].
    pub time_constant_s: f64,
}

impl Describe for WindingHeating {
    const COMPONENT: Component = Component::Motor;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { thermal_resistance_k_per_w: 180.0 * strength * draw.uniform(0.85, 1.2), time_constant_s: draw.uniform(10.0, 20.0) }
    }

    fn resize(&mut self, size: &Size) {
        self.thermal_resistance_k_per_w /= size.power;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("thermal_resistance_k_per_w", self.thermal_resistance_k_per_w.into()), ("time_constant_s", self.time_constant_s.into())]
    }
}

impl WindingHeating {
    /// Resistance over cold resistance after one step; `rise_k` is the state, `cold_loss_w` is `i²·R_cold`.
    pub(crate) fn resistance_factor(&self, rise_k: &mut f64, cold_loss_w: f64, dt: f64) -> f64 {
        let loss_w = cold_loss_w * (1.0 + COPPER_PER_K * *rise_k);
        *rise_k += dt / self.time_constant_s * (loss_w * self.thermal_resistance_k_per_w - *rise_k);
        1.0 + COPPER_PER_K * *rise_k
    }
}
