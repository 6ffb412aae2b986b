//! An encoder disc off its axis: shown `θ + A sin(θ + φ) - A sin φ`.

use core::f64::consts::PI;

use crate::channel::Channel;
use crate::effect::{Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, SensorPort};
use crate::search::Starts;
use libm::sin;

/// An encoder disc off its axis: shown `θ + A sin(θ + φ) - A sin φ`.
pub struct EncoderEccentricity;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "encoder_eccentricity",
    component: Component::Sensors,
    summary: "an encoder disc sits off its axis",
    parameters: &[
        ParameterSpec::linear("amplitude_rad", "rad", [-0.2, 0.2], 0.01, "amplitude of the error"),
        ParameterSpec::linear("phase_rad", "rad", [-3.15, 3.15], 0.0, "phase at angle zero"),
    ],
    neutral: Some(0.0),
    channels: &[Channel::ThetaIn, Channel::ThetaOut, Channel::ThetaMotor],
};

fn error_rad(p: &[f64; MAX_PARAMETERS], theta_rad: f64) -> f64 {
    p[0] * (sin(theta_rad + p[1]) - sin(p[1]))
}

impl Effect for EncoderEccentricity {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    /// The other two quarters are these with the other sign.
    fn starts(&self) -> Starts {
        Starts::At("phase_rad", &[0.01 - PI, 0.01 - PI / 2.0])
    }

    /// What it makes of an angle that drives the replay shows in what follows from it.
    fn is_looked_for_on(&self, _channel: Channel, _drives: bool) -> bool {
        true
    }

    fn measure(&self, p: &[f64; MAX_PARAMETERS], _s: &mut EffectState, port: &mut SensorPort) {
        port.value += error_rad(p, port.value);
    }

    fn correct(&self, p: &[f64; MAX_PARAMETERS], _s: &mut EffectState, port: &mut SensorPort) {
        let shown = port.value;
        // The error is far below the angle: two rounds of the fixed point leave less than A³.
        for _ in 0..2 {
            port.value = shown - error_rad(p, port.value);
        }
    }
}
