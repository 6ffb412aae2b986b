//! Slow stretch under load: `τ dx/dt = ρ T / k - x` with end-to-end stiffness `k`, starting from what the pretension `F0`
//! alone has done in the time before, `x = ρ/(1+ρ) F0/k (1 - exp(-(1+ρ) age/τ))`: the length between the pulleys is held,
//! so that the tension falls by `k x` meanwhile. A recording that follows others of the bench begins later by their length.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};
use crate::search::Aftermath;
use libm::exp;

/// Slow stretch under load: `τ dx/dt = ρ T / k - x` with end-to-end stiffness `k`.
pub struct TendonCreep;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "tendon_creep",
    component: Component::Transmission,
    summary: "tendons that stretch slowly under load",
    parameters: &[
        ParameterSpec::linear("ratio", "1", [0.0, 2.0], 0.15, "final creep over elastic elongation"),
        ParameterSpec::log("time_constant_s", "s", [0.05, 10000.0], 8.0, "time constant"),
        ParameterSpec::linear("age_s", "s", [0.0, 1e9], 0.0, "time under pretension before the clock begins")
            .not_searched(),
    ],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for TendonCreep {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn after(&self, p: &mut [f64; MAX_PARAMETERS], clock_s: f64) -> Aftermath {
        p[2] += clock_s;
        Aftermath::NONE
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], s: &mut EffectState, port: &mut TransmissionPort) {
        let [lengths_m @ .., begun] = s;
        if *begun == 0.0 {
            *begun = 1.0;
            let crept = p[0] / (1.0 + p[0]) * (1.0 - exp(-(1.0 + p[0]) * (p[2] + port.t_s) / p[1]));
            lengths_m.fill(crept * port.pretension_n / port.stiffness_n_per_m);
        }
        for (tendon, length_m) in port.tendons.iter_mut().zip(lengths_m) {
            let wanted_m = p[0] * tendon.mean_tension_n / port.stiffness_n_per_m;
            *length_m += port.dt_s / p[1] * (wanted_m - *length_m);
            tendon.added_length_m += *length_m;
        }
    }
}
