//! Contacts between tendon and sheath give way elastically before they slip: `dg = -g dx / δ`, with the distance `g` to
//! the friction limit and the travel `x` of each contact.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};
use crate::search::{Ordinary, OrdinaryUnit};

/// Contacts between tendon and sheath give way elastically before they slip: Dahl's law over `δ`, see
/// [`crate::sheath::presliding`].
pub struct PreslidingCompliance;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "presliding_compliance",
    component: Component::Transmission,
    summary: "tendon and sheath give way elastically before they slip",
    parameters: &[ParameterSpec::log(
        "displacement_m",
        "m",
        [1e-6, 2e-3],
        5e-5,
        "travel that mobilises 63 % of the friction",
    )],
    neutral: None,
    channels: &[],
};

impl Effect for PreslidingCompliance {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    /// Travel of a contact before it slips: 6 to 16 µm came out of virtual benches, whose bristles give way over 7.5 µm.
    fn ordinary(&self) -> Option<Ordinary> {
        Some(Ordinary { unit: OrdinaryUnit::OfSheath, usual: 1e-5, largest: 4e-5, parameters: 1 })
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        for tendon in &mut port.tendons {
            tendon.presliding_m = p[0];
        }
    }
}
