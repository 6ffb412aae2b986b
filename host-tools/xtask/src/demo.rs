//! `cargo xtask demo`: a joint with a fault that its rig file does not mention, found and made up for by `bowden investigate`.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use serde_json::Value;

use crate::process::{self, built, cargo};

/// What the joint conceals, and the seed of the case.
const CONCEALED: &str = "transmission_backlash";
const SEED: &str = "11";

/// Time that the joint is driven, s of the simulated board.
const JOINT_SECONDS: &str = "90";

/// Weight on the arm of the simulated joint and its distance from the axis, kg and m.
const LOAD: &str = "2.5,0.03";

/// Runs the demonstration in `bowden-demo` below the current folder.
///
/// # Errors
/// When a program fails, or writes something else than it promises.
pub fn run() -> Result<(), String> {
    let started = Instant::now();
    let folder =
        std::env::current_dir().map_err(|error| format!("current folder: {error}"))?.join("bowden-demo");
    println!("1/3 building bowden");
    process::run(&mut cargo(&["build", "--release", "--package", "bowden"]), &[0])?;
    let out = folder.join("investigation");
    clear(&out)?;
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;

    println!("2/3 writing a rig file from the parameters of a simulated driver board ({})", folder.display());
    let mut rig = Command::new(built("release", "bowden")?);
    rig.current_dir(&folder).args(["record", "--port", "sim", "--seconds", "0.2", "--out", "joint.csv"]);
    process::run(rig.args(["--rig", "rig.toml", "--load", LOAD]), &[0])?;

    println!(
        "3/3 investigating a joint that conceals something: the rig file and the board are all that bowden sees"
    );
    let mut investigate = Command::new(built("release", "bowden")?);
    let port = format!("sim:{CONCEALED},seed={SEED}");
    investigate.current_dir(&folder).args(["investigate", "--port", &port, "--rig", "rig.toml"]);
    investigate.args(["--out", "investigation", "--time", JOINT_SECONDS, "--yes"]);
    process::run(&mut investigate, &[0, 3])?;

    let result = read(&out.join("investigation.json"))?;
    let last = result["rounds"].as_array().and_then(|rounds| rounds.last());
    let diagnosis =
        last.and_then(|round| round["folder"].as_str()).ok_or("investigation.json: no diagnosis")?;
    println!("\n{}", summary(&result, &read(&out.join(diagnosis).join("diagnosis.json"))?)?);
    let report = out.join("investigate.html");
    println!("report: {}", report.display());
    println!("took {:.0} s", started.elapsed().as_secs_f64());
    show(&report);
    Ok(())
}

/// Removes what an earlier demonstration left: an investigation wants a folder of its own.
fn clear(folder: &Path) -> Result<(), String> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(format!("{}: cannot be removed: {error}", folder.display()))
        }
        _ => Ok(()),
    }
}

fn read(path: &Path) -> Result<Value, String> {
    let shown = path.display();
    let text = fs::read_to_string(path).map_err(|error| format!("{shown}: cannot be read: {error}"))?;
    serde_json::from_str(&text).map_err(|error| format!("{shown}: not JSON: {error}"))
}

/// What was concealed, what was found, what that gains on held-out data, and how much better the joint follows.
fn summary(investigation: &Value, diagnosis: &Value) -> Result<String, String> {
    let verdict = diagnosis["verdict"].as_str().ok_or("diagnosis.json: no verdict")?;
    let mut lines = vec![format!("concealed: {CONCEALED}"), format!("verdict:   {verdict}")];
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
    let error = |key: &str| investigation["verification"][key].as_f64().map(|rad| 1e3 * rad);
    let before = error("before_rms_rad").ok_or("investigation.json: no tracking error")?;
    let after = error("after_rms_rad").ok_or("investigation.json: no parameter was changed")?;
    lines.push(format!("tracking error:  {before:.2} mrad before, {after:.2} mrad with the new parameters"));
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
        let investigation =
            json!({ "verification": { "before_rms_rad": 0.0093, "after_rms_rad": 0.000_89 } });
        let diagnosis = json!({
            "verdict": "missing_physics",
            "effects": [{ "id": "transmission_backlash", "probability": 0.97, "sentence": "A gap of 0.02 rad." }],
            "fit": { "channels": { "f1_n": {
                "before_rmse": 2.0, "recalibrated_rmse": 1.5, "after_rmse": 0.25, "noise_rmse": 0.1
            } } }
        });
        assert_eq!(
            summary(&investigation, &diagnosis).unwrap(),
            "concealed: transmission_backlash\n\
             verdict:   missing_physics\n\
             found:     transmission_backlash (97 %): A gap of 0.02 rad.\n\
             held-out RMSE        rig file  recalibrated   diagnosed\n  \
             f1_n                 2.0000        1.5000      0.2500\n\
             tracking error:  9.30 mrad before, 0.89 mrad with the new parameters"
        );
        assert!(summary(&json!({}), &diagnosis).is_err() && summary(&investigation, &json!({})).is_err());
    }
}
