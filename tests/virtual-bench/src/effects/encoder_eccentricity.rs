//! An encoder disc that is mounted off its centre.

use serde_json::Value;

use super::{Channel, Component, Describe};
use crate::draw::Draw;

use std::f64::consts::PI;

/// Reading `theta + amplitude·(sin(theta + phase) − sin(phase))`: once a turn, zero at theta = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct EncoderEccentricity {
    /// `ThetaIn` or `ThetaOut`; no other channel is affected.
    pub channel: Channel,
    /// Amplitude \[rad\].
    pub amplitude_rad: f64,
    /// Phase at theta = 0 \[rad\].
    pub phase_rad: f64,
}

impl Describe for EncoderEccentricity {
    const COMPONENT: Component = Component::Sensors;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self {
            channel: draw.one_of(&[Channel::ThetaIn, Channel::ThetaOut]),
            amplitude_rad: 0.035 * strength * draw.uniform(0.85, 1.2),
            phase_rad: draw.uniform(-PI, PI),
        }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("channel", self.channel.column().into()), ("amplitude_rad", self.amplitude_rad.into()), ("phase_rad", self.phase_rad.into())]
    }
}

impl EncoderEccentricity {
    /// Angle the encoder sees.
    pub(crate) fn reading_rad(&self, theta_rad: f64) -> f64 {
        theta_rad + self.amplitude_rad * ((theta_rad + self.phase_rad).sin() - self.phase_rad.sin())
    }
}
