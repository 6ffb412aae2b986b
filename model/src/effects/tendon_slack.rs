//! A tendon cannot push: at zero tension it goes slack and its end moves freely until it is taut again.
//!
//! Tendons mounted without pretension may be too long by some length each; both pulleys then have free play between the
//! angles at which one or the other cable pulls.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};

/// A tendon cannot push: at zero tension it goes slack and its end moves freely until it is taut again.
pub struct TendonSlack;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "tendon_slack",
    component: Component::Transmission,
    summary: "tendons go slack instead of pushing",
    parameters: &[ParameterSpec::linear(
        "looseness_m",
        "m",
        [0.0, 0.005],
        0.0,
        "length by which each tendon is too long at zero angles, on top of what the pretension stretches",
    )
    // Pretension and looseness shift the same sum; a search that moves the one must leave the other.
    .not_searched()],
    neutral: None,
    channels: &[],
};

impl Effect for TendonSlack {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        for tendon in &mut port.tendons {
            tendon.unilateral = true;
            tendon.added_length_m += p[0];
        }
    }
}
