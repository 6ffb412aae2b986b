//! A channel with a wrong zero.

use serde_json::Value;

use super::{Channel, Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// Reading `value + offset` of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorOffset {
    /// The channel.
    pub channel: Channel,
    /// Offset in the channel's unit.
    pub offset: f64,
}

impl Describe for SensorOffset {
    const COMPONENT: Component = Component::Sensors;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        let (channel, scale) = draw.one_of(&[
            (Channel::F1, 1.5),
            (Channel::F2, 1.5),
            (Channel::F3, 1.5),
            (Channel::F4, 1.5),
            (Channel::Current, 0.08),
            (Channel::ThetaOut, 0.02),
        ]);
        Self { channel, offset: scale * strength * draw.uniform(0.85, 1.2) * draw.sign() }
    }

    fn resize(&mut self, size: &Size) {
        self.offset *= match self.channel {
            Channel::ThetaIn | Channel::ThetaOut => 1.0,
            Channel::Current => size.current,
            _ => size.force,
        };
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("channel", self.channel.column().into()), ("offset", self.offset.into())]
    }
}
