//! `cargo xtask demo`: a bench with a fault that its rig file does not mention, recorded and diagnosed.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use serde_json::Value;

use crate::process::{self, built, cargo};

/// What the bench conceals, with which strength, and the seed of the case.
const CONCEALED: &str = "pretension_loss:1";
const SEED: &str = "11";

/// Runs the demonstration in `bowden-demo` below the current folder.
///
/// # Errors
/// When a program fails, or writes something else than it promises.
pub fn run() -> Result<(), String> {
    let started = Instant::now();
    let folder =
        std::env::current_dir().map_err(|error| format!("current folder: {error}"))?.join("bowden-demo");
    println!("1/3 building bowden and virtual-bench");
    let build = ["build", "--release", "--package", "bowden", "--package", "virtual-bench"];
    process::run(&mut cargo(&build), &[0])?;

    println!("2/3 recording 60 s of a simulated bench that conceals something ({})", folder.display());
    let mut record = Command::new(built("release", "virtual-bench")?);
    record.args(["record", "--effect", CONCEALED, "--seed", SEED, "--out"]).arg(&folder);
    process::run(&mut record, &[0])?;

    println!("3/3 diagnosing: the rig file and the recordings are all that bowden sees");
    let out = folder.join("diagnosis");
    let mut diagnose = Command::new(built("release", "bowden")?);
    diagnose.current_dir(&folder).args([
        "diagnose",
        "train.csv",
        "--heldout",
        "heldout.csv",
        "--rig",
        "rig.toml",
    ]);
    diagnose.args(["--out", "diagnosis"]);
    process::run(&mut diagnose, &[0, 3])?;

    let truth = read(&folder.join("truth.json"))?;
    let diagnosis = read(&out.join("diagnosis.json"))?;
    println!("\n{}", summary(&truth, &diagnosis)?);
    let report = out.join("report.html");
    println!("report: {}", report.display());
    println!("took {:.0} s", started.elapsed().as_secs_f64());
    show(&report);
    Ok(())
}

fn read(path: &Path) -> Result<Value, String> {
    let shown = path.display();
    let text = fs::read_to_string(path).map_err(|error| format!("{shown}: cannot be read: {error}"))?;
    serde_json::from_str(&text).map_err(|error| format!("{shown}: not JSON: {error}"))
}

/// What was concealed, what was found, and what that gains on held-out data.
fn summary(truth: &Value, diagnosis: &Value) -> Result<String, String> {
    let ids = |value: &Value| -> Vec<String> {
        value.as_array().into_iter().flatten().filter_map(|id| id.as_str().map(str::to_owned)).collect()
    };
    let concealed = ids(&truth["effects"]).join(", ");
    let verdict = diagnosis["verdict"].as_str().ok_or("diagnosis.json: no verdict")?;
    let mut lines = vec![format!("concealed: {concealed}"), format!("verdict:   {verdict}")];
    for effect in diagnosis["effects"].as_array().into_iter().flatten() {
        let text = |key: &str| effect[key].as_str().unwrap_or("?").to_owned();
        let percent = 100.0 * effect["probability"].as_f64().unwrap_or(0.0);
        lines.push(format!("found:     {} ({percent:.0} %): {}", text("id"), text("sentence")));
    }
    lines.push(format!("{:<17}{:>12}{:>14}{:>12}", "held-out RMSE", "rig file", "recalibrated", "diagnosed"));
    for (channel, fit) in diagnosis["fit"]["channels"].as_object().into_iter().flatten() {
        let value = |key: &str| fit[key].as_f64().unwrap_or(f64::NAN);
        let values = [value("before_rmse"), value("recalibrated_rmse"), value("after_rmse")];
        lines.push(format!("  {channel:<15}{:>12.4}{:>14.4}{:>12.4}", values[0], values[1], values[2]));
    }
    Ok(lines.join("\n"))
}

/// Opens the report where there is a screen; everybody else has its path.
fn show(report: &Path) {
    let screen = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
    if !cfg!(target_os = "linux") {
        println!("open it in a browser: only Linux with xdg-open is known here");
    } else if screen && Command::new("xdg-open").arg(report).spawn().is_err() {
        println!("open it in a browser: there is no xdg-open on this machine");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_summary_tells_what_was_hidden_found_and_gained() {
        let truth = json!({ "effects": ["pretension_loss"] });
        let diagnosis = json!({
            "verdict": "missing_physics",
            "effects": [{ "id": "pretension_loss", "probability": 0.97, "sentence": "F0 dropped at 12 s." }],
            "fit": { "channels": { "f1_n": {
                "before_rmse": 2.0, "recalibrated_rmse": 1.5, "after_rmse": 0.25, "noise_rmse": 0.1
            } } }
        });
        assert_eq!(
            summary(&truth, &diagnosis).unwrap(),
            "concealed: pretension_loss\n\
             verdict:   missing_physics\n\
             found:     pretension_loss (97 %): F0 dropped at 12 s.\n\
             held-out RMSE        rig file  recalibrated   diagnosed\n  \
             f1_n                 2.0000        1.5000      0.2500"
        );
        assert!(summary(&truth, &json!({})).is_err());
    }
}
