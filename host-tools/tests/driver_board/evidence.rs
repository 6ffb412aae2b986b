//! What a recording says of itself: in MCAP as other programs read it, and beside a CSV.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use bowden_core::recording::{Metadata, ReadOptions, Recording};
use bowden_core::rig::Rig;

use crate::bowden;
use crate::cuts::PATIENCE;
use crate::fake::Fake;
use crate::mishaps::Mishaps;
use crate::pseudo_terminal::Terminal;
use crate::screen::Screen;
use crate::terminal::THOUSAND_ROWS;

const RECORDING: &str = "bowden.recording";
const END: &str = "bowden.end";

fn metadata(path: &Path) -> Metadata {
    Recording::load(path, &ReadOptions::default()).unwrap().metadata().clone()
}

fn number(metadata: &Metadata, group: &str, name: &str) -> f64 {
    let text = metadata.entry(group, name).unwrap_or_else(|| panic!("no {group} {name}"));
    text.parse().unwrap_or_else(|_| panic!("{name} = {text}"))
}

/// What `date` says, UTC, as ISO 8601 sorts.
fn now_utc() -> String {
    let output = std::process::Command::new("date").args(["-u", "+%Y-%m-%dT%H:%M:%S"]).output().unwrap();
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

#[test]
fn a_recording_says_when_with_what_and_by_whom_it_was_made() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let rest = ["--seconds", "0.3", "--every", "10", "--reference", "sine", "--amplitude", "0.2"];
    let before_utc = now_utc();
    for out in ["a.mcap", "b.csv.gz"] {
        let arguments = [&["--out", out, "--note", "new \"tendon\"\nleft"], &rest[..]].concat();
        let (status, _, stderr) =
            terminal.bowden(place, "record", &[&arguments[..], &["--rig", "rig.toml"]].concat());
        assert_eq!((status, stderr.as_str()), (0, ""));
        let metadata = metadata(&place.join(out));
        let said = |name: &str| metadata.entry(RECORDING, name).unwrap_or_else(|| panic!("{out}: no {name}"));
        // By the fake board, the command line and the clock of another program.
        assert_eq!(
            (said("firmware"), said("firmware_revision"), said("board_serial")),
            ("9.8.7", "0123456789ab", "0042002A")
        );
        assert_eq!((said("note"), said("mode"), said("every")), ("new \"tendon\"\nleft", "position", "10"));
        assert_eq!(said("reference"), "sine of 0.2 rad at 0.5 Hz around 0 rad");
        assert_eq!((said("port"), said("period_ns")), (terminal.port(), "100000"));
        assert_eq!(said("tool"), format!("bowden {}", env!("CARGO_PKG_VERSION")));
        let head = std::process::Command::new("git").args(["rev-parse", "--short=12", "HEAD"]).output();
        if let Ok(head) = head.map(|head| String::from_utf8(head.stdout).unwrap())
            && !head.is_empty()
        {
            assert_eq!(said("tool_revision").trim_end_matches('+'), head.trim());
        }
        let ended_utc = metadata.entry(END, "ended_utc").unwrap();
        for utc in [said("started_utc"), ended_utc] {
            assert!(utc.ends_with('Z') && utc[..19] >= *before_utc && utc[..19] <= *now_utc(), "{utc}");
        }
        let lasted_s =
            number(&metadata, END, "ended_monotonic_s") - number(&metadata, RECORDING, "started_monotonic_s");
        assert!((0.0..600.0).contains(&lasted_s), "{lasted_s} s");
        let uptime_s: f64 =
            fs::read_to_string("/proc/uptime").unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!(number(&metadata, END, "ended_monotonic_s") <= uptime_s + 1.0);
        assert_eq!(number(&metadata, END, "rows"), 300.0);
        assert_eq!(
            (metadata.entry(END, "end"), metadata.entry(END, "samples_lost")),
            (Some("complete"), Some("0"))
        );
        let rig = fs::read_to_string(place.join("rig.toml")).unwrap();
        assert_eq!((said("rig"), metadata.entry(END, "rig")), (rig.as_str(), Some(rig.as_str())));
        assert_eq!(number(&metadata, "bowden.parameters", "tendon.pretension"), 30.0);
        let recording = Recording::load(&place.join(out), &ReadOptions::default()).unwrap();
        let first_s =
            number(&metadata, RECORDING, "first_tick") * number(&metadata, RECORDING, "period_ns") / 1e9;
        assert!((recording.t_s()[0] - first_s).abs() < 1e-9);
    }
    // Converting keeps it.
    let original = metadata(&place.join("a.mcap"));
    for pair in ["a.mcap", "c.csv", "d.mcap", "p.parquet", "e.csv.gz", "q.parquet", "r.mcap"].windows(2) {
        assert_eq!(bowden(place, &["convert", pair[0], pair[1]]).0, 0);
        assert_eq!(metadata(&place.join(pair[1])), original, "{}", pair[1]);
    }
    assert_eq!(bowden(place, &["recover", "a.mcap", "--out", "f.csv"]).0, 0);
    assert_eq!(metadata(&place.join("f.csv")), original);
    fs::write(place.join("f.recording.toml"), "x = ").unwrap();
    let (status, _, stderr) = bowden(place, &["check", "f.csv"]);
    assert_eq!((status, stderr.lines().count()), (3, 1), "{stderr}");
    assert!(stderr.starts_with("bowden: f.recording.toml: "), "{stderr}");
}

