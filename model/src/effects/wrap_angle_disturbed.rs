//! Somebody moves the sheaths for a while: `K` changes by `ΔK` from `t_0` to `t_0 + T`, with ramps of a tenth of `T`, 2 s at
//! most.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};
use crate::search::Aftermath;

/// A hand has moved a sheath within this time, s: a change that takes longer is a drift.
const LONGEST_RAMP_S: f64 = 2.0;

/// Somebody moves the sheaths for a while: `K` changes by `ΔK` from `t_0` to `t_0 + T`, with ramps of a tenth of `T`, 2 s at most.
pub struct WrapAngleDisturbed;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "wrap_angle_disturbed",
    component: Component::Transmission,
    summary: "the sheaths were moved from outside for a while",
    parameters: &[
        ParameterSpec::linear("change_rad", "rad", [-6.0, 12.0], 1.5, "change of wrap angle while disturbed"),
        ParameterSpec::linear("start_s", "s", [0.0, 100_000.0], 10.0, "when it begins"),
        ParameterSpec::log("duration_s", "s", [0.2, 100_000.0], 5.0, "how long it lasts"),
    ],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for WrapAngleDisturbed {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    /// A disturbance that has ended is gone.
    fn after(&self, p: &mut [f64; MAX_PARAMETERS], clock_s: f64) -> Aftermath {
        let [_, start_s, duration_s, ..] = *p;
        if start_s + duration_s < clock_s { Aftermath::GONE } else { Aftermath::NONE }
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        let since_s = port.t_s - p[1];
        let until_s = p[1] + p[2] - port.t_s;
        let ramp_s = (0.1 * p[2]).min(LONGEST_RAMP_S);
        let share = (since_s.min(until_s) / ramp_s).clamp(0.0, 1.0);
        for tendon in &mut port.tendons {
            tendon.wrap_angle_rad = (tendon.wrap_angle_rad + p[0] * share).max(0.0);
        }
    }
}
