//! Board parameters from a rig file: what a fit or a diagnosis found, carried to the joint.
//!
//! | part of the rig | becomes |
//! |---|---|
//! | `[motor]`, `[pulleys]`, `[tendon]`, `[sheath]`, `[load]` | the parameter of the same meaning, see [`nominal`] |
//! | gain and zero of a sensor | gain and zero of the board's channel, see [`sensors`] |
//! | any other effect | its correction on the board, see [`corrections`], or a reason why there is none, see [`effects`] |
//!
//! A [`Transfer`] only says what is to be set; [`ParameterSet::replace`] sets it.

mod corrections;
mod draft;
mod effects;
mod nominal;
mod sensors;

use std::fmt::Write;

use bowden_core::outcome::Failure;
use bowden_core::rig::Rig;
use bowden_model::effect::ActiveEffect;
use draft::Draft;
use serde::Serialize;

use super::parameters::ParameterSet;

/// A parameter that gets another value; as JSON with the keys of `investigation.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Index of the parameter.
    #[serde(skip)]
    pub index: u16,
    /// Name of the parameter.
    #[serde(rename = "parameter")]
    pub name: String,
    /// Value on the board.
    pub old: f32,
    /// Value from the rig.
    pub new: f32,
    /// Unit of both, empty for a bare number.
    pub unit: String,
    /// Keys of the rig file that the new value comes from.
    #[serde(rename = "from")]
    pub sources: String,
}

/// Something that does not act in full: a part of the rig that the board cannot use, or a limit of the board.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Unused {
    /// Key of the rig file, or parameter of the board.
    pub source: String,
    /// Why not.
    pub reason: String,
}

/// What a rig file changes on a board.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Transfer {
    /// Parameters to set, in the board's order; all within their ranges.
    pub changes: Vec<Change>,
    /// Parts of the rig that change nothing.
    pub unused: Vec<Unused>,
    /// Limits of the board that cut a part of the rig.
    pub limited: Vec<Unused>,
}

impl Transfer {
    /// Compares `rig` with the board's `parameters`. Values that differ by no more than the board resolves are no changes.
    ///
    /// `recorded` are the parameters under which the recordings of the rig were made, where they differ from the
    /// board's: errors of sensors are relative to them. `source` is the rig's name in messages.
    ///
    /// # Errors
    /// Exit status 2 for a value outside the range of its parameter: which, got, allowed.
    pub fn new(
        rig: &Rig,
        source: &str,
        parameters: &ParameterSet,
        recorded: &[(u16, f32)],
    ) -> Result<Self, Failure> {
        let mut draft = Draft::new(parameters, recorded);
        let mut unused = nominal::carry(rig, &mut draft);
        // What a channel shows passes its effects in the order of the file; it is undone from the last one on.
        let (mut instances, others): (Vec<&ActiveEffect>, Vec<&ActiveEffect>) =
            rig.effects.iter().rev().partition(|active| active.effect.instances_differ_in().is_some());
        // The board has places for the strongest ones.
        instances.sort_by(|a, b| a.parameters[0].abs().total_cmp(&b.parameters[0].abs()));
        let mut of_effects: Vec<Unused> = others
            .into_iter()
            .chain(instances.into_iter().rev())
            .filter_map(|active| effects::carry(active, &mut draft))
            .collect();
        of_effects.reverse();
        unused.append(&mut of_effects);
        Ok(Self { changes: draft.changes(source)?, unused, limited: corrections::limited(&draft) })
    }

    /// The new values by index, for [`ParameterSet::replace`].
    pub fn values(&self) -> Vec<(u16, f32)> {
        self.changes.iter().map(|change| (change.index, change.new)).collect()
    }

    /// A table of the changes, and one line for each part of the rig that is not used.
    pub fn table(&self) -> String {
        let mut rows = vec![["parameter", "old", "new", "unit", "from"].map(str::to_owned)];
        rows.extend(self.changes.iter().map(|change| {
            let Change { name, old, new, unit, sources, .. } = change;
            [name.clone(), format!("{old:?}"), format!("{new:?}"), unit.clone(), sources.clone()]
        }));
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let widths = [0, 1, 2, 3].map(width);
        let mut text = String::new();
        if self.changes.is_empty() {
            text += "no parameter changes\n";
        } else {
            for [name, old, new, unit, sources] in &rows {
                let [w0, w1, w2, w3] = widths;
                let _ = writeln!(text, "{name:w0$}  {old:w1$}  {new:w2$}  {unit:w3$}  {sources}");
            }
        }
        for Unused { source, reason } in &self.unused {
            let _ = writeln!(text, "not used: {source}: {reason}");
        }
        for Unused { source, reason } in &self.limited {
            let _ = writeln!(text, "limited: {source}: {reason}");
        }
        text
    }
}
