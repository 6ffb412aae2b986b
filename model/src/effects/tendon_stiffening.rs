//! Stiffness that grows with tension: `EA(T) = EA (1 + β (T / F_0 - 1))`, the rope beds in as it is loaded.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};
use libm::log1p as ln_1p;

/// Stiffness that grows with tension: `EA(T) = EA (1 + β (T / F_0 - 1))`, the rope beds in as it is loaded.
pub struct TendonStiffening;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "tendon_stiffening",
    component: Component::Transmission,
    summary: "tendons that get stiffer with tension",
    parameters: &[ParameterSpec::linear(
        "slope",
        "1",
        [-0.4, 0.9],
        0.3,
        "relative gain of stiffness per relative gain of tension",
    )],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for TendonStiffening {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], s: &mut EffectState, port: &mut TransmissionPort) {
        if p[0].abs() < 1e-9 {
            return;
        }
        for (tendon, length_m) in port.tendons.iter_mut().zip(s.iter_mut()) {
            let relative = (tendon.mean_tension_n / port.pretension_n - 1.0).clamp(-1.0, 4.0);
            // Elongation beyond the linear tendon's, both counted from the pretension; the tension of the last step is
            // used, half a step at a time, which settles within milliseconds.
            let bent = ln_1p((p[0] * relative).max(-0.9)) / p[0];
            let wanted_m = (bent - relative) * port.pretension_n / port.stiffness_n_per_m;
            *length_m += 0.5 * (wanted_m - *length_m);
            tendon.added_length_m += *length_m;
        }
    }
}
