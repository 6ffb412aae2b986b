//! What a diagnosis changes on the board.

use bowden_core::diagnose::verdict::Verdict;
use bowden_core::rig::Rig;
use serde::Serialize;

use super::rounds::Diagnosed;
use super::verification::Effect;
use crate::from_rig::{Transfer, Unused};

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
    /// The rig that they come from.
    pub rig: Origin,
    /// New values.
    pub changes: Vec<Change>,
    /// Parts of the rig that the board cannot use.
    pub unused: Vec<Reason>,
    /// Limits of the board that cut a part of the rig.
    pub limited: Vec<Reason>,
    /// What was found and stays: effects that the board cannot correct, and what no effect explains.
    pub left: Vec<Reason>,
}

/// Where new values come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// The rig file as given: the diagnosis found nothing to change.
    Given,
    /// The diagnosed rig.
    Diagnosed,
    /// The diagnosed rig without the effects that it found, after the joint had followed worse with their corrections. Parameters
    /// were fitted beside those effects, so that they stay only where the joint follows better.
    DiagnosedWithoutEffects,
    /// Fitted nominal parameters of a diagnosis that could not explain what it saw. They may make up for something else, so
    /// that they stay only where the joint follows better.
    Recalibrated,
}

impl Origin {
    /// The origin that follows from a verdict.
    pub const fn of(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Consistent => Self::Given,
            Verdict::Recalibrate | Verdict::MissingPhysics => Self::Diagnosed,
            Verdict::Unexplained => Self::Recalibrated,
        }
    }

    /// Whether new values stay on the board, after what they did to the tracking error.
    pub const fn stays(self, effect: Option<Effect>) -> bool {
        match effect {
            Some(Effect::Better) | None => true,
            Some(Effect::Same) => !matches!(self, Self::Recalibrated | Self::DiagnosedWithoutEffects),
            Some(Effect::Worse) => false,
        }
    }
}

/// A rig whose values go to the board, and what is known to be missing in it.
#[derive(Clone, Debug)]
pub struct Correction {
    /// Where the values come from.
    pub origin: Origin,
    /// The values.
    pub rig: Rig,
    /// What no effect explains.
    pub unexplained: Option<Reason>,
}

impl Correction {
    /// What follows from a diagnosis of the given rig.
    pub fn of(found: Diagnosed, given: &Rig) -> Self {
        let diagnosis = &found.findings.diagnosis;
        let origin = Origin::of(diagnosis.verdict);
        let unexplained = diagnosis.unexplained.as_ref().map(|left| Reason {
            source: format!("{} of the {}", left.channel, left.component),
            reason: left.sentence.clone(),
        });
        let rig = if origin == Origin::Given { given.clone() } else { found.rig };
        Self { origin, rig, unexplained }
    }

    /// The same without the effects that the diagnosis found; `None` where it found none.
    pub fn without_effects(&self, given: &Rig) -> Option<Self> {
        if self.origin != Origin::Diagnosed || self.rig.effects == given.effects {
            return None;
        }
        let rig = Rig { effects: given.effects.clone(), ..self.rig.clone() };
        Some(Self { origin: Origin::DiagnosedWithoutEffects, rig, unexplained: self.unexplained.clone() })
    }
}

impl Changes {
    /// The account of a transfer.
    pub fn of(transfer: &Transfer, correction: &Correction, state: State) -> Self {
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
        let effects = transfer.unused.iter().filter(|unused| unused.source.starts_with("effects."));
        let left = effects.map(reason).chain(correction.unexplained.clone()).collect();
        Self {
            state,
            rig: correction.origin,
            changes: changes.collect(),
            unused: transfer.unused.iter().map(reason).collect(),
            limited: transfer.limited.iter().map(reason).collect(),
            left,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_that_may_make_up_for_something_else_stay_only_where_the_joint_follows_better() {
        let stays = |verdict| {
            [Effect::Better, Effect::Same, Effect::Worse]
                .map(|effect| Origin::of(verdict).stays(Some(effect)))
        };
        assert_eq!(stays(Verdict::Unexplained), [true, false, false]);
        for verdict in [Verdict::Consistent, Verdict::Recalibrate, Verdict::MissingPhysics] {
            assert_eq!(stays(verdict), [true, true, false], "{verdict:?}");
        }
    }
}
