//! Play between output pulley and arm: no torque passes inside the gap.

use crate::effect::{Component, Descriptor, Effect, EffectState, JointPort, MAX_PARAMETERS, ParameterSpec};

/// Play between output pulley and arm: no torque passes inside the gap.
pub struct JointBacklash;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "joint_backlash",
    component: Component::Joint,
    summary: "play between output pulley and arm",
    parameters: &[ParameterSpec::linear("gap_rad", "rad", [0.0, 0.5], 0.02, "whole play")],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for JointBacklash {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("slow small triangles about the hanging position, where the torque changes sign")
    }

    fn joint(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut JointPort) {
        port.play_rad += p[0];
    }
}
