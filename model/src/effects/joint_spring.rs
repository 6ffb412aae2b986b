//! A spring pulls the joint towards an angle: `τ = -k (θ - θ_0)`, as of a cable harness.

use crate::effect::{Component, Descriptor, Effect, EffectState, JointPort, MAX_PARAMETERS, ParameterSpec};

/// A spring pulls the joint towards an angle: `τ = -k (θ - θ_0)`, as of a cable harness.
pub struct JointSpring;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "joint_spring",
    component: Component::Joint,
    summary: "a spring acts on the joint",
    parameters: &[
        ParameterSpec::linear("stiffness_nm_per_rad", "N·m/rad", [-20.0, 100.0], 0.3, "stiffness"),
        ParameterSpec::linear("rest_rad", "rad", [-3.2, 3.2], 0.0, "angle without spring torque"),
    ],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for JointSpring {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn joint(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut JointPort) {
        port.torque_nm -= p[0] * (port.theta_rad - p[1]);
    }
}
