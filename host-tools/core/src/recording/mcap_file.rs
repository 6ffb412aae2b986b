//! Recordings in MCAP: one JSON message a sample on one topic.
//!
//! A message on [`TOPIC`] is an object with one property a column, `t_s` among them; the schema names them in
//! order. `log_time` is `t_s` in nanoseconds from an epoch of 0, for players that sort by it; what counts is the
//! property, which keeps every bit. Without that topic, joint states of a ROS 2 bag are read ([`super::ros2`]). Messages on other topics are passed over: they take no part in anything and are
//! not copied when the recording is written elsewhere, which [`Recording::topics_passed_over`] tells.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io::{self, Read, Seek, Write};

use mcap::McapError;
use mcap::read::ChannelAccumulator;
use mcap::records::{Metadata, Record};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

use super::build::Table;
use super::origin::Origin;
use super::place::Places;
use super::ros2::Bag;
use super::row::{Cell, RowColumn};
use super::{ReadOptions, Recording, TIME_ROLE};
use crate::outcome::Failure;

/// Topic of the samples.
pub const TOPIC: &str = "/bowden/samples";

/// Name of the schema of a sample.
pub const SCHEMA: &str = "bowden.Sample";

/// Largest record that is read, bytes; a length beyond it is damage.
pub(super) const RECORD_LIMIT: usize = 1 << 28;

/// Samples of a chunk before compression, bytes: what a damaged byte costs.
const CHUNK_BYTES: u64 = 1 << 20;

/// Reads the samples as they stream past.
pub(super) fn read(data: impl Read, source: String, options: &ReadOptions) -> Result<Recording, Failure> {
    let mut origin = Origin::new(source, Places::messages());
    let mut other_topics = BTreeSet::new();
    let mut table: Option<Table> = None;
    let mut number = 0;
    let mut bag = Bag::new(options);
    let mut records = Records::new(data);
    let mut channels = ChannelAccumulator::default();
    loop {
        let damaged = |error: McapError| {
            Failure::bad_input(format!(
                "{}: after message {number}: {error}; take out what is whole with `bowden recover`",
                origin.source
            ))
        };
        let record = match records.next() {
            Ok(Some(record)) => record,
            Ok(None) => break,
            Err(McapError::UnexpectedEof) if table.is_some() || bag.table.is_some() => {
                number = number.max(bag.messages);
                origin.notes.push(format!(
                    "{}: the file ends early; the {number} whole samples before the end were used",
                    origin.source
                ));
                break;
            }
            Err(error) => return Err(damaged(error)),
        };
        let (header, message) = match record {
            Record::Schema { header, data } => {
                if header.name == SCHEMA {
                    origin.units = units_of(&data);
                }
                channels.add_schema(header, Cow::Owned(data.into_owned())).map_err(damaged)?;
                continue;
            }
            Record::Channel(channel) => {
                channels.add_channel(channel).map_err(damaged)?;
                continue;
            }
            Record::Metadata(Metadata { name, metadata }) => {
                origin.metadata.extend(&name, metadata);
                continue;
            }
            Record::Message { header, data } => (header, data),
            _ => continue,
        };
        let channel = channels
            .get(header.channel_id)
            .ok_or_else(|| damaged(McapError::UnknownChannel(header.sequence, header.channel_id)))?;
        if channel.topic != TOPIC && bag.takes(&channel) {
            bag.add(&channel, &header, &message).map_err(|reason| {
                let place = bag.places.describe_number(&origin.source, bag.messages);
                Failure::bad_input(format!("{place}: {reason}"))
            })?;
            continue;
        }
        if channel.topic != TOPIC {
            if !other_topics.contains(&channel.topic) {
                other_topics.insert(channel.topic.clone());
            }
            continue;
        }
        number += 1;
        let refuse = |reason: String| {
            Failure::bad_input(format!("{}: {reason}", origin.places.describe_number(&origin.source, number)))
        };
        let encoding = &channel.message_encoding;
        if encoding != "json" {
            return Err(refuse(format!(
                "topic {TOPIC} is encoded as `{encoding}`, expected json; convert it"
            )));
        }
        let row = Row::parse(&message).map_err(&refuse)?;
        let cells = row.cells().map_err(&refuse)?;
        let table = if let Some(table) = &mut table {
            table
        } else {
            let names: Vec<&str> = row.names().collect();
            table.insert(Table::from_header(&names, options).map_err(&refuse)?)
        };
        let sample = table.len();
        row.push_to(&cells, table).map_err(&refuse)?;
        origin.places.push(sample, number);
    }
    origin.passed_over = other_topics.into_iter().collect();
    if let Some(table) = table {
        return origin.finish(table);
    }
    if let Some(table) = bag.table {
        if bag.of_others > 0 {
            let (others, all) = (bag.of_others, bag.messages);
            let note = format!("{others} of {all} messages are of other joints; they were passed over");
            origin.notes.push(format!("{}: {note}", origin.source));
        }
        origin.places = bag.places;
        return origin.finish(table);
    }
    if let Some(lacking) = bag.lacking() {
        let reason = format!("no message has `{lacking}`, which the rig maps; correct [recording.columns]");
        return Err(Failure::bad_input(format!("{}: {reason}", origin.source)));
    }
    let others = match origin.passed_over.as_slice() {
        [] => "no message at all".to_owned(),
        topics => topics.join(", "),
    };
    Err(Failure::bad_input(format!(
        "{}: no message on topic {TOPIC}; the file has {others}; convert a table with `bowden convert`",
        origin.source
    )))
}

