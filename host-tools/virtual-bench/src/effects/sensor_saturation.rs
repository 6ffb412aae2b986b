//! An amplifier that runs into its limit early.

use serde_json::Value;

use super::{Channel, Component, Describe};
use crate::draw::Draw;

/// Half width of the bend \[N\].
const KNEE_N: f64 = 0.5;

/// Reading of one tension channel never exceeds `limit_n`; it bends within the last 1 N.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorSaturation {
    /// A tension channel.
    pub channel: Channel,
    /// Largest reading \[N\].
    pub limit_n: f64,
}

impl Describe for SensorSaturation {
    const COMPONENT: Component = Component::Sensors;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { channel: draw.one_of(&Channel::TENSIONS), limit_n: (98.0665 - 52.0 * strength * draw.uniform(0.95, 1.05)).max(10.0) }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("channel", self.channel.column().into()), ("limit_n", self.limit_n.into())]
    }
}

impl SensorSaturation {
    /// Tension the amplifier puts out.
    pub(crate) fn reading_n(&self, tension_n: f64) -> f64 {
        let below = self.limit_n - tension_n;
        if below >= KNEE_N {
            tension_n
        } else if below <= -KNEE_N {
            self.limit_n
        } else {
            self.limit_n - (below + KNEE_N).powi(2) / (4.0 * KNEE_N)
        }
    }
}
