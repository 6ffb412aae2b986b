//! The arm touches a stop: `τ = -s k d (d / 0.1 rad)^(n - 1) (1 + c ḋ)`, at least 0 against the arm, with the depth `d = max(s (θ - θ_stop), 0)` and the side
//! `s` given by the sign of the stop angle.
//!
//! With `n = 1` and `c = 0` the stop is a spring. A contact of two bodies gets stiffer as they flatten, `n` = 1.5 for round ones, and loses energy in proportion to the
//! depth: Hunt and Crossley, J. Appl. Mech. 42 (1975) 440.

use libm::pow;

use crate::effect::{Component, Descriptor, Effect, EffectState, JointPort, MAX_PARAMETERS, ParameterSpec};
use crate::search::Starts;

/// Depth at which the stiffness is stated, rad.
const STATED_DEPTH_RAD: f64 = 0.1;

/// The arm touches a stop: `τ = -s k d (d / 0.1 rad)^(n - 1) (1 + c ḋ)`, with the depth `d = max(s (θ - θ_stop), 0)` and the side `s` given by the
/// sign of the stop angle.
pub struct EndStopContact;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "end_stop_contact",
    component: Component::Joint,
    summary: "the arm touches an end stop",
    parameters: &[
        ParameterSpec::log(
            "stiffness_nm_per_rad",
            "N·m/rad",
            [0.1, 1000.0],
            20.0,
            "torque over depth at a depth of 0.1 rad",
        ),
        ParameterSpec::linear(
            "stop_rad",
            "rad",
            [-3.2, 3.2],
            0.5,
            "angle of first contact; its sign tells the side",
        ),
        // A short touch tells neither.
        ParameterSpec::linear("exponent", "1", [1.0, 3.0], 1.0, "power of the depth")
            .believed_within(1.0, 0.5),
        ParameterSpec::linear(
            "damping_s_per_rad",
            "s/rad",
            [0.0, 2.0],
            0.0,
            "share of the torque added by speed",
        )
        .believed_within(0.0, 0.5),
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
        let [stiffness_nm_per_rad, stop_rad, exponent, damping_s_per_rad, ..] = *p;
        let side = 1.0_f64.copysign(stop_rad);
        let depth_rad = side * (port.theta_rad - stop_rad);
        if depth_rad > 0.0 {
            let stiffened =
                if exponent == 1.0 { 1.0 } else { pow(depth_rad / STATED_DEPTH_RAD, exponent - 1.0) };
            let damped = (1.0 + damping_s_per_rad * side * port.omega_rad_s).max(0.0);
            port.torque_nm -= side * stiffness_nm_per_rad * depth_rad * stiffened * damped;
        }
    }
}
