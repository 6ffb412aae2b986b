//! The weight changes at some moment: `m → m + Δm` at `t_0`.

use crate::effect::{Component, Descriptor, Effect, EffectState, JointPort, MAX_PARAMETERS, ParameterSpec};

/// The weight changes at some moment: `m → m + Δm` at `t_0`.
pub struct PayloadChange;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "payload_change",
    component: Component::Joint,
    summary: "the weight at the arm changes at some moment",
    parameters: &[
        ParameterSpec::linear("change_kg", "kg", [-100.0, 100.0], 0.5, "change of mass"),
        ParameterSpec::linear("time_s", "s", [0.0, 100_000.0], 10.0, "when it happens"),
    ],
    neutral: Some(0.0),
    channels: &[],
};

/// Time over which the weight changes; short against any motion, long enough for a smooth fit of the moment.
const HANDLING_TIME_S: f64 = 0.02;

impl Effect for PayloadChange {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("holding at five poses across the whole range for two seconds each")
    }

    fn joint(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut JointPort) {
        let share = ((port.t_s - p[1]) / HANDLING_TIME_S + 0.5).clamp(0.0, 1.0);
        port.mass_kg = (port.mass_kg + p[0] * share).max(0.0);
    }
}
