//! Play between the input pulley and the tendons: no torque passes inside the gap.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};

/// Play between the input pulley and the tendons: no torque passes inside the gap.
pub struct TransmissionBacklash;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "transmission_backlash",
    component: Component::Transmission,
    summary: "play between the input pulley and the tendons",
    parameters: &[ParameterSpec::linear(
        "gap_rad",
        "rad",
        [0.0, 0.5],
        0.02,
        "whole play, at the input pulley",
    )],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for TransmissionBacklash {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("slow small triangles about the hanging position, where the torque changes sign")
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        port.play_rad += p[0];
    }
}
