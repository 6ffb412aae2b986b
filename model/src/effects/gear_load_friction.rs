//! Dry friction of the gear that grows with the torque it carries: `τ = c |τ_load|`.

use crate::effect::{Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, MotorPort, ParameterSpec};

/// Dry friction of the gear that grows with the torque it carries: `τ = c |τ_load|`.
pub struct GearLoadFriction;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "gear_load_friction",
    component: Component::Motor,
    summary: "gear friction that grows with the torque carried",
    parameters: &[ParameterSpec::linear(
        "coefficient",
        "1",
        [0.0, 1.0],
        0.1,
        "friction torque per torque carried",
    )],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for GearLoadFriction {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn motor(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut MotorPort) {
        port.coulomb_nm += p[0] * port.load_torque_nm.abs();
    }
}
