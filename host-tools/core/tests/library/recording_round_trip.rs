//! A recording keeps every bit through CSV, gzipped CSV and MCAP, and what is not interpreted keeps every letter.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::Path;

use bowden_core::recording::{Column, ColumnMap, ColumnSource, ReadOptions, Recording, TOPIC};
use bowden_model::channel::Channel;

fn load(path: &Path) -> Recording {
    Recording::load(path, &ReadOptions::default()).unwrap()
}

/// 64-bit values that cover signs, exponents and mantissas; a multiplicative sequence, so that failures repeat.
fn assorted_values(count: usize) -> Vec<f64> {
    let edge = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.1,
        1e-308,
        5e-324,
        f64::MAX,
        f64::MIN,
        f64::MIN_POSITIVE,
        1e16,
        1e17,
        1e-5,
        1e-7,
    ];
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let random = std::iter::from_fn(move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        Some(f64::from_bits(state))
    });
    edge.into_iter().chain(random.filter(|value| value.is_finite())).take(count).collect()
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn values_keep_every_bit_through_every_format() {
    let count = 2000;
    let t_s: Vec<f64> = (0..count).map(|sample| -0.5 + sample as f64 / 3.0 * 1e-3).collect();
    let values = assorted_values(count);
    let recording = Recording::new("made", t_s.clone()).with(Channel::F2, values.clone());
    let folder = tempfile::tempdir().unwrap();
    let mut last = recording;
    for name in ["a.csv", "b.mcap", "c.csv", "d.csv.gz", "p.parquet", "e.mcap", "f.csv"] {
        let path = folder.path().join(name);
        last.save(&path).unwrap();
        last = load(&path);
        assert_eq!(bits(last.t_s()), bits(&t_s), "{name}");
        assert_eq!(bits(last.channel(Channel::F2).unwrap()), bits(&values), "{name}");
        assert!(last.notes().is_empty(), "{name}: {:?}", last.notes());
    }
    let text = |name| fs::read(folder.path().join(name)).unwrap();
    assert_eq!(text("a.csv"), text("c.csv"));
    assert_eq!(text("a.csv"), text("f.csv"));
}

