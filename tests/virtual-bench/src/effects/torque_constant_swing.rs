//! Outside the catalogue: the torque constant swings slowly, as with a magnet that warms and cools.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;

use std::f64::consts::PI;

/// kt and back-emf are multiplied by `1 + amplitude·sin(2π·t/period + phase)`.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueConstantSwing {
    /// Relative amplitude, below 1 \[1\].
    pub amplitude: f64,
    /// Period \[s\].
    pub period_s: f64,
    /// Phase at t = 0 \[rad\].
    pub phase_rad: f64,
}

impl Describe for TorqueConstantSwing {
    const COMPONENT: Component = Component::Motor;
    const OUTSIDE_CATALOGUE: bool = true;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self {
            amplitude: (0.15 * strength * draw.uniform(0.85, 1.2)).min(0.9),
            period_s: draw.uniform(6.0, 14.0),
            phase_rad: draw.uniform(-PI, PI),
        }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("amplitude", self.amplitude.into()), ("period_s", self.period_s.into()), ("phase_rad", self.phase_rad.into())]
    }
}

impl TorqueConstantSwing {
    /// Factor on kt at `clock_s`.
    pub(crate) fn factor(&self, clock_s: f64) -> f64 {
        1.0 + self.amplitude * (2.0 * PI * clock_s / self.period_s + self.phase_rad).sin()
    }
}
