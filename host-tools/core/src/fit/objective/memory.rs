//! Replays that were simulated lately. A search asks for the same joint again and again: a candidate is judged, given room and fitted from
//! one start, and the laws of a component are screened where the names were.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use super::block::Moments;
use crate::joint_model::JointModel;
use crate::simulation::Passes;

/// Bytes that the replays of one recording may take, unless a single one takes more: 140 of 40 s with all channels, one of an hour.
const BYTES: usize = 16 << 20;

/// Moments of every series of a replay.
pub(super) type Seen = Vec<Vec<Moments>>;

/// One replay.
#[derive(Debug)]
struct Replayed {
    joint: JointModel,
    passes: Passes,
    seen: Arc<Seen>,
}

/// The last replays of one recording, the latest in the last place.
#[derive(Debug, Default)]
pub(super) struct Memory(Mutex<VecDeque<Replayed>>);

/// A copy has everything still to be simulated: its recording may become another one.
impl Clone for Memory {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl Memory {
    /// What was seen of a joint in these passes.
    pub(super) fn recall(&self, joint: &JointModel, passes: Passes) -> Option<Arc<Seen>> {
        let replays = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |replayed: &&Replayed| replayed.passes == passes && replayed.joint == *joint;
        replays.iter().rfind(same).map(|replayed| Arc::clone(&replayed.seen))
    }

    /// Remembers what was seen of a joint, and forgets what was seen longest ago.
    pub(super) fn keep(&self, joint: JointModel, passes: Passes, seen: &Arc<Seen>) {
        let bytes = seen.iter().map(|moments| size_of_val(moments.as_slice())).sum::<usize>();
        let most = (BYTES / bytes.max(1)).max(1);
        let mut replays = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        while replays.len() >= most {
            replays.pop_front();
        }
        replays.push_back(Replayed { joint, passes, seen: Arc::clone(seen) });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bench;

    /// Moments that take a third of the room.
    fn seen() -> Arc<Seen> {
        let moments = Moments { mean: 0.0, variance: 0.0 };
        Arc::new(vec![vec![moments; BYTES / 3 / size_of::<Moments>()]])
    }

    #[test]
    fn what_was_seen_of_a_joint_is_recalled_until_there_is_no_room_for_it() {
        let joint = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(10)).unwrap();
        let with_step = |step_s: f64| JointModel { step_s, ..joint.clone() };
        let (memory, first) = (Memory::default(), seen());
        let whole = Passes::All;
        memory.keep(with_step(1.0), whole, &first);
        memory.keep(with_step(2.0), whole, &seen());
        memory.keep(with_step(3.0), whole, &seen());
        assert!(Arc::ptr_eq(&memory.recall(&with_step(1.0), whole).unwrap(), &first));
        assert!(memory.recall(&with_step(1.0), Passes::First).is_none());
        assert!(memory.recall(&with_step(4.0), whole).is_none());
        assert!(memory.clone().recall(&with_step(1.0), whole).is_none());
        memory.keep(with_step(4.0), whole, &seen());
        let kept = [1.0, 2.0, 3.0, 4.0].map(|s| memory.recall(&with_step(s), whole).is_some());
        assert_eq!(kept, [false, true, true, true]);
    }
}
