//! Recordings of real benches, each replayed with physics fitted to the others, stay within the marks.
//!
//! The data lie in the folder that `BOWDEN_DATA` names, or beside the workspace in `shared/data`; where they are absent
//! the tests say so and pass. Bounds hold on both sides: a score far better than ever seen means that something else is
//! measured than before.

use std::path::PathBuf;

use bowden::marks::{Mark, cable_tool, mean, servo_pendulum};

/// Folder of the data set, if it is there.
fn data(folder: &str) -> Option<PathBuf> {
    let beside = || [env!("CARGO_MANIFEST_DIR"), "..", "..", "shared", "data"].iter().collect();
    let data = std::env::var_os("BOWDEN_DATA").map_or_else(beside, PathBuf::from);
    if data.join(folder).is_dir() {
        return Some(data);
    }
    eprintln!("skipped: no {folder} in {}; set BOWDEN_DATA to the folder of the data sets", data.display());
    None
}

fn within(mark: &Mark) {
    assert!(mark.met(), "{mark}");
    assert!(mark.score > 0.5 * mark.limit, "{mark}, but below half of it: is the same thing measured?");
}

#[test]
fn a_servo_pendulum_is_predicted_from_its_goal() {
    let Some(data) = data(servo_pendulum::FOLDER) else { return };
    let runs = servo_pendulum::load(&data).unwrap();
    assert_eq!(runs.len(), 11);
    let score =
        |physics| mean(servo_pendulum::held_out(&runs, physics, servo_pendulum::Split::Recording).unwrap());
    let all = score(servo_pendulum::Physics::All);
    within(&Mark { quantity: "angle error, rad", score: all, limit: servo_pendulum::LIMIT_RAD });
    // Without the friction that the mark demands it is missed: the test can fail.
    assert!(score(servo_pendulum::Physics::Viscous) > 1.3 * servo_pendulum::LIMIT_RAD);
}

#[test]
fn a_cable_driven_jaw_is_predicted_from_input_angle_and_load() {
    let Some(data) = data(cable_tool::FOLDER) else { return };
    let runs = cable_tool::load(&data, cable_tool::Load::Recorded).unwrap();
    assert_eq!(runs.full.len(), 13);
    let out =
        cable_tool::held_out(&runs, cable_tool::Physics::All, cable_tool::Calibration::PerTool).unwrap();
    let total = cable_tool::pooled(&out);
    within(&Mark { quantity: "jaw angle, rad", score: total.angle_rad, limit: cable_tool::LIMIT_RAD });
    within(&Mark { quantity: "input torque, N m", score: total.torque_nm, limit: cable_tool::LIMIT_NM });
}

/// The four rigs of one bench differ where the firmware gain does, and the rigs replay what they describe.
#[test]
fn the_rigs_of_the_servo_differ_in_name_and_gain_alone() {
    let rig = |gain: u32| -> Vec<String> {
        let path: PathBuf =
            [env!("CARGO_MANIFEST_DIR"), "rigs", &format!("xl330-kp{gain}.toml")].iter().collect();
        std::fs::read_to_string(path).unwrap().lines().map(str::to_owned).collect()
    };
    let first = rig(100);
    for gain in [200, 400, 800] {
        let other = rig(gain);
        assert_eq!(first.len(), other.len());
        for (a, b) in first.iter().zip(&other).filter(|(a, b)| a != b) {
            assert!(
                ["name", "gain_duty_per_rad", "# Dynamixel"].iter().any(|key| a.starts_with(key)),
                "{a:?} differs from {b:?}"
            );
        }
    }
}
