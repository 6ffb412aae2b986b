//! Recordings written row by row, so that memory does not grow with their length.

use std::io::{self, Seek, Write};

use super::gzip_members::Members;
use super::row::{Cell, RowColumn};
use super::{Format, Metadata, comma_separated, mcap_file};

/// Writes a recording in any format.
pub struct RowWriter<W: Write + Seek>(Form<W>);

enum Form<W: Write + Seek> {
    Csv(comma_separated::Writer<W>),
    GzippedCsv(comma_separated::Writer<Members<W>>),
    Mcap(Box<mcap_file::Writer<W>>),
}

impl<W: Write + Seek> RowWriter<W> {
    /// Writes what stands before the rows. Formats without a place for `metadata` drop it.
    ///
    /// # Errors
    /// The reason why `out` refuses; the same holds for the other calls.
    pub fn new(format: Format, columns: &[RowColumn], metadata: &Metadata, out: W) -> io::Result<Self> {
        let names = columns.iter().map(RowColumn::name);
        Ok(Self(match format {
            Format::Csv => Form::Csv(comma_separated::Writer::new(names, out)?),
            Format::GzippedCsv => Form::GzippedCsv(comma_separated::Writer::new(names, Members::new(out))?),
            // Refused by `Format::for_rows` before.
            Format::Parquet => return Err(io::ErrorKind::Unsupported.into()),
            Format::Mcap => Form::Mcap(Box::new(mcap_file::Writer::new(columns, metadata, out)?)),
        }))
    }

    /// Writes a row: the time, s, and one cell a column.
    ///
    /// # Errors
    /// The reason why the medium refuses.
    pub fn row<'c>(&mut self, t_s: f64, cells: impl IntoIterator<Item = Cell<'c>>) -> io::Result<()> {
        match &mut self.0 {
            Form::Csv(writer) => writer.row(t_s, cells),
            Form::GzippedCsv(writer) => writer.row(t_s, cells),
            Form::Mcap(writer) => writer.row(t_s, cells),
        }
    }

    /// Hands on all rows to what they are written to: a reader that is cut off behind them gets them all.
    ///
    /// # Errors
    /// The reason why the medium refuses.
    pub fn flush(&mut self) -> io::Result<()> {
        match &mut self.0 {
            Form::Csv(writer) => writer.flush(),
            Form::GzippedCsv(writer) => writer.flush(),
            Form::Mcap(writer) => writer.flush(),
        }
    }

    /// Writes what stands behind the rows, `metadata` first.
    ///
    /// # Errors
    /// The reason why the medium refuses.
    pub fn finish(self, metadata: &Metadata) -> io::Result<()> {
        match self.0 {
            Form::Csv(writer) => writer.finish()?.flush(),
            Form::GzippedCsv(writer) => writer.finish()?.finish()?.flush(),
            Form::Mcap(writer) => writer.finish(metadata),
        }
    }
}
