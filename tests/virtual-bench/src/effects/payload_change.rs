//! Something is hung on the arm, or taken off, during the recording.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;
use super::smooth_step;

/// Mass at the arm changes by `change_kg` at `onset_s`, within 0.1 s, and stays so in later recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct PayloadChange {
    /// Added mass, negative if taken off \[kg\].
    pub change_kg: f64,
    /// When it happens \[s\].
    pub onset_s: f64,
}

impl Describe for PayloadChange {
    const COMPONENT: Component = Component::Joint;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { change_kg: (0.5 * strength * draw.uniform(0.85, 1.2) * draw.sign()).max(-1.5), onset_s: draw.uniform(8.0, 28.0) }
    }

    fn resize(&mut self, size: &Size) {
        self.change_kg *= size.mass;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("change_kg", self.change_kg.into()), ("onset_s", self.onset_s.into())]
    }
}

impl PayloadChange {
    /// Mass beyond the bench's own at `clock_s` \[kg\].
    pub(crate) fn extra_kg(&self, clock_s: f64) -> f64 {
        self.change_kg * smooth_step((clock_s - self.onset_s) / 0.1)
    }
}
