//! A sensor that stops at a limit: shown `min(x, limit)`.

use crate::channel::Channel;
use crate::effect::{Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, SensorPort};
use crate::search::Starts;

/// A sensor that stops at a limit: shown `min(x, limit)`.
pub struct SensorSaturation;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "sensor_saturation",
    component: Component::Sensors,
    summary: "a sensor saturates below its full scale",
    parameters: &[ParameterSpec::linear(
        "limit",
        "unit of the channel",
        [-1e4, 1e4],
        50.0,
        "largest value shown",
    )],
    neutral: None,
    channels: &Channel::SENSED,
};

impl Effect for SensorSaturation {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn starts(&self) -> Starts {
        Starts::LargestShown
    }

    fn measure(&self, p: &[f64; MAX_PARAMETERS], _s: &mut EffectState, port: &mut SensorPort) {
        port.value = port.value.min(p[0]);
    }
}
