//! `bowden run PLAN.toml`: what it does, refuses, and how it goes on after a stop.

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::Instant;

use bowden_core::recording::{ReadOptions, Recording};
use bowden_model::channel::Channel;
use serde_json::Value;

use crate::cuts::PATIENCE;
use crate::fake::Fake;
use crate::mishaps::Mishaps;
use crate::pseudo_terminal::Terminal;
use crate::{bowden, command};

const PLAN: &str = r#"schema = "bowden-plan/1"
name = "check"

[limits]
angle_rad = 0.4

[[step]]
kind = "pretension_check"

[[step]]
kind = "home"

[[step]]
kind = "pause"
seconds = 0.5

[[step]]
kind = "follow"
reference = "sine"
amplitude = 0.2
frequency_hz = 1.0
seconds = 0.3
repeat = 2

[[step]]
kind = "follow"
reference = "hold"
offset = 0.1
seconds = 0.2
every = 10
"#;

/// Runs a plan of the simulated board.
fn run(folder: &Path, plan: &str, arguments: &[&str]) -> (i32, String, String) {
    fs::write(folder.join("plan.toml"), plan).unwrap();
    bowden(folder, &[&["run", "plan.toml", "--port", "sim", "--out", "out"], arguments].concat())
}

/// Names of the steps that the ledger has, and their rows.
fn ledger(folder: &Path) -> Vec<(String, u64)> {
    let text = fs::read_to_string(folder.join("out/run.json")).unwrap();
    let ledger: Value = serde_json::from_str(&text).unwrap();
    let done = ledger["done"].as_array().unwrap();
    done.iter()
        .map(|done| (done["name"].as_str().unwrap().to_owned(), done["rows"].as_u64().unwrap()))
        .collect()
}

#[test]
fn a_plan_is_carried_out_with_a_recording_each_and_a_summary() {
    let folder = tempfile::tempdir().unwrap();
    let (status, stdout, stderr) = run(folder.path(), PLAN, &[]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    let expected = [
        ("01-pretension-check", 0),
        ("02-home", 0),
        ("03-pause", 0),
        ("04-sine-1", 3000),
        ("05-sine-2", 3000),
        ("06-hold", 200),
    ];
    let expected = expected.map(|(name, rows)| (name.to_owned(), rows));
    assert_eq!(ledger(folder.path()), expected);
    assert!(
        stdout.starts_with("check: 6 steps done\n") && stdout.contains("3000 rows in 04-sine-1.mcap"),
        "{stdout}"
    );
    assert_eq!(fs::read_to_string(folder.path().join("out/summary.txt")).unwrap(), stdout);
    // The same as JSON, of a start that finds nothing to do.
    let (status, facts, stderr) = run(folder.path(), PLAN, &["--json"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    let facts: Value = serde_json::from_str(&facts).unwrap();
    assert_eq!((&facts["plan"], &facts["before"]), (&"check".into(), &6.into()));
    let written: Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("out/run.json")).unwrap()).unwrap();
    assert_eq!(facts["steps"], written["done"]);
    assert_eq!(facts["steps"][4]["file"], "05-sine-2.mcap");
    // Each recording says which step of which plan it is, and holds what the step asked for.
    let recording =
        Recording::load(&folder.path().join("out/05-sine-2.mcap"), &ReadOptions::default()).unwrap();
    let entry = |name| recording.metadata().entry("bowden.recording", name);
    assert_eq!((entry("plan"), entry("plan_step")), (Some(PLAN), Some("05-sine-2")));
    assert!((recording.duration_s() - 0.2999).abs() < 1e-9, "{}", recording.duration_s());
    // Once more: nothing is left to do, and nothing is recorded again.
    let before = fs::read(folder.path().join("out/05-sine-2.mcap")).unwrap();
    let (status, stdout, _) = run(folder.path(), PLAN, &[]);
    assert!(
        status == 0 && stdout.starts_with("check: 6 steps done, 6 of them before this start\n"),
        "{stdout}"
    );
    assert_eq!(fs::read(folder.path().join("out/05-sine-2.mcap")).unwrap(), before);
    // Another plan has no business there.
    let (status, _, stderr) = run(folder.path(), &PLAN.replace("0.5", "0.6"), &[]);
    assert_eq!(
        (status, stderr.as_str()),
        (2, "bowden: out/run.json: the run of another plan; choose another folder with --out\n")
    );
}

#[test]
fn a_run_that_a_fault_stopped_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let plan = "schema = \"bowden-plan/1\"\n[[step]]\nkind = \"home\"\n[[step]]\nkind = \"follow\"\nreference = \"hold\"\nseconds = 0.2\n";
    fs::write(folder.path().join("plan.toml"), plan).unwrap();
    let arguments = ["plan.toml", "--out", "out", "--format", "csv"];
    let terminal = Terminal::new(Fake::new(Mishaps { slack_after: Some(500), ..Mishaps::default() }));
    let (status, stdout, stderr) = terminal.bowden(folder.path(), "run", &arguments);
    assert_eq!((status, stdout.as_str(), stderr.lines().count()), (1, "", 1), "{stderr}");
    assert!(
        stderr.contains("a tendon is slack") && stderr.contains("rows are kept in out/02-hold.stopped-1.csv"),
        "{stderr}"
    );
    assert!(
        stderr.ends_with(
            "1 of 2 steps are done; after `bowden faults --clear` the same command goes on with 02-hold\n"
        ),
        "{stderr}"
    );
    assert_eq!(ledger(folder.path()), [("01-home".to_owned(), 0)]);
    let stopped =
        Recording::load(&folder.path().join("out/02-hold.stopped-1.csv"), &ReadOptions::default()).unwrap();
    assert!(
        stopped.len() > 400
            && stopped.metadata().entry("bowden.end", "end").is_some_and(|end| end.contains("slack"))
    );
    assert!(!folder.path().join("out/02-hold.csv").exists());
    drop(terminal);
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let (status, stdout, stderr) = terminal.bowden(folder.path(), "run", &arguments);
    assert_eq!((status, stderr.as_str()), (0, ""));
    assert!(stdout.starts_with("unnamed: 2 steps done, 1 of them before this start\n"), "{stdout}");
    assert_eq!(ledger(folder.path())[1], ("02-hold".to_owned(), 2000));
    assert!(folder.path().join("out/02-hold.stopped-1.csv").exists());
}