#[test]
fn what_is_not_interpreted_keeps_every_letter_and_its_place() {
    let cells = [
        "1.50",
        "007",
        "1e5",
        " 2 ",
        "idle",
        "a,b",
        "say \"x\"",
        "",
        "true",
        "null",
        "{\"k\":1}",
        "ä\u{1f600}",
        "-0.0",
    ];
    let mut text = "mode,f1_n,t_s,\"odd \"\"name\"\"\",theta_in_rad\n".to_owned();
    for (sample, cell) in cells.iter().enumerate() {
        let quoted = format!("\"{}\"", cell.replace('"', "\"\""));
        writeln!(text, "{quoted},{sample}.25,{sample}.5,{quoted},0.125").unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let first = folder.path().join("a.csv");
    fs::write(&first, text).unwrap();
    let mut last = load(&first);
    for name in ["b.mcap", "c.csv", "d.mcap", "p.parquet", "e.csv.gz"] {
        let path = folder.path().join(name);
        last.save(&path).unwrap();
        last = load(&path);
        let names: Vec<&str> = last.columns().iter().map(Column::name).collect();
        assert_eq!(names, ["mode", "f1_n", "odd \"name\"", "theta_in_rad"], "{name}");
        for column in [0, 2] {
            let Column::Unknown(text) = &last.columns()[column] else { panic!("{name}: column {column}") };
            assert_eq!(text.cells().collect::<Vec<_>>(), cells, "{name}: column {column}");
        }
        assert_eq!(last.channel(Channel::F1).unwrap()[3], 3.25);
    }
}

#[test]
fn a_map_renames_and_scales_and_one_column_may_serve_two_roles() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("raw.csv");
    fs::write(&path, "ms,deg,f1_n,grams\n0,180,7,100\n4,-90,8,200\n").unwrap();
    let source = |column: &str, scale, offset| ColumnSource { column: column.into(), scale, offset };
    let columns = ColumnMap {
        time: Some(source("ms", 1e-3, 10.0)),
        channels: vec![
            (Channel::ThetaIn, source("deg", std::f64::consts::PI / 180.0, 0.0)),
            (Channel::ThetaMotor, source("deg", 1.0, 1.0)),
            (Channel::F1, source("grams", 0.01, -0.5)),
        ],
    };
    let recording = Recording::load(&path, &ReadOptions { columns, only: None }).unwrap();
    assert_eq!(recording.t_s(), [10.0, 10.004]);
    let theta_in = recording.channel(Channel::ThetaIn).unwrap();
    assert!((theta_in[1] + std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    assert_eq!(recording.channel(Channel::ThetaMotor).unwrap(), [181.0, -89.0]);
    // The file's own f1_n is not the f1_n of the rig.
    assert_eq!(recording.channel(Channel::F1).unwrap(), [0.5, 1.5]);
    assert_eq!(recording.columns().len(), 3);
}

#[test]
fn what_is_not_asked_for_may_be_broken() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rec.csv");
    let text = "t_s,duty,f1_n,junk\n0,0.5,NaN,x\n0.1,0.25,,\n";
    fs::write(&path, text).unwrap();
    let options = ReadOptions { only: Some(vec![Channel::Duty]), ..ReadOptions::default() };
    let recording = Recording::load(&path, &options).unwrap();
    assert_eq!(recording.channels().collect::<Vec<_>>(), [Channel::Duty]);
    assert_eq!(recording.channel(Channel::Duty).unwrap(), [0.5, 0.25]);
    assert!(Recording::load(&path, &ReadOptions::default()).is_err());
}

#[test]
fn places_are_lines_of_the_file_whatever_stands_between() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rec.csv");
    fs::write(&path, "t_s,note\r\n0,a\r\n\r\n\r\n1,\"b, b\"\r\n\n2,c").unwrap();
    let recording = load(&path);
    let lines: Vec<String> =
        (0..3).map(|sample| recording.place(sample).rsplit(':').next().unwrap().to_owned()).collect();
    assert_eq!(lines, ["2", "5", "7"]);
    assert!(recording.slice(1..3).place(1).ends_with("rec.csv:7"));
}

/// Topic, encoding, data.
type Message<'m> = (&'m str, &'m str, &'m str);

