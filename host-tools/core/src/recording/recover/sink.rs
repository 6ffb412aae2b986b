//! Where whole rows go.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Seek, Write};

use bowden_model::channel::Channel;

use super::Recovered;
use crate::recording::{Cell, Format, Metadata, RowColumn, RowWriter, TIME_ROLE};

/// Why nothing more is taken.
#[derive(Debug)]
pub enum Stopped {
    /// The input cannot be used: the reason.
    Input(String),
    /// The output refuses.
    Output(io::Error),
}

impl From<io::Error> for Stopped {
    fn from(error: io::Error) -> Self {
        Self::Output(error)
    }
}

/// Writes rows in the order of their columns in the first one.
pub struct Sink<W: Write + Seek> {
    format: Format,
    out: Option<W>,
    writer: Option<RowWriter<W>>,
    /// Names of the columns, the time among them.
    names: Vec<String>,
    time: usize,
    /// Units by the file's own schema.
    pub units: BTreeMap<String, String>,
    /// What the file says beside the rows.
    pub metadata: Metadata,
    /// The same, as far as it was written before the rows.
    before: Metadata,
    rows: u64,
    span_s: Option<(f64, f64)>,
}

impl<W: Write + Seek> Sink<W> {
    /// Writes in this format.
    pub fn new(format: Format, out: W) -> Self {
        Self {
            format,
            out: Some(out),
            writer: None,
            names: Vec::new(),
            time: 0,
            units: BTreeMap::new(),
            metadata: Metadata::default(),
            before: Metadata::default(),
            rows: 0,
            span_s: None,
        }
    }

    /// Time of the last row, s.
    pub fn last_s(&self) -> Option<f64> {
        self.span_s.map(|(_, last_s)| last_s)
    }

    /// Names of the columns, the time among them; empty before the first row.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Sets the columns.
    pub fn header(&mut self, names: Vec<String>) -> Result<(), Stopped> {
        let Some(time) = names.iter().position(|name| name == TIME_ROLE) else {
            return Err(Stopped::Input(format!(
                "no column `{TIME_ROLE}` in the first whole row; name the time in seconds so, or recover a recording of this program"
            )));
        };
        if let Some(name) = twice(&names) {
            return Err(Stopped::Input(format!(
                "column `{name}` stands twice in the header, which is damaged; put one from another recording before the rows"
            )));
        }
        self.time = time;
        let columns: Vec<RowColumn> = names
            .iter()
            .filter(|name| *name != TIME_ROLE)
            .map(|name| {
                match (Channel::ALL.into_iter().find(|channel| channel.role() == name), self.units.get(name))
                {
                    (Some(channel), _) => RowColumn::Known(channel),
                    (None, Some(unit)) => RowColumn::described(name, unit),
                    (None, None) => RowColumn::Unknown(name.clone()),
                }
            })
            .collect();
        self.names = names;
        if let Some(out) = self.out.take() {
            self.writer = Some(RowWriter::new(self.format, &columns, &self.metadata, out)?);
            self.before = self.metadata.clone();
        }
        Ok(())
    }

    /// Time of a row, s, if the row is whole: a cell a column, numbers where a role needs them, later than the row before.
    pub fn time_of(&self, cells: &[Cow<str>]) -> Option<f64> {
        if cells.len() != self.names.len() {
            return None;
        }
        let number = |cell: &str| cell.trim().parse::<f64>().ok().filter(|value| value.is_finite());
        let is_role = |name: &str| Channel::ALL.into_iter().any(|channel| channel.role() == name);
        let whole = self.names.iter().zip(cells).all(|(name, cell)| !is_role(name) || number(cell).is_some());
        let t_s = number(&cells[self.time])?;
        let later = self.last_s().is_none_or(|last_s| t_s > last_s);
        (whole && later).then_some(t_s)
    }

    /// Writes a row that is whole by [`Sink::time_of`].
    pub fn row(&mut self, t_s: f64, cells: &[Cow<str>]) -> Result<(), Stopped> {
        let others = cells.iter().enumerate().filter(|(index, _)| *index != self.time);
        if let Some(writer) = &mut self.writer {
            writer.row(t_s, others.map(|(_, cell)| Cell::Text(cell)))?;
        }
        self.rows += 1;
        self.span_s = Some((self.span_s.map_or(t_s, |(first_s, _)| first_s), t_s));
        Ok(())
    }

    /// Ends the output.
    pub fn finish(mut self, missing: Vec<String>) -> Result<Recovered, Stopped> {
        if let Some(writer) = self.writer.take() {
            let mut rest = Metadata::default();
            for (group, entries) in
                self.metadata.groups().filter(|(group, all)| self.before.group(group) != Some(all))
            {
                rest.extend(group, entries.clone());
            }
            writer.finish(&rest)?;
        }
        Ok(Recovered { rows: self.rows, span_s: self.span_s, missing, metadata: self.metadata })
    }
}

/// The first name that stands twice, as a reader of the output sees names: without blanks around them.
pub fn twice(names: &[String]) -> Option<&str> {
    let mut seen = BTreeSet::new();
    names.iter().map(|name| name.trim()).find(|name| !seen.insert(*name))
}
