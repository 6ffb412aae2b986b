//! Recordings that end by force: the program is killed, or the medium is full.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use bowden_core::recording::{Format, ReadOptions, Recording, SAVE_INTERVAL};

use crate::fake::Fake;
use crate::mishaps::Mishaps;
use crate::pseudo_terminal::Terminal;
use crate::screen::Screen;
use crate::{bowden, command, result_of};

/// Longest wait for what has to come soon.
pub const PATIENCE: Duration = Duration::from_mins(2);

fn load(path: &Path) -> Recording {
    Recording::load(path, &ReadOptions::default()).unwrap()
}

/// A run of the simulated joint, which gives equal rows every time.
const RUN: [&str; 7] = ["record", "--port", "sim", "--reference", "sine", "--amplitude", "0.2"];

#[test]
fn a_killed_recording_is_the_beginning_of_the_whole_one() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let (status, _, stderr) = bowden(place, &[&RUN[..], &["--seconds", "6", "--out", "whole.csv"]].concat());
    assert_eq!((status, stderr.as_str()), (0, ""));
    let whole = load(&place.join("whole.csv"));
    for (name, bytes) in
        [("a.mcap", 100_000), ("b.mcap", 500_000), ("c.csv", 1_000_000), ("d.csv.gz", 200_000)]
    {
        let path = place.join(name);
        let mut child = command(place, &[&RUN[..], &["--out", name]].concat())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let begun = Instant::now();
        while fs::metadata(&path).map_or(0, |file| file.len()) < bytes {
            assert!(child.try_wait().unwrap().is_none() && begun.elapsed() < PATIENCE, "{name}");
            std::thread::sleep(Duration::from_millis(2));
        }
        // SIGKILL: nothing of the program runs any more.
        child.kill().unwrap();
        child.wait().unwrap();
        let recovered = format!("recovered-{name}");
        let (status, stdout, stderr) = bowden(place, &["recover", name, "--out", &recovered]);
        assert!(matches!(status, 0 | 3), "{stderr}");
        let part = load(&place.join(&recovered));
        let rows = part.len();
        assert!(stdout.starts_with(&format!("{recovered}: {rows} rows, t_s = ")), "{stdout}");
        assert!(rows > 1000 && rows < whole.len(), "{name}: {rows} rows");
        assert_eq!(part, whole.slice(0..rows), "{name}");
        if Format::of(&path) == Some(Format::Mcap) {
            assert_eq!(status, 3);
            assert!(stderr.contains("the file ends early, after t_s = "), "{stderr}");
        } else {
            assert!(place.join(name.replace(".csv", ".parameters.toml").replace(".gz", "")).exists());
        }
    }
}

#[test]
fn what_a_board_has_sent_is_on_the_medium_soon_also_if_it_sends_no_more() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut child = terminal.start_recording(folder.path(), "a.mcap");
    let rows = || Recording::load(&path, &ReadOptions::default()).map_or(0, |recording| recording.len());
    let begun = Instant::now();
    while rows() < 5000 {
        assert!(child.try_wait().unwrap().is_none() && begun.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(20));
    }
    // The board falls silent, and with it the recording's own time: only the clock can have the rest saved.
    let fake = terminal.fake();
    let silent_s = fake.now().as_secs_f64();
    let last_s = || load(&path).t_s().last().copied().unwrap_or_default();
    // What the terminal holds on its way, and what is lost in the worst case.
    let on_the_way_s = 0.1;
    let begun = Instant::now();
    while last_s() < silent_s - on_the_way_s - SAVE_INTERVAL.as_secs_f64() / 10.0 {
        assert!(begun.elapsed() < PATIENCE, "{} s of {silent_s} s", last_s());
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    drop(fake);
}

/// `bowden` where no file may grow beyond a limit, as on a full disk: the write that does not fit fails.
fn limited(folder: &Path, blocks: u32, arguments: &[&str]) -> Command {
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$@\"");
    let mut command = Command::new("sh");
    command
        .current_dir(folder)
        .args(["-c", &script, "sh", env!("CARGO_BIN_EXE_bowden"), "--quiet"])
        .args(arguments)
        .stdin(Stdio::null());
    command
}

#[test]
fn a_full_disk_keeps_what_found_room_and_says_so_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    for (out, blocks) in [("a.mcap", 1000), ("b.csv", 4000), ("c.csv.gz", 1000)] {
        let run = [&RUN[..], &["--seconds", "6", "--out", out]].concat();
        let (status, stdout, stderr) = result_of(&limited(place, blocks, &run).output().unwrap());
        assert_eq!((status, stdout.as_str()), (1, ""), "{stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        let recording = load(&place.join(out));
        let rows = recording.len();
        assert!(rows > 2000, "{out}: {rows} rows");
        let expected = format!("bowden: {out}: cannot be written: file too large; {rows} rows over ");
        assert!(stderr.starts_with(&expected), "{expected}: {stderr}");
        assert!(stderr.trim_end().ends_with("are kept; make room and record again"), "{stderr}");
    }
    // A device that is full from the start.
    std::os::unix::fs::symlink("/dev/full", place.join("full.mcap")).unwrap();
    let run = [&RUN[..], &["--seconds", "1", "--out", "full.mcap"]].concat();
    let (status, _, stderr) = bowden(place, &run);
    assert_eq!((status, stderr.lines().count()), (1, 1), "{stderr}");
    assert!(stderr.contains("no space left on device; 0 rows"), "{stderr}");
}

