//! An amplifier that runs into its limit early.

use serde_json::Value;

use super::{Channel, Component, Describe};
use crate::draw::Draw;

/// Half width of the bend \[N\].
const KNEE_N: f64 = 0.5;

/// Largest tensions of the nominal bench in its laboratory motion \[N\]: input ends, output ends.
const LARGEST_N: [f64; 2] = [60.0, 48.0];

/// Share of them that a clear fault does not show.
const CUT: f64 = 0.25;

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
        let channel = draw.one_of(&Channel::TENSIONS);
        // A limit that is never reached is no fault: friction keeps the output ends lower.
        let largest_n = if matches!(channel, Channel::F1 | Channel::F3) { LARGEST_N[0] } else { LARGEST_N[1] };
        Self { channel, limit_n: largest_n * (1.0 - CUT * strength * draw.uniform(0.95, 1.05)) }
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
