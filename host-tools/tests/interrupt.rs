//! Ctrl-C during a diagnosis: the results so far are written and marked as incomplete.
#![cfg(unix)]

use std::fs::{self, File};
use std::io::Write;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use rustix::fs::{OFlags, fcntl_setfl};
use rustix::io::Errno;

const RIG: &str = include_str!("../core/tests/rigs/bench.toml");

fn bowden(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bowden"));
    command.args(arguments).current_dir(folder).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Opens a named pipe for writing as soon as `reader` has opened it for reading.
fn open_for(reader: &mut Child, pipe: &Path) -> File {
    loop {
        let opened =
            File::options().write(true).custom_flags(OFlags::NONBLOCK.bits().cast_signed()).open(pipe);
        match opened {
            Ok(file) => {
                fcntl_setfl(&file, OFlags::empty()).unwrap();
                return file;
            }
            Err(error) => assert_eq!(Errno::from_io_error(&error), Some(Errno::NXIO), "{error}"),
        }
        assert_eq!(reader.try_wait().unwrap(), None, "it ended without reading the recording");
        sleep(Duration::from_millis(5));
    }
}

#[test]
fn an_interrupted_diagnosis_writes_its_results_so_far() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    fs::write(place.join("rig.toml"), RIG).unwrap();
    // Another rig than the one that is diagnosed, so that there is something to look for.
    fs::write(place.join("true.toml"), RIG.replace("= 0.12", "= 0.16")).unwrap();
    let simulate = ["simulate", "--rig", "true.toml", "--out", "run.csv", "--seconds", "60"];
    assert!(bowden(place, &simulate).status().unwrap().success());

    // The recording comes through a pipe, so that the search cannot begin before the signal is sent.
    let pipe = place.join("pipe.csv");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let diagnose = ["diagnose", "pipe.csv", "--rig", "rig.toml", "--out", "found", "--quiet"];
    let mut child = bowden(place, &diagnose).spawn().unwrap();
    let mut recording = open_for(&mut child, &pipe);
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    recording.write_all(&fs::read(place.join("run.csv")).unwrap()).unwrap();
    drop(recording);
    let output = child.wait_with_output().unwrap();
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
