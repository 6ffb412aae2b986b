//! Stiffness that grows with tension, as a rope beds in: `EA(T) = EA (1 + β (1 + c/2) r / (1 + c |r|))` with `r = T / F_0 - 1`, a straight line
//! `EA (1 + β r)` where `c` is 0.
//!
//! With `d = β (1 + c/2) + c sign(r)` a tendon whose tension goes from the pretension to `T` elongates, in units of `F_0 / k`, by
//!
//! ```text
//! ∫_0^r dr' / (1 + β (1 + c/2) r' / (1 + c |r'|)) = L + c sign(r) (r - L) / d,   L = ln(1 + d r) / d
//! ```

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};
use libm::log1p as ln_1p;

/// Stiffness that grows with tension: `EA(T) = EA (1 + β (1 + c/2) r / (1 + c |r|))` with `r = T / F_0 - 1`.
pub struct TendonStiffening;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "tendon_stiffening",
    component: Component::Transmission,
    summary: "tendons that get stiffer with tension",
    parameters: &[
        ParameterSpec::linear(
            "slope",
            "1",
            [-0.4, 0.9],
            0.3,
            "relative gain of stiffness per relative gain of tension, between the pretension and half as much again",
        ),
        ParameterSpec::linear(
            "levelling",
            "1",
            [0.0, 8.0],
            0.0,
            "how soon the stiffness levels off: half of the gain is there at a relative change of tension of one over this; 0 if it does not",
        )
        .believed_within(0.0, 2.0),
    ],
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
            let wanted_m =
                (elongation(p[0], p[1], relative) - relative) * port.pretension_n / port.stiffness_n_per_m;
            *length_m += 0.5 * (wanted_m - *length_m);
            tendon.added_length_m += *length_m;
        }
    }
}

/// Elongation from the pretension to a tension that is `relative` above it, over that of the pretension in the linear tendon.
fn elongation(slope: f64, levelling: f64, relative: f64) -> f64 {
    let bend = levelling.copysign(relative);
    let d = slope * (1.0 + 0.5 * levelling) + bend;
    let straight = if d.abs() < 1e-6 { relative } else { ln_1p((d * relative).max(-0.9)) / d };
    if levelling == 0.0 {
        return straight;
    }
    let second = if d.abs() < 1e-4 {
        relative * relative * (0.5 - d * relative / 3.0)
    } else {
        (relative - straight) / d
    };
    straight + bend * second
}
