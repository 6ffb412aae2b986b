//! Dry friction of the joint: a constant torque `τ_c` that opposes motion.

use crate::dry_friction::BuildUp;
use crate::effect::{
    Component, Descriptor, Effect, EffectState, JointPort, MAX_PARAMETERS, PRESLIDING, PRESLIDING_EXPONENT,
    ParameterSpec,
};

/// Dry friction of the joint: a constant torque `τ_c` that opposes motion.
pub struct JointCoulombFriction;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "joint_coulomb_friction",
    component: Component::Joint,
    summary: "dry friction in the joint",
    parameters: &[
        ParameterSpec::linear("torque_nm", "N·m", [0.0, 20.0], 0.05, "friction torque"),
        PRESLIDING,
        PRESLIDING_EXPONENT,
    ],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for JointCoulombFriction {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn joint(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut JointPort) {
        port.coulomb_nm += p[0];
        port.presliding_rad = p[1];
        port.build_up = BuildUp::of_exponent(p[2]);
    }
}
