//! Dry friction of motor and gear: a constant torque `τ_c` that opposes motion.

use crate::dry_friction::BuildUp;
use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, MotorPort, PRESLIDING, PRESLIDING_EXPONENT,
    ParameterSpec,
};
use crate::search::{Ordinary, OrdinaryUnit};

/// Dry friction of motor and gear: a constant torque `τ_c` that opposes motion.
pub struct MotorCoulombFriction;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "motor_coulomb_friction",
    component: Component::Motor,
    summary: "dry friction in motor or gear",
    parameters: &[
        ParameterSpec::linear("torque_nm", "N·m", [0.0, 20.0], 0.08, "friction torque at the input pulley"),
        PRESLIDING,
        PRESLIDING_EXPONENT,
    ],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for MotorCoulombFriction {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    /// What bearings and teeth hold back.
    fn ordinary(&self) -> Option<Ordinary> {
        Some(Ordinary { unit: OrdinaryUnit::StallTorque, usual: 4e-4, largest: 1.5e-3, parameters: 1 })
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("constant-speed turns at five speeds from 0.02 to 2 rad/s in both directions, arm unloaded")
    }

    fn motor(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut MotorPort) {
        port.coulomb_nm += p[0];
        port.presliding_rad = p[1];
        port.build_up = BuildUp::of_exponent(p[2]);
    }
}
