//! Recordings in MCAP against the plain `mcap` crate: prints one line of JSON a way, with its wall times.
//!
//! The plain crate writes the same messages, made by `write!`, and numbers as bytes, which no schema describes; it reads its messages
//! without looking into them.

use std::fmt::Write;
use std::io::Cursor;
use std::time::Instant;

use bowden_core::recording::{ReadOptions, Recording};
use bowden_model::channel::Channel;

const ROWS: usize = 100_000;
const REPEATS: usize = 5;
const CHANNELS: [Channel; 12] = [
    Channel::ThetaRef,
    Channel::ThetaIn,
    Channel::ThetaOut,
    Channel::F1,
    Channel::F2,
    Channel::F3,
    Channel::F4,
    Channel::TorqueIn,
    Channel::TorqueOut,
    Channel::Duty,
    Channel::BusVoltage,
    Channel::MotorCurrent,
];

/// Values that repeat nowhere and have all digits.
fn value(row: usize, column: usize) -> f64 {
    (row as f64 * 0.000_37 + column as f64).sin() * 0.7
}

fn report(what: &str, bytes: u64, mut work: impl FnMut()) {
    let seconds: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .collect();
    println!("{}", serde_json::json!({ "what": what, "bytes": bytes, "seconds": seconds }));
}

fn plain(message: impl Fn(usize) -> Vec<u8>) -> Vec<u8> {
    let options = mcap::WriteOptions::new().chunk_size(Some(1 << 20)).compression_threads(0);
    let mut writer = options.create(Cursor::new(Vec::new())).expect("a writer");
    let channel =
        writer.add_channel(0, "/samples", "json", &std::collections::BTreeMap::new()).expect("a channel");
    for row in 0..ROWS {
        let log_time = row as u64 * 1_000_000;
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence: row as u32,
            log_time,
            publish_time: log_time,
        };
        writer.write_to_known_channel(&header, &message(row)).expect("a message");
    }
    writer.finish().expect("an end");
    writer.into_inner().into_inner()
}

fn json(row: usize) -> Vec<u8> {
    let mut text = format!("{{\"t_s\":{:?}", row as f64 * 1e-3);
    for (column, channel) in CHANNELS.iter().enumerate() {
        write!(text, ",\"{}\":{:?}", channel.role(), value(row, column)).expect("a string takes all");
    }
    (text + "}").into_bytes()
}

fn binary(row: usize) -> Vec<u8> {
    let values = (0..CHANNELS.len()).map(|column| value(row, column));
    std::iter::once(row as f64 * 1e-3).chain(values).flat_map(f64::to_le_bytes).collect()
}

fn main() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("rows.mcap");
    let mut recording = Recording::new("rows", (0..ROWS).map(|row| row as f64 * 1e-3).collect());
    for (column, channel) in CHANNELS.iter().enumerate() {
        recording.set(*channel, (0..ROWS).map(|row| value(row, column)).collect());
    }
    recording.save(&path).expect("a file");
    let bytes = std::fs::metadata(&path).expect("its size").len();
    report("bowden writes", bytes, || recording.save(&path).expect("a file"));
    report("bowden reads, to columns of numbers", bytes, || {
        let read = Recording::load(&path, &ReadOptions::default()).expect("a recording");
        assert_eq!(read.len(), ROWS);
    });
    for (what, message) in [("JSON", json as fn(usize) -> Vec<u8>), ("bytes", binary)] {
        let file = plain(message);
        let size = file.len() as u64;
        report(&format!("mcap crate writes {what}"), size, || assert_eq!(plain(message).len(), file.len()));
        report(&format!("mcap crate reads {what}, messages unopened"), size, || {
            let messages = mcap::MessageStream::new(&file).expect("a file");
            assert_eq!(messages.flatten().count(), ROWS);
        });
    }
}
