//! A sheath that runs straight beside both pulleys and is bent evenly between: the same wrap angle on less of its length.

use crate::effect::{Component, Descriptor, Effect, MAX_PARAMETERS, ParameterSpec};

/// A sheath that runs straight beside both pulleys, see [`crate::sheath::TendonMesh::with_straight_ends`].
pub struct StraightEnds;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "straight_ends",
    component: Component::Transmission,
    summary: "the sheath is straight beside the pulleys",
    parameters: &[ParameterSpec::linear(
        "straight_share",
        "1",
        [0.0, 0.4],
        0.1,
        "part of the sheath's length beside each pulley that is straight",
    )],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for StraightEnds {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn on_request(&self) -> bool {
        true
    }

    fn straight_share(&self, p: &[f64; MAX_PARAMETERS]) -> f64 {
        p[0]
    }
}
