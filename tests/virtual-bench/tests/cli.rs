//! The program as a user meets it: files, exit status, one-line errors.

use std::fs;

use assert_cmd::Command;

fn bench() -> Command {
    let mut command = Command::cargo_bin("virtual-bench").expect("the binary is built with the tests");
    command.env_remove("RUST_BACKTRACE");
    command
}

#[test]
fn record_writes_the_four_files_of_a_case() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let out = folder.path().join("case-9");
    let arguments =
        ["record", "--effect", "joint_backlash:0.8", "--effect", "sheath_kink_spot", "--off", "mu:0.5"];
    let times = ["--seed", "9", "--seconds", "2", "--heldout-seconds", "1", "--out"];
    bench().args(arguments).args(times).arg(&out).assert().success().stdout("").stderr("");

    let read = |name: &str| fs::read_to_string(out.join(name)).expect("a file of the case");
    let header = "t_s,theta_ref_rad,theta_in_rad,theta_out_rad,f1_n,f2_n,f3_n,f4_n,duty,bus_v,i_motor_a";
    for (name, rows) in [("train.csv", 2_000), ("heldout.csv", 1_000)] {
        let text = read(name);
        assert_eq!(text.lines().next(), Some(header));
        assert_eq!(text.lines().count(), rows + 1, "{name}");
        assert!(text.lines().all(|line| line.split(',').count() == 11), "{name} is ragged");
        assert!(text.starts_with("t_s") && text.contains("\n0.000000,0.000000,0.000000,0.000000,"));
    }
    let rig = read("rig.toml");
    for line in
        ["schema = \"bowden-rig/1\"", "name = \"case-9\"", "friction_coefficient = 0.12", "effects = []"]
    {
        assert!(rig.lines().any(|found| found == line), "no line '{line}' in\n{rig}");
    }
    let truth: serde_json::Value = serde_json::from_str(&read("truth.json")).expect("truth.json is JSON");
    assert_eq!(truth["effects"], serde_json::json!(["joint_backlash"]));
    assert_eq!(truth["outside_catalogue"], serde_json::json!(["sheath_kink_spot"]));
    assert_eq!(truth["components"], serde_json::json!(["joint", "transmission"]));
    assert_eq!(truth["parameters_off"], serde_json::json!(["mu"]));
    assert_eq!(truth["true_over_nominal"]["mu"], 0.5);
    let gap = truth["effect_parameters"]["joint_backlash.gap_rad"].as_f64().expect("the gap");
    assert!(gap > 0.8 * 0.85 * 0.025 && gap < 0.8 * 1.2 * 0.025, "{gap}");
}

#[test]
fn bad_usage_is_one_line_and_status_2() {
    for (arguments, word) in [
        (vec!["record", "--effect", "joint_slop", "--out", "x"], "joint_slop"),
        (vec!["record", "--effect", "joint_backlash:much", "--out", "x"], "joint_backlash:much"),
        (vec!["record", "--effect", "joint_backlash:9", "--out", "x"], "strength 9"),
        (vec!["record", "--off", "mass:0.5", "--out", "x"], "mass:0.5"),
        (vec!["record", "--motion", "waltz", "--out", "x"], "lab-heldout"),
        (vec!["record", "--seconds", "-1", "--out", "x"], "--seconds -1"),
        (vec!["record", "--seconds", "0", "--out", "x"], "--seconds 0"),
        (vec!["record", "--percent", "90", "--out", "x"], "0 to 20"),
        (vec!["record"], "--out"),
        (vec!["play"], "play"),
        (vec![], "a command is missing"),
    ] {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let result = bench().current_dir(folder.path()).args(&arguments).assert().code(2).stdout("");
        let text = String::from_utf8_lossy(&result.get_output().stderr).into_owned();
        assert_eq!(text.lines().count(), 1, "{arguments:?}: {text}");
        assert!(text.contains(word), "{arguments:?}: {text}");
        assert!(!folder.path().join("x").exists(), "{arguments:?} left something behind");
    }
}

#[test]
fn a_folder_that_cannot_be_made_is_status_1_and_named() {
    let file = tempfile::NamedTempFile::new().expect("a file for the test");
    let out = file.path().join("case");
    let result =
        bench().args(["record", "--seconds", "0.1", "--heldout-seconds", "0.1", "--out"]).arg(&out).assert();
    let result = result.code(1);
    let text = String::from_utf8_lossy(&result.get_output().stderr).into_owned();
    assert!(text.contains(&out.display().to_string()) && text.lines().count() == 1, "{text}");
}

#[test]
fn effects_lists_every_id_once() {
    let result = bench().arg("effects").assert().success();
    let text = String::from_utf8_lossy(&result.get_output().stdout).into_owned();
    let ids: Vec<&str> = text.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert_eq!(ids, virtual_bench::ConcealedEffect::IDS);
    assert_eq!(text.lines().filter(|line| line.ends_with("outside the catalogue")).count(), 9);
}
