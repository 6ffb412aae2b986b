//! Viscous friction of motor and gear beyond the nominal one: `τ = -b ω`.

use crate::effect::{Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, MotorPort, ParameterSpec};

/// Viscous friction of motor and gear beyond the nominal one: `τ = -b ω`.
pub struct MotorViscousFriction;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "motor_viscous_friction",
    component: Component::Motor,
    summary: "viscous friction in motor or gear beyond the stated one",
    parameters: &[ParameterSpec::linear(
        "viscous_nm_s_per_rad",
        "N·m·s/rad",
        [0.0, 20.0],
        0.05,
        "added viscous friction at the input pulley",
    )],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for MotorViscousFriction {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("constant-speed turns at five speeds from 0.02 to 2 rad/s in both directions, arm unloaded")
    }

    fn motor(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut MotorPort) {
        port.torque_nm -= p[0] * port.omega_rad_s;
    }
}
