//! Which recordings of a bench name an effect or a law, and since when.

use std::collections::BTreeMap;

use super::rows::SurveyRow;
use crate::diagnose::verdict::{Diagnosis, FoundLaw, NamedEffect};

/// Name of an effect on the page of a survey: those of two sensors are two.
pub(super) fn effect_name(effect: &NamedEffect) -> String {
    match &effect.channel {
        Some(channel) => format!("{} ({channel})", effect.id),
        None => effect.id.clone(),
    }
}

/// Name of a law on the page of a survey: its port.
pub(super) fn law_name(law: &FoundLaw) -> String {
    format!("law at {}", law.port)
}

/// Places of the recordings that name an effect or law, among all recordings of a bench, rising; by its name.
pub(super) fn occurrences(rows: &[SurveyRow<'_>]) -> BTreeMap<String, Vec<usize>> {
    let mut all: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (place, row) in rows.iter().enumerate() {
        let Some(Diagnosis { effects, laws, .. }) = row.surveyed.as_ref().map(|surveyed| &surveyed.diagnosis)
        else {
            continue;
        };
        for name in effects.iter().map(effect_name).chain(laws.iter().map(law_name)) {
            all.entry(name).or_default().push(place);
        }
    }
    // An effect may be named twice in a recording, with other parameters.
    all.values_mut().for_each(Vec::dedup);
    all
}

/// How the recordings that name an effect lie among those of a bench that were diagnosed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Since {
    /// All name it, from the first one, whose place this is.
    Always(usize),
    /// All from this place on name it, and these are two at least.
    From(usize),
    /// The one at this place names it alone.
    Once(usize),
    /// Some name it.
    Sometimes {
        /// How many do.
        count: usize,
        /// Of how many.
        diagnosed: usize,
        /// Place of the first that does.
        first: usize,
        /// Place of the last that does.
        last: usize,
    },
}

impl Since {
    /// From the places of the recordings that name it; `None` without any.
    pub(super) fn of(places: &[usize], rows: &[SurveyRow<'_>]) -> Option<Self> {
        let (&first, &last) = (places.first()?, places.last()?);
        let from = |place: usize| rows[place..].iter().filter(|row| row.surveyed.is_some()).count();
        let (count, diagnosed) = (places.len(), from(0));
        Some(match count {
            _ if count == diagnosed => Self::Always(first),
            2.. if count == from(first) => Self::From(first),
            1 => Self::Once(first),
            _ => Self::Sometimes { count, diagnosed, first, last },
        })
    }

    /// Place of the recording from which on all diagnosed ones name it; `None` where they do not, or where the last one is the only one.
    pub(super) const fn place(self) -> Option<usize> {
        match self {
            Self::Always(place) | Self::From(place) => Some(place),
            Self::Once(_) | Self::Sometimes { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::super::rows::Status;
    use super::super::store::Surveyed;
    use super::super::task::Task;
    use super::*;
    use crate::report::example::findings;

    /// A bench: for each recording whether it was diagnosed (`x`: names dry friction of the joint; `.`: names nothing) or failed (`-`).
    fn since(recordings: &str) -> Option<Since> {
        let task = Task { recording: "a.csv".into(), path: PathBuf::new(), bench: "a".into(), rig: None };
        let row = |kind: char| {
            let mut diagnosis = findings(2).diagnosis;
            let named = NamedEffect {
                id: "joint_coulomb_friction".into(),
                channel: None,
                ..diagnosis.effects[0].clone()
            };
            // Twice, as with other parameters.
            diagnosis.effects = if kind == 'x' { vec![named.clone(), named] } else { Vec::new() };
            diagnosis.laws.clear();
            let surveyed = Surveyed::new(&task, String::new(), (2, 1.0), Vec::new(), diagnosis);
            let status = if kind == '-' { Status::Failed("damaged".into()) } else { Status::Done };
            SurveyRow { task: &task, status, surveyed: (kind != '-').then_some(surveyed) }
        };
        let rows: Vec<SurveyRow<'_>> = recordings.chars().map(row).collect();
        let found = occurrences(&rows);
        assert!(found.len() <= 1);
        Since::of(found.get("joint_coulomb_friction")?, &rows)
    }

    #[test]
    fn an_effect_is_there_always_from_one_recording_on_once_or_sometimes() {
        let sometimes =
            |count, diagnosed, first, last| Some(Since::Sometimes { count, diagnosed, first, last });
        for (recordings, expected) in [
            ("...", None),
            ("-", None),
            ("x", Some(Since::Always(0))),
            ("xxx", Some(Since::Always(0))),
            // What failed says nothing.
            ("-x-x", Some(Since::Always(1))),
            (".xx", Some(Since::From(1))),
            ("..x-x-", Some(Since::From(2))),
            ("x..", Some(Since::Once(0))),
            ("..x", Some(Since::Once(2))),
            (".x-", Some(Since::Once(1))),
            ("xx.", sometimes(2, 3, 0, 1)),
            ("x.xx", sometimes(3, 4, 0, 3)),
            (".xx-.", sometimes(2, 4, 1, 2)),
        ] {
            assert_eq!(since(recordings), expected, "{recordings}");
        }
    }

    #[test]
    fn only_an_effect_that_lasts_has_a_first_recording() {
        for (recordings, place) in [("-x-x", Some(1)), (".xx", Some(1)), ("..x", None), ("xx.", None)] {
            assert_eq!(since(recordings).and_then(Since::place), place, "{recordings}");
        }
    }
}
