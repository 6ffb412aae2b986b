//! Recordings as an objective takes them.

use super::variation::Variation;
use crate::recording::Recording;

/// What a recording is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// Parameters are fitted to all of it.
    Training,
    /// Every third second is held out, parameters are fitted to the rest.
    Both,
    /// All of it is held out.
    HeldOut,
}

/// A recording and what it is used for.
#[derive(Clone, Debug)]
pub struct Observed<'r> {
    /// The samples.
    pub recording: &'r Recording,
    /// Whether anything is fitted to it.
    pub used_for: Use,
    /// Index of the bench.
    pub bench: usize,
    /// What is different in it; `None` where its joint is the one that all share.
    pub variation: Option<Variation>,
}

impl<'r> Observed<'r> {
    /// A recording of the only bench.
    #[must_use]
    pub const fn alone(recording: &'r Recording, used_for: Use) -> Self {
        Self { recording, used_for, bench: 0, variation: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::objective::{Objective, Part};
    use crate::joint_model::JointModel;
    use crate::test_bench;

    #[test]
    fn every_third_second_of_a_recording_for_both_is_held_out() {
        let recording = test_bench::swung(6000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let uses = [Use::Training, Use::Both, Use::HeldOut];
        let observed = uses.map(|used_for| Observed::alone(&recording, used_for)).to_vec();
        let objective = Objective::of(&model, observed).unwrap();
        let heldout_share = |recording: usize| {
            let blocks = objective.blocks(recording);
            let heldout = blocks.iter().filter(|block| block.part == Part::HeldOut).count();
            heldout as f64 / blocks.len() as f64
        };
        let [training, both, heldout] = [0, 1, 2].map(heldout_share);
        assert_eq!((training, heldout), (0.0, 1.0));
        assert!((0.25..0.42).contains(&both), "{both}");
    }
}
