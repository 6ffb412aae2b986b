//! What is different on a bench or in a recording of a study, beside the parameters that all of it shares.

use crate::joint_model::{JointModel, OwnParameters};
use crate::rig::RigParameter;

/// Turns the joint that a study shares into the joint of one recording.
#[derive(Clone, Debug)]
pub struct Variation {
    /// The bench as its rig file states it, with what was different in the recording.
    base: JointModel,
    bench: usize,
    /// Effects that the rig file of the shared joint states; they come first in its list.
    stated_effects: usize,
    /// Parameters that the bench decides, not the shared joint.
    kept: Vec<RigParameter>,
    /// Parameters that the recording states.
    set: Vec<RigParameter>,
}

impl Variation {
    /// The variation of a recording of bench `bench`. `base` is that bench with what was different in the recording, `shared` the
    /// joint of the first bench as its rig file states it, `kept` what the bench decides and `set` what the recording states.
    #[must_use]
    pub fn new(
        base: JointModel,
        bench: usize,
        shared: &JointModel,
        kept: Vec<RigParameter>,
        set: Vec<RigParameter>,
    ) -> Self {
        Self { base, bench, stated_effects: shared.effects.len(), kept, set }
    }

    /// The joint of the recording: nominal parameters of `shared`, but for those that are kept, and its found effects, but for those that
    /// another bench alone has; sensors, channels, position loop and stated effects of the bench.
    #[must_use]
    pub fn apply(&self, shared: &JointModel) -> JointModel {
        let mut model = JointModel {
            elements: shared.elements,
            step_s: shared.step_s,
            guide_stride: shared.guide_stride,
            own: OwnParameters::default(),
            ..self.base.clone()
        };
        for parameter in RigParameter::nominal() {
            if let Some(value) = shared.value(&parameter)
                && !self.kept.contains(&parameter)
                && !self.set.contains(&parameter)
            {
                model.set_value(&parameter, value);
            }
        }
        let found = shared.effects[self.stated_effects.min(shared.effects.len())..].iter();
        model.effects.extend(found.filter(|effect| effect.is_on(self.bench as u16)));
        for own in shared.own.values.iter().filter(|own| own.bench == self.bench) {
            // What was different in the recording is known.
            if let Some(value) = own.value
                && !self.set.contains(&own.parameter)
            {
                model.set_value(&own.parameter, value);
            }
        }
        model
    }

    /// Whether something was different in the recording.
    #[must_use]
    pub const fn states_conditions(&self) -> bool {
        !self.set.is_empty()
    }

    /// The bench as its rig file states it, with what was different in the recording.
    #[must_use]
    pub const fn base(&self) -> &JointModel {
        &self.base
    }
}
