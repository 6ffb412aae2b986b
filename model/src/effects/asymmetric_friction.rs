//! The two sheaths differ: `μ_a = μ (1 + α)`, `μ_b = μ (1 - α)`.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};

/// The two sheaths differ: `μ_a = μ (1 + α)`, `μ_b = μ (1 - α)`.
pub struct AsymmetricFriction;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "asymmetric_friction",
    component: Component::Transmission,
    summary: "the two sheaths have different friction",
    parameters: &[ParameterSpec::linear(
        "asymmetry",
        "1",
        [-0.95, 0.95],
        0.2,
        "half the relative difference; positive when cable a rubs more",
    )],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for AsymmetricFriction {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("slow triangles with the weight pulling on cable a, then on cable b")
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        for (tendon, sign) in port.tendons.iter_mut().zip([1.0, -1.0]) {
            for law in &mut tendon.slip {
                law.friction_coefficient *= 1.0 + sign * p[0];
            }
        }
    }
}
