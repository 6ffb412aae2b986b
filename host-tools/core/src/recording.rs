//! Recordings: a table with one row a sample, from and to CSV, gzipped CSV, MCAP and Parquet.
//!
//! A recording holds the time `t_s`, strictly increasing, and columns. A column whose name is a role of
//! [`Channel`], or that a rig's [`ColumnMap`] assigns to one, is read as numbers; any other is kept as the text that
//! stood in the file and written back untouched. Numbers are written in the shortest form that reads back to the
//! same `f64`, so that converting between the formats and back changes no bit of them.

mod arrays;
mod build;
mod column;
mod columns;
mod comma_separated;
mod durable;
mod file;
mod format;
mod frozen;
mod gzip_members;
mod mcap_file;
mod metadata;
mod origin;
mod parquet_file;
mod place;
mod recover;
mod ros2;
mod row;
mod row_writer;
mod spikes;
mod tail;
mod text_column;

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use bowden_model::channel::Channel;

pub use column::Column;
pub use columns::{ColumnMap, ColumnSource, TIME_ROLE};
pub use durable::{DurableFile, DurableWriter, SAVE_INTERVAL, Saved};
pub use format::Format;
pub use mcap_file::{SCHEMA, TOPIC};
pub use metadata::{END_GROUP, METADATA_SCHEMA, Metadata, RECORDING_GROUP};
pub use place::Places;
pub use recover::{Recovered, recover};
pub use row::{Cell, RowColumn};
pub use row_writer::RowWriter;
pub use text_column::TextColumn;

/// A step in time longer than so many median steps is a gap: samples were lost.
const GAP_IN_STEPS: f64 = 10.0;

/// Buffer between file and parser, bytes.
const READ_BUFFER: usize = 1 << 18;

/// What to read from a file; by default everything, under the names of the roles.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// Names and units that the file uses.
    pub columns: ColumnMap,
    /// Channels to read; all other columns are then passed over unread. `None` reads everything.
    pub only: Option<Vec<Channel>>,
}

/// A recorded table. Every column has as many values as there are samples.
#[derive(Clone, Debug)]
pub struct Recording {
    source: String,
    t_s: Arc<Vec<f64>>,
    columns: Vec<Column>,
    places: Places,
    notes: Vec<String>,
    passed_over: Vec<String>,
    metadata: Metadata,
    /// Units of columns that are no roles, where the file says them.
    units: BTreeMap<String, String>,
}

/// Two recordings are equal when they hold the same samples, wherever they came from.
impl PartialEq for Recording {
    fn eq(&self, other: &Self) -> bool {
        self.t_s == other.t_s && self.columns == other.columns
    }
}

impl Recording {
    /// A recording without columns. `source` is what messages call it: a file name, or what made it.
    pub fn new(source: impl Into<String>, t_s: Vec<f64>) -> Self {
        Self {
            source: source.into(),
            t_s: Arc::new(t_s),
            columns: Vec::new(),
            places: Places::samples(),
            notes: Vec::new(),
            passed_over: Vec::new(),
            metadata: Metadata::default(),
            units: BTreeMap::new(),
        }
    }

    /// Adds a channel, or replaces its values.
    ///
    /// # Panics
    /// If there are not as many values as samples, which is a mistake of the caller and never of a file.
    pub fn set(&mut self, channel: Channel, values: Vec<f64>) {
        assert_eq!(values.len(), self.len(), "{}: one value a sample", channel.role());
        let same = |column: &Column| matches!(column, Column::Known { channel: c, .. } if *c == channel);
        self.columns.retain(|column| !same(column));
        self.columns.push(Column::Known { channel, values: Arc::new(values) });
    }

    /// The recording with a channel added; see [`Recording::set`].
    #[must_use]
    pub fn with(mut self, channel: Channel, values: Vec<f64>) -> Self {
        self.set(channel, values);
        self
    }

    /// File name, or what made the recording.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Time, s, strictly increasing.
    pub fn t_s(&self) -> &[f64] {
        &self.t_s
    }

