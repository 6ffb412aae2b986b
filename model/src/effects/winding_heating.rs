//! Winding resistance that rises with dissipated power: `R = R_0 (1 + x)`, `τ dx/dt = g i² R - x`.

use crate::effect::{Component, Descriptor, DrivePort, Effect, EffectState, MAX_PARAMETERS, ParameterSpec};
use crate::search::Starts;

/// Winding resistance that rises with dissipated power: `R = R_0 (1 + x)`, `τ dx/dt = g i² R - x`.
pub struct WindingHeating;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "winding_heating",
    component: Component::Motor,
    summary: "winding resistance that rises as the motor warms up",
    parameters: &[
        ParameterSpec::linear(
            "gain_per_w",
            "1/W",
            [0.0, 1.0],
            0.05,
            "relative rise of resistance per watt in steady state",
        ),
        ParameterSpec::log("time_constant_s", "s", [0.5, 2000.0], 20.0, "thermal time constant"),
    ],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for WindingHeating {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn starts(&self) -> Starts {
        Starts::HeatByPower
    }

    fn drive(&self, p: &[f64; MAX_PARAMETERS], s: &mut EffectState, port: &mut DrivePort) {
        let resistance_ohm = port.resistance_ohm * (1.0 + s[0]);
        let power_w = port.current_a * port.current_a * resistance_ohm;
        s[0] += port.dt_s / p[1] * (p[0] * power_w - s[0]);
        port.resistance_ohm = resistance_ohm;
    }
}
