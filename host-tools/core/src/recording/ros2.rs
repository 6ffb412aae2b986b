//! Joint states of ROS 2 bags: MCAP messages of `sensor_msgs/msg/JointState` in CDR.
//!
//! A joint's number is the column `TOPIC:JOINT.position`, `.velocity` or `.effort`, which `[recording.columns]` of a rig maps to a role:
//!
//! ```toml
//! [recording.columns]
//! theta_out_rad = { column = "/joint_states:elbow.position", scale = 1.0, offset = 0.12 }
//! ```
//!
//! Rows are the messages of one topic, the first that the rig maps or, without a rig, the first of the bag. `t_s` is the time of the header's
//! stamp after the first one; where a publisher leaves the stamp at zero, the time at which the message was recorded.

use std::borrow::Cow;

use byteorder::{BigEndian, LittleEndian};
use mcap::Channel;
use mcap::records::MessageHeader;
use serde::Deserialize;

use super::build::Table;
use super::place::Places;
use super::{ReadOptions, TIME_ROLE};

/// Name of the schema of a joint state.
const SCHEMA: &str = "sensor_msgs/msg/JointState";

/// Between the topic and the joint in a column's name.
const JOINT_MARK: char = ':';

/// `sensor_msgs/msg/JointState`.
#[derive(Debug, Deserialize)]
struct JointState {
    stamp: Stamp,
    _frame: String,
    name: Vec<String>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
}

#[derive(Debug, Deserialize)]
struct Stamp {
    sec: i32,
    nanosec: u32,
}

/// Joint states of a bag as they come.
pub(super) struct Bag<'o> {
    options: &'o ReadOptions,
    /// Columns that the rig maps, those of joints.
    wanted: Vec<&'o str>,
    topic: Option<String>,
    joints: Vec<String>,
    start_ns: Option<i128>,
    pub(super) table: Option<Table>,
    pub(super) places: Places,
    /// Messages of the topic, and those of them that are of other joints.
    pub(super) messages: u64,
    pub(super) of_others: u64,
}

impl<'o> Bag<'o> {
    pub(super) fn new(options: &'o ReadOptions) -> Self {
        let mapped = options.columns.channels.iter().map(|(_, source)| source.column.as_str());
        Self {
            options,
            wanted: mapped.filter(|column| column.contains(JOINT_MARK)).collect(),
            topic: None,
            joints: Vec::new(),
            start_ns: None,
            table: None,
            places: Places::messages(),
            messages: 0,
            of_others: 0,
        }
    }

    /// Whether a channel's messages are rows.
    pub(super) fn takes(&self, channel: &Channel) -> bool {
        let is_joint_state = channel.schema.as_ref().is_some_and(|schema| schema.name == SCHEMA);
        let is_topic = match (&self.topic, self.wanted.first()) {
            (Some(topic), _) => *topic == channel.topic,
            (None, Some(column)) => topic_of(column) == channel.topic,
            (None, None) => true,
        };
        is_joint_state && is_topic
    }

    /// A column that the rig maps and no message had; none where there were no messages of that topic.
    pub(super) fn lacking(&self) -> Option<&'o str> {
        if self.messages > 0 { self.wanted.first().copied() } else { None }
    }

    /// Adds a message; the error is what is said after the place.
    pub(super) fn add(
        &mut self,
        channel: &Channel,
        header: &MessageHeader,
        data: &[u8],
    ) -> Result<(), String> {
        self.messages += 1;
        let topic = &channel.topic;
        if channel.message_encoding != "cdr" {
            let encoding = &channel.message_encoding;
            return Err(format!("topic {topic} is encoded as `{encoding}`, expected cdr; convert the bag"));
        }
        let state = decoded(data).map_err(|reason| format!("topic {topic}: {reason}; record again"))?;
        let cells = state.columns(topic)?;
        let lacks = |column: &&str| {
            topic_of(column) == topic && cells.iter().all(|(name, _)| name.as_str() != *column)
        };
        let of_others = match &self.table {
            // A topic may carry the states of several publishers, each with joints of its own.
            None => state.name.is_empty() || (!self.wanted.is_empty() && self.wanted.iter().any(lacks)),
            Some(_) => self.joints != state.name,
        };
        if of_others {
            self.of_others += 1;
            return Ok(());
        }
        let stamp_ns = 1_000_000_000 * i128::from(state.stamp.sec) + i128::from(state.stamp.nanosec);
        let time_ns = if stamp_ns == 0 { i128::from(header.log_time) } else { stamp_ns };
        let start_ns = *self.start_ns.get_or_insert(time_ns);
        let table = if let Some(table) = &mut self.table {
            table
        } else {
            let names = cells.iter().map(|(name, _)| name.as_str());
            let names: Vec<&str> = std::iter::once(TIME_ROLE).chain(names).collect();
            let table = self.table.insert(Table::from_header(&names, self.options)?);
            self.topic = Some(topic.clone());
            self.joints.clone_from(&state.name);
            table
        };
        if cells.len() + 1 != table.width() {
            let (got, expected) = (cells.len(), table.width() - 1);
            return Err(format!(
                "topic {topic}: {got} numbers, the first message has {expected}; record position, velocity and effort \
                 always or never"
            ));
        }
        let time = Cow::from(format!("{:?}", (time_ns - start_ns) as f64 * 1e-9));
        let numbers = cells.iter().map(|(_, value)| Cow::from(format!("{value:?}")));
        let row: Vec<Cow<str>> = std::iter::once(time).chain(numbers).collect();
        let sample = table.len();
        table.push(row.iter().map(|cell| cell.as_bytes()))?;
        self.places.push(sample, self.messages);
        Ok(())
    }
}