    /// Time as [`Recording::t_s`], to be kept beside the recording.
    pub fn shared_t_s(&self) -> Arc<Vec<f64>> {
        Arc::clone(&self.t_s)
    }

    /// Values of a channel, if it was recorded.
    pub fn channel(&self, channel: Channel) -> Option<&[f64]> {
        self.values(channel).map(|values| values.as_slice())
    }

    /// The same, to be kept beside the recording.
    pub fn shared(&self, channel: Channel) -> Option<Arc<Vec<f64>>> {
        self.values(channel).map(Arc::clone)
    }

    fn values(&self, channel: Channel) -> Option<&Arc<Vec<f64>>> {
        self.columns.iter().find_map(|column| match column {
            Column::Known { channel: c, values } if *c == channel => Some(values),
            _ => None,
        })
    }

    /// Channels that were recorded, in the order of the columns.
    pub fn channels(&self) -> impl Iterator<Item = Channel> + '_ {
        self.columns.iter().filter_map(|column| match column {
            Column::Known { channel, .. } => Some(*channel),
            Column::Unknown(_) => None,
        })
    }

    /// All columns in their order.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    /// Time from the first to the last sample, s; 0 for fewer than two samples.
    pub fn duration_s(&self) -> f64 {
        match (self.t_s.first(), self.t_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Median time between samples, s; `None` for fewer than two samples.
    pub fn median_step_s(&self) -> Option<f64> {
        let mut steps: Vec<f64> = self.t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if steps.is_empty() {
            return None;
        }
        let middle = steps.len() / 2;
        Some(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
    }

    /// Time from which on a step between samples is a gap, s; `None` for fewer than two samples.
    pub fn gap_s(&self) -> Option<f64> {
        self.median_step_s().map(|step_s| GAP_IN_STEPS * step_s)
    }

    /// What was lost or repaired when the recording was read, one line each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Adds what was lost or repaired.
    pub fn add_notes(&mut self, notes: impl IntoIterator<Item = String>) {
        self.notes.extend(notes);
    }

    /// Puts what lies between its neighbours in the place of every spike of an angle, a tension or a torque, and notes it.
    ///
    /// A spike is a run of at most two samples that stands out of what is before and after it by eight times as much as the
    /// samples around it change; see [`spikes`] for all conditions. A channel of which more than one sample in fifty would
    /// be one is left as it is. So is, of any channel, a run of as many beyond the `largest` magnitude that it can have, where no more
    /// than one sample in two hundred is.
    pub fn set_spikes_aside(&mut self, largest: impl Fn(Channel) -> Option<f64>) {
        let channels: Vec<Channel> = self.channels().collect();
        let mut counted: Vec<String> = Vec::new();
        let mut first: Option<(usize, String)> = None;
        let mut set_aside = 0;
        for channel in channels {
            let values = self.channel(channel).unwrap_or_default();
            let beyond = largest(channel).map_or_else(Vec::new, |largest| spikes::beyond(values, largest));
            let outstanding = if channel.is_mechanical() { spikes::find(values) } else { Vec::new() };
            let found = spikes::together(beyond, outstanding);
            let Some(run) = found.first() else { continue };
            let count: usize = found.iter().map(ExactSizeIterator::len).sum();
            if first.as_ref().is_none_or(|(start, _)| run.start < *start) {
                let [got, before, after] = [run.start, run.start - 1, run.end].map(|sample| values[sample]);
                first =
                    Some((run.start, format!("{} is {got} between {before} and {after}", channel.role())));
            }
            counted.push(format!("{} {count}", channel.role()));
            set_aside += count;
            let repaired = spikes::between_neighbours(&self.t_s, values, &found);
            self.replace(channel, repaired);
        }
        if let Some((start, what)) = first {
            let values = match set_aside {
                1 => "one value of".to_owned(),
                _ => format!("{set_aside} values of"),
            };
            self.notes.push(format!(
                "{}: {what}; {values} {} samples stood out as spikes and were set aside ({})",
                self.place(start),
                self.len(),
                counted.join(", ")
            ));
        }
    }

    /// Drops the rows in which the recording stood still while the bench moved on, and notes it.
    ///
    /// Such a stretch is of ten rows at least, in all columns, and an angle, a tension or a torque jumps at its end; see [`frozen`].
    pub fn drop_frozen_rows(&mut self) {
        let Some(step_s) = self.median_step_s() else { return };
        let columns: Vec<(&[f64], bool)> = self
            .channels()
            .filter_map(|channel| Some((self.channel(channel)?, channel.is_mechanical())))
            .collect();
        let found = frozen::find(&self.t_s, step_s, &columns);
        let Some(first) = found.first() else { return };
        let rows: usize = found.iter().map(ExactSizeIterator::len).sum();
        let stretches = match found.len() {
            1 => String::new(),
            count => format!("; {count} such stretches"),
        };
        let note = format!(
            "{}: all columns stand still for {:.3} s and then jump{stretches}, {rows} of {} rows, were dropped",
            self.place(first.start),
            self.t_s[first.end] - self.t_s[first.start - 1],
            self.len()
        );
        self.drop_rows(&found);
        self.notes.push(note);
    }

    /// Drops rows, whose ranges rise; the others keep their time and place.
    fn drop_rows(&mut self, ranges: &[Range<usize>]) {
        let from = std::iter::once(0).chain(ranges.iter().map(|range| range.end));
        let ends = ranges.iter().map(|range| range.start).chain([self.len()]);
        let kept: Vec<usize> = from.zip(ends).flat_map(|(from, end)| from..end).collect();
        let of = |values: &[f64]| Arc::new(kept.iter().map(|row| values[*row]).collect::<Vec<f64>>());
        self.t_s = of(&self.t_s);
        self.places = self.places.of(&kept);
        for column in &mut self.columns {
            match column {
                Column::Known { values, .. } => *values = of(values),
                Column::Unknown(text) => *text = text.of(kept.iter().copied()),
            }
        }
    }

    /// Other values of a channel, whose column stays where it is.
    fn replace(&mut self, replaced: Channel, repaired: Vec<f64>) {
        for column in &mut self.columns {
            if let Column::Known { channel, values } = column
                && *channel == replaced
            {
                *values = Arc::new(repaired);
                return;
            }
        }
    }

    /// Topics of the MCAP file that were passed over, sorted; they would be lost if the file were rewritten.
    pub fn topics_passed_over(&self) -> &[String] {
        &self.passed_over
    }

    /// What the file says beside the rows; it is kept where the recording is written as MCAP.
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// Unit of a column, where it is known.
    pub fn unit(&self, column: &Column) -> Option<&str> {
        match column {
            Column::Known { channel, .. } => Some(channel.unit()),
            Column::Unknown(text) => self.units.get(text.name()).map(String::as_str),
        }
    }

    /// Says something else beside the rows.
    pub fn set_metadata(&mut self, metadata: Metadata) {
        self.metadata = metadata;
    }

    /// Where a sample stands in its file, as messages begin: `rec.csv:12` is line 12.
    pub fn place(&self, sample: usize) -> String {
        self.places.describe(&self.source, sample)
    }

    /// A part of the recording, whose samples keep their time and place.
    ///
    /// # Panics
    /// If the range reaches beyond the samples.
    #[must_use]
    pub fn slice(&self, samples: Range<usize>) -> Self {
        let columns = self.columns.iter().map(|column| match column {
            Column::Known { channel, values } => {
                Column::Known { channel: *channel, values: Arc::new(values[samples.clone()].to_vec()) }
            }
            Column::Unknown(text) => Column::Unknown(text.of(samples.clone())),
        });
        Self {
            source: self.source.clone(),
            t_s: Arc::new(self.t_s[samples.clone()].to_vec()),
            columns: columns.collect(),
            places: self.places.after(samples.start),
            notes: self.notes.clone(),
            passed_over: self.passed_over.clone(),
            metadata: self.metadata.clone(),
            units: self.units.clone(),
        }
    }
}