/// Records of a file, those within chunks among them; a chunk is checked before its first record is given.
pub(super) struct Records<R> {
    data: R,
    reader: LinearReader,
}

impl<R: Read> Records<R> {
    /// Of a whole file.
    fn new(data: R) -> Self {
        Self::with(data, LinearReaderOptions::default().with_validate_data_section_crc(true))
    }

    /// Of one chunk, with its opcode and length before it.
    pub(super) fn of_chunk(data: R) -> Self {
        Self::with(data, LinearReaderOptions::default().with_skip_start_magic(true).with_skip_end_magic(true))
    }

    fn with(data: R, options: LinearReaderOptions) -> Self {
        let options = options.with_record_length_limit(RECORD_LIMIT).with_prevalidate_chunk_crcs(true);
        Self { data, reader: LinearReader::new_with_options(options) }
    }

    /// The next record; none at the end.
    pub(super) fn next(&mut self) -> Result<Option<Record<'static>>, McapError> {
        loop {
            match self.reader.next_event() {
                None => return Ok(None),
                Some(Err(error)) => return Err(error),
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                    let into = self.reader.insert(wanted);
                    let read = loop {
                        match self.data.read(into) {
                            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                            read => break read?,
                        }
                    };
                    self.reader.notify_read(read);
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    return mcap::parse_record(opcode, data).map(|record| Some(record.into_owned()));
                }
            }
        }
    }
}

/// Units of the columns, by the descriptions of a schema that this program wrote.
pub(super) fn units_of(schema: &[u8]) -> BTreeMap<String, String> {
    #[derive(Deserialize)]
    struct Schema {
        properties: BTreeMap<String, Property>,
    }
    #[derive(Deserialize)]
    struct Property {
        description: Option<String>,
    }
    let Ok(Schema { properties }) = serde_json::from_slice(schema) else { return BTreeMap::new() };
    let units = properties.into_iter().filter_map(|(name, property)| Some((name, property.description?)));
    units.filter(|(name, _)| name != TIME_ROLE).collect()
}

/// One message: properties in their order, values as they are written.
pub(super) struct Row<'m>(Vec<(Cow<'m, str>, &'m RawValue)>);

