//! Torque on the joint that is locked to its angle: `τ = A sin(n θ + φ)`, as of balls that have dented the race of a bearing.

use crate::channel::Channel;
use crate::effect::{Component, Descriptor, Effect, EffectState, JointPort, MAX_PARAMETERS, ParameterSpec};
use crate::search::Starts;
use libm::sin;

/// Torque on the joint that is locked to its angle: `τ = A sin(n θ + φ)`.
pub struct JointTorqueRipple;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "joint_torque_ripple",
    component: Component::Joint,
    summary: "torque ripple locked to the joint angle",
    parameters: &[
        ParameterSpec::linear("amplitude_nm", "N·m", [0.0, 20.0], 0.1, "amplitude at the joint"),
        ParameterSpec::log("cycles_per_turn", "1", [1.0, 2000.0], 20.0, "periods per turn of the joint"),
        ParameterSpec::linear("phase_rad", "rad", [-3.15, 3.15], 0.0, "phase at angle zero"),
    ],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for JointTorqueRipple {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn starts(&self) -> Starts {
        Starts::LockedTo(Channel::ThetaOut)
    }

    fn instances_differ_in(&self) -> Option<&'static str> {
        Some("cycles_per_turn")
    }

    fn on_request(&self) -> bool {
        true
    }

    fn joint(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut JointPort) {
        port.torque_nm += p[0] * sin(p[1] * port.theta_rad + p[2]);
    }
}