#[test]
fn a_full_disk_ends_the_recording_of_a_monitor_and_not_the_view() {
    let folder = tempfile::tempdir().unwrap();
    let command = limited(folder.path(), 2000, &["monitor", "--port", "sim", "--record", "a.csv"]);
    let mut screen = Screen::start(&command, 100, 30);
    screen.wait_for("a.csv: NOT RECORDED ANY MORE");
    screen.press("a");
    screen.wait_for("ARMED");
    screen.press("q");
    let (status, stderr) = screen.end();
    let rows = load(&folder.path().join("a.csv")).len();
    assert!(rows > 1000, "{rows} rows");
    let expected = format!("bowden: a.csv: cannot be written: file too large; {rows} rows over ");
    assert!(stderr.starts_with(&expected) && stderr.lines().count() == 1, "{expected}: {stderr}");
    assert!(stderr.trim_end().ends_with("are kept; make room and record again"), "{stderr}");
    assert_eq!(status, 1);
}

#[test]
fn a_full_disk_stops_a_plan_which_goes_on_when_there_is_room() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let follow =
        |seconds: f64| format!("[[step]]\nkind = \"follow\"\nreference = \"hold\"\nseconds = {seconds:?}\n");
    let plan = ["schema = \"bowden-plan/1\"\n".to_owned(), follow(0.1), follow(2.0)].concat();
    fs::write(place.join("plan.toml"), plan).unwrap();
    let run = ["run", "plan.toml", "--port", "sim", "--out", "out", "--format", "csv"];
    let (status, stdout, stderr) = result_of(&limited(place, 2000, &run).output().unwrap());
    assert_eq!((status, stdout.as_str(), stderr.lines().count()), (1, "", 1), "{stderr}");
    let rows = load(&place.join("out/02-hold.csv")).len();
    assert!(rows > 1000 && rows < 20_000, "{rows} rows");
    let expected = format!("bowden: out/02-hold.csv: cannot be written: file too large; {rows} rows over ");
    assert!(stderr.starts_with(&expected), "{expected}: {stderr}");
    assert!(stderr.ends_with("1 of 2 steps are done; the same command goes on with 02-hold\n"), "{stderr}");
    let (status, stdout, stderr) = bowden(place, &run);
    assert_eq!((status, stderr.as_str()), (0, ""));
    assert!(stdout.starts_with("unnamed: 2 steps done, 1 of them before this start\n"), "{stdout}");
    let [whole, kept] = ["out/02-hold.csv", "out/02-hold.stopped-1.csv"].map(|name| load(&place.join(name)));
    assert_eq!((whole.len(), kept.len()), (20_000, rows));
}

#[test]
fn one_flipped_byte_in_the_middle_of_200_000_rows_costs_one_chunk() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let t_s: Vec<f64> = (0..200_000).map(|row| f64::from(row) * 1e-4).collect();
    let values = t_s.iter().map(|t_s| (3.0 * t_s).sin()).collect();
    Recording::new("made", t_s)
        .with(bowden_model::channel::Channel::F1, values)
        .save(&place.join("a.mcap"))
        .unwrap();
    let mut file = fs::read(place.join("a.mcap")).unwrap();
    let middle = file.len() / 2;
    file[middle] ^= 1;
    fs::write(place.join("b.mcap"), file).unwrap();
    let (status, stdout, stderr) = bowden(place, &["convert", "b.mcap", "b.csv"]);
    assert_eq!((status, stdout.as_str()), (2, ""));
    assert!(stderr.contains("take out what is whole with `bowden recover`"), "{stderr}");
    let (status, facts, stderr) = bowden(place, &["recover", "b.mcap", "--out", "b.csv", "--json"]);
    assert_eq!((status, stderr.lines().count()), (3, 1), "{stderr}");
    let facts: serde_json::Value = serde_json::from_str(&facts).unwrap();
    let (whole, part) = (load(&place.join("a.mcap")), load(&place.join("b.csv")));
    let missing = whole.len() - part.len();
    // A chunk is a megabyte of messages of some 40 bytes and their heads of 31.
    assert!((5000..25_000).contains(&missing), "{missing}");
    assert_eq!(
        (&facts["rows"], &facts["span_s"]),
        (&part.len().into(), &serde_json::json!([0.0, whole.t_s()[whole.len() - 1]]))
    );
    assert_eq!(facts["missing"].as_array().map(Vec::len), Some(1));
    assert!(stderr.contains(&format!(" are damaged: {missing} rows between t_s = ")), "{stderr}");
    let gap = part.t_s().windows(2).position(|pair| pair[1] - pair[0] > 1.5e-4).unwrap() + 1;
    assert_eq!(part.slice(0..gap), whole.slice(0..gap));
    assert_eq!(part.slice(gap..part.len()), whole.slice(gap + missing..whole.len()));
    for (arguments, expected) in [
        (["recover", "none.mcap", "--out", "x.csv"], "none.mcap: cannot be read: no such file"),
        (["recover", "a.mcap", "--out", "a.mcap"], "a.mcap: would overwrite the input a.mcap"),
        (["recover", "a.mcap", "--out", "x.txt"], "x.txt: unknown format"),
    ] {
        let (status, _, stderr) = bowden(place, &arguments);
        assert_eq!((status, stderr.lines().count()), (2, 1), "{stderr}");
        assert!(stderr.starts_with(&format!("bowden: {expected}")), "{stderr}");
    }
    fs::write(place.join("noise.mcap"), [7; 5000]).unwrap();
    let (status, _, stderr) = bowden(place, &["recover", "noise.mcap", "--out", "x.csv"]);
    assert_eq!((status, stderr.lines().count()), (2, 1), "{stderr}");
    assert!(!place.join("x.csv").exists());
}
