//! Slow stretch under load: `τ dx/dt = ρ T / k - x` with end-to-end stiffness `k`, starting from none.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};

/// Slow stretch under load: `τ dx/dt = ρ T / k - x` with end-to-end stiffness `k`, starting from none.
pub struct TendonCreep;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "tendon_creep",
    component: Component::Transmission,
    summary: "tendons that stretch slowly under load",
    parameters: &[
        ParameterSpec::linear("ratio", "1", [0.0, 2.0], 0.15, "final creep over elastic elongation"),
        ParameterSpec::log("time_constant_s", "s", [0.05, 10000.0], 8.0, "time constant"),
    ],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for TendonCreep {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], s: &mut EffectState, port: &mut TransmissionPort) {
        for (tendon, length_m) in port.tendons.iter_mut().zip(s.iter_mut()) {
            let wanted_m = p[0] * tendon.mean_tension_n / port.stiffness_n_per_m;
            *length_m += port.dt_s / p[1] * (wanted_m - *length_m);
            tendon.added_length_m += *length_m;
        }
    }
}
