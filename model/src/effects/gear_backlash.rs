//! Play between rotor and input pulley: no torque passes inside the gap.

use crate::effect::{Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, MotorPort, ParameterSpec};
use crate::search::Starts;

/// Play between rotor and input pulley: no torque passes inside the gap.
pub struct GearBacklash;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "gear_backlash",
    component: Component::Motor,
    summary: "play in the gear between rotor and input pulley",
    parameters: &[
        ParameterSpec::linear("gap_rad", "rad", [0.0, 0.5], 0.02, "whole play, at the input pulley"),
        ParameterSpec::linear(
            "drag_behind",
            "1",
            [0.0, 1.0],
            0.5,
            "share of the motor's viscous friction that acts on the pulley's side",
        ),
    ],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for GearBacklash {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    /// A simulation with a fifth more or less play than there is predicts no better than one without.
    fn starts(&self) -> Starts {
        Starts::ThirdsOfOctaves
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("slow small triangles about the hanging position, where the torque changes sign")
    }

    fn motor(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut MotorPort) {
        port.gear_play_rad += p[0];
        port.drag_behind_play = p[1];
    }
}
