//! Writes a recording as MCAP.

use std::io::{self, Seek, Write};

use mcap::records::Metadata;
use serde_json::value::RawValue;

use super::schema::{schema_of, units};
use super::{CHUNK_BYTES, SCHEMA, TOPIC};
use crate::recording::row::{Cell, RowColumn};
use crate::recording::{self, TIME_ROLE};

/// Writes one message a sample.
pub(in crate::recording) struct Writer<W: Write + Seek> {
    file: mcap::Writer<W>,
    channel: u16,
    names: Vec<String>,
    data: Vec<u8>,
    samples: u32,
}

impl<W: Write + Seek> Writer<W> {
    /// Writes what stands before the samples: schema, channel, and the metadata under its name, if there is any.
    pub(in crate::recording) fn new(
        columns: &[RowColumn],
        metadata: &recording::Metadata,
        out: W,
    ) -> io::Result<Self> {
        let library = concat!("bowden ", env!("CARGO_PKG_VERSION"));
        // Without seeking a chunk is written when it is complete, and a file that is cut has no half one with a whole head.
        let options = mcap::WriteOptions::new().profile("").library(library).chunk_size(Some(CHUNK_BYTES));
        let options = options.disable_seeking(true).compression_threads(0);
        let mut file = options.create(out).map_err(io_error)?;
        write_metadata(&mut file, metadata)?;
        let schema = file.add_schema(SCHEMA, "jsonschema", &schema_of(columns)).map_err(io_error)?;
        let channel = file.add_channel(schema, TOPIC, "json", &units(columns)).map_err(io_error)?;
        let names = columns.iter().map(|column| serde_json::Value::from(column.name()).to_string()).collect();
        Ok(Self { file, channel, names, data: Vec::with_capacity(512), samples: 0 })
    }

    /// Writes a sample: the time and one cell a column.
    pub(in crate::recording) fn row<'c>(
        &mut self,
        t_s: f64,
        cells: impl IntoIterator<Item = Cell<'c>>,
    ) -> io::Result<()> {
        self.data.clear();
        write!(self.data, "{{\"{TIME_ROLE}\":{t_s:?}")?;
        for (name, cell) in self.names.iter().zip(cells) {
            write!(self.data, ",{name}:")?;
            match cell {
                Cell::Number(value) => write!(self.data, "{value:?}")?,
                Cell::Integer(value) => write!(self.data, "{value}")?,
                Cell::Text(text) => write_text(&mut self.data, text)?,
            }
        }
        self.data.push(b'}');
        // Casts saturate: a time before the epoch is logged at the epoch, and the property keeps it.
        let log_time = (t_s * 1e9).round() as u64;
        let header = mcap::records::MessageHeader {
            channel_id: self.channel,
            sequence: self.samples,
            log_time,
            publish_time: log_time,
        };
        self.samples = self.samples.wrapping_add(1);
        self.file.write_to_known_channel(&header, &self.data).map_err(io_error)
    }

    /// Ends the chunk, so that a file that is cut behind it has all samples so far.
    pub(in crate::recording) fn flush(&mut self) -> io::Result<()> {
        self.file.flush().map_err(io_error)
    }

    /// Writes what stands behind the samples.
    pub(in crate::recording) fn finish(mut self, metadata: &recording::Metadata) -> io::Result<()> {
        write_metadata(&mut self.file, metadata)?;
        self.file.finish().map_err(io_error)?;
        Ok(())
    }
}

fn write_metadata<W: Write + Seek>(
    file: &mut mcap::Writer<W>,
    metadata: &recording::Metadata,
) -> io::Result<()> {
    metadata.groups().try_for_each(|(name, entries)| {
        let record = Metadata { name: name.to_owned(), metadata: entries.clone() };
        file.write_metadata(&record).map_err(io_error)
    })
}

fn io_error(error: mcap::McapError) -> io::Error {
    match error {
        mcap::McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}

/// A cell that is not interpreted: a JSON value if it is one letter for letter, else a string.
fn write_text(data: &mut Vec<u8>, cell: &str) -> io::Result<()> {
    match serde_json::from_str::<&RawValue>(cell) {
        Ok(value) if value.get() == cell && !cell.starts_with('"') => data.extend_from_slice(cell.as_bytes()),
        _ => serde_json::to_writer(data, cell)?,
    }
    Ok(())
}
