//! A spring pulls the joint towards an angle: `τ = -k d (1 + h d²)` with `d = θ - θ_0`, as of a cable harness, which is stiffer the
//! farther it is bent (the odd part of a spring's law up to the third power, as in Duffing's oscillator).

use crate::effect::{Component, Descriptor, Effect, EffectState, JointPort, MAX_PARAMETERS, ParameterSpec};
use crate::search::Starts;

/// Angle of rest at which a spring is looked for, either side of zero.
const REST_RAD: f64 = 0.05;

/// Standard deviation of the hardening of a spring of which nothing is known, 1/rad²: bent by 0.5 rad it is a quarter stiffer.
const HARDENING_STD: f64 = 1.0;

/// A spring pulls the joint towards an angle: `τ = -k d (1 + h d²)` with `d = θ - θ_0`, as of a cable harness.
pub struct JointSpring;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "joint_spring",
    component: Component::Joint,
    summary: "a spring acts on the joint",
    parameters: &[
        ParameterSpec::linear("stiffness_nm_per_rad", "N·m/rad", [-20.0, 100.0], 0.3, "stiffness"),
        ParameterSpec::linear("rest_rad", "rad", [-3.2, 3.2], 0.0, "angle without spring torque"),
        // It never softens: within a swing that would be a lighter weight.
        ParameterSpec::linear(
            "hardening_per_rad2",
            "1/rad²",
            [0.0, 100.0],
            0.0,
            "growth of the stiffness, h",
        )
        .believed_within(0.0, HARDENING_STD),
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
        let bent_rad = port.theta_rad - p[1];
        port.torque_nm -= p[0] * bent_rad * (1.0 + p[2] * bent_rad * bent_rad);
    }
}
