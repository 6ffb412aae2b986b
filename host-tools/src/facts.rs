//! What is in a recording, in numbers: for people and, as JSON, for programs.
//!
//! What is wrong with it are its `findings`; what its reader had to repair are notes of the reader.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use bowden_core::recording::{Column, END_GROUP, RECORDING_GROUP, Recording};
use bowden_link::{Limit, State};
use bowden_model::channel::Channel;
use serde::Serialize;

/// Gaps that are listed; all are counted.
const GAPS_SHOWN: usize = 5;

/// Sampling is even where so many of the steps are the median step.
const EVEN_SHARE: f64 = 0.95;

/// Relative difference of two equal steps: times are rounded.
const EVEN_TOLERANCE: f64 = 1e-3;

/// What is in a recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Facts {
    /// File.
    pub file: String,
    /// Size, bytes.
    pub bytes: u64,
    /// Rows.
    pub rows: usize,
    /// Time of the first row, s.
    pub start_s: f64,
    /// Time from the first to the last row, s.
    pub duration_s: f64,
    /// Rows a second by the median step, Hz; none for one row.
    pub rate_hz: Option<f64>,
    /// Whether nearly all steps are equal.
    pub even: bool,
    /// Where rows are missing.
    pub gaps: Gaps,
    /// Columns beside the time.
    pub columns: Vec<ColumnFacts>,
    /// When the board went to fault, s.
    pub faults_s: Vec<f64>,
    /// Rows in which a limit of the board acted, by its name.
    pub limits: BTreeMap<String, usize>,
    /// What the file says beside the rows, without the board's parameters.
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
    /// Parameters of the board that the file holds.
    pub parameters: usize,
    /// Angles, tensions and torques that have the same value in every row: a sensor that hangs, or a joint at rest.
    pub still: Vec<String>,
    /// What is wrong, one line each.
    pub findings: Vec<String>,
}

/// Where rows are missing.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Gaps {
    /// How many there are.
    pub count: usize,
    /// Rows that would fill them.
    pub rows: u64,
    /// The first ones.
    pub first: Vec<Gap>,
}

/// Where rows are missing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gap {
    /// Time of the row before, s.
    pub after_s: f64,
    /// Length, s.
    pub length_s: f64,
}

/// A column in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ColumnFacts {
    /// Name.
    pub name: String,
    /// Whether it is a role.
    pub role: bool,
    /// Unit, where it is known.
    pub unit: Option<String>,
    /// Smallest, mean and largest value; none for text.
    pub range: Option<[f64; 3]>,
}

impl Facts {
    /// Looks at a recording from a file.
    pub fn of(recording: &Recording, path: &Path) -> Self {
        let t_s = recording.t_s();
        let step_s = recording.median_step_s();
        let (even, gaps) =
            step_s.map_or((false, Gaps::default()), |step_s| gaps(t_s, step_s, recording.gap_s()));
        let state = numbers(recording, "state");
        let fault = f64::from(State::Fault as u8);
        let faults_s = state.iter().flat_map(|state| {
            let began =
                (0..state.len()).filter(|row| state[*row] == fault && (*row == 0 || state[row - 1] != fault));
            began.map(|row| t_s[row]).collect::<Vec<_>>()
        });
        let mut facts = Self {
            file: path.display().to_string(),
            bytes: path.metadata().map_or(0, |file| file.len()),
            rows: recording.len(),
            start_s: t_s.first().copied().unwrap_or_default(),
            duration_s: recording.duration_s(),
            rate_hz: step_s.map(f64::recip),
            even,
            gaps,
            columns: recording.columns().iter().map(|column| column_facts(recording, column)).collect(),
            faults_s: faults_s.collect(),
            limits: limits(recording),
            metadata: [RECORDING_GROUP, END_GROUP]
                .into_iter()
                .filter_map(|group| Some((group.to_owned(), recording.metadata().group(group)?.clone())))
                .collect(),
            parameters: recording.metadata().group("bowden.parameters").map_or(0, BTreeMap::len),
            still: still(recording),
            findings: Vec::new(),
        };
        facts.findings = facts.wrong(recording);
        facts
    }

    /// What is wrong with the recording, one line each, beside what its reader has noted.
    fn wrong(&self, recording: &Recording) -> Vec<String> {
        let file = &self.file;
        let mut lines = Vec::new();
        // A reader that holds it against a rig has said so already.
        let said = recording
            .notes()
            .iter()
            .any(|note| note.contains("a gap in t_s") || note.contains("stand still for"));
        if let Some(first) = self.gaps.first.first().filter(|_| !said) {
            let Gaps { count, rows, .. } = self.gaps;
            let plural = if count == 1 { "" } else { "s" };
            lines.push(format!(
                "{file}: {rows} rows are missing in {count} gap{plural}, the first after t_s = {:?} for {:.4} s; what follows a gap is \
                 not compared for 0.3 s",
                first.after_s, first.length_s
            ));
        }
        if let Some(first_s) = self.faults_s.first() {
            let end =
                recording.metadata().entry(END_GROUP, "end").map_or(String::new(), |end| format!(": {end}"));
            lines.push(format!("{file}: the board went to fault at t_s = {first_s:?}{end}"));
        }
        let began = recording.metadata().group(RECORDING_GROUP).is_some();
        if began && recording.metadata().group(END_GROUP).is_none() {
            lines.push(format!(
                "{file}: the end of the recording is missing: the program was stopped by force"
            ));
        }
        // Spikes and rows that stand still, as a replay would treat them.
        let mut treated = recording.clone();
        let noted = treated.notes().len();
        treated.drop_frozen_rows();
        treated.set_spikes_aside(|_| None);
        lines.extend(treated.notes()[noted..].iter().map(|note| {
            let note = note.replace(" were set aside", " would be set aside");
            note.replace(" were dropped", " would be dropped")
        }));
        lines
    }

