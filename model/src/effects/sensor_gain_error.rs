//! A sensor with a wrong scale: shown `g x`.

use crate::channel::Channel;
use crate::effect::{Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, SensorPort};
use crate::search::Starts;

/// A sensor with a wrong scale: shown `g x`.
pub struct SensorGainError;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "sensor_gain_error",
    component: Component::Sensors,
    summary: "a sensor has a wrong gain",
    parameters: &[ParameterSpec::log("gain", "1", [0.2, 5.0], 1.1, "shown over true")],
    neutral: Some(1.0),
    channels: &Channel::SENSED,
};

impl Effect for SensorGainError {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn starts(&self) -> Starts {
        Starts::At("gain", &[0.92, 1.08])
    }

    /// An encoder counts; where angles do not fit each other by a factor, that is the pulleys' ratio, which is recalibrated.
    fn is_looked_for_on(&self, channel: Channel, drives: bool) -> bool {
        !drives && !channel.is_angle()
    }

    fn measure(&self, p: &[f64; MAX_PARAMETERS], _s: &mut EffectState, port: &mut SensorPort) {
        port.value *= p[0];
    }

    fn correct(&self, p: &[f64; MAX_PARAMETERS], _s: &mut EffectState, port: &mut SensorPort) {
        port.value /= p[0];
    }
}