/// Starts a command that records `file` of the fake board, and kills it in the middle, so that what it writes at the end is missing.
fn cut(terminal: &Terminal, place: &Path, command: &str, arguments: &[&str], file: &str) {
    let mut command_line = terminal.command(place, command, arguments);
    let file = place.join(file);
    let is_long = || fs::metadata(&file).is_ok_and(|file| file.len() > THOUSAND_ROWS);
    let begun = Instant::now();
    if command == "monitor" {
        let mut screen = Screen::start(&command_line, 100, 30);
        while !is_long() {
            assert!(!screen.has_ended() && begun.elapsed() < PATIENCE, "{}", screen.text());
            std::thread::sleep(Duration::from_millis(2));
        }
        // Kills it.
        drop(screen);
        return;
    }
    let mut child = command_line.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while !is_long() {
        assert!(child.try_wait().unwrap().is_none() && begun.elapsed() < PATIENCE, "{command}");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn a_killed_program_leaves_its_evidence_before_the_rows() {
    let plan = "schema = \"bowden-plan/1\"\n[[step]]\nkind = \"follow\"\nreference = \"sine\"\namplitude = 0.2\nfrequency_hz = 0.5\nseconds = 600\n";
    let course = ["--reference", "sine", "--amplitude", "0.2"];
    for (command, arguments, file) in [
        ("record", [&["--out", "a.mcap"][..], &course].concat(), "a.mcap"),
        ("record", [&["--out", "b.csv"][..], &course].concat(), "b.csv"),
        ("monitor", [&["--record", "c.mcap"][..], &course].concat(), "c.mcap"),
        ("run", vec!["plan.toml", "--out", "out"], "out/01-sine.mcap"),
    ] {
        let terminal = Terminal::new(Fake::new(Mishaps::default()));
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path();
        fs::write(place.join("plan.toml"), plan).unwrap();
        let arguments = [&arguments[..], &["--note", "new tendon", "--load", "2.5,0.03"]].concat();
        cut(&terminal, place, command, &arguments, file);
        let (status, _, stderr) = bowden(place, &["recover", file, "--out", "whole.mcap"]);
        assert!(matches!(status, 0 | 3), "{stderr}");
        let metadata = metadata(&place.join("whole.mcap"));
        assert_eq!(metadata.group(END), None, "{command}");
        let said = |name: &str| {
            metadata.entry(RECORDING, name).unwrap_or_else(|| panic!("{command} {file}: no {name}"))
        };
        assert_eq!(
            (said("note"), said("board_serial"), said("firmware")),
            ("new tendon", "0042002A", "9.8.7")
        );
        assert!(
            said("reference").starts_with("sine of 0.2 rad at 0.5 Hz around 0 rad"),
            "{}",
            said("reference")
        );
        assert_eq!(number(&metadata, "bowden.parameters", "tendon.pretension"), 30.0);
        assert!(!said("started_utc").is_empty() && !said("tool_revision").is_empty());
        // The parameters of the fake, its supply of 2707 codes of 0.0088645 V, and the weight of the command line.
        let rig = Rig::parse(said("rig"), "rig").unwrap();
        let (tendon, pulleys) = (rig.joint.tendon.unwrap(), rig.joint.pulleys.unwrap());
        assert_eq!((tendon.pretension_n, pulleys.input_radius_m), (30.0, 0.015));
        for line in ["supply_v = 24.0", "mass_kg = 2.5", "arm_m = 0.03", "gear_ratio = 30.0"] {
            assert!(said("rig").lines().any(|got| got == line), "{command}: {line} in {}", said("rig"));
        }
        if command == "run" {
            assert_eq!((said("plan"), said("plan_step")), (plan, "01-sine"));
        }
    }
}

#[test]
fn an_mcap_file_has_schema_and_units_for_other_programs() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["record", "--port", "sim", "--seconds", "0.1", "--out", "a.mcap"];
    assert_eq!(bowden(folder.path(), &arguments).0, 0);
    let file = fs::read(folder.path().join("a.mcap")).unwrap();
    // By the index at the end, as Foxglove and PlotJuggler open a file.
    let summary = mcap::Summary::read(&file).unwrap().expect("an index");
    let statistics = summary.stats.unwrap();
    assert_eq!((statistics.message_count, statistics.channel_count, statistics.schema_count), (1000, 1, 1));
    let channel = summary.channels.values().next().unwrap();
    assert_eq!((channel.topic.as_str(), channel.message_encoding.as_str()), ("/bowden/samples", "json"));
    let schema = channel.schema.as_ref().unwrap();
    assert_eq!((schema.name.as_str(), schema.encoding.as_str()), ("bowden.Sample", "jsonschema"));
    let schema: serde_json::Value = serde_json::from_slice(&schema.data).unwrap();
    assert_eq!(schema["type"], "object");
    // Names and units by the page about the driver board.
    let expected: BTreeMap<&str, &str> = [
        ("theta_ref_rad", "rad"),
        ("theta_in_rad", "rad"),
        ("theta_out_rad", "rad"),
        ("f1_n", "N"),
        ("f2_n", "N"),
        ("f3_n", "N"),
        ("f4_n", "N"),
        ("duty", "1"),
        ("bus_v", "V"),
        ("i_motor_a", "A"),
        ("drive_enable", "1"),
        ("theta_command_rad", "rad"),
        ("encoder_in_count_raw", "count"),
        ("encoder_out_count_raw", "count"),
        ("f1_raw", "code"),
        ("current_raw", "code"),
    ]
    .into();
    for (name, unit) in expected {
        assert_eq!(schema["properties"][name]["type"], "number", "{name}");
        assert_eq!(schema["properties"][name]["description"], unit, "{name}");
        assert_eq!(channel.metadata.get(&format!("unit.{name}")).map(String::as_str), Some(unit), "{name}");
    }
    assert_eq!(channel.metadata.get("unit.t_s").map(String::as_str), Some("s"));
    let first = mcap::MessageStream::new(&file).unwrap().next().unwrap().unwrap();
    let row: serde_json::Value = serde_json::from_slice(&first.data).unwrap();
    let t_s = row["t_s"].as_f64().unwrap();
    assert!((first.log_time as f64 / 1e9 - t_s).abs() < 1e-9);
    let properties: Vec<&String> = schema["properties"].as_object().unwrap().keys().collect();
    assert!(row.as_object().unwrap().keys().all(|name| properties.contains(&name)));
}
