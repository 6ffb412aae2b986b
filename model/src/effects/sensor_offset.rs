//! A sensor with a wrong zero: shown `x + o`.

use crate::channel::Channel;
use crate::effect::{Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, SensorPort};
use crate::search::Starts;

/// A sensor with a wrong zero: shown `x + o`.
pub struct SensorOffset;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "sensor_offset",
    component: Component::Sensors,
    summary: "a sensor has a wrong zero",
    parameters: &[ParameterSpec::linear(
        "offset",
        "unit of the channel",
        [-1000.0, 1000.0],
        1.0,
        "shown minus true",
    )],
    neutral: Some(0.0),
    channels: &Channel::SENSED,
};

impl Effect for SensorOffset {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn starts(&self) -> Starts {
        Starts::MeanDifference
    }

    /// What is usual depends on the channel.
    fn is_hardly_there(&self, _p: &[f64; MAX_PARAMETERS], _usual: f64) -> bool {
        false
    }

    fn measure(&self, p: &[f64; MAX_PARAMETERS], _s: &mut EffectState, port: &mut SensorPort) {
        port.value += p[0];
    }

    fn correct(&self, p: &[f64; MAX_PARAMETERS], _s: &mut EffectState, port: &mut SensorPort) {
        port.value -= p[0];
    }
}
