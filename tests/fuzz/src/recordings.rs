//! Recordings of every format, and what `bowden recover` makes of them.

use std::collections::BTreeMap;
use std::fs;
use std::io::{Cursor, Write};
use std::path::Path;

use bowden_core::recording::{ReadOptions, Recording, recover};

use crate::files::{file, folder};
use crate::judge;

/// A table of 12 samples with roles, a column of text, quotes and a gap.
const TABLE: &str = "t_s,theta_in_rad,theta_out_rad,f1_n,duty,note\n0,0,0,30,0,a\n0.001,0.01,0,30.5,0.1,\"b, c\"\n\
                     0.002,0.02,0.01,31,0.1,\n0.003,0.03,0.02,31.5,0.1,d\n0.004,0.04,0.03,32,0.1,e\n0.005,0.05,0.04,32.5,0.1,f\n\
                     0.5,0.06,0.05,33,-0.1,g\n0.501,0.05,0.05,33,-0.1,\n0.502,0.04,0.05,32,-0.1,h\n0.503,0.03,0.04,31,-0.1,i\n\
                     0.504,0.02,0.03,30,-0.1,j\n0.505,0.01,0.02,30,0,k\n";

/// Reads a file with both readers. What is read is finite, rises in time, and is read as the same from every format that it is written in.
fn judge_file(path: &Path, bytes: &[u8]) {
    // A page of Parquet states its length in 31 bits, and the library makes room for it, packed and unpacked, before it looks.
    let more = if bytes.starts_with(b"PAR1") { 2 << 31 } else { 0 };
    let shown = path.display().to_string();
    let read = judge::bounded_beside(more, bytes, || Recording::load(path, &ReadOptions::default()));
    match read {
        Err(failure) => judge::one_line(&failure, &shown),
        Ok(recording) => judge_recording(recording, bytes),
    }
    let out = folder().join("recovered.csv");
    match judge::bounded(bytes, || recover(path, &out)) {
        Err(failure) => judge::one_line(&failure, &folder().display().to_string()),
        Ok(recovered) => {
            recovered.missing.iter().for_each(|line| judge::is_one_line(line));
            // What is recovered is whole: it can be read, with as many rows.
            let whole = Recording::load(&out, &ReadOptions::default());
            let whole = whole.unwrap_or_else(|failure| panic!("recovered and not readable: {failure}"));
            assert_eq!(whole.len() as u64, recovered.rows);
        }
    }
}

fn judge_recording(mut recording: Recording, bytes: &[u8]) {
    recording.notes().iter().for_each(|note| judge::is_one_line(note));
    assert!(recording.t_s().windows(2).all(|pair| pair[0] < pair[1]) && !recording.is_empty());
    for channel in recording.channels().collect::<Vec<_>>() {
        let values = recording.channel(channel).expect("a channel that is listed is there");
        assert!(values.len() == recording.len() && values.iter().all(|value| value.is_finite()));
    }
    for name in ["again.csv", "again.mcap", "again.parquet"] {
        let out = folder().join(name);
        match recording.save(&out) {
            Ok(()) => {
                let again = Recording::load(&out, &ReadOptions::default());
                let again = again.unwrap_or_else(|failure| panic!("written and not readable: {failure}"));
                assert_eq!(again, recording, "{name}");
            }
            // A table cannot keep a line break in a cell; the message says so.
            Err(failure) => judge::one_line(&failure, name),
        }
    }
    judge::bounded(bytes, || {
        recording.set_spikes_aside(|_| None);
        recording.drop_frozen_rows();
    });
    recording.notes().iter().for_each(|note| judge::is_one_line(note));
}

/// Any bytes as a file that is called a table.
pub fn csv(bytes: &[u8]) {
    judge_file(&file("rec.csv", bytes), bytes);
}

/// Tables.
pub fn tables() -> Vec<Vec<u8>> {
    let windows = TABLE.replace('\n', "\r\n");
    let marked = format!("\u{feff}{TABLE}");
    vec![TABLE.into(), windows.into(), marked.into()]
}

/// The first byte says whether the rest is compressed data or the text that is compressed; whole and cut.
pub fn gzip(bytes: &[u8]) {
    let Some((kind, rest)) = bytes.split_first() else { return };
    let data = if kind & 1 == 0 { rest.to_vec() } else { compressed(rest, 1 + usize::from(kind >> 1)) };
    judge_file(&file("rec.csv.gz", &data), &data);
}