/// Writes an MCAP file with the library alone.
fn write_mcap(path: &Path, messages: &[Message]) {
    let mut writer = mcap::Writer::new(std::io::BufWriter::new(fs::File::create(path).unwrap())).unwrap();
    for (number, (topic, encoding, data)) in messages.iter().enumerate() {
        let channel_id = writer.add_channel(0, topic, encoding, &BTreeMap::new()).unwrap();
        let time = number as u64;
        let header =
            mcap::records::MessageHeader { channel_id, sequence: 0, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, data.as_bytes()).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn other_topics_are_passed_over_and_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rec.mcap");
    write_mcap(
        &path,
        &[
            ("/imu", "ros1", "\u{1}\u{2}"),
            (TOPIC, "json", "{\"t_s\": 0.5, \"duty\": 1e-1, \"mode\": \"on\"}"),
            // The order of properties is free in JSON.
            (TOPIC, "json", "{\"mode\": \"off\", \"duty\": 0.25, \"t_s\": 0.75}"),
        ],
    );
    let recording = load(&path);
    assert_eq!(recording.t_s(), [0.5, 0.75]);
    assert_eq!(recording.channel(Channel::Duty).unwrap(), [0.1, 0.25]);
    assert_eq!(recording.topics_passed_over(), ["/imu"]);
    assert!(recording.notes().is_empty());
}

#[test]
fn bad_messages_are_named_by_their_number() {
    let good = (TOPIC, "json", "{\"t_s\": 0.5, \"duty\": 0}");
    let cases: &[(&[Message], &str)] = &[
        (&[("/imu", "json", "{}")], "no message on topic /bowden/samples; the file has /imu"),
        (&[(TOPIC, "ros1", "x")], "message 1: topic /bowden/samples is encoded as `ros1`, expected json"),
        (&[good, (TOPIC, "json", "[1]")], "message 2: not a JSON object"),
        (
            &[good, (TOPIC, "json", "{\"t_s\": 0.6}")],
            "message 2: no property `duty`, which the first message has",
        ),
        (
            &[good, (TOPIC, "json", "{\"t_s\": 0.6, \"duty\": 0, \"x\": 1}")],
            "message 2: 3 properties, expected 2 as in the first message",
        ),
        (&[good, (TOPIC, "json", "{\"t_s\": 0.6, \"duty\": null}")], "message 2: column `duty`: got `null`"),
        (&[good, good], "message 2: column `t_s`: got 0.5 s after 0.5 s"),
        (&[(TOPIC, "json", "{\"duty\": 0}")], "message 1: no column `t_s`"),
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rec.mcap");
    for (messages, expected) in cases {
        write_mcap(&path, messages);
        let failure = Recording::load(&path, &ReadOptions::default()).unwrap_err();
        let line = failure.message().replace(&format!("{}: ", path.display()), "");
        assert!(line.starts_with(expected), "\nexpected {expected}\n     got {line}");
    }
}

#[test]
fn a_cut_mcap_file_gives_its_whole_samples_and_a_note() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rec.mcap");
    let samples = 40_000;
    let t_s: Vec<f64> = (0..samples).map(|sample| f64::from(sample) * 1e-3).collect();
    Recording::new("made", t_s.clone()).with(Channel::Duty, t_s.clone()).save(&path).unwrap();
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() * 3 / 4]).unwrap();
    let recording = load(&path);
    let read = recording.len();
    assert!(read > 0 && read < t_s.len(), "{read}");
    assert_eq!(recording.t_s(), &t_s[..read]);
    let expected = format!("the file ends early; the {read} whole samples before the end were used");
    assert!(recording.notes()[0].ends_with(&expected), "{:?}", recording.notes());
}

/// The samples of `part` are the first of `whole`, to the last bit, and every column has as many.
fn assert_is_start_of(part: &Recording, whole: &Recording, what: &str) {
    let samples = part.len();
    assert!(samples > 0 && samples < whole.len(), "{what}: {samples}");
    assert_eq!(part, &whole.slice(0..samples), "{what}");
}

#[test]
fn data_cut_at_any_byte_gives_whole_samples_only() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rec.csv.gz");
    let t_s: Vec<f64> = (0..100).map(|sample| f64::from(sample) * 1e-3).collect();
    let values: Vec<f64> = t_s.iter().map(|t_s| (7.0 * t_s).sin()).collect();
    let plain = folder.path().join("rec.csv");
    Recording::new("made", t_s.clone())
        .with(Channel::F1, values)
        .with(Channel::Duty, t_s)
        .save(&plain)
        .unwrap();
    let whole = load(&plain);
    let text = fs::read(&plain).unwrap();
    // Stored without compression, a cut of the file is a cut of the table at the same distance from its start.
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::none());
    encoder.write_all(&text).unwrap();
    let stored = encoder.finish().unwrap();
    for cut in (stored.len() - 150)..(stored.len() - 60) {
        fs::write(&path, &stored[..cut]).unwrap();
        let part = load(&path);
        assert_is_start_of(&part, &whole, &format!("gzip cut at byte {cut}"));
        let last_note = part.notes().last().unwrap();
        assert!(last_note.contains(&format!("the {} whole samples", part.len())), "{last_note}");
    }
    // A table that ends within a line, but not within its last cell, loses that line.
    let line_start = text[..text.len() - 1].iter().rposition(|byte| *byte == b'\n').unwrap() + 1;
    let last_comma = text.iter().rposition(|byte| *byte == b',').unwrap();
    for cut in line_start + 1..=last_comma + 1 {
        fs::write(&plain, &text[..cut]).unwrap();
        let part = load(&plain);
        assert_is_start_of(&part, &whole, &format!("table cut at byte {cut}"));
        assert!(part.notes()[0].ends_with(":101: the file ends within this line; the line was dropped"));
    }
}
