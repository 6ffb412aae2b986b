//! Bad input on real processes: exit status, and one line that says file, place and what is wrong.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::bowden;
use tempfile::TempDir;

/// Samples of the recording that each case starts from.
const SAMPLES: usize = 60;

const RIG: &str = r#"schema = "bowden-rig/1"
name = "bench"

[motor]
supply_v = 24.0
resistance_ohm = 2
inductance_h = 0.0008
torque_constant_nm_per_a = 0.03
gear_ratio = 30.0
rotor_inertia_kg_m2 = 5.0e-6
viscous_nm_s_per_rad = 0.02

[pulleys]
input_radius_m = 0.015
output_radius_m = 0.015

[tendon]
length_m = 1.0
axial_stiffness_n = 72900
pretension_n = 30

[sheath]
wrap_angle_rad = 3.14159265
friction_coefficient = 0.12

[load]
mass_kg = 2.5
arm_m = 0.03
inertia_kg_m2 = 0.0
viscous_nm_s_per_rad = 0.004

[sensors]
encoder_bits = 12
tension_full_scale_n = 98.0665
adc_bits = 12
tension_noise_n = 0.1
current_noise_a = 0.01

[simulation]
friction = "distributed"
effects = []
"#;

/// A recording without fault: time at 1 kHz, one input, one output, one column of text. Line 2 is sample 0.
fn good_csv() -> String {
    let mut text = "t_s,theta_in_rad,f1_n,note\n".to_owned();
    for sample in 0..SAMPLES {
        let t_s = sample as f64 * 1e-3;
        writeln!(text, "{t_s:.3},{:.4},{:.2},step {sample}", 0.1 * t_s, 30.0 + t_s).unwrap();
    }
    text
}

/// The good recording with one line (counted from 1) replaced.
fn with_line(number: usize, line: &str) -> Vec<u8> {
    let mut lines: Vec<String> = good_csv().lines().map(str::to_owned).collect();
    line.clone_into(&mut lines[number - 1]);
    (lines.join("\n") + "\n").into_bytes()
}

/// The good recording with the first data cell of one column multiplied.
fn scaled(column: usize, factor: f64) -> Vec<u8> {
    let mut text = String::new();
    for (number, line) in good_csv().lines().enumerate() {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if number > 0 {
            cells[column] = format!("{:?}", cells[column].parse::<f64>().unwrap() * factor);
        }
        text += &(cells.join(",") + "\n");
    }
    text.into_bytes()
}

fn gzip(data: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(data).unwrap();
    encoder.finish().unwrap()
}

/// Runs `bowden` in a folder: exit status, standard output, standard error.
/// Exit status 2, nothing on standard output, and this one line.
fn assert_refused(folder: &Path, arguments: &[&str], expected: &str) {
    let (status, stdout, stderr) = bowden(folder, arguments);
    assert_eq!(stderr, format!("bowden: {expected}\n"), "{arguments:?}");
    assert_eq!((status, stdout.as_str()), (2, ""), "{arguments:?}");
}

fn folder_with(files: &[(&str, &[u8])]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        fs::write(folder.path().join(name), content).unwrap();
    }
    folder
}