/// `text` in gzip members of so many bytes times 16.
fn compressed(text: &[u8], sixteens: usize) -> Vec<u8> {
    let members = text.chunks(16 * sixteens).map(|part| {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(part).and_then(|()| encoder.finish()).expect("memory takes everything")
    });
    members.collect::<Vec<_>>().concat()
}

/// Compressed tables, and tables to be compressed.
pub fn gzipped() -> Vec<Vec<u8>> {
    let kinds = [
        (0, compressed(TABLE.as_bytes(), 1 << 10)),
        (0, compressed(TABLE.as_bytes(), 4)),
        (0x7f, TABLE.into()),
        (9, TABLE.into()),
    ];
    kinds.map(|(kind, data)| [&[kind][..], &data].concat()).into()
}

/// Any bytes as a file that is called MCAP.
pub fn mcap(bytes: &[u8]) {
    judge_file(&file("rec.mcap", bytes), bytes);
}

/// MCAP as this program writes it, and plain: without chunks, without compression, without check sums, so that changes get past them;
/// joint states of a ROS 2 bag.
pub fn mcaps() -> Vec<Vec<u8>> {
    let own = written("seed.mcap");
    let options = || mcap::WriteOptions::new().profile("").library("seed");
    let plain =
        options().use_chunks(false).calculate_data_section_crc(false).calculate_summary_section_crc(false);
    let chunked = options().compression(None).calculate_chunk_crcs(false);
    let chunked = chunked.calculate_data_section_crc(false).calculate_summary_section_crc(false);
    let rows =
        (0..6).map(|n| format!("{{\"t_s\":{n},\"theta_in_rad\":0.{n},\"note\":\"n{n}\"}}").into_bytes());
    let rows: Vec<Vec<u8>> = rows.collect();
    let states: Vec<Vec<u8>> = (1..6).map(joint_state).collect();
    let samples = ("bowden.Sample", "jsonschema", "/bowden/samples", "json");
    let bag = ("sensor_msgs/msg/JointState", "ros2msg", "/joint_states", "cdr");
    let mut files = vec![own];
    for options in [plain, chunked] {
        files.push(with_messages(options.clone(), samples, &rows));
        files.push(with_messages(options, bag, &states));
    }
    files
}

fn with_messages(
    options: mcap::WriteOptions,
    kind: (&str, &str, &str, &str),
    messages: &[Vec<u8>],
) -> Vec<u8> {
    let (schema, encoding, topic, message_encoding) = kind;
    let mut file = options.create(Cursor::new(Vec::new())).expect("memory takes everything");
    let schema = file.add_schema(schema, encoding, b"{}").expect("memory takes everything");
    let channel = file
        .add_channel(schema, topic, message_encoding, &BTreeMap::default())
        .expect("memory takes everything");
    for (n, message) in (0..).zip(messages) {
        let time = u64::from(n) * 1_000_000;
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence: n,
            log_time: time,
            publish_time: time,
        };
        file.write_to_known_channel(&header, message).expect("memory takes everything");
    }
    file.finish().expect("memory takes everything");
    file.into_inner().into_inner()
}

/// `sensor_msgs/msg/JointState` in little-endian CDR: stamp `n` s, an empty frame, joint `j` at `n` rad.
fn joint_state(n: u32) -> Vec<u8> {
    let mut body: Vec<u8> = [n, 0, 1].into_iter().flat_map(u32::to_le_bytes).collect();
    body.resize(16, 0);
    body.extend([1_u32, 2].into_iter().flat_map(u32::to_le_bytes));
    body.extend(*b"j\0");
    body.resize(28, 0);
    body.extend(1_u32.to_le_bytes());
    body.extend(f64::from(n).to_le_bytes());
    body.extend([0_u8; 8]);
    [&[0, 1, 0, 0][..], &body].concat()
}

/// Any bytes as a file that is called Parquet.
pub fn parquet(bytes: &[u8]) {
    judge_file(&file("rec.parquet", bytes), bytes);
}

/// Parquet as this program writes it.
pub fn parquets() -> Vec<Vec<u8>> {
    vec![written("seed.parquet")]
}

fn written(name: &str) -> Vec<u8> {
    let table = Recording::load(&file("seed.csv", TABLE.as_bytes()), &ReadOptions::default());
    let path = folder().join(name);
    table.and_then(|table| table.save(&path)).expect("the seed is a recording");
    fs::read(&path).expect("what was written can be read")
}
