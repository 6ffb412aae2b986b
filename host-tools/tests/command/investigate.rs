//! `bowden investigate` from end to end on the simulated board, whose joint is the virtual bench; in virtual time.

use std::cell::Cell;
use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::Path;
use std::rc::Rc;
use std::time::Duration;

use crate::common::{bowden, command};
use crate::screen::Screen;
use bowden_core::outcome::Failure;
use bowden_core::progress::Quiet;
use bowden_host_link::evidence::Origin;
use bowden_host_link::investigate::limits::Wishes;
use bowden_host_link::investigate::{Dialog, Setup, investigate};
use bowden_host_link::sim::SimTransport;
use bowden_host_link::{Client, Transport};
use serde_json::Value;
use tempfile::TempDir;

/// A folder with the rig file of the nominal bench.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("rig.toml"), virtual_bench::nominal_rig_toml("bench")).unwrap();
    folder
}

/// Runs `bowden investigate` without a terminal: exit status, standard output, standard error.
fn run(folder: &Path, port: &str, more: &[&str]) -> (i32, String, String) {
    let investigate = ["investigate", "--port", port, "--rig", "rig.toml", "--out", "out"];
    bowden(folder, &[&investigate, more].concat())
}

fn result(folder: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join("out/investigation.json")).unwrap()).unwrap()
}

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

#[test]
fn play_is_found_and_made_up_for() {
    let folder = folder();
    let port = "sim:transmission_backlash:1,seed=601";
    let (status, stdout, stderr) = run(folder.path(), port, &["--yes", "--time", "90"]);
    assert_eq!((status, stderr.as_str()), (0, ""), "{stdout}");
    let result = result(folder.path());
    let last = result["rounds"].as_array().unwrap().last().unwrap();
    assert_eq!(last["diagnosis"]["verdict"], "missing_physics", "{stdout}");
    assert_eq!(last["diagnosis"]["effects"][0]["id"], "transmission_backlash");
    let verification = &result["verification"];
    let [before, after] = ["before_rms_rad", "after_rms_rad"].map(|key| number(&verification[key]));
    assert!(after < 0.9 * before, "{before} to {after} rad");
    // A slow motion crosses the play a few times; a fast one does so all the time, which no lead makes up for.
    let slow = &verification["references"][0];
    let [before, after] = ["before", "after"].map(|key| number(&slow[key]["rms_rad"]));
    assert!(slow["run"]["form"] == "sine" && after < 0.4 * before, "{slow}");
    assert_eq!((&verification["effect"], &result["parameters"]["state"]), (&"better".into(), &"set".into()));
    let changes = result["parameters"]["changes"].as_array().unwrap();
    let gap = changes.iter().find(|change| change["parameter"] == "correction.backlash.transmission_gap");
    // 0.02 rad, drawn within 0.85 to 1.2 of it; the motion wears a part of it out as stretch.
    let gap = gap.unwrap();
    assert!((0.012..0.028).contains(&number(&gap["new"])) && gap["unit"] == "rad", "{gap}");
    assert_eq!(result["stopped"], Value::Null);

    let files = names(&folder.path().join("out"));
    for recorded in result["recordings"].as_array().unwrap() {
        assert!(
            files.contains(recorded["file"].as_str().unwrap()) && recorded["complete"] == true,
            "{recorded}"
        );
    }
    for name in ["investigate.html", "parameters.before.toml", "parameters.after.toml", "diagnosis"] {
        assert!(files.contains(name), "{name}: {files:?}");
    }
    let page = fs::read_to_string(folder.path().join("out/investigate.html")).unwrap();
    for text in ["The joint follows better", "correction.backlash.transmission_gap", "diagnosis/report.html"]
    {
        assert!(page.contains(text), "{text}");
    }
    assert!(stdout.trim_end().ends_with("out/investigate.html"), "{stdout}");

    let (status, stdout, stderr) = run(folder.path(), port, &["--yes"]);
    assert_eq!((status, stdout.as_str()), (2, ""));
    assert!(stderr.starts_with("bowden: out: holds ") && stderr.lines().count() == 1, "{stderr}");
    assert_eq!(names(&folder.path().join("out")), files);
}

