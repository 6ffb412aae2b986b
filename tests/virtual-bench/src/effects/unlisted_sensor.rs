//! Outside the catalogue: errors of a sensor that no listed effect gives, of a kind that the seed draws.

use std::f64::consts::TAU;

use serde_json::Value;

use super::{Channel, Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// What a sensor shows beyond the true value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SensorLaw {
    /// A tension channel whose gain grows with the load.
    Curved,
    /// A tension channel that warms up.
    WarmingUp,
    /// A tension channel that picks up the mains.
    Mains,
    /// A joint encoder with an error of several periods a turn.
    Interpolation,
}

/// An error of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct UnlistedSensor {
    /// Kind.
    pub law: SensorLaw,
    /// Channel.
    pub channel: Channel,
    /// Size: at 30 N, at last, or the largest \[N or rad\].
    pub size: f64,
    /// Time constant \[s\], frequency \[Hz\] or periods a turn \[1\], where the kind has one.
    pub place: f64,
}

impl Describe for UnlistedSensor {
    const COMPONENT: Component = Component::Sensors;
    const OUTSIDE_CATALOGUE: bool = true;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        let law =
            draw.one_of(&[SensorLaw::Curved, SensorLaw::WarmingUp, SensorLaw::Mains, SensorLaw::Interpolation]);
        let tension = draw.one_of(&Channel::TENSIONS);
        let (channel, size, place) = match law {
            SensorLaw::Curved => (tension, 2.5, 0.0),
            SensorLaw::WarmingUp => (tension, 2.0, draw.uniform(4.0, 12.0)),
            SensorLaw::Mains => (tension, 1.2, 50.0),
            SensorLaw::Interpolation => (Channel::ThetaOut, 0.015, draw.one_of(&[8.0, 16.0, 32.0])),
        };
        Self { law, channel, size: strength * size * draw.uniform(0.85, 1.2), place }
    }

    fn resize(&mut self, size: &Size) {
        self.size *= match self.law {
            // The square of a load that is `force` times as large.
            SensorLaw::Curved => size.force.recip(),
            SensorLaw::WarmingUp | SensorLaw::Mains => size.force,
            SensorLaw::Interpolation => 1.0,
        };
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("law", format!("{:?}", self.law).into()),
            ("channel", self.channel.column().into()),
            ("size", self.size.into()),
            ("place", self.place.into()),
        ]
    }
}

impl UnlistedSensor {
    /// What is added to the reading of `value` at `clock_s`.
    pub(crate) fn error(&self, value: f64, clock_s: f64) -> f64 {
        let shape = match self.law {
            SensorLaw::Curved => (value / 30.0).powi(2),
            SensorLaw::WarmingUp => 1.0 - (-clock_s / self.place).exp(),
            SensorLaw::Mains => (TAU * self.place * clock_s).sin(),
            SensorLaw::Interpolation => (self.place * value).sin(),
        };
        self.size * shape
    }
}