#[test]
fn the_starting_point_of_all_cases_is_good() {
    let folder = folder_with(&[("rec.csv", good_csv().as_bytes()), ("rig.toml", RIG.as_bytes())]);
    let (status, stdout, stderr) = bowden(folder.path(), &["check", "rec.csv", "--rig", "rig.toml"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    assert!(stdout.contains("rec.csv: 60 samples, 0.059 s"), "{stdout}");
    assert!(stdout.contains("roles: theta_in_rad, f1_n; kept and not interpreted: note"), "{stdout}");
}

#[test]
fn a_recording_that_cannot_be_used_is_named_with_its_place() {
    let header_only = good_csv().lines().next().unwrap().to_owned() + "\n";
    let mut not_utf8 = good_csv().into_bytes();
    let cut = not_utf8.len() - 3;
    not_utf8[cut] = 0xff;
    let not_utf8_line =
        format!("rec.csv: byte {cut}: got 0xff, expected UTF-8 text; this is no comma-separated table");
    let utf16: Vec<u8> = good_csv().encode_utf16().flat_map(u16::to_le_bytes).collect();
    let utf16 = [vec![0xff, 0xfe], utf16].concat();
    let mut damaged = gzip(good_csv().as_bytes());
    let length = damaged.len();
    damaged[length - 6] ^= 0x55;
    let damaged_line = format!(
        "rec.csv.gz: after byte {} of the table: corrupt gzip stream does not have a matching checksum; copy \
         the file again, or take out what is whole with `bowden recover`",
        good_csv().len()
    );
    let short: String = good_csv().split_inclusive('\n').take(11).collect();
    let quoted = with_line(20, "0.018,0.0018,30.02,\"open");
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("rec.csv", vec![], "rec.csv:1: the file is empty, expected a header line with t_s; record again"),
        ("rec.csv", header_only.into(), "rec.csv: a header and no samples; record again"),
        (
            "rec.csv",
            b"\n\n".to_vec(),
            "rec.csv:1: the file has no line, expected a header with t_s; record again",
        ),
        (
            "rec.csv",
            b"time_s,theta_in_rad\n0,1\n".to_vec(),
            "rec.csv:1: no column `t_s`; the header has time_s, theta_in_rad; rename the time column, or map it under \
             [recording.columns] of the rig: t_s = { column = \"...\" }",
        ),
        (
            "rec.csv",
            b"t_s,f1_n,f2_n,f1_n\n0,1,2,3\n".to_vec(),
            "rec.csv:1: column `f1_n` stands twice in the header (columns 2 and 4); rename or remove one",
        ),
        (
            "rec.csv",
            b"0.0,1.0\n0.1,1.1\n".to_vec(),
            "rec.csv:1: the first line holds numbers, expected a header with t_s; add a header line",
        ),
        (
            "rec.csv",
            b"t_s;f1_n\n0;1\n".to_vec(),
            "rec.csv:1: columns are separated by `;`, expected commas; export as comma-separated",
        ),
        (
            "rec.csv",
            with_line(17, "0.015,0.0015,30.01"),
            "rec.csv:17: 3 fields, expected 4 as in the header; correct or drop the line",
        ),
        (
            "rec.csv",
            with_line(5, "0.003,NaN,30.0,x"),
            "rec.csv:5: column `theta_in_rad`: got `NaN`, expected a finite number; correct the cell or drop the row",
        ),
        (
            "rec.csv",
            with_line(5, "0.003,0.1,-inf,x"),
            "rec.csv:5: column `f1_n`: got `-inf`, expected a finite number; correct the cell or drop the row",
        ),
        (
            "rec.csv",
            with_line(61, "0.059,0.1,1e999,x"),
            "rec.csv:61: column `f1_n`: got `1e999`, expected a finite number; correct the cell or drop the row",
        ),
        (
            "rec.csv",
            with_line(2, "0.000,,30.0,x"),
            "rec.csv:2: column `theta_in_rad`: empty cell, expected a finite number; fill it or drop the row",
        ),
        (
            "rec.csv",
            with_line(9, "0.007,12 deg,30.0,x"),
            "rec.csv:9: column `theta_in_rad`: got `12 deg`, expected a finite number; correct the cell or drop the \
             row",
        ),
        (
            "rec.csv",
            with_line(30, "0.027,0.0,30.1,x"),
            "rec.csv:30: column `t_s`: got 0.027 s after 0.027 s, expected strictly increasing time; sort the rows \
             and drop repeated ones",
        ),
        ("rec.csv", not_utf8, &not_utf8_line),
        ("rec.csv", utf16, "rec.csv: byte 0: UTF-16 text; save the file as UTF-8"),
        (
            "rec.csv",
            quoted,
            "rec.csv:20: a quote is opened and not closed before the end of the line; remove it",
        ),
        ("rec.csv.gz", damaged, &damaged_line),
        (
            "rec.mcap",
            good_csv().into(),
            "rec.mcap: byte 0: not the start of an MCAP file; if it is a table, call it .csv",
        ),
        (
            "rec.parquet",
            good_csv().into(),
            "rec.parquet: byte 0: not the start of a Parquet file; if it is a table, call it .csv",
        ),
        ("rec.csv", short.into(), "rec.csv:11: got 10 samples, expected at least 50; record longer"),
        (
            "rec.csv",
            scaled(0, 1000.0),
            "rec.csv:2: t_s: the median step is 1 s, expected at most 0.5 s; if the time is in ms, map it under \
             [recording.columns] with scale = 0.001",
        ),
        (
            "rec.csv",
            with_line(61, "0.059,57.2958,30.0,x"),
            "rec.csv:61: theta_in_rad: got 57.2958, expected within ±12.5664 rad; if it is in degrees, map the \
             column under [recording.columns] with its scale",
        ),
        (
            "rec.csv",
            scaled(2, 1000.0),
            "rec.csv:2: f1_n: got 30000, expected within ±980.6650 N; if it is in another unit than N, map the \
             column under [recording.columns] with its scale",
        ),
        (
            "rec.csv",
            good_csv().replace("theta_in_rad", "theta_in_deg").into(),
            "rec.csv: no column that could drive a replay, expected theta_in_rad or duty; record one, map it under \
             [recording.columns] of the rig, or name another in replay.inputs",
        ),
        (
            "rec.csv",
            good_csv().replace("f1_n", "force").into(),
            "rec.csv: no column to compare a simulation with, expected one of theta_motor_rad, theta_out_rad, f1_n, \
             f2_n, f3_n, f4_n, torque_in_nm, torque_out_nm; record one, or map it under [recording.columns] of the \
             rig",
        ),
    ];
    for (name, content, expected) in cases {
        let folder = folder_with(&[(name, &content), ("rig.toml", RIG.as_bytes())]);
        assert_refused(folder.path(), &["check", name, "--rig", "rig.toml"], expected);
    }
}

#[test]
fn what_a_cut_or_gappy_recording_still_holds_is_used_and_said() {
    let good = good_csv();
    let cut_line = &good.as_bytes()[..good.len() - 12];
    let bad_last = with_line(61, "0.059,0.1,-");
    let bad_last = &bad_last[..bad_last.len() - 1];
    let whole = gzip(good.as_bytes());
    let mut gap = good.clone();
    gap.insert_str(good.len(), "0.9,0.0,30.0,late\n");
    let again = |line: usize| good.lines().nth(line - 1).expect("a line of the file");
    let repeated = with_line(30, &format!("{}\n{}\n{}", again(30), again(30), again(30)));
    let spiked = with_line(30, "0.028,0.0028,-44.5,x");
    // The logger writes sample 19 again in the twelve rows after it, under new times.
    let mut frozen: Vec<String> = good.lines().map(str::to_owned).collect();
    for (sample, line) in frozen[1..].iter_mut().enumerate().take(32).skip(20) {
        *line = format!("{:.3},{},again", sample as f64 * 1e-3, "0.0019,30.02");
    }
    let frozen = frozen.join("\n") + "\n";
    let cases: Vec<(&str, &[u8], &str)> = vec![
        ("rec.csv", &repeated, "rec.csv:31: the row before it stands here again; 2 such rows were dropped"),
        (
            "rec.csv",
            &spiked,
            "rec.csv:30: f1_n is -44.5 between 30.03 and 30.03; one value of 60 samples stood out as spikes and were set aside \
             (f1_n 1)",
        ),
        (
            "rec.csv",
            frozen.as_bytes(),
            "rec.csv:22: all columns stand still for 0.013 s and then jump, 12 of 60 rows, were dropped",
        ),
        ("rec.csv", cut_line, "rec.csv:61: the file ends within this line; the line was dropped"),
        ("rec.csv", bad_last, "rec.csv:61: the file ends within this line; the line was dropped"),
        (
            "rec.csv.gz",
            &whole[..whole.len() - 4],
            "rec.csv.gz: the gzip data ends early; the 60 whole samples before the end were used",
        ),
        (
            "rec.csv",
            gap.as_bytes(),
            "rec.csv:62: a gap in t_s: 0.841000 s without a sample where the median step is 0.001000 s; samples were \
             lost",
        ),
    ];
    for (name, content, expected) in cases {
        let folder = folder_with(&[(name, content), ("rig.toml", RIG.as_bytes())]);
        let (status, stdout, stderr) = bowden(folder.path(), &["check", name, "--rig", "rig.toml"]);
        assert_eq!(stderr, format!("bowden: {expected}\n"));
        assert_eq!(status, 3, "{expected}");
        assert!(stdout.contains(" samples, "), "{stdout}");
    }
}

#[test]
fn odd_but_whole_recordings_are_read_without_a_word() {
    let good = good_csv();
    let constant = scaled(2, 0.0);
    let cases: Vec<(&str, Vec<u8>)> = vec![
        ("no end of the last line", good.trim_end().into()),
        ("Windows line ends", good.replace('\n', "\r\n").into()),
        ("byte order mark", ["\u{feff}", &good].concat().into()),
        ("quoted header", good.replacen("t_s,theta_in_rad", "\"t_s\",\"theta_in_rad\"", 1).into()),
        ("spaces around numbers", good.replace(',', " , ").into()),
        ("blank last line", [good.as_str(), "\n"].concat().into()),
        ("a channel at zero throughout", constant),
        ("gzip under a plain name", gzip(good.as_bytes())),
    ];
    for (what, content) in cases {
        let folder = folder_with(&[("rec.csv", &content), ("rig.toml", RIG.as_bytes())]);
        let (status, stdout, stderr) = bowden(folder.path(), &["check", "rec.csv", "--rig", "rig.toml"]);
        assert_eq!((status, stderr.as_str()), (0, ""), "{what}");
        assert!(stdout.contains("rec.csv: 60 samples"), "{what}: {stdout}");
    }
}

#[test]
fn a_rig_that_cannot_be_used_is_named_with_line_and_column() {
    let cases: &[(&str, &str, &str)] = &[
        (
            "schema = \"bowden-rig/1\"",
            "schema = \"bowden-rig/2\"",
            "rig.toml:1:10: schema: got `bowden-rig/2`, expected `bowden-rig/1`; this version reads no other",
        ),
        (
            "schema = \"bowden-rig/1\"\n",
            "",
            "rig.toml:1:1: no `schema`, expected schema = \"bowden-rig/1\" as the first line; add it",
        ),
        ("supply_v = 24.0", "supply_v = 24.0 V", "rig.toml:5:12: not TOML: "),
        ("[sheath]", "[sheeth]", "rig.toml:22:2: unknown section `sheeth`; did you mean `sheath`?"),
        (
            "friction_coefficient",
            "frictoin_coefficient",
            "rig.toml:24:1: unknown key `frictoin_coefficient` in [sheath]; did you mean `friction_coefficient`?",
        ),
        (
            "friction_coefficient = 0.12\n",
            "",
            "rig.toml:22:1: [sheath] lacks `friction_coefficient` (friction coefficient, such as 0.12); add it",
        ),
        (
            "friction_coefficient = 0.12",
            "friction_coefficient = 12",
            "rig.toml:24:24: sheath.friction_coefficient: got 12, allowed 0 to 2; check value and unit",
        ),
        (
            "friction_coefficient = 0.12",
            "friction_coefficient = nan",
            "rig.toml:24:24: sheath.friction_coefficient: got NaN, allowed 0 to 2; check value and unit",
        ),
        (
            "input_radius_m = 0.015",
            "input_radius_m = 15.0",
            "rig.toml:14:18: pulleys.input_radius_m: got 15, allowed 0.0005 to 1 m; check value and unit",
        ),
        (
            "length_m = 1.0",
            "length_m = \"1 m\"",
            "rig.toml:18:12: tendon.length_m: got the string \"1 m\", expected a number; correct it",
        ),
        (
            "encoder_bits = 12",
            "encoder_bits = 12.5",
            "rig.toml:33:16: sensors.encoder_bits: got the number 12.5, expected a whole number; correct it",
        ),
        (
            "encoder_bits = 12",
            "encoder_bits = 99",
            "rig.toml:33:16: sensors.encoder_bits: got 99, allowed 4 to 32; correct it",
        ),
        (
            "tension_noise_n = 0.1\n",
            "",
            "rig.toml:32:1: [sensors] lacks `tension_noise_n` (standard deviation, such as 0.1 N); add it",
        ),
        (
            "[pulleys]\ninput_radius_m = 0.015\noutput_radius_m = 0.015\n",
            "",
            "rig.toml:1:1: [tendon] is there and [pulleys] is not; add the radii of the pulleys",
        ),
        (
            "\"distributed\"",
            "\"lumpd\"",
            "rig.toml:40:12: simulation.friction: got `lumpd`; did you mean `lumped`?",
        ),
        (
            "effects = []",
            "effects = [\"joint_backlsh\"]",
            "rig.toml:41:12: unknown effect `joint_backlsh`; did you mean `joint_backlash`?",
        ),
        (
            "effects = []",
            "effects = [\"joint_backlash\", \"joint_backlash\"]",
            "rig.toml:41:30: effect `joint_backlash` is listed twice; list it once",
        ),
        (
            "effects = []",
            "effects = [\"joint_backlash\"]\n[effects.joint_backlash]\ngap = 0.1",
            "rig.toml:43:1: unknown parameter `gap` in [effects.joint_backlash]; did you mean `gap_rad`?",
        ),
        (
            "effects = []",
            "effects = [\"joint_backlash\"]\n[effects.joint_backlash]\ngap_rad = 5.0",
            "rig.toml:43:11: effects.joint_backlash.gap_rad: got 5, allowed 0 to 0.5 rad; check value and unit",
        ),
        (
            "effects = []",
            "effects = []\n[effects.joint_backlash]\ngap_rad = 0.1",
            "rig.toml:42:10: effect `joint_backlash` is not in simulation.effects; list it there or drop its table",
        ),
        (
            "effects = []",
            "effects = [\"sensor_offset\"]\n[effects.sensor_offset]\noffset = 0.1\nchannel = \"f5_n\"",
            "rig.toml:44:11: effect `sensor_offset` has no channel `f5_n`; did you mean `f4_n`?",
        ),
        (
            "effects = []",
            "effects = [\"sensor_offset\"]\n[effects.sensor_offset]\noffset = 0.1",
            "rig.toml:42:1: [effects.sensor_offset] lacks `channel` (one of f1_n, f2_n, f3_n, f4_n, ",
        ),
        (
            "effects = []",
            "effects = []\nelements = 65",
            "rig.toml:42:12: simulation.elements: got 65, allowed 1 to 64; correct it",
        ),
        (
            "effects = []",
            "effects = []\n[recording.columns]\nf5_n = { column = \"x\" }",
            "rig.toml:43:1: unknown role `f5_n` in [recording.columns]; did you mean `f4_n`?",
        ),
        (
            "effects = []",
            "effects = []\n[recording.columns]\nf1_n = { column = \"x\", scale = 0 }",
            "rig.toml:43:32: recording.columns.f1_n.scale: got 0, which would erase the column; give the unit's factor",
        ),
        (
            "effects = []",
            "effects = []\n[replay]\ninputs = [\"theta_ref_rad\"]",
            "rig.toml:43:11: `theta_ref_rad` in replay.inputs needs the law of the position loop; add [controller] or \
          take duty as input",
        ),
        (
            "effects = []",
            "effects = []\n[replay]\ninputs = [\"f1_n\"]",
            "rig.toml:43:11: `f1_n` in replay.inputs cannot drive a replay; take angles, torques or duty as inputs",
        ),
        (
            "effects = []",
            "effects = []\n[replay]\ninputs = [\"duty\"]\noutputs = [\"duty\"]",
            "rig.toml:44:12: `duty` in replay.outputs is an input too; keep one of the two",
        ),
        (
            "effects = []",
            "effects = []\n[controller]\nkind = \"proportional\"\nduty_limit = 1",
            "rig.toml:42:1: [controller] lacks `gain_duty_per_rad` (duty per rad of error); add it",
        ),
    ];
    for (old, new, expected) in cases {
        assert!(RIG.contains(old), "{old}");
        let rig = RIG.replacen(old, new, 1);
        let folder = folder_with(&[("rig.toml", rig.as_bytes())]);
        let (status, stdout, stderr) = bowden(folder.path(), &["check", "--rig", "rig.toml"]);
        assert_eq!((status, stdout.as_str(), stderr.lines().count()), (2, "", 1), "{expected}\n{stderr}");
        let line = stderr.strip_prefix("bowden: ").unwrap();
        // The wording of syntax errors is the TOML library's, and long lists are cut here.
        let open_ended = expected.ends_with(": ") || expected.ends_with(", ");
        let matches = if open_ended { line.starts_with(expected) } else { line.trim_end() == *expected };
        assert!(matches, "\nexpected {expected}\n     got {line}");
    }
}

#[test]
fn files_that_are_no_files_are_refused() {
    let folder = folder_with(&[("rig.toml", b"\x00\xff")]);
    fs::create_dir(folder.path().join("sub")).unwrap();
    let at = folder.path();
    assert_refused(
        at,
        &["check", "no.csv"],
        "no.csv: cannot be read: no such file or directory; check the path",
    );
    assert_refused(at, &["check", "sub"], "sub: is a folder, expected a recording; name a file");
    assert_refused(
        at,
        &["check", "--rig", "no.toml"],
        "no.toml: cannot be read: no such file or directory; check the path",
    );
    assert_refused(at, &["check", "--rig", "sub"], "sub: is a folder, expected a rig file; name a file");
    assert_refused(
        at,
        &["check", "--rig", "rig.toml"],
        "rig.toml: byte 1: got 0xff, expected UTF-8 text; a rig is a TOML file",
    );
}

#[test]
fn bad_usage_is_one_line_and_exit_status_2() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [(&[&str], &str, &str); 10] = [
        (&[], "", "bowden"),
        (&["convrt", "a", "b"], "unrecognized subcommand 'convrt'", "bowden"),
        (&["convert", "a.csv"], "were not provided: <OUTPUT>", "bowden convert"),
        (&["convert", "a.csv", "b.csv", "--bogus"], "unexpected argument '--bogus' found", "bowden convert"),
        (&["check"], "were not provided", "bowden check"),
        (&["--jobs", "0", "check", "a.csv"], "invalid value '0' for '--jobs <N>'", "bowden check"),
        (&["--jobs", "many", "check", "a.csv"], "invalid value 'many' for '--jobs <N>'", "bowden check"),
        (
            &["send", "status", "--port", "sim"],
            "unexpected argument '--port' found; it belongs before `status`; ",
            "bowden send status",
        ),
        (&["send", "status", "--bogus"], "unexpected argument '--bogus' found; see", "bowden send status"),
        // The name of a command may be a value.
        (
            &["convert", "check", "--bogus"],
            "unexpected argument '--bogus' found; to pass '--bogus'",
            "bowden convert",
        ),
    ];
    for (arguments, what, of) in cases {
        let (status, stdout, stderr) = bowden(folder.path(), arguments);
        assert_eq!((status, stdout.as_str(), stderr.lines().count()), (2, "", 1), "{arguments:?}: {stderr}");
        let next = format!("; see `{of} --help`\n");
        assert!(
            stderr.starts_with("bowden: ") && stderr.contains(what) && stderr.ends_with(&next),
            "{stderr}"
        );
    }
    let (status, stdout, stderr) = bowden(folder.path(), &["--help"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    assert!(stdout.contains("Exit status: 0 done, 1 failed"), "{stdout}");
}

#[test]
fn an_output_that_cannot_be_is_refused_before_the_input_is_read() {
    // The input is unusable, so a message about the output shows that it was checked first.
    let folder = folder_with(&[("in.csv", b"broken")]);
    fs::create_dir(folder.path().join("out.csv")).unwrap();
    let at = folder.path();
    assert_refused(
        at,
        &["convert", "in.csv", "missing/out.csv"],
        "missing/out.csv: folder missing does not exist; create it first",
    );
    assert_refused(
        at,
        &["convert", "in.csv", "./in.csv"],
        "./in.csv: would overwrite the input in.csv; name another output",
    );
    assert_refused(
        at,
        &["convert", "in.csv", "out.csv"],
        "out.csv: is a folder, expected a file name; add one",
    );
    assert_refused(
        at,
        &["convert", "in.csv", "out.xlsx"],
        "out.xlsx: unknown format; end the name in .csv, .csv.gz, .mcap or .parquet",
    );
    assert_eq!(fs::read(at.join("in.csv")).unwrap(), b"broken");
}

#[test]
fn a_name_with_a_line_break_does_not_break_the_line() {
    let folder = tempfile::tempdir().unwrap();
    assert_refused(
        folder.path(),
        &["check", "a\nb.csv"],
        "a\\nb.csv: cannot be read: no such file or directory; check the path",
    );
}

#[test]
fn a_reader_that_left_is_no_failure() {
    let folder = folder_with(&[("rec.csv", good_csv().as_bytes())]);
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let child = Command::new(env!("CARGO_BIN_EXE_bowden"))
        .current_dir(folder.path())
        .args(["check", "rec.csv"])
        .stdout(writer)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), b"".as_slice()));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_failure_and_not_bad_input() {
    let folder = folder_with(&[("rec.csv", good_csv().as_bytes())]);
    for name in ["full.csv", "full.csv.gz", "full.mcap"] {
        std::os::unix::fs::symlink("/dev/full", folder.path().join(name)).unwrap();
        let (status, _, stderr) = bowden(folder.path(), &["convert", "rec.csv", name]);
        assert_eq!(stderr, format!("bowden: {name}: cannot be written: no space left on device\n"));
        assert_eq!(status, 1);
    }
}

/// Set in the process that is to panic.
const PANICS: &str = "BOWDEN_TEST_PANICS";

#[test]
fn a_defect_is_one_line_and_exit_status_1() {
    if std::env::var_os(PANICS).is_some() {
        bowden::cli::exit_on_panic();
        let worker = std::thread::spawn(|| panic!("no such\nstate"));
        let _ = worker.join();
        unreachable!("a panic in any thread ends the process");
    }
    let this_test = ["--exact", "bad_input::a_defect_is_one_line_and_exit_status_1", "--nocapture"];
    let output =
        Command::new(std::env::current_exe().unwrap()).args(this_test).env(PANICS, "1").output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), stderr.lines().count()), (Some(1), 1), "{stderr}");
    assert!(
        stderr.starts_with("bowden: internal error at ") && stderr.contains("no such\\nstate"),
        "{stderr}"
    );
}
