//! `bowden info` and `check` on recordings, and Parquet as other programs read it.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs::{self, File};

use crate::common::bowden;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

/// 2 s at 1 kHz: 20 rows from 0.5 s on are missing, the board goes to fault in the last row, and f3 hangs.
fn table() -> String {
    let mut text = "t_s,theta_out_rad,f3_n,state,limits,label\n".to_owned();
    for row in (0..2000).filter(|row| !(501..521).contains(row)) {
        let t_s = f64::from(row) * 1e-3;
        let (angle, state) = (0.25 * (TAU * t_s).sin(), if row == 1999 { 6 } else { 5 });
        let limits = if row < 30 { 1 + 512 } else { 0 };
        writeln!(text, "{t_s},{angle},30.5,{state},{limits},x{row}").unwrap();
    }
    text
}

#[test]
fn info_shows_what_is_in_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.csv"), table()).unwrap();
    let (status, stdout, stderr) = bowden(folder.path(), &["info", "a.csv"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    let lines: Vec<&str> = stdout.lines().collect();
    assert!(lines[0].starts_with("a.csv: 1980 rows, 1.999 s from t_s = 0.0, 1000.0 Hz, "), "{}", lines[0]);
    for expected in [
        "  theta_out_rad     -0.250000 to     0.250000, mean ",
        "  f3_n              30.500000 to    30.500000, mean    30.500000 N",
        "  label          text",
        "  gap after t_s = 0.5: 0.0210 s",
        "  limit: duty at its limit in 30 rows",
        "  limit: reference acceleration limited in 30 rows",
        "theta_out_rad, rad",
    ] {
        assert!(lines.iter().any(|line| line.starts_with(expected)), "{expected}:\n{stdout}");
    }
    // The curve: it spans the page, and its first and last line carry the largest and the smallest value.
    let curve: Vec<&str> = lines.iter().skip_while(|line| **line != "theta_out_rad, rad").copied().collect();
    assert!(curve[1].starts_with("      0.2500 ") && curve[8].starts_with("     -0.2500 "), "{stdout}");
    let dots = |line: &&str| line.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count();
    assert!(curve[1..9].iter().map(dots).sum::<usize>() >= 71, "{stdout}");

    let (status, stdout, _) = bowden(folder.path(), &["info", "--json", "a.csv"]);
    assert_eq!(status, 0);
    let facts: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    let facts = &facts[0];
    assert_eq!((&facts["rows"], &facts["even"]), (&1980.into(), &true.into()));
    assert!((facts["rate_hz"].as_f64().unwrap() - 1000.0).abs() < 1e-6);
    assert_eq!((&facts["gaps"]["count"], &facts["gaps"]["rows"]), (&1.into(), &20.into()));
    assert_eq!(facts["gaps"]["first"][0]["after_s"], 0.5);
    assert_eq!(facts["faults_s"], serde_json::json!([1.999]));
    assert_eq!(facts["columns"][0]["unit"], "rad");
    assert_eq!(facts["columns"][4]["range"], serde_json::Value::Null);

    let (status, _, stderr) = bowden(folder.path(), &["info", "a.csv", "--plot", "label"]);
    assert_eq!((status, stderr.lines().count()), (2, 1), "{stderr}");
    assert!(stderr.contains("--plot label: no column of numbers has this name"), "{stderr}");
    let (status, stdout, _) = bowden(folder.path(), &["info", "a.csv", "--plot", "state"]);
    assert!(status == 0 && stdout.contains("\nstate\n      6.0000 "), "{stdout}");
}

#[test]
fn check_says_what_is_wrong_with_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.csv"), table()).unwrap();
    let began = "[\"bowden.recording\"]\nschema = \"bowden-recording/1\"\n";
    fs::write(folder.path().join("a.recording.toml"), began).unwrap();
    let (status, stdout, stderr) = bowden(folder.path(), &["check", "a.csv"]);
    assert_eq!(status, 3);
    assert!(stdout.starts_with("a.csv: 1980 samples, "), "{stdout}");
    assert!(
        stdout.ends_with("\n  the same value in every row: f3_n; at rest, or a sensor hangs\n"),
        "{stdout}"
    );
    let expected = [
        "bowden: a.csv: 20 rows are missing in 1 gap, the first after t_s = 0.5 for 0.0210 s; what follows a gap is not compared for \
         0.3 s",
        "bowden: a.csv: the board went to fault at t_s = 1.999",
        "bowden: a.csv: the end of the recording is missing: the program was stopped by force",
    ];
    assert_eq!(stderr.lines().collect::<Vec<_>>(), expected);
    let (status, stdout, _) = bowden(folder.path(), &["check", "--json", "a.csv"]);
    let facts: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((status, facts[0]["findings"].as_array().unwrap().len()), (3, 3));
    // Nothing is wrong with a whole one.
    let mut whole = "t_s,duty\n".to_owned();
    for row in 0..500 {
        writeln!(whole, "{},{}", f64::from(row) * 1e-3, row % 90).unwrap();
    }
    fs::write(folder.path().join("b.csv"), whole).unwrap();
    let (status, _, stderr) = bowden(folder.path(), &["check", "b.csv"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
}

#[test]
fn parquet_has_types_units_and_metadata_for_other_programs() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let run = ["record", "--port", "sim", "--seconds", "0.05", "--note", "for pandas", "--out", "a.mcap"];
    assert_eq!(bowden(place, &run).0, 0);
    let (status, _, stderr) = bowden(place, &["convert", "a.mcap", "a.parquet"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    let reader = SerializedFileReader::new(File::open(place.join("a.parquet")).unwrap()).unwrap();
    let file = reader.metadata().file_metadata();
    assert_eq!(file.num_rows(), 500);
    let said = |key: &str| {
        let values = file.key_value_metadata().unwrap();
        values.iter().find(|entry| entry.key == key).and_then(|entry| entry.value.clone())
    };
    assert_eq!(said("bowden.recording/note").as_deref(), Some("for pandas"));
    assert_eq!((said("unit.f1_n").as_deref(), said("unit.f1_raw").as_deref()), (Some("N"), Some("code")));
    let row = reader.get_row_iter(None).unwrap().nth(7).unwrap().unwrap();
    let field = |name: &str| row.get_column_iter().find(|(column, _)| *column == name).unwrap().1.clone();
    let Field::Double(f1_n) = field("f1_n") else { panic!("{:?}", field("f1_n")) };
    let Field::Long(f1_raw) = field("f1_raw") else { panic!("{:?}", field("f1_raw")) };
    // By hand from the front end, as in the recording.
    assert!((f1_n - (f1_raw as f64 * 3.3 / 4095.0 - 0.5) / 0.023).abs() < 2.4e-3);
    // Where a file is written row by row, Parquet is refused before anything moves.
    for arguments in [
        vec!["record", "--port", "sim", "--out", "b.parquet"],
        vec!["recover", "a.mcap", "--out", "b.parquet"],
    ] {
        let (status, _, stderr) = bowden(place, &arguments);
        assert_eq!((status, stderr.lines().count()), (2, 1), "{stderr}");
        assert!(stderr.contains("write .csv, .csv.gz or .mcap, then `bowden convert` it"), "{stderr}");
    }
    let mut damaged = fs::read(place.join("a.parquet")).unwrap();
    let length = damaged.len();
    damaged.truncate(length - 100);
    fs::write(place.join("c.parquet"), damaged).unwrap();
    let (status, _, stderr) = bowden(place, &["check", "c.parquet"]);
    assert_eq!((status, stderr.lines().count()), (2, 1), "{stderr}");
    assert!(stderr.starts_with("bowden: c.parquet: not readable as Parquet: "), "{stderr}");
}
