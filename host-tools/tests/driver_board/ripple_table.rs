//! `bowden params table`: files, resampling, the way to the board and back, and what is refused.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use std::time::Duration;

use bowden_core::outcome::FailureClass;
use bowden_core::rig::Rig;
use bowden_host_link::from_rig::Transfer;
use bowden_host_link::ripple_table::{Sampled, download, largest_nm, to_csv};
use bowden_host_link::sim::SimTransport;
use bowden_host_link::{Client, LinkError, ParameterSet};
use bowden_link::message::{Goal, Mode, Refusal, TableReport};
use bowden_link::{State, ToBoard};

use crate::bowden;
use crate::fake::Fake;
use crate::from_rig::rig;
use crate::mishaps::Mishaps;
use crate::pseudo_terminal::Terminal;
use crate::wires::connect;

/// `count` rows of a torque over `period_rad` from `from_rad` on.
fn file(from_rad: f64, period_rad: f64, count: usize, torque_nm: impl Fn(f64) -> f64) -> String {
    let mut text = "angle_rad,torque_nm\n".to_owned();
    for row in 0..count {
        let angle_rad = from_rad + period_rad * row as f64 / count as f64;
        let _ = writeln!(text, "{angle_rad},{}", torque_nm(angle_rad));
    }
    text
}

/// Torque of point `node`, N·m.
fn node_nm(sampled: &Sampled, node: usize) -> f64 {
    let scale_nm = f64::from(sampled.table.head().full_scale_nm) / 32_768.0;
    scale_nm * f64::from(sampled.table.points_raw()[node])
}

#[test]
fn rows_are_joined_by_straight_lines_over_the_end_of_the_period() {
    // Period 2.56 rad: a point each 10 mrad. From 0.5 rad on, in any order of whole periods.
    let text = "# by hand\nangle_rad, torque_nm, note\n0.5,0.10,a\n1.0,0.20,b\n1.5,-0.20,c\n2.1,0.00,d\n2.7,0.05,e\n";
    let sampled = Sampled::parse(text, "a.csv", 2.56).unwrap();
    assert_eq!(sampled.rows, 5);
    for (node, expected_nm) in [
        (50, 0.10),
        (75, 0.15),
        (100, 0.20),
        (125, 0.0),
        (150, -0.20),
        (180, -0.10),
        (210, 0.0),
        (240, 0.025),
        // 2.7 rad is 0.14 rad a period later; from there 0.36 rad to the first row.
        (14, 0.05),
        (32, 0.075),
        (0, 0.05 - 0.05 * 0.14 / 0.6),
    ] {
        // Half of a point of 0.2/32767 N·m.
        let got = node_nm(&sampled, node);
        assert!((got - expected_nm).abs() <= 3.1e-6, "node {node}: {got}, expected {expected_nm}");
    }
    // Rows are nodes here: half a bit, and what the 32-bit period moves them.
    assert!(sampled.largest_error_nm <= 3.3e-6, "{}", sampled.largest_error_nm);
    assert!((largest_nm(&sampled.table) - 0.2).abs() < 1e-7);
}

#[test]
fn the_error_of_straight_lines_is_that_of_their_chords() {
    // A sine of `k` periods over 256 points: (π k/256)²/2 of its amplitude, within 3 % for k up to 24.
    for k in [1.0, 3.0, 12.0, 24.0] {
        let text = file(0.0, TAU, 5000, |angle_rad| 0.3 * (k * angle_rad + 0.2).sin());
        let sampled = Sampled::parse(&text, "a.csv", TAU).unwrap();
        let chord_nm = 0.3 * (std::f64::consts::PI * k / 256.0).powi(2) / 2.0;
        let got = sampled.largest_error_nm;
        // Two rounded points, and 5000 rows do not meet the middle of every chord.
        assert!(got > 0.9 * chord_nm && got < 1.03 * chord_nm + 1e-5, "{k}: {got}, chord {chord_nm}");
    }
}

#[test]
fn a_table_goes_to_the_board_and_back_bit_for_bit() {
    let mut client = Client::connect(Box::new(SimTransport::new()), "sim", Duration::from_secs(1)).unwrap();
    assert_eq!(client.ripple_table(), Ok(TableReport::Absent));
    let text = file(-0.3, 0.4488, 700, |angle_rad| 0.2 * (42.0 * angle_rad).sin() - 0.01);
    let table = Sampled::parse(&text, "a.csv", 0.4488).unwrap().table;
    client.write_ripple_table(&table).unwrap();
    assert_eq!(client.ripple_table(), Ok(TableReport::Whole(table.head())));
    let read = download(&mut client, table.head()).unwrap();
    assert_eq!(read, table);
    // And through a file.
    let period_rad = f64::from(table.head().period_rad);
    assert_eq!(Sampled::parse(&to_csv(&read), "b.csv", period_rad).unwrap().table, table);
    client.store_parameters().unwrap();
    client.clear_ripple_table().unwrap();
    assert_eq!(client.ripple_table(), Ok(TableReport::Absent));
}

