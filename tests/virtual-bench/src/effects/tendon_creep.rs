//! A rope that goes on stretching under load.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;

/// Standard linear solid: each tendon has a creep strain c with `tau·dc/dt = compliance·T/EA − c`, T its mean tension.
///
/// The bench was tensioned just before the recording, so c starts at 0.
#[derive(Debug, Clone, PartialEq)]
pub struct TendonCreep {
    /// Creep strain in the end over elastic strain \[1\].
    pub compliance: f64,
    /// Time constant, tau \[s\].
    pub time_constant_s: f64,
}

impl Describe for TendonCreep {
    const COMPONENT: Component = Component::Transmission;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { compliance: 0.3 * strength * draw.uniform(0.85, 1.2), time_constant_s: draw.uniform(6.0, 15.0) }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("compliance", self.compliance.into()), ("time_constant_s", self.time_constant_s.into())]
    }
}

impl TendonCreep {
    /// Creep strain after one step \[1\].
    pub(crate) fn advance(&self, strain: f64, elastic_strain: f64, dt: f64) -> f64 {
        strain + dt / self.time_constant_s * (self.compliance * elastic_strain - strain)
    }

    /// Strain after `clock_s` at the constant elastic strain of the pretension.
    ///
    /// Length is held, so the tension relaxes meanwhile: `c = e·q/(1+q)·(1 − exp(−(1+q)·t/tau))`, q the compliance.
    pub(crate) fn strain_after(&self, clock_s: f64, elastic_strain: f64) -> f64 {
        let q = 1.0 + self.compliance;
        elastic_strain * self.compliance / q * (1.0 - (-q * clock_s / self.time_constant_s).exp())
    }
}
