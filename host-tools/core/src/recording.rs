//! Recordings: a table with one row a sample, from and to CSV, gzipped CSV and MCAP.
//!
//! A recording holds the time `t_s`, strictly increasing, and columns. A column whose name is a role of
//! [`Channel`], or that a rig's [`ColumnMap`] assigns to one, is read as numbers; any other is kept as the text that
//! stood in the file and written back untouched. Numbers are written in the shortest form that reads back to the
//! same `f64`, so that converting between the formats and back changes no bit of them.

mod build;
mod columns;
mod comma_separated;
mod mcap_file;
mod place;
mod row;
mod row_writer;
mod spikes;
mod text_column;

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use bowden_model::channel::Channel;

use crate::outcome::Failure;
use crate::output;

pub use columns::{ColumnMap, ColumnSource, TIME_ROLE};
pub use mcap_file::TOPIC;
pub use place::Places;
pub use row::{Cell, RowColumn};
pub use row_writer::RowWriter;
pub use text_column::TextColumn;

/// Buffer between file and parser, bytes.
const READ_BUFFER: usize = 1 << 18;

/// One column beside the time.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// A role, in the unit of its channel.
    Known {
        /// The role.
        channel: Channel,
        /// One value a sample; what is prepared for a replay shares them.
        values: Arc<Vec<f64>>,
    },
    /// A column that is not interpreted.
    Unknown(TextColumn),
}

impl Column {
    /// Name as it stands in a header.
    pub fn name(&self) -> &str {
        match self {
            Self::Known { channel, .. } => channel.role(),
            Self::Unknown(text) => text.name(),
        }
    }

    fn written(&self) -> RowColumn {
        match self {
            Self::Known { channel, .. } => RowColumn::Known(*channel),
            Self::Unknown(text) => RowColumn::Unknown(text.name().to_owned()),
        }
    }

    fn cell(&self, sample: usize) -> Cell<'_> {
        match self {
            Self::Known { values, .. } => Cell::Number(values[sample]),
            Self::Unknown(text) => Cell::Text(text.cell(sample).unwrap_or_default()),
        }
    }
}

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
    /// be one is left as it is.
    pub fn set_spikes_aside(&mut self) {
        let mechanical: Vec<Channel> = self.channels().filter(|channel| channel.is_mechanical()).collect();
        let mut counted: Vec<String> = Vec::new();
        let mut first: Option<(usize, String)> = None;
        let mut set_aside = 0;
        for channel in mechanical {
            let values = self.channel(channel).unwrap_or_default();
            let found = spikes::find(values);
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
            Column::Unknown(text) => Column::Unknown(text.slice(samples.clone())),
        });
        Self {
            source: self.source.clone(),
            t_s: Arc::new(self.t_s[samples.clone()].to_vec()),
            columns: columns.collect(),
            places: self.places.after(samples.start),
            notes: self.notes.clone(),
            passed_over: self.passed_over.clone(),
        }
    }

    /// Reads a file. The content decides between CSV, gzipped CSV and MCAP, whatever the file is called.
    ///
    /// A file that ends early (a last line without its end that makes no whole row, gzip data or an MCAP file
    /// without its end) gives the samples that are whole and a note.
    ///
    /// # Errors
    /// One line that names the file, the line or byte, the column, what was there, and what to do: no or double
    /// `t_s` column, rows of another length than the header, cells of a channel that are no finite number, time that
    /// does not increase, text that is not UTF-8, damaged compression, no samples.
    pub fn load(path: &Path, options: &ReadOptions) -> Result<Self, Failure> {
        let source = path.display().to_string();
        let unreadable = |error: &std::io::Error| {
            let reason = output::describe(error);
            Failure::bad_input(format!("{source}: cannot be read: {reason}; check the path"))
        };
        if path.is_dir() {
            return Err(Failure::bad_input(format!(
                "{source}: is a folder, expected a recording; name a file"
            )));
        }
        let file = File::open(path).map_err(|error| unreadable(&error))?;
        let mut file = BufReader::with_capacity(READ_BUFFER, file);
        let start = file.fill_buf().map_err(|error| unreadable(&error))?;
        let named_mcap = Format::of(path).is_some_and(|format| format == Format::Mcap);
        if start.is_empty() {
            return Err(Failure::bad_input(format!(
                "{source}:1: the file is empty, expected a header line with t_s; record again"
            )));
        }
        if start.starts_with(mcap::MAGIC) {
            mcap_file::read(file, source, options)
        } else if named_mcap {
            Err(Failure::bad_input(format!(
                "{source}: byte 0: not the start of an MCAP file; if it is a table, call it .csv"
            )))
        } else if start.starts_with(&GZIP_MAGIC) {
            comma_separated::read(flate2::bufread::MultiGzDecoder::new(file), source, options)
        } else {
            comma_separated::read(file, source, options)
        }
    }

    /// Writes the recording in the format that the file name asks for: `.csv`, `.csv.gz` or `.mcap`.
    ///
    /// # Errors
    /// A name that asks for no known format (see [`Format::for_output`]), or the reason why the medium refuses.
    pub fn save(&self, path: &Path) -> Result<(), Failure> {
        let format = Format::for_output(path)?;
        let columns: Vec<RowColumn> = self.columns.iter().map(Column::written).collect();
        output::write_file(path, |file| {
            let mut writer = RowWriter::new(format, &columns, None, file)?;
            for (sample, t_s) in self.t_s.iter().enumerate() {
                writer.row(*t_s, self.columns.iter().map(|column| column.cell(sample)))?;
            }
            writer.finish()
        })
    }
}

