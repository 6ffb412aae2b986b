//! Sheath friction that does not scale with tension, as of a stiff or coated rope: `q` newton per radian of wrap.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};

/// Sheath friction that does not scale with tension, as of a stiff or coated rope: `q` newton per radian of wrap.
pub struct BendingFriction;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "bending_friction",
    component: Component::Transmission,
    summary: "a part of the sheath friction that does not scale with tension",
    parameters: &[ParameterSpec::linear(
        "friction_n_per_rad",
        "N/rad",
        [0.0, 100.0],
        0.6,
        "friction per wrap angle",
    )],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for BendingFriction {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("the same slow triangle at three pretensions")
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        for law in port.tendons.iter_mut().flat_map(|tendon| &mut tendon.slip) {
            law.friction_n_per_rad += p[0];
        }
    }
}
