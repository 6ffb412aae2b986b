//! Outside the catalogue: a tension channel that picks up a machine next to it.

use std::f64::consts::{PI, TAU};

use serde_json::Value;

use super::{Channel, Component, Describe};
use crate::draw::Draw;

/// Reading `tension + amplitude·sin(2π·frequency·t + phase)` on one tension channel.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorHum {
    /// A tension channel.
    pub channel: Channel,
    /// Amplitude \[N\].
    pub amplitude_n: f64,
    /// Frequency \[Hz\].
    pub frequency_hz: f64,
    /// Phase at t = 0 \[rad\].
    pub phase_rad: f64,
}

impl Describe for SensorHum {
    const COMPONENT: Component = Component::Sensors;
    const OUTSIDE_CATALOGUE: bool = true;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self {
            channel: draw.one_of(&Channel::TENSIONS),
            amplitude_n: 1.5 * strength * draw.uniform(0.85, 1.2),
            frequency_hz: draw.uniform(4.0, 25.0),
            phase_rad: draw.uniform(-PI, PI),
        }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("channel", self.channel.column().into()),
            ("amplitude_n", self.amplitude_n.into()),
            ("frequency_hz", self.frequency_hz.into()),
            ("phase_rad", self.phase_rad.into()),
        ]
    }
}

impl SensorHum {
    /// What is added to the reading at `clock_s` \[N\].
    pub(crate) fn pick_up_n(&self, clock_s: f64) -> f64 {
        self.amplitude_n * (TAU * self.frequency_hz * clock_s + self.phase_rad).sin()
    }
}