#[test]
fn a_joint_that_conceals_nothing_is_left_as_it_is() {
    let folder = folder();
    let (status, stdout, stderr) =
        run(folder.path(), "sim:seed=602", &["--yes", "--time", "48", "--format", "mcap", "--json"]);
    assert_eq!((status, stderr.as_str()), (0, ""), "{stdout}");
    let result = result(folder.path());
    assert_eq!(serde_json::from_str::<Value>(&stdout).unwrap(), result);
    let last = result["rounds"].as_array().unwrap().last().unwrap();
    assert_eq!(last["diagnosis"]["verdict"], "consistent", "{stdout}");
    assert_eq!(last["diagnosis"]["effects"], Value::Array(Vec::new()));
    assert_eq!(result["parameters"]["state"], "unchanged", "{}", result["parameters"]);
    let verification = &result["verification"];
    assert!(number(&verification["before_rms_rad"]) < 6e-3, "{verification}");
    assert_eq!(verification["after_rms_rad"], Value::Null);
    assert!(names(&folder.path().join("out")).contains("verify-1-sine-before.mcap"));
}

#[test]
fn nothing_moves_where_nobody_can_be_asked() {
    let folder = folder();
    let (status, stdout, stderr) = run(folder.path(), "sim", &[]);
    assert_eq!((status, stdout.as_str()), (2, ""));
    assert!(
        stderr.contains("no terminal to ask at; nothing was moved") && stderr.lines().count() == 1,
        "{stderr}"
    );
    let (status, stdout, stderr) = run(folder.path(), "sim", &["--dry-run", "--angle", "0.3"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    assert!(
        stdout.contains("angle -0.300 to 0.300 rad") && stdout.contains("train     multisine"),
        "{stdout}"
    );
    assert!(stdout.ends_with("nothing was moved and nothing was written\n"), "{stdout}");
    let (status, stdout, stderr) = run(folder.path(), "sim", &["--dry-run", "--angle", "0.3", "--json"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    let planned: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((&planned["schema"], &planned["stopped"]), (&"bowden-investigation/1".into(), &Value::Null));
    assert_eq!(planned["recordings"], Value::Array(Vec::new()));
    let runs = planned["plan"]["runs"].as_array().unwrap();
    assert!(
        runs.iter().all(|run| number(&run["amplitude_rad"]) <= 0.3) && runs[0]["form"] == "multisine",
        "{planned}"
    );
    let (status, stdout, stderr) = run(folder.path(), "sim", &["--json"]);
    assert_eq!((status, stdout.as_str(), stderr.lines().count()), (2, "", 1), "{stderr}");
    assert!(stderr.starts_with("bowden: --json: nobody can be asked"), "{stderr}");
    assert_eq!(names(folder.path()), BTreeSet::from(["rig.toml".to_owned()]));
}

#[test]
fn a_person_at_the_terminal_is_asked_before_the_joint_moves_and_before_it_is_changed() {
    let folder = folder();
    let port = "sim:motor_coulomb_friction:1,seed=3";
    let line = [
        "investigate",
        "--port",
        port,
        "--rig",
        "rig.toml",
        "--out",
        "out",
        "--angle",
        "0.4",
        "--time",
        "42",
    ];
    let asked = |answer: &str| {
        let mut screen = Screen::start(&command(folder.path(), &line), 120, 40);
        screen.wait_for("Move the joint along these references? [y/N]");
        screen.press(answer);
        screen
    };
    for (answer, expected) in
        [("\r", "not confirmed: nothing was moved and nothing was written"), ("\u{3}", "stopped by the user")]
    {
        let (status, stderr) = asked(answer).end();
        assert_eq!((status, stderr), (1, format!("bowden: {expected}\n")));
        assert_eq!(names(folder.path()).len(), 1, "{expected}");
    }
    let mut screen = asked("y\r");
    screen.wait_for("on the board? [y/N]");
    assert!(screen.text().contains("correction.motor_friction.enable"), "{}", screen.text());
    screen.press("n\r");
    let (status, stderr) = screen.end();
    assert_eq!((status, stderr.as_str()), (0, ""), "{}", screen.text());
    let result = result(folder.path());
    assert_eq!(result["parameters"]["state"], "declined", "{}", result["parameters"]);
    assert_eq!(result["verification"]["after_rms_rad"], Value::Null);
}

#[test]
fn limits_and_ports_that_cannot_be_used_are_refused_in_one_line() {
    let folder = folder();
    for (port, more, expected) in [
        ("sim", ["--time", "3"], "--time 3: too short"),
        ("sim", ["--angle", "0.001"], "the limits leave no reference"),
        ("sim:gremlins", ["--time", "60"], "sim:gremlins: no effect is called 'gremlins'"),
    ] {
        let (status, stdout, stderr) = run(folder.path(), port, &[&["--yes"], more.as_slice()].concat());
        assert_eq!((status, stdout.as_str()), (2, ""), "{stderr}");
        assert!(
            stderr.starts_with(&format!("bowden: {expected}")) && stderr.lines().count() == 1,
            "{stderr}"
        );
    }
    assert_eq!(names(folder.path()).len(), 1);
}

#[test]
fn a_fault_midway_keeps_what_was_recorded() {
    let folder = folder();
    // Nine tenths of the pretension go within the first half minute.
    let (status, _, stderr) = run(folder.path(), "sim:pretension_loss:5", &["--yes"]);
    assert_eq!((status, stderr.lines().count()), (1, 1), "{stderr}");
    assert!(stderr.starts_with("bowden: fault 11, f") && stderr.contains("a tendon is slack"), "{stderr}");
    assert!(stderr.trim_end().ends_with("what was recorded is kept in out"), "{stderr}");
    let result = result(folder.path());
    assert!(result["stopped"].as_str().unwrap().starts_with("fault 11"), "{}", result["stopped"]);
    let recordings = result["recordings"].as_array().unwrap();
    assert_eq!(recordings.last().unwrap()["complete"], false);
    let files = names(&folder.path().join("out"));
    assert!(
        recordings.iter().all(|recorded| files.contains(recorded["file"].as_str().unwrap())),
        "{files:?}"
    );
    let page = fs::read_to_string(folder.path().join("out/investigate.html")).unwrap();
    assert!(page.contains("Ended early") && page.contains("fault 11"));
}

/// A simulated board whose cable is cut after some time.
struct Cut {
    board: SimTransport,
    at: Duration,
}

impl Transport for Cut {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        if self.now() >= self.at {
            Err(io::Error::other("the device is gone"))
        } else {
            self.board.read(buffer, timeout)
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        if self.now() >= self.at {
            Err(io::Error::other("the device is gone"))
        } else {
            self.board.write(bytes)
        }
    }

    fn now(&self) -> Duration {
        self.board.now()
    }
}

/// Counts the questions and says yes.
struct Agrees(Rc<Cell<u32>>);

impl Dialog for Agrees {
    fn show(&self, _text: &str) -> Result<(), Failure> {
        Ok(())
    }

    fn may(&self, _question: &str) -> Result<bool, Failure> {
        self.0.set(self.0.get() + 1);
        Ok(true)
    }
}

fn setup<'s>(rig: &'s Path, out: &'s Path) -> Setup<'s> {
    let origin = Origin::default();
    Setup { rig, folder: out, wishes: Wishes::default(), ending: "csv", every: 10, origin, dry_run: false }
}

#[test]
fn a_cut_cable_keeps_what_was_recorded() {
    let folder = folder();
    let board = Cut { board: SimTransport::new(), at: Duration::from_secs(20) };
    let client = Client::connect(Box::new(board), "board", Duration::from_secs(1)).unwrap();
    let (rig, out) = (folder.path().join("rig.toml"), folder.path().join("out"));
    let asked = Rc::new(Cell::new(0));
    let failure =
        investigate(&setup(&rig, &out), client, &Agrees(asked.clone()), &|| false, &Quiet).unwrap_err();
    assert!(failure.message().starts_with("board: the device is gone; check cable and supply"), "{failure}");
    assert!(failure.message().contains("what was recorded is kept in"), "{failure}");
    assert_eq!(asked.get(), 1);
    let files = names(&out);
    assert!(files.contains("train-1-multisine.csv") && files.contains("investigation.json"), "{files:?}");
}

#[test]
fn ctrl_c_stops_the_joint_and_keeps_what_was_recorded() {
    let folder = folder();
    let client = Client::connect(Box::new(SimTransport::new()), "sim", Duration::from_secs(1)).unwrap();
    let (rig, out) = (folder.path().join("rig.toml"), folder.path().join("out"));
    let looks = Cell::new(0);
    let stop = || {
        looks.set(looks.get() + 1);
        looks.get() > 5000
    };
    let agrees = Agrees(Rc::new(Cell::new(0)));
    let failure = investigate(&setup(&rig, &out), client, &agrees, &stop, &Quiet).unwrap_err();
    assert!(failure.message().starts_with("stopped by the user during train-"), "{failure}");
    let result: Value =
        serde_json::from_str(&fs::read_to_string(out.join("investigation.json")).unwrap()).unwrap();
    assert!(!result["recordings"].as_array().unwrap().is_empty());
}