    /// Text for people.
    pub fn text(&self) -> String {
        let mut text = format!(
            "{}: {} rows, {:.3} s from t_s = {:?}, {}{} bytes\n",
            self.file,
            self.rows,
            self.duration_s,
            self.start_s,
            match self.rate_hz {
                Some(rate_hz) if self.even => format!("{rate_hz:.1} Hz, "),
                Some(rate_hz) => format!("uneven, {rate_hz:.1} Hz in the median, "),
                None => String::new(),
            },
            self.bytes
        );
        let width = self.columns.iter().map(|column| column.name.len()).max().unwrap_or(0);
        for column in &self.columns {
            let ColumnFacts { name, unit, range, .. } = column;
            let unit = unit.as_deref().unwrap_or("");
            let _ = match range {
                Some([least, mean, most]) => {
                    writeln!(text, "  {name:width$}  {least:>12.6} to {most:>12.6}, mean {mean:>12.6} {unit}")
                }
                None => writeln!(text, "  {name:width$}  text"),
            };
        }
        for Gap { after_s, length_s } in &self.gaps.first {
            let _ = writeln!(text, "  gap after t_s = {after_s:?}: {length_s:.4} s");
        }
        for (limit, rows) in &self.limits {
            let _ = writeln!(text, "  limit: {limit} in {rows} rows");
        }
        for (group, entries) in &self.metadata {
            for (name, value) in entries {
                let value = match value.lines().count() {
                    0 | 1 => value.clone(),
                    lines => format!("({lines} lines)"),
                };
                let _ = writeln!(text, "  {}.{name}: {value}", group.trim_start_matches("bowden."));
            }
        }
        if self.parameters > 0 {
            let _ = writeln!(text, "  parameters of the board: {}", self.parameters);
        }
        text
    }
}

/// Whether sampling is even, and where rows are missing.
fn gaps(t_s: &[f64], step_s: f64, uneven_gap_s: Option<f64>) -> (bool, Gaps) {
    let steps = || t_s.windows(2).map(|pair| pair[1] - pair[0]);
    let equal = steps().filter(|step| (step / step_s - 1.0).abs() < EVEN_TOLERANCE).count();
    let even = equal as f64 >= EVEN_SHARE * steps().count() as f64;
    let gap_s = if even { 1.5 * step_s } else { uneven_gap_s.unwrap_or(f64::INFINITY) };
    let mut gaps = Gaps::default();
    for (row, length_s) in steps().enumerate().filter(|(_, step)| *step > gap_s) {
        gaps.count += 1;
        gaps.rows += ((length_s / step_s).round() as u64).saturating_sub(1);
        if gaps.first.len() < GAPS_SHOWN {
            gaps.first.push(Gap { after_s: t_s[row], length_s });
        }
    }
    (even, gaps)
}

/// Values of a column by its name; none if it holds text.
pub fn numbers(recording: &Recording, name: &str) -> Option<Vec<f64>> {
    match recording.columns().iter().find(|column| column.name() == name)? {
        Column::Known { values, .. } => Some(values.to_vec()),
        Column::Unknown(text) => text.cells().map(|cell| cell.trim().parse().ok()).collect(),
    }
}

fn column_facts(recording: &Recording, column: &Column) -> ColumnFacts {
    let range = numbers(recording, column.name()).filter(|values| !values.is_empty()).map(|values| {
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        [least, values.iter().sum::<f64>() / values.len() as f64, most]
    });
    ColumnFacts {
        name: column.name().to_owned(),
        role: matches!(column, Column::Known { .. }),
        unit: recording.unit(column).map(str::to_owned),
        range,
    }
}

/// Angles, tensions and torques that have the same value in every row.
fn still(recording: &Recording) -> Vec<String> {
    let sensors = recording.channels().filter(|channel| channel.is_mechanical());
    let hangs = |channel: &Channel| {
        let values = recording.channel(*channel).unwrap_or_default();
        values.len() > 1 && values.windows(2).all(|pair| pair[0] == pair[1])
    };
    sensors.filter(hangs).map(|channel| channel.role().to_owned()).collect()
}

/// Rows in which a limit of the board acted.
fn limits(recording: &Recording) -> BTreeMap<String, usize> {
    let mut rows = BTreeMap::new();
    for limits in numbers(recording, "limits").unwrap_or_default() {
        for limit in Limit::ALL.into_iter().filter(|limit| limits as u16 & *limit as u16 != 0) {
            *rows.entry(limit.title().to_owned()).or_insert(0) += 1;
        }
    }
    rows
}