/// First bytes of gzip data.
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// Format of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated, one header line.
    Csv,
    /// The same, gzipped.
    GzippedCsv,
    /// MCAP with JSON messages.
    Mcap,
}

impl Format {
    /// The format that a file name asks for, if any.
    pub fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        [(".csv", Self::Csv), (".csv.gz", Self::GzippedCsv), (".mcap", Self::Mcap)]
            .into_iter()
            .find_map(|(ending, format)| name.ends_with(ending).then_some(format))
    }

    /// The format of a file that is to be written.
    ///
    /// # Errors
    /// Says which endings are known, if the name has none of them.
    pub fn for_output(path: &Path) -> Result<Self, Failure> {
        Self::of(path).ok_or_else(|| {
            let path = path.display();
            Failure::bad_input(format!("{path}: unknown format; end the name in .csv, .csv.gz or .mcap"))
        })
    }
}

/// What readers share: a recording under construction.
struct Origin {
    source: String,
    places: Places,
    notes: Vec<String>,
    passed_over: Vec<String>,
}

impl Origin {
    fn finish(self, table: build::Table) -> Result<Recording, Failure> {
        let (t_s, columns) = table.finish();
        if t_s.is_empty() {
            let reason = self.notes.first().map_or(String::new(), |note| format!(" ({note})"));
            return Err(Failure::bad_input(format!(
                "{}: a header and no samples{reason}; record again",
                self.source
            )));
        }
        Ok(Recording {
            source: self.source,
            t_s: Arc::new(t_s),
            columns,
            places: self.places,
            notes: self.notes,
            passed_over: self.passed_over,
        })
    }
}

/// A reader that remembers how the data ended.
struct Tail<R> {
    inner: R,
    bytes: u64,
    last_byte: Option<u8>,
    cut_short: bool,
}

impl<R: Read> Tail<R> {
    fn new(inner: R) -> Self {
        Self { inner, bytes: 0, last_byte: None, cut_short: false }
    }
}

impl<R: Read> Read for Tail<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        match self.inner.read(buffer) {
            Ok(read) => {
                self.bytes += read as u64;
                if let Some(last) = buffer[..read].last() {
                    self.last_byte = Some(*last);
                }
                Ok(read)
            }
            // Compressed data that stops early: what came before is whole.
            Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
                self.cut_short = true;
                Ok(0)
            }
            Err(error) => Err(error),
        }
    }
}