#[test]
fn a_moving_joint_keeps_its_table() {
    let mut client = Client::connect(Box::new(SimTransport::new()), "sim", Duration::from_secs(1)).unwrap();
    let parse = |nm: f64| Sampled::parse(&file(0.0, TAU, 64, |_| nm), "a.csv", TAU).unwrap().table;
    let (first, second) = (parse(0.1), parse(0.2));
    client.write_ripple_table(&first).unwrap();
    client.enter(Goal::Ready).unwrap();
    while client.status().unwrap().state != State::Ready {
        client.listen(Duration::from_millis(10)).unwrap();
    }
    client.enter(Goal::Run(Mode::Position)).unwrap();
    while client.status().unwrap().state != State::Run {}
    let moving = |result: Result<(), LinkError>| {
        assert!(matches!(result, Err(LinkError::Refused { refusal: Refusal::Moving, .. })), "{result:?}");
    };
    moving(client.write_ripple_table(&second));
    moving(client.clear_ripple_table());
    assert_eq!(client.ripple_table(), Ok(TableReport::Whole(first.head())));
}

#[test]
fn a_rig_does_not_set_harmonics_that_the_table_stands_for() {
    let mut client = Client::connect(Box::new(SimTransport::new()), "sim", Duration::from_secs(1)).unwrap();
    let rig = Rig::parse(&rig("\"motor_cogging\"", ""), "rig.toml").unwrap();
    for (on, expected) in [(0.0, 0), (1.0, 1)] {
        let set = ParameterSet::read(&mut client).unwrap();
        let index = set.find("correction.ripple_table.enable").unwrap().index;
        client.set_parameter(index, on).unwrap();
        let set = ParameterSet::read(&mut client).unwrap();
        let transfer = Transfer::new(&rig, "rig.toml", &set, &[]).unwrap();
        let reasons: Vec<&str> = transfer
            .unused
            .iter()
            .filter(|unused| unused.source == "effects.motor_cogging")
            .map(|unused| unused.reason.as_str())
            .collect();
        assert_eq!(reasons.len(), expected, "{reasons:?}");
        assert!(reasons.iter().all(|reason| reason.starts_with("the ripple table acts in the place of")));
        let harmonics = transfer.changes.iter().any(|change| change.name == "correction.cogging.amplitude_1");
        assert_eq!(harmonics, on == 0.0);
    }
}

#[test]
fn the_two_strongest_harmonics_of_a_rig_are_carried_and_the_third_is_told() {
    let mut client = Client::connect(Box::new(SimTransport::new()), "sim", Duration::from_secs(1)).unwrap();
    let harmonics = [(12.0, 0.1), (7.0, 0.3), (28.0, 0.2)];
    let tables = harmonics.map(|(cycles, amplitude_nm)| {
        format!(
            "[[effects.motor_cogging]]\namplitude_nm = {amplitude_nm}\ncycles_per_turn = {cycles}\nphase_rad = 0.5\n"
        )
    });
    let rig = Rig::parse(&rig("\"motor_cogging\"", &tables.concat()), "rig.toml").unwrap();
    let set = ParameterSet::read(&mut client).unwrap();
    let transfer = Transfer::new(&rig, "rig.toml", &set, &[]).unwrap();
    let new = |name: &str| {
        transfer
            .changes
            .iter()
            .find(|change| change.name == format!("correction.cogging.{name}"))
            .unwrap()
            .new
    };
    assert_eq!([new("amplitude_1"), new("periods_1"), new("phase_1")], [0.3, 7.0, 0.5]);
    assert_eq!([new("amplitude_2"), new("periods_2"), new("phase_2")], [0.2, 28.0, 0.5]);
    let told: Vec<&str> = transfer
        .unused
        .iter()
        .filter(|unused| unused.source == "effects.motor_cogging")
        .map(|unused| unused.reason.as_str())
        .collect();
    let [one] = told[..] else { panic!("{told:?}") };
    assert!(
        one.starts_with("the board takes the two strongest harmonics, 12.0 periods a turn are not"),
        "{one}"
    );
}

