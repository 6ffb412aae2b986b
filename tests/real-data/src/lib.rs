//! Scores on recordings of real benches that took no part in what is scored.
//!
//! [`study`] makes the diagnosis of a data set and replays what it held out. The other modules are what it is compared with, fits by people: every
//! recording is left out once, all parameters are fitted to the others, and the left-out one is replayed. The physics of these fits was
//! chosen by people who had seen all recordings; `host-tools/docs/real-recordings.md` says how far that reaches.

#![forbid(unsafe_code)]

pub mod band_damper;
pub mod cable_tool;
pub mod cogging_motor;
pub mod direct_drive;
pub mod joint_fit;
pub mod late;
pub mod page;
pub mod servo_pendulum;
pub mod study;
mod table;

use std::fmt;
use std::path::Path;

use bowden_core::outcome::Failure;
use bowden_core::rig::Rig;
use bowden_model::effect::ActiveEffect;
use bowden_model::effects::find;

pub use table::Table;

/// What a data set demands of the physics that is meant to explain it.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// What is scored, with its unit.
    pub quantity: &'static str,
    /// Score over all held-out recordings.
    pub score: f64,
    /// Largest score that passes.
    pub limit: f64,
}

impl Mark {
    /// Whether the score passes; a score that is not a number does not.
    #[must_use]
    pub fn met(&self) -> bool {
        self.score <= self.limit
    }
}

impl fmt::Display for Mark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.met() { "met" } else { "MISSED" };
        write!(f, "{}: {:.4}, mark {:.4}: {verdict}", self.quantity, self.score, self.limit)
    }
}

/// Root of the mean square.
#[must_use]
pub fn root_mean_square(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values {
        sum += value * value;
        count += 1.0;
    }
    f64::sqrt(sum / count)
}

/// Mean.
#[must_use]
pub fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values {
        sum += value;
        count += 1.0;
    }
    sum / count
}

/// Standard deviation: root mean square about the mean.
#[must_use]
pub fn standard_deviation(values: &[f64]) -> f64 {
    let middle = mean(values.iter().copied());
    root_mean_square(values.iter().map(|value| value - middle))
}

/// A rig file that a reference fit starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RigFile {
    /// Where it is.
    pub name: &'static str,
    /// What it holds.
    pub text: &'static str,
}

impl RigFile {
    /// The rig.
    ///
    /// # Errors
    /// When the text is no rig.
    pub fn parse(self) -> Result<Rig, Failure> {
        Rig::parse(self.text, self.name)
    }
}

/// The [`RigFile`] of a path from this package.
macro_rules! rig_file {
    ($path:literal) => {
        $crate::RigFile { name: $path, text: include_str!(concat!("../", $path)) }
    };
}
use rig_file;

/// Effects of the catalogue with some values, and the usual ones of the others. A name that the catalogue does not have panics: without
/// it another joint would be measured.
fn with_values(effects: &[(&str, &[(&str, f64)])]) -> Vec<ActiveEffect> {
    let of = |(id, values): &(&str, &[(&str, f64)])| {
        let effect = find(id).unwrap_or_else(|| panic!("{id}: no effect of the catalogue"));
        values.iter().fold(ActiveEffect::with_defaults(effect), |effect, (name, value)| {
            assert!(effect.descriptor().index_of(name).is_some(), "{id}: no parameter {name}");
            effect.with(name, *value)
        })
    };
    effects.iter().map(of).collect()
}

/// The reason for a file of a data set that cannot be used.
fn unusable(path: &Path, reason: impl fmt::Display) -> Failure {
    Failure::bad_input(format!("{}: {reason}; name the folder that holds the data sets", path.display()))
}

/// Names of the recordings in the manifest of a data set, in its order.
///
/// # Errors
/// When the manifest cannot be read or names none.
pub fn listed_recordings(folder: &Path) -> Result<Vec<String>, Failure> {
    let path = folder.join("manifest.csv");
    let mut reader = csv::Reader::from_path(&path).map_err(|error| unusable(&path, error))?;
    let mut names = Vec::new();
    for row in reader.records() {
        let row = row.map_err(|error| unusable(&path, error))?;
        names.extend(row.get(0).and_then(|file| file.strip_suffix(".csv")).map(str::to_owned));
    }
    names.sort_unstable();
    if names.is_empty() { Err(unusable(&path, "lists no recordings")) } else { Ok(names) }
}

/// Columns of a table of numbers, in the order of `names`.
///
/// # Errors
/// When the file cannot be read, lacks a column, or holds something else than a number there.
pub fn columns<const N: usize>(path: &Path, names: [&str; N]) -> Result<[Vec<f64>; N], Failure> {
    let mut reader = csv::Reader::from_path(path).map_err(|error| unusable(path, error))?;
    let header = reader.headers().map_err(|error| unusable(path, error))?.clone();
    let mut places = [0; N];
    for (place, name) in places.iter_mut().zip(names) {
        *place = header
            .iter()
            .position(|there| there == name)
            .ok_or_else(|| unusable(path, format!("no column `{name}`")))?;
    }
    let mut columns = [const { Vec::new() }; N];
    for (number, row) in reader.records().enumerate() {
        let row = row.map_err(|error| unusable(path, error))?;
        for ((column, place), name) in columns.iter_mut().zip(places).zip(names) {
            let value = row.get(place).and_then(|cell| cell.parse().ok());
            let nothing = || unusable(path, format!("line {}: {name}: no number", number + 2));
            column.push(value.ok_or_else(nothing)?);
        }
    }
    Ok(columns)
}
