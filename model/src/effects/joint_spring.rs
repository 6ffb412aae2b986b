//! A spring pulls the joint towards an angle: `τ = -k (θ - θ_0)`, as of a cable harness.

use crate::effect::{Component, Descriptor, Effect, EffectState, JointPort, MAX_PARAMETERS, ParameterSpec};
use crate::search::Starts;

/// Angle of rest at which a spring is looked for, either side of zero.
const REST_RAD: f64 = 0.05;

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

    /// Where a harness is at rest it is some degrees off; the torque of that is as much a sign of it as the slope.
    fn starts(&self) -> Starts {
        Starts::StrengthsAt("rest_rad", &[-REST_RAD, 0.0, REST_RAD])
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("holding at five poses across the whole range for two seconds each")
    }

    fn joint(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut JointPort) {
        port.torque_nm -= p[0] * (port.theta_rad - p[1]);
    }
}