impl<'m> Row<'m> {
    /// Reads a message; the error is what a message says after the place.
    pub(super) fn parse(message: &'m [u8]) -> Result<Self, String> {
        serde_json::from_slice(message).map_err(|error| format!("not a JSON object: {error}; record again"))
    }

    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|(name, _)| name.as_ref())
    }

    /// Text of every value, strings without their quotes.
    pub(super) fn cells(&self) -> Result<Vec<Cow<'m, str>>, String> {
        self.0
            .iter()
            .map(|(name, value)| {
                let value = value.get();
                if value.starts_with('"') {
                    serde_json::from_str(value)
                        .map(Cow::Owned)
                        .map_err(|error| format!("property `{name}`: {error}; record again"))
                } else {
                    Ok(Cow::Borrowed(value))
                }
            })
            .collect()
    }

    /// Adds the cells in the order of the first message.
    fn push_to(&self, cells: &[Cow<str>], table: &mut Table) -> Result<(), String> {
        if self.names().eq(table.names()) {
            return table.push(cells.iter().map(|cell| cell.as_bytes()));
        }
        let given: BTreeMap<&str, &Cow<str>> = self.names().zip(cells).collect();
        let mut row = Vec::with_capacity(table.width());
        for name in table.names() {
            let cell = given.get(name.as_str()).ok_or_else(|| {
                format!("no property `{name}`, which the first message has; record it always or never")
            })?;
            row.push(cell.as_bytes());
        }
        if self.0.len() != table.width() {
            let (got, expected) = (self.0.len(), table.width());
            return Err(format!(
                "{got} properties, expected {expected} as in the first message; record again"
            ));
        }
        table.push(row.into_iter())
    }
}

#[derive(Deserialize)]
struct Name<'m>(#[serde(borrow)] Cow<'m, str>);

impl<'de> Deserialize<'de> for Row<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Rows;
        impl<'de> Visitor<'de> for Rows {
            type Value = Row<'de>;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                formatter.write_str("an object with one property a column")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Row<'de>, A::Error> {
                let mut properties = Vec::with_capacity(16);
                while let Some((Name(name), value)) = map.next_entry::<Name, &RawValue>()? {
                    properties.push((name, value));
                }
                Ok(Row(properties))
            }
        }
        deserializer.deserialize_map(Rows)
    }
}

/// Writes one message a sample.
pub(super) struct Writer<W: Write + Seek> {
    file: mcap::Writer<W>,
    channel: u16,
    names: Vec<String>,
    data: Vec<u8>,
    samples: u32,
}

impl<W: Write + Seek> Writer<W> {
    /// Writes what stands before the samples: schema, channel, and the metadata under its name, if there is any.
    pub(super) fn new(columns: &[RowColumn], metadata: &super::Metadata, out: W) -> io::Result<Self> {
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
    pub(super) fn row<'c>(&mut self, t_s: f64, cells: impl IntoIterator<Item = Cell<'c>>) -> io::Result<()> {
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
    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.file.flush().map_err(io_error)
    }

    /// Writes what stands behind the samples.
    pub(super) fn finish(mut self, metadata: &super::Metadata) -> io::Result<()> {
        write_metadata(&mut self.file, metadata)?;
        self.file.finish().map_err(io_error)?;
        Ok(())
    }
}

fn write_metadata<W: Write + Seek>(file: &mut mcap::Writer<W>, metadata: &super::Metadata) -> io::Result<()> {
    metadata.groups().try_for_each(|(name, entries)| {
        let record = Metadata { name: name.to_owned(), metadata: entries.clone() };
        file.write_metadata(&record).map_err(io_error)
    })
}

/// Units by column, for the channel; a schema has a place for descriptions only.
fn units(columns: &[RowColumn]) -> BTreeMap<String, String> {
    let unit = |column: &RowColumn| match column {
        RowColumn::Known(channel) => Some(channel.unit().to_owned()),
        RowColumn::Described { unit, .. } => Some(unit.clone()),
        RowColumn::Unknown(_) => None,
    };
    let columns = columns.iter().filter_map(|column| Some((column.name(), unit(column)?)));
    std::iter::once((TIME_ROLE, "s".to_owned()))
        .chain(columns)
        .map(|(name, unit)| (format!("unit.{name}"), unit))
        .collect()
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

fn schema_of(columns: &[RowColumn]) -> Vec<u8> {
    let mut properties = serde_json::Map::new();
    properties
        .insert(TIME_ROLE.to_owned(), serde_json::json!({ "type": "number", "description": "time, s" }));
    for column in columns {
        let schema = match column {
            RowColumn::Known(channel) => {
                serde_json::json!({ "type": "number", "description": channel.unit() })
            }
            RowColumn::Described { unit, .. } => {
                serde_json::json!({ "type": "number", "description": unit })
            }
            RowColumn::Unknown(_) => serde_json::json!({}),
        };
        properties.insert(column.name().to_owned(), schema);
    }
    let schema = serde_json::json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": SCHEMA,
        "type": "object",
        "properties": properties,
    });
    schema.to_string().into_bytes()
}