impl JointState {
    /// Every number under its column's name.
    fn columns(&self, topic: &str) -> Result<Vec<(String, f64)>, String> {
        let mut columns = Vec::new();
        let fields = [("position", &self.position), ("velocity", &self.velocity), ("effort", &self.effort)];
        for (field, values) in fields.into_iter().filter(|(_, values)| !values.is_empty()) {
            if values.len() != self.name.len() {
                let (got, joints) = (values.len(), self.name.len());
                return Err(format!(
                    "topic {topic}: {got} numbers of {field} for {joints} joints; record again"
                ));
            }
            let named = self.name.iter().zip(values);
            columns
                .extend(named.map(|(joint, value)| (format!("{topic}{JOINT_MARK}{joint}.{field}"), *value)));
        }
        Ok(columns)
    }
}

/// Topic in a column's name.
fn topic_of(column: &str) -> &str {
    column.split(JOINT_MARK).next().unwrap_or(column)
}

/// A message behind its four bytes of encapsulation, of which the second says the order of bytes.
fn decoded(data: &[u8]) -> Result<JointState, String> {
    let [0, order @ (0 | 1), _, _, body @ ..] = data else {
        let start: Vec<String> = data.iter().take(4).map(|byte| format!("{byte:02x}")).collect();
        return Err(format!("got the encapsulation `{}`, expected plain CDR", start.join(" ")));
    };
    let decoded = if *order == 1 {
        cdr_encoding::from_bytes::<JointState, LittleEndian>(body)
    } else {
        cdr_encoding::from_bytes::<JointState, BigEndian>(body)
    };
    decoded.map(|(state, _)| state).map_err(|error| format!("no joint state: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand after the OMG's CDR, numbers aligned to their size from behind the encapsulation: stamp 2 s 500 ns, an empty frame, one joint `j`
    /// at 0.5 rad, no velocity, effort -2.
    fn message(big_endian: bool) -> Vec<u8> {
        let mut body: Vec<u8> = Vec::new();
        let word = |value: u32| if big_endian { value.to_be_bytes() } else { value.to_le_bytes() };
        let float = |value: f64| if big_endian { value.to_be_bytes() } else { value.to_le_bytes() };
        for value in [2, 500, 1] {
            body.extend(word(value));
        }
        body.push(0);
        body.resize(16, 0);
        body.extend(word(1));
        body.extend(word(2));
        body.extend(*b"j\0");
        body.resize(28, 0);
        body.extend(word(1));
        body.extend(float(0.5));
        body.extend(word(0));
        body.extend(word(1));
        body.extend(float(-2.0));
        [&[0, u8::from(!big_endian), 0, 0][..], &body].concat()
    }

    #[test]
    fn a_joint_state_is_read_in_either_order_of_bytes() {
        for big_endian in [false, true] {
            let state = decoded(&message(big_endian)).unwrap();
            assert_eq!((state.stamp.sec, state.stamp.nanosec), (2, 500));
            let columns = state.columns("/joint_states").unwrap();
            let expected = [("/joint_states:j.position", 0.5), ("/joint_states:j.effort", -2.0)];
            assert_eq!(columns, expected.map(|(name, value)| (name.to_owned(), value)));
        }
    }

    #[test]
    fn what_is_cut_or_lies_about_its_length_is_refused() {
        let whole = message(false);
        for length in 0..whole.len() - 1 {
            assert!(decoded(&whole[..length]).is_err(), "{length}");
        }
        let mut lies = whole.clone();
        lies[4 + 16..4 + 20].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(decoded(&lies).is_err());
        assert!(decoded(&[0, 7, 0, 0]).unwrap_err().contains("00 07 00 00"));
    }
}
