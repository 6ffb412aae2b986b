//! A channel that comes late.

use serde_json::Value;

use super::{Channel, Component, Describe};
use crate::draw::Draw;

/// One channel passes a dead time and then a first-order low-pass; either may be 0.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorLag {
    /// The channel.
    pub channel: Channel,
    /// Dead time, rounded to whole samples \[s\].
    pub dead_time_s: f64,
    /// Time constant of the low-pass \[s\].
    pub filter_s: f64,
}

impl Describe for SensorLag {
    const COMPONENT: Component = Component::Sensors;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        let channel = draw.one_of(&[Channel::ThetaOut, Channel::F1, Channel::F2, Channel::F3, Channel::F4]);
        let total = 0.05 * strength * draw.uniform(0.85, 1.2);
        let dead_share = draw.one_of(&[0.0, 0.3, 1.0]);
        Self { channel, dead_time_s: dead_share * total, filter_s: (1.0 - dead_share) * total }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("channel", self.channel.column().into()), ("dead_time_s", self.dead_time_s.into()), ("filter_s", self.filter_s.into())]
    }
}
