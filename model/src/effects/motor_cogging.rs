//! Torque ripple locked to the rotor position: `τ = A sin(n θ + φ)`.

use crate::channel::Channel;
use crate::effect::{Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, MotorPort, ParameterSpec};
use crate::search::Starts;
use libm::sin;

/// Torque ripple locked to the rotor position: `τ = A sin(n θ + φ)`.
pub struct MotorCogging;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "motor_cogging",
    component: Component::Motor,
    summary: "torque ripple locked to the motor position",
    parameters: &[
        ParameterSpec::linear("amplitude_nm", "N·m", [0.0, 20.0], 0.1, "amplitude at the input pulley"),
        ParameterSpec::log(
            "cycles_per_turn",
            "1",
            [1.0, 2000.0],
            40.0,
            "periods per turn of the input pulley",
        ),
        ParameterSpec::linear("phase_rad", "rad", [-3.15, 3.15], 0.0, "phase at angle zero"),
    ],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for MotorCogging {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn starts(&self) -> Starts {
        Starts::LockedTo(Channel::ThetaIn)
    }

    fn instances_differ_in(&self) -> Option<&'static str> {
        Some("cycles_per_turn")
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("one slow turn at constant speed in each direction with the tendons at low pretension")
    }

    fn motor(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut MotorPort) {
        port.torque_nm += p[0] * sin(p[1] * port.theta_rad + p[2]);
    }
}
