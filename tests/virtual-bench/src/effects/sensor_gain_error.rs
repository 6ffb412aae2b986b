//! A channel with a wrong gain.

use serde_json::Value;

use super::{Channel, Component, Describe};
use crate::draw::Draw;

/// Reading `(1 + error) · value` of one tension channel or the current.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorGainError {
    /// The channel.
    pub channel: Channel,
    /// Relative error of the gain \[1\].
    pub error: f64,
}

impl Describe for SensorGainError {
    const COMPONENT: Component = Component::Sensors;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        let channels = [Channel::F1, Channel::F2, Channel::F3, Channel::F4, Channel::Current];
        Self { channel: draw.one_of(&channels), error: 0.06 * strength * draw.uniform(0.85, 1.2) * draw.sign() }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("channel", self.channel.column().into()), ("error", self.error.into())]
    }
}
