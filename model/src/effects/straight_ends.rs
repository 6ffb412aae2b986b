//! A sheath that runs straight beside both pulleys and is bent evenly between: the same wrap angle on less of its length.

use crate::effect::{Component, Descriptor, Effect, MAX_PARAMETERS, ParameterSpec};
use crate::search::{Ordinary, OrdinaryUnit};

/// A sheath that runs straight beside both pulleys, see [`crate::sheath::TendonMesh::bent_between`].
pub struct StraightEnds;

/// What a sheath has straight beside each pulley, as a part of its length, and the standard deviation of that.
const STRAIGHT: [f64; 2] = [0.1, 0.07];

/// Standard deviation of where the middle of the bends lies, as a part of the sheath's length.
const MIDDLE_STD: f64 = 0.1;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "straight_ends",
    component: Component::Transmission,
    summary: "the sheath is straight beside the pulleys",
    parameters: &[
        ParameterSpec::linear(
            "straight_share",
            "1",
            [0.0, 0.4],
            STRAIGHT[0],
            "part of the sheath's length beside each pulley that is straight",
        )
        .believed_within(STRAIGHT[0], STRAIGHT[1]),
        ParameterSpec::linear(
            "towards_joint",
            "1",
            [-2.0 * MIDDLE_STD, 2.0 * MIDDLE_STD],
            0.0,
            "part of the sheath's length by which the bends lie nearer to the joint",
        )
        .believed_within(0.0, MIDDLE_STD),
    ],
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

    /// No sheath is bent evenly from pulley to pulley: what lies before the first bend and behind the last one gives way without friction.
    fn ordinary(&self) -> Option<Ordinary> {
        Some(Ordinary { unit: OrdinaryUnit::OfBends, usual: STRAIGHT[0], largest: 0.3, parameters: 2 })
    }

    fn bent_between(&self, p: &[f64; MAX_PARAMETERS]) -> Option<[f64; 2]> {
        let [straight, towards_joint, ..] = *p;
        Some([(straight + towards_joint).max(0.0), (1.0 - straight + towards_joint).min(1.0)])
    }
}
