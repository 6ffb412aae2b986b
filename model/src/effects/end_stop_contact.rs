//! The arm touches a stop: `τ = -k max(s (θ - θ_stop), 0) s`, with the side `s` given by the sign of the stop angle.

use crate::effect::{Component, Descriptor, Effect, EffectState, JointPort, MAX_PARAMETERS, ParameterSpec};
use crate::search::Starts;

/// The arm touches a stop: `τ = -k max(s (θ - θ_stop), 0) s`, with the side `s` given by the sign of the stop angle.
pub struct EndStopContact;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "end_stop_contact",
    component: Component::Joint,
    summary: "the arm touches an end stop",
    parameters: &[
        ParameterSpec::log("stiffness_nm_per_rad", "N·m/rad", [0.1, 1000.0], 20.0, "stiffness of the stop"),
        ParameterSpec::linear(
            "stop_rad",
            "rad",
            [-3.2, 3.2],
            0.5,
            "angle of first contact; its sign tells the side",
        ),
    ],
    neutral: None,
    channels: &[],
};

impl Effect for EndStopContact {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn starts(&self) -> Starts {
        Starts::EndsOfTravel
    }

    fn joint(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut JointPort) {
        let side = 1.0_f64.copysign(p[1]);
        let depth_rad = (side * (port.theta_rad - p[1])).max(0.0);
        port.torque_nm -= side * p[0] * depth_rad;
    }
}
