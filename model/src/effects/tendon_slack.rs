//! A tendon cannot push: at zero tension it goes slack and its end moves freely until it is taut again.

use crate::effect::{Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, TransmissionPort};

/// A tendon cannot push: at zero tension it goes slack and its end moves freely until it is taut again.
pub struct TendonSlack;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "tendon_slack",
    component: Component::Transmission,
    summary: "tendons go slack instead of pushing",
    parameters: &[],
    neutral: None,
    channels: &[],
};

impl Effect for TendonSlack {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn transmission(
        &self,
        _p: &[f64; MAX_PARAMETERS],
        _state: &mut EffectState,
        port: &mut TransmissionPort,
    ) {
        for tendon in &mut port.tendons {
            tendon.unilateral = true;
        }
    }
}
