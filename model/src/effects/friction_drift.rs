//! Sheath friction that changes all the time, at a rate that may fade: `μ(t) = μ (1 + ρ (1 - e^{-κ t}) / κ)`, a straight line `μ (1 + ρ t)` where
//! `κ` is 0.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};
use crate::search::Aftermath;
use libm::{exp, expm1};

/// What fades faster than this has settled within a recording: that is friction that sets in, a law, and no drift.
const FASTEST_FADING_PER_S: f64 = 1.0 / 30.0;

/// Sheath friction that changes all the time: `μ(t) = μ (1 + ρ (1 - e^{-κ t}) / κ)`, with rate `ρ` at first and fading `κ` of the rate.
pub struct FrictionDrift;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "friction_drift",
    component: Component::Transmission,
    summary: "sheath friction that changes steadily over the recording",
    parameters: &[
        ParameterSpec::linear("rate_per_s", "1/s", [-0.1, 0.2], 0.01, "relative change per second at first"),
        ParameterSpec::linear(
            "fading_per_s",
            "1/s",
            [0.0, FASTEST_FADING_PER_S],
            0.0,
            "part of the rate that is lost per second; 0 for a straight line",
        )
        .believed_within(0.0, 0.02),
    ],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for FrictionDrift {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    /// It goes on from where it is, at the rate to which it has faded; what falls on by the same amount is a larger share of what is left.
    fn after(&self, p: &mut [f64; MAX_PARAMETERS], clock_s: f64) -> Aftermath {
        let friction_factor = factor(p, clock_s);
        p[0] *= exp(-p[1] * clock_s) / friction_factor.max(1e-3);
        Aftermath { friction_factor, ..Aftermath::NONE }
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        let factor = factor(p, port.t_s);
        for law in port.tendons.iter_mut().flat_map(|tendon| &mut tendon.slip) {
            law.friction_coefficient *= factor;
        }
    }
}

/// Friction at `t_s` over that at first, at least 0.
fn factor(p: &[f64; MAX_PARAMETERS], t_s: f64) -> f64 {
    let [rate_per_s, fading_per_s, ..] = *p;
    let faded_s = if fading_per_s == 0.0 { t_s } else { -expm1(-fading_per_s * t_s) / fading_per_s };
    (1.0 + rate_per_s * faded_s).max(0.0)
}
