//! Pretension that drops at some moment, as when an anchor slips: `F_0` falls by the share `f` at `t_0`.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};

/// Pretension that drops at some moment, as when an anchor slips: `F_0` falls by the share `f` at `t_0`.
pub struct PretensionLoss;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "pretension_loss",
    component: Component::Transmission,
    summary: "pretension drops at some moment",
    parameters: &[
        ParameterSpec::linear("share", "1", [0.0, 0.95], 0.2, "part of the pretension that is lost"),
        ParameterSpec::linear("time_s", "s", [0.0, 100_000.0], 10.0, "when it happens"),
    ],
    neutral: Some(0.0),
    channels: &[],
};

/// Time an anchor takes to slip; far below what a recording resolves, long enough for a smooth fit of the moment.
const SLIP_TIME_S: f64 = 0.02;

impl Effect for PretensionLoss {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        let share = p[0] * ((port.t_s - p[1]) / SLIP_TIME_S + 0.5).clamp(0.0, 1.0);
        for tendon in &mut port.tendons {
            tendon.added_length_m += share * port.pretension_n / port.stiffness_n_per_m;
        }
    }
}