#[test]
fn the_command_shows_and_writes_and_a_dry_run_only_shows() {
    let folder = tempfile::tempdir().unwrap();
    // 0.125 at the largest of 1024 rows.
    fs::write(folder.path().join("ripple.csv"), file(0.0, TAU, 1024, |angle_rad| 0.125 * angle_rad.cos()))
        .unwrap();
    let table = |arguments: &[&str]| {
        let all = [&["params", "--port", "sim", "table"], arguments].concat();
        bowden(folder.path(), &all)
    };
    assert_eq!(table(&[]), (0, "no ripple table\n".to_owned(), String::new()));
    let (status, shown, stderr) = table(&["ripple.csv", "--dry-run"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    let lines: Vec<&str> = shown.lines().collect();
    let expected = "ripple table: 256 points over 6.283185 rad, 1.000 periods a turn of the input pulley, up to 0.125000 N·m, CRC-32 ";
    assert!(lines[0].starts_with(expected) && lines[0].len() == expected.len() + 8, "{shown}");
    assert_eq!(lines[1], "switched off; `params set correction.ripple_table.enable=1.0` switches it on");
    // The chord of one period, (π/256)²/2 of 0.125.
    assert_eq!(lines[2], "sampled from 1024 rows, which it meets to within 0.000010 N·m");
    assert_eq!(lines[3..], ["would be written"]);
    let (status, written, _) = table(&["ripple.csv"]);
    assert_eq!(status, 0);
    let end = "written until the board is switched off; `store` keeps it\n";
    assert_eq!(written, shown.replace("would be written\n", end));
    let (status, cleared, _) = table(&["--clear"]);
    assert_eq!(
        (status, cleared.as_str()),
        (0, "cleared until the board is switched off; `store` clears it there too\n")
    );
    let (status, _, stderr) = table(&["--save", "out.csv"]);
    assert_eq!((status, stderr.as_str()), (1, "bowden: the board has no ripple table; write one first\n"));
    assert!(!folder.path().join("out.csv").exists());
}

#[test]
fn a_file_that_cannot_be_used_is_named_with_its_line() {
    let whole = file(0.0, TAU, 8, |_| 0.1);
    for (text, expected) in [
        ("", "a.csv:1: no column `angle_rad`: got ``, expected angle_rad,torque_nm; name it so"),
        ("angle_rad,torque\n0,0\n", "a.csv:1: no column `torque_nm`: got `angle_rad,torque`, expected"),
        (
            "# only\nangle_rad,torque_nm\n",
            "a.csv:1: no row, expected angle_rad and torque_nm over a period; add",
        ),
        ("angle_rad,torque_nm\n0,0.1\n1,x\n", "a.csv:3: torque_nm: got `x`, expected a number; correct it"),
        ("angle_rad,torque_nm\n0,0.1\n1\n", "a.csv:3: torque_nm: got ``, expected a number; correct it"),
        ("angle_rad,torque_nm\n0,NaN\n", "a.csv:2: torque_nm: got NaN, allowed -19.99"),
        ("angle_rad,torque_nm\n0,0.1\n\n1,25\n", "a.csv:4: torque_nm: got 25, allowed -19.99"),
        (
            "angle_rad,torque_nm\n1,0.1\n1,0.2\n",
            "a.csv:3: angle_rad: got 1 behind 1, expected more; sort the rows",
        ),
        (
            "angle_rad,torque_nm\n0,0\n1.5,0\n3.2,0\n",
            "a.csv:4: no row from 1.5 to 3.2 rad, expected one a quarter of the period (1.570796 rad) at least; add rows, or",
        ),
        ("angle_rad,torque_nm\n0,0\n1,0\n", "a.csv:3: no row from 1 to 6.28"),
        (
            &format!("{whole}6.2832,0.1\n"),
            "a.csv:10: angle_rad: got 6.2832, a period of 6.283185 rad or more behind the first row at 0; leave the row out",
        ),
    ] {
        let failure = Sampled::parse(text, "a.csv", TAU).unwrap_err();
        assert!(failure.message().starts_with(expected), "{}\n{expected}", failure.message());
        assert_eq!(failure.class(), FailureClass::BadInput);
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.csv"), "angle_rad,torque_nm\n0,0.1\n1,x\n").unwrap();
    for (arguments, expected) in [
        (&["a.csv"][..], "bowden: a.csv:3: torque_nm: got `x`"),
        (&["b.csv"][..], "bowden: b.csv: cannot be read: "),
        (
            &["a.csv", "--period", "70"][..],
            "bowden: invalid value '70' for '--period <RAD>': allowed 0.0021 to 63 rad",
        ),
        (&["a.csv", "--clear"][..], "bowden: the argument '[FILE.csv]' cannot be used with '--clear'"),
        (&["--dry-run"][..], "bowden: the following required arguments were not provided"),
    ] {
        let all = [&["params", "--port", "sim", "table"], arguments].concat();
        let (status, _, stderr) = bowden(folder.path(), &all);
        assert!(status == 2 && stderr.starts_with(expected), "{status} {stderr}\n{expected}");
    }
}

#[test]
fn a_stored_table_that_cannot_be_read_and_a_refusal_are_told() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let (status, _, stderr) = terminal.bowden(folder.path(), "params", &["table"]);
    let expected =
        "bowden: the stored ripple table cannot be read; write it anew, or clear it with --clear\n";
    assert_eq!((status, stderr.as_str()), (1, expected));
    // The fake takes points, and finds that they are others.
    let (client, fake) = connect(Fake::new(Mishaps::default()));
    let table = Sampled::parse(&file(0.0, TAU, 8, |_| 0.1), "a.csv", TAU).unwrap().table;
    let refused = client.unwrap().write_ripple_table(&table).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "the board refused the ripple table: the points on the board do not fit the table's checksum; send the table again"
    );
    let parts = fake.borrow().count(|message| matches!(message, ToBoard::WriteTablePoints { .. }));
    assert_eq!(parts, 8);
}
