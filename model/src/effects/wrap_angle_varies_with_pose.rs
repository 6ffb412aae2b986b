//! The joint bends the sheaths as it moves: `K(θ) = K + k θ_out`.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};

/// The joint bends the sheaths as it moves: `K(θ) = K + k θ_out`.
pub struct WrapAngleVariesWithPose;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "wrap_angle_varies_with_pose",
    component: Component::Transmission,
    summary: "the wrap angle of the sheaths changes with the pose of the joint",
    parameters: &[ParameterSpec::linear(
        "slope_rad_per_rad",
        "1",
        [-10.0, 10.0],
        1.0,
        "change of wrap angle per joint angle",
    )],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for WrapAngleVariesWithPose {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("small slow triangles at five poses across the whole range")
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        for tendon in &mut port.tendons {
            tendon.wrap_angle_rad = (tendon.wrap_angle_rad + p[0] * port.theta_out_rad).max(0.0);
        }
    }
}
