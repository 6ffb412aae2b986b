//! Sheath friction that is higher at low speed: `μ(v) = μ (1 + (ρ - 1) e^{-|v/v_s|^δ})`.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};
use libm::{exp, pow};

/// Sheath friction that is higher at low speed: `μ(v) = μ (1 + (ρ - 1) e^{-|v/v_s|^δ})`.
pub struct SheathStribeckFriction;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "sheath_stribeck_friction",
    component: Component::Transmission,
    summary: "friction in the sheath that is higher at low speed",
    parameters: &[
        ParameterSpec::linear(
            "static_ratio",
            "1",
            [1.0, 5.0],
            1.6,
            "friction coefficient at standstill over that at speed",
        ),
        ParameterSpec::log(
            "speed_m_s",
            "m/s",
            [1e-5, 0.5],
            0.003,
            "speed at which the excess has fallen to 37 %",
        ),
        ParameterSpec::linear("exponent", "1", [0.5, 3.0], 1.5, "shape of the fall"),
    ],
    neutral: Some(1.0),
    channels: &[],
};

impl Effect for SheathStribeckFriction {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        for tendon in &mut port.tendons {
            for (law, speed) in tendon.slip.iter_mut().zip(tendon.speed_m_s) {
                let excess = (p[0] - 1.0) * exp(-pow(speed.abs() / p[1], p[2]));
                law.friction_coefficient *= 1.0 + excess;
            }
        }
    }
}
