//! Sheath friction that changes steadily: `μ(t) = μ (1 + ρ t)`.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};
use crate::search::Aftermath;

/// Sheath friction that changes steadily: `μ(t) = μ (1 + ρ t)`.
pub struct FrictionDrift;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "friction_drift",
    component: Component::Transmission,
    summary: "sheath friction that changes steadily over the recording",
    parameters: &[ParameterSpec::linear(
        "rate_per_s",
        "1/s",
        [-0.1, 0.2],
        0.01,
        "relative change per second",
    )],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for FrictionDrift {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    /// It goes on from where it is; what falls on by the same amount is a larger share of what is left.
    fn after(&self, p: &mut [f64; MAX_PARAMETERS], clock_s: f64) -> Aftermath {
        let friction_factor = (1.0 + p[0] * clock_s).max(0.0);
        p[0] /= friction_factor.max(1e-3);
        Aftermath { friction_factor, ..Aftermath::NONE }
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        let factor = (1.0 + p[0] * port.t_s).max(0.0);
        for law in port.tendons.iter_mut().flat_map(|tendon| &mut tendon.slip) {
            law.friction_coefficient *= factor;
        }
    }
}
