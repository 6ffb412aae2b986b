//! Ctrl-C during a diagnosis: what was found so far is written, and said to be incomplete.
#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const RIG: &str = include_str!("rigs/bench.toml");

fn bowden(folder: &Path, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_bowden"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn wait(mut child: Child) -> Output {
    let limit = Instant::now() + Duration::from_mins(2);
    while child.try_wait().unwrap().is_none() {
        assert!(Instant::now() < limit, "it goes on after two minutes");
        sleep(Duration::from_millis(20));
    }
    child.wait_with_output().unwrap()
}

#[test]
fn an_interrupted_diagnosis_leaves_what_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    fs::write(place.join("rig.toml"), RIG).unwrap();
    // Another rig than the one that is diagnosed, so that there is something to look for.
    fs::write(place.join("true.toml"), RIG.replace("= 0.12", "= 0.16")).unwrap();
    let made =
        wait(bowden(place, &["simulate", "--rig", "true.toml", "--out", "run.csv", "--seconds", "60"]));
    assert!(made.status.success());

    let child = bowden(place, &["diagnose", "run.csv", "--rig", "rig.toml", "--out", "found"]);
    // The folder is made once the recording has been read; the search then takes many times longer than this wait.
    let limit = Instant::now() + Duration::from_mins(1);
    while !place.join("found").exists() {
        assert!(Instant::now() < limit, "the recording is not read");
        sleep(Duration::from_millis(5));
    }
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let output = wait(child);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("stopped early"), "{said}");

    let found = place.join("found");
    let text = fs::read_to_string(found.join("diagnosis.json")).unwrap();
    let diagnosis: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(diagnosis["complete"], false);
    assert_eq!(diagnosis["effects"].as_array().map(Vec::len), Some(0));
    assert!(fs::read_to_string(found.join("report.html")).unwrap().contains("stopped before every effect"));
    assert!(found.join("rig.diagnosed.toml").exists());
}
