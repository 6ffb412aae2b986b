//! Friction acts along the whole sheath, so that a part of the tendon may stick while the rest slips; for a rig that
//! lumps it.

use crate::effect::{Component, Descriptor, Effect};
use crate::friction_law::FrictionLaw;

/// Friction acts along the whole sheath, so that a part of the tendon may stick while the rest slips; without effect where
/// the rig says so already.
pub struct DistributedFriction;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "distributed_friction",
    component: Component::Transmission,
    summary: "sheath friction acts along the whole sheath instead of at one place",
    parameters: &[],
    neutral: None,
    channels: &[],
};

impl Effect for DistributedFriction {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn friction_law(&self) -> Option<FrictionLaw> {
        Some(FrictionLaw::Distributed)
    }
}
