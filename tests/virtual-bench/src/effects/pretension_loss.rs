//! A terminal that slips once.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use super::smooth_step;

/// F0 of both tendons falls by the share `loss` at `onset_s`, within 50 ms, and stays there in later recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct PretensionLoss {
    /// Relative loss of pretension, 0 to 1 \[1\].
    pub loss: f64,
    /// When it happens \[s\].
    pub onset_s: f64,
}

impl Describe for PretensionLoss {
    const COMPONENT: Component = Component::Transmission;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { loss: (0.2 * strength * draw.uniform(0.85, 1.2)).min(0.9), onset_s: draw.uniform(8.0, 30.0) }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("loss", self.loss.into()), ("onset_s", self.onset_s.into())]
    }
}

impl PretensionLoss {
    /// Pretension over its first value at `clock_s`.
    pub(crate) fn factor(&self, clock_s: f64) -> f64 {
        1.0 - self.loss * smooth_step((clock_s - self.onset_s) / 0.05)
    }
}
