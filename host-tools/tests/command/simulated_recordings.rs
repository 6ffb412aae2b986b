//! `bowden record` on the simulated board, then `bowden diagnose`: what the board writes is what a diagnosis can use.

use std::fs;

use crate::common::bowden;
use bowden_core::recording::{ReadOptions, Recording};
use bowden_model::channel::Channel;
use serde_json::Value;
use tempfile::tempdir;

/// Records every tenth tick of `seconds` on a joint that conceals `concealed`, and diagnoses that with the rig file of the data sheet.
fn diagnosed(concealed: &str, reference: [&str; 3], seconds: &str) -> Value {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("rig.toml"), virtual_bench::nominal_rig_toml("bench")).unwrap();
    let port = format!("sim:{concealed}");
    let [shape, amplitude, frequency] = reference;
    let moved = ["--reference", shape, "--amplitude", amplitude, "--frequency", frequency];
    let record =
        ["record", "--port", &port, "--home", "--seconds", seconds, "--every", "10", "--out", "rec.csv"];
    let (status, _, errors) = bowden(folder.path(), &[&record, moved.as_slice()].concat());
    assert_eq!((status, errors.contains("fault")), (0, false), "{errors}");
    let (status, _, errors) =
        bowden(folder.path(), &["diagnose", "rec.csv", "--rig", "rig.toml", "--out", "found"]);
    assert_eq!(status, 0, "{errors}");
    serde_json::from_str(&fs::read_to_string(folder.path().join("found/diagnosis.json")).unwrap()).unwrap()
}

fn named(diagnosis: &Value) -> Vec<&Value> {
    diagnosis["effects"].as_array().unwrap().iter().map(|effect| &effect["id"]).collect()
}

/// Three counts a sample at the fastest, and a reference that passes the same places in every period.
#[test]
fn a_joint_that_conceals_nothing_is_consistent() {
    for reference in [["multisine", "0.5", "0.25"], ["staircase", "0.4", "0.25"]] {
        let diagnosis = diagnosed("seed=711", reference, "16");
        assert_eq!(diagnosis["verdict"], "consistent", "{reference:?}: {}", diagnosis["summary"]);
    }
}

/// A spring of some thousandths of a newton metre a radian makes up for the coarser steps of the search; the final fit takes it back.
#[test]
fn what_only_the_coarse_search_needs_is_not_named() {
    let diagnosis = diagnosed("sheath_viscous_friction,seed=721", ["multisine", "0.5", "0.25"], "16");
    assert_eq!(named(&diagnosis), ["sheath_viscous_friction"], "{}", diagnosis["summary"]);
}

/// Half of a clear fault: a whole one slackens a tendon in this motion, and the board stops. Beside the noise of the second seed a gain of
/// the motor current fits too, though the resistance does as well in its place.
#[test]
fn play_of_the_joint_is_found_in_a_fast_motion() {
    for seed in [712, 714] {
        let rig = format!("joint_backlash:0.5,seed={seed}");
        let diagnosis = diagnosed(&rig, ["multisine", "0.4", "0.25"], "16");
        assert_eq!(named(&diagnosis), ["joint_backlash"], "seed {seed}: {}", diagnosis["summary"]);
    }
}

/// The virtual bench bends its sheaths between 14 % and 86 % of their length. Each step of a staircase leaves the arm ringing on the free
/// tendon beside the pulley.
#[test]
fn a_rig_that_says_where_the_sheath_is_straight_predicts_better() {
    let folder = tempdir().unwrap();
    let even = virtual_bench::nominal_rig_toml("bench");
    let effects = "effects = []";
    assert!(even.contains(effects));
    let straight = even.replace(effects, "effects = [\"straight_ends\"]")
        + "\n[effects.straight_ends]\nstraight_share = 0.14\n";
    fs::write(folder.path().join("even.toml"), even).unwrap();
    fs::write(folder.path().join("straight.toml"), straight).unwrap();
    let moved = ["--reference", "staircase", "--amplitude", "0.4", "--frequency", "0.25"];
    let record =
        ["record", "--port", "sim", "--home", "--seconds", "16", "--every", "10", "--out", "rec.csv"];
    assert_eq!(bowden(folder.path(), &[&record[..], &moved].concat()).0, 0);
    let load = |name: &str| Recording::load(&folder.path().join(name), &ReadOptions::default()).unwrap();
    let recorded = load("rec.csv");
    let error_n = |rig: &str| {
        let replay = ["replay", "rec.csv", "--rig", rig, "--out", "predicted.csv"];
        assert_eq!(bowden(folder.path(), &replay).0, 0);
        let predicted = load("predicted.csv");
        let [recorded_n, predicted_n] = [&recorded, &predicted].map(|it| it.channel(Channel::F2).unwrap());
        let squares: f64 = recorded_n.iter().zip(predicted_n).map(|(a, b)| (a - b).powi(2)).sum();
        (squares / recorded_n.len() as f64).sqrt()
    };
    let [even_n, straight_n] = ["even.toml", "straight.toml"].map(error_n);
    println!("{even_n:.2} N, where the sheath is straight {straight_n:.2} N");
    assert!(straight_n < 0.88 * even_n && straight_n > 0.5, "{even_n} N, {straight_n} N");
}

/// The first two seconds are learned from, and nothing judges what was learned.
#[test]
fn a_run_that_was_stopped_early_is_too_short_to_be_diagnosed() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("rig.toml"), virtual_bench::nominal_rig_toml("bench")).unwrap();
    let record =
        ["record", "--port", "sim", "--home", "--seconds", "1.5", "--reference", "sine", "--every", "10"];
    assert_eq!(bowden(folder.path(), &[&record[..], &["--out", "rec.csv"]].concat()).0, 0);
    let (status, _, errors) =
        bowden(folder.path(), &["diagnose", "rec.csv", "--rig", "rig.toml", "--out", "found"]);
    let expected = "bowden: rec.csv: 1.50 s are too short to judge a diagnosis by, which holds out every third second; record \
                    at least 3 s, or name another recording with --heldout\n";
    assert_eq!((status, errors.as_str()), (2, expected));
}
