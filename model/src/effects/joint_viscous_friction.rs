//! Viscous friction of the joint beyond the nominal one: `τ = -b ω`.

use crate::effect::{Component, Descriptor, Effect, EffectState, JointPort, MAX_PARAMETERS, ParameterSpec};

/// Viscous friction of the joint beyond the nominal one: `τ = -b ω`.
pub struct JointViscousFriction;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "joint_viscous_friction",
    component: Component::Joint,
    summary: "viscous friction in the joint beyond the stated one",
    parameters: &[ParameterSpec::linear(
        "viscous_nm_s_per_rad",
        "N·m·s/rad",
        [0.0, 20.0],
        0.05,
        "added viscous friction",
    )],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for JointViscousFriction {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn joint(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut JointPort) {
        port.torque_nm -= p[0] * port.omega_rad_s;
    }
}
