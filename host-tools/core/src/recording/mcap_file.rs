//! Recordings in MCAP: one JSON message a sample on one topic.
//!
//! A message on [`TOPIC`] is an object with one property a column, `t_s` among them; the schema names them in
//! order. `log_time` is `t_s` in nanoseconds from an epoch of 0, for players that sort by it; what counts is the
//! property, which keeps every bit. Without that topic, joint states of a ROS 2 bag are read ([`super::ros2`]). Messages on
//! other topics are passed over: they take no part in anything and are not copied when the recording is written elsewhere,
//! which [`Recording::topics_passed_over`] tells.

mod lengths;
mod records;
mod row;
mod schema;
mod writer;

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::io::Read;

use mcap::McapError;
use mcap::read::ChannelAccumulator;
use mcap::records::{Metadata, Record};

use super::build::Table;
use super::origin::Origin;
use super::place::Places;
use super::ros2::Bag;
use super::{ReadOptions, Recording};
use crate::outcome::Failure;

pub(super) use lengths::parse_record;
pub(super) use records::Records;
pub(super) use row::Row;
pub(super) use schema::units_of;
pub(super) use writer::Writer;

/// Topic of the samples.
pub const TOPIC: &str = "/bowden/samples";

/// Name of the schema of a sample.
pub const SCHEMA: &str = "bowden.Sample";

/// Largest record that is read, bytes; a length beyond it is damage.
pub(super) const RECORD_LIMIT: usize = 1 << 28;

/// Samples of a chunk before compression, bytes: what a damaged byte costs.
const CHUNK_BYTES: u64 = 1 << 20;

/// Reads the samples of a file of `length` bytes as they stream past.
pub(super) fn read(
    data: impl Read,
    length: u64,
    source: String,
    options: &ReadOptions,
) -> Result<Recording, Failure> {
    let mut origin = Origin::new(source, Places::messages());
    let mut other_topics = BTreeSet::new();
    let mut table: Option<Table> = None;
    let mut number = 0;
    let mut bag = Bag::new(options);
    let mut records = Records::new(data, length);
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
