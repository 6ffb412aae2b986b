//! What a diagnosis changes on the board.

use serde::Serialize;

use crate::diagnose::verdict::Verdict;
use crate::link::from_rig::{Transfer, Unused};

/// What became of the new parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Nothing is to be changed.
    Unchanged,
    /// The user did not want them.
    Declined,
    /// They are set, until the board is switched off.
    Set,
    /// They were set, and the old ones are back.
    Restored,
}

/// A parameter with its old and new value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Name.
    pub parameter: String,
    /// Value before.
    pub old: f64,
    /// Value from the diagnosis.
    pub new: f64,
    /// Unit of both, empty for a bare number.
    pub unit: String,
    /// Keys of the rig that it comes from.
    pub from: String,
}

/// Something that does not act in full.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reason {
    /// Key of the rig, or parameter of the board.
    pub source: String,
    /// Why not.
    pub reason: String,
}

/// Parameters of the board before and after.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Changes {
    /// What became of them.
    pub state: State,
    /// The rig that they come from: `diagnosed`, or `given` where the diagnosis found nothing to change.
    pub rig: &'static str,
    /// New values.
    pub changes: Vec<Change>,
    /// Parts of the rig that the board cannot use.
    pub unused: Vec<Reason>,
    /// Limits of the board that cut a part of the rig.
    pub limited: Vec<Reason>,
}

/// Whether the parameters follow the diagnosed rig: not where the diagnosis found nothing, and not where it could not explain
/// what it saw, because the fitted values then make up for something else.
pub const fn follows_diagnosis(verdict: Verdict) -> bool {
    matches!(verdict, Verdict::MissingPhysics | Verdict::Recalibrate)
}

impl Changes {
    /// The account of a transfer.
    pub fn of(transfer: &Transfer, from_diagnosed: bool, state: State) -> Self {
        // The decimal number that stands for a parameter, not the binary one behind it.
        let number = |value: f32| format!("{value:?}").parse().unwrap_or(f64::from(value));
        let reason =
            |Unused { source, reason }: &Unused| Reason { source: source.clone(), reason: reason.clone() };
        let changes = transfer.changes.iter().map(|change| Change {
            parameter: change.name.clone(),
            old: number(change.old),
            new: number(change.new),
            unit: change.unit.clone(),
            from: change.sources.clone(),
        });
        Self {
            state,
            rig: if from_diagnosed { "diagnosed" } else { "given" },
            changes: changes.collect(),
            unused: transfer.unused.iter().map(reason).collect(),
            limited: transfer.limited.iter().map(reason).collect(),
        }
    }
}