/// Names and contents of a folder's files whose name begins so.
fn files(folder: &Path, beginning: &str) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap())
        .filter(|entry| entry.file_name().to_str().unwrap().starts_with(beginning))
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap()))
        .collect();
    files.sort();
    files
}

fn names(files: &[(String, Vec<u8>)]) -> Vec<&str> {
    files.iter().map(|(name, _)| name.as_str()).collect()
}

#[test]
fn rows_of_a_killed_run_are_kept_whatever_format_the_next_start_writes() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let plan = "schema = \"bowden-plan/1\"\n[[step]]\nkind = \"follow\"\nreference = \"hold\"\nseconds = 6\n";
    fs::write(place.join("plan.toml"), plan).unwrap();
    // What each start leaves, by the names under which it is to be kept.
    let mut kept: Vec<(String, Vec<u8>)> = Vec::new();
    for (turn, (format, bytes)) in
        [("csv", 500_000), ("csv.gz", 50_000), ("mcap", 100_000), ("csv", 500_000)].into_iter().enumerate()
    {
        let arguments = ["run", "plan.toml", "--port", "sim", "--out", "out", "--format", format];
        let path = place.join(format!("out/01-hold.{format}"));
        let mut child =
            command(place, &arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let begun = Instant::now();
        while fs::metadata(&path).map_or(0, |file| file.len()) < bytes {
            assert!(child.try_wait().unwrap().is_none() && begun.elapsed() < PATIENCE, "{format}");
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        // SIGKILL: nothing of the program runs any more.
        child.kill().unwrap();
        child.wait().unwrap();
        let (earlier, mut left): (Vec<_>, Vec<_>) = files(&place.join("out"), "01-hold")
            .into_iter()
            .partition(|(name, _)| name.contains(".stopped-"));
        kept.sort();
        assert_eq!(names(&earlier), names(&kept), "start {turn}");
        assert!(earlier == kept, "start {turn}: bytes of what was kept have changed");
        for (name, _) in &mut left {
            *name = name.replacen("01-hold", &format!("01-hold.stopped-{}", turn + 1), 1);
        }
        kept.extend(left);
    }
    let (status, stdout, stderr) = run(place, plan, &["--format", "csv.gz"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    assert!(stdout.contains("60000 rows in 01-hold.csv.gz"), "{stdout}");
    kept.sort();
    let found = files(&place.join("out"), "01-hold.stopped-");
    let names = names(&kept);
    assert_eq!(found.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), names);
    assert!(found == kept, "bytes of what was kept have changed");
    for (number, beside) in [(1, true), (2, true), (3, false), (4, true)] {
        let beside = beside.then(|| format!("01-hold.stopped-{number}.parameters.toml"));
        assert!(beside.is_none_or(|beside| names.contains(&beside.as_str())), "{names:?}");
    }
    assert!(names.contains(&"01-hold.stopped-3.mcap"), "{names:?}");
    // The killed CSV is the beginning of the run that went to its end: the simulated joint does the same every time.
    let load = |name: &str| Recording::load(&place.join("out").join(name), &ReadOptions::default()).unwrap();
    let whole = load("01-hold.csv.gz");
    assert_eq!(whole.len(), 60_000);
    for name in ["01-hold.stopped-1.csv", "01-hold.stopped-4.csv"] {
        let text = fs::read_to_string(place.join("out").join(name)).unwrap();
        let rows = text.lines().count() - 1;
        assert!(rows > 1000, "{name}: {rows} rows");
        fs::write(place.join("out/cut.csv"), &text[..=text.rfind('\n').unwrap()]).unwrap();
        let cut = load("cut.csv");
        assert_eq!(cut, whole.slice(0..cut.len()), "{name}");
    }
}

#[test]
fn what_a_plan_may_not_ask_is_said_with_its_place_before_anything_moves() {
    let folder = tempfile::tempdir().unwrap();
    let follow = "kind = \"follow\"\nreference = \"sine\"";
    for (from, to, expected) in [
        (
            "angle_rad = 0.4",
            "angle_rad = 3.5",
            "plan.toml:5:13: limits.angle_rad: 3.5 rad is above the board's ",
        ),
        (
            "angle_rad = 0.4",
            "torque_nm = 90",
            "plan.toml:5:13: limits.torque_nm: 90 N·m is above the board's ",
        ),
        (
            "amplitude = 0.2",
            "amplitude = 0.45",
            "plan.toml:17:1: sine of 0.45 rad at 1 Hz around 0 rad, position, 0.3 s: angle of 0.4500 rad is above the plan's limit of 0.4 rad",
        ),
        (
            "frequency_hz = 1.0",
            "frequency_hz = 40",
            "plan.toml:17:1: sine of 0.2 rad at 40 Hz around 0 rad, position, 0.3 s: the joint cannot do it: ",
        ),
        (
            "kind = \"home\"",
            "kind = \"hone\"",
            "plan.toml:11:8: unknown kind `hone` of a step; did you mean `home`?",
        ),
        (
            follow,
            "kind = \"follow\"\nreference = \"sinus\"",
            "plan.toml:19:13: unknown reference `sinus`; did you mean `sine`?",
        ),
        (
            "frequency_hz = 1.0\n",
            "",
            "plan.toml:17:1: [step] lacks `frequency_hz` (periods a second); add it",
        ),
        (
            "bowden-plan/1",
            "bowden-plan/2",
            "plan.toml:1:10: schema: got `bowden-plan/2`, expected `bowden-plan/1`",
        ),
    ] {
        assert!(PLAN.contains(from));
        let (status, stdout, stderr) = run(folder.path(), &PLAN.replacen(from, to, 1), &[]);
        assert_eq!((status, stdout.as_str(), stderr.lines().count()), (2, "", 1), "{stderr}");
        assert!(stderr.starts_with(&format!("bowden: {expected}")), "{stderr}\n{expected}");
        assert!(!folder.path().join("out").exists(), "{expected}");
    }
}

#[test]
fn an_excitation_is_carried_out_as_it_was_listed_and_another_rig_gets_another_one() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let rig = virtual_bench::nominal_rig_toml("bench");
    fs::write(place.join("rig.toml"), &rig).unwrap();
    let plan = "schema = \"bowden-plan/1\"\n[limits]\nangle_rad = 0.3\n[[step]]\nkind = \"excite\"\nrig = \"rig.toml\"\nseconds = 6\n";
    let listed = || -> Vec<[String; 2]> {
        let (status, stdout, stderr) = run(place, plan, &["--dry-run", "--json"]);
        assert_eq!((status, stderr.as_str()), (0, ""));
        let facts: Value = serde_json::from_str(&stdout).unwrap();
        let steps = facts["steps"].as_array().unwrap();
        steps.iter().map(|step| ["name", "what"].map(|key| step[key].as_str().unwrap().to_owned())).collect()
    };
    let steps = listed();
    let (status, stdout, stderr) = run(place, plan, &[]);
    assert_eq!((status, stderr.as_str()), (0, ""), "{stdout}");
    let expected: Vec<(String, u64)> = steps.iter().map(|[name, _]| (name.clone(), 20_000)).collect();
    assert_eq!(ledger(place), expected);
    for [name, what] in &steps {
        let path = place.join(format!("out/{name}.mcap"));
        let recording = Recording::load(&path, &ReadOptions::default()).unwrap();
        assert_eq!(recording.metadata().entry("bowden.recording", "reference"), Some(what.as_str()));
        // The joint goes as far as the words say, and no farther than the plan allows but for its overshoot.
        let amplitude: f64 = what.split(" of ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        let angles = recording.channel(Channel::ThetaOut).unwrap();
        let largest = angles.iter().fold(0.0_f64, |largest, angle| largest.max(angle.abs()));
        assert!(largest > 0.7 * amplitude && largest < 1.1 * 0.3, "{what}: {largest} rad");
    }
    // Tendons that give way nine times as far.
    let other = rig.replace("axial_stiffness_n = 72900.0", "axial_stiffness_n = 8000.0");
    assert_ne!(rig, other);
    fs::write(place.join("rig.toml"), other).unwrap();
    assert_ne!(listed(), steps);
}

#[test]
fn an_excitation_is_chosen_for_the_rig() {
    let folder = tempfile::tempdir().unwrap();
    let rig = [
        "record",
        "--port",
        "sim",
        "--seconds",
        "0.01",
        "--out",
        "a.csv",
        "--rig",
        "rig.toml",
        "--load",
        "2.5,0.03",
    ];
    assert_eq!(bowden(folder.path(), &rig).0, 0);
    let plan = "schema = \"bowden-plan/1\"\n[limits]\nangle_rad = 0.3\n[[step]]\nkind = \"excite\"\nrig = \"rig.toml\"\nseconds = 9\n";
    let (status, stdout, stderr) = run(folder.path(), plan, &["--dry-run"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    let lines: Vec<&str> = stdout.lines().skip(1).collect();
    assert_eq!(lines.len(), 3, "{stdout}");
    // Three different motions, none beyond the limit, none all alike in form and frequency.
    for line in &lines {
        let amplitude: f64 = line.split(" of ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((0.03..=0.3).contains(&amplitude) && line.ends_with("position, 3 s"), "{line}");
    }
    assert!(lines[0][2..] != lines[1][2..] && lines[1][2..] != lines[2][2..], "{stdout}");
    assert!(!folder.path().join("out").exists());
    let (status, facts, _) = run(folder.path(), plan, &["--dry-run", "--json"]);
    let facts: Value = serde_json::from_str(&facts).unwrap();
    let steps = facts["steps"].as_array().unwrap();
    let said = steps.iter().map(|step| {
        let [name, what] = ["name", "what"].map(|key| step[key].as_str().unwrap());
        format!("{name:<24} {what}")
    });
    assert_eq!(
        (status, said.collect::<Vec<_>>()),
        (0, lines.iter().map(|line| (*line).to_owned()).collect())
    );
    let (_, _, stderr) = run(folder.path(), &plan.replace("seconds = 9", "seconds = 3"), &["--dry-run"]);
    assert!(
        stderr.starts_with("bowden: plan.toml:4:1: 3 s are too short for 3 motions; give 6 s or more"),
        "{stderr}"
    );
}
