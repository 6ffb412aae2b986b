//! Models of MuJoCo and URDF into rigs, and a diagnosed rig out to MuJoCo, by the command.

use std::fs;
use std::path::Path;

use crate::common::bowden;
use bowden_core::rig::Rig;

const BENCH: &str = include_str!("../../core/tests/rigs/bench.toml");
const MODELS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/core/tests/models");

/// A folder with `base.toml`, and a model that others wrote.
fn folder_with(model: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("base.toml"), BENCH).unwrap();
    fs::copy(Path::new(MODELS).join(model), folder.path().join(model)).unwrap();
    folder
}

/// Moment of inertia of a rig's load about the joint, kg·m².
fn inertia_kg_m2(rig: &Rig) -> f64 {
    let load = rig.joint.load.unwrap();
    load.mass_kg * load.arm_m * load.arm_m + load.inertia_kg_m2
}

#[test]
fn a_joint_of_a_mujoco_model_becomes_a_rig_and_every_statement_is_listed() {
    let folder = folder_with("arm26.xml");
    let folder = folder.path();
    let arguments =
        ["rig", "from-mujoco", "arm26.xml", "--joint", "elbow", "--base", "base.toml", "--out", "rig.toml"];
    let (status, output, errors) = bowden(folder, &arguments);
    assert_eq!((status, errors.as_str()), (0, ""));
    // As docs/neighbours.md shows it.
    for line in [
        "line 61: 2.103820 kg hang on joint `elbow` -> load.mass_kg = 0.000000, load.arm_m = 0.000000, \
         load.inertia_kg_m2 = 0.184657306",
        "line 61: damping = 0.1 -> load.viscous_nm_s_per_rad = 0.1",
        "line 61: range = 0 120: not mapped, a limit of MuJoCo is a constraint; end_stop_contact needs the stiffness of \
         a stop",
        "line 103: tendon spatial `BE`: not mapped, its path is no pair of Bowden cables; state [pulleys], [tendon] and \
         [sheath] in the base rig",
    ] {
        assert!(output.lines().any(|said| said == line), "{line}\n{output}");
    }
    assert!(output.ends_with("rig.toml: base.toml with the load of elbow\n"), "{output}");
    let (rig, base) = (Rig::load(&folder.join("rig.toml")).unwrap(), Rig::parse(BENCH, "base.toml").unwrap());
    assert!((inertia_kg_m2(&rig) - 0.184_657_306).abs() < 1e-9, "{}", inertia_kg_m2(&rig));
    assert_eq!(rig.joint.load.unwrap().viscous_nm_s_per_rad, 0.1);
    assert_eq!(rig.joint.tendon, base.joint.tendon);

    let wrong =
        ["rig", "from-mujoco", "arm26.xml", "--joint", "wrist", "--base", "base.toml", "--out", "none.toml"];
    let (status, output, errors) = bowden(folder, &wrong);
    assert_eq!((status, output.as_str(), errors.lines().count()), (2, "", 1), "{errors}");
    assert!(errors.contains("arm26.xml:") && errors.contains("no joint `wrist`"), "{errors}");
    assert!(!folder.join("none.toml").exists());
}

#[test]
fn a_joint_of_a_urdf_becomes_a_rig_and_every_statement_is_listed() {
    let folder = folder_with("double_pendulum.urdf");
    let folder = folder.path();
    let model = "double_pendulum.urdf";
    let arguments =
        ["rig", "from-urdf", model, "--joint", "joint1", "--base", "base.toml", "--out", "rig.toml"];
    let (status, output, errors) = bowden(folder, &arguments);
    assert_eq!((status, errors.as_str()), (0, ""));
    for start in ["line 104: damping = 0.05 -> load.viscous_nm_s_per_rad = 0.05", "line 99: limit lower = 0"]
    {
        assert!(output.lines().any(|said| said.starts_with(start)), "{start}\n{output}");
    }
    assert!(output.ends_with("rig.toml: base.toml with the load of joint1\n"), "{output}");
    let load = Rig::load(&folder.join("rig.toml")).unwrap().joint.load.unwrap();
    // Both links.
    assert!((load.mass_kg - (0.26703 + 0.33238)).abs() < 1e-9, "{}", load.mass_kg);
    assert_eq!(load.viscous_nm_s_per_rad, 0.05);

    let wrong =
        ["rig", "from-mujoco", model, "--joint", "joint1", "--base", "base.toml", "--out", "none.toml"];
    let (status, _, errors) = bowden(folder, &wrong);
    assert_eq!(status, 2);
    assert!(errors.contains("got <robot>, expected <mujoco>"), "{errors}");
}

#[test]
fn a_diagnosed_rig_becomes_a_mujoco_model_and_its_play_is_listed_as_not_mapped() {
    let folder = folder_with("arm26.xml");
    let folder = folder.path();
    let play = "\n[simulation]\neffects = [\"joint_backlash\"]\n[effects.joint_backlash]\ngap_rad = 0.03\n";
    fs::write(folder.join("true.toml"), [BENCH, play].concat()).unwrap();
    let done = |arguments: &[&str]| {
        let (status, output, errors) = bowden(folder, arguments);
        assert_eq!((status, errors.as_str()), (0, ""), "{arguments:?}");
        output
    };
    done(&[
        "simulate",
        "--rig",
        "true.toml",
        "--out",
        "run.csv",
        "--seconds",
        "8",
        "--rate-hz",
        "250",
        "--seed",
        "3",
    ]);
    done(&["diagnose", "run.csv", "--rig", "base.toml", "--out", "found"]);
    let rig = Rig::load(&folder.join("found/rig.diagnosed.toml")).unwrap();
    let effects: Vec<&str> = rig.effects.iter().map(|effect| effect.descriptor().id).collect();
    // Where the sheaths are bent is fitted with every diagnosis.
    assert_eq!(effects, ["joint_backlash", "straight_ends"]);

    let output = done(&["export", "mujoco", "found/rig.diagnosed.toml", "--out", "bench.xml"]);
    let not_mapped = format!(
        "effects.joint_backlash.gap_rad = {}: not mapped, MuJoCo has no element for it",
        rig.effects[0].parameters[0]
    );
    assert!(output.lines().any(|line| line == not_mapped), "{not_mapped}\n{output}");
    assert!(output.contains("motor.inductance_h: not mapped, "), "{output}");
    assert!(output.ends_with("bench.xml: MuJoCo model of found/rig.diagnosed.toml\n"), "{output}");
    // The model says it too, for who gets nothing else.
    let model = fs::read_to_string(folder.join("bench.xml")).unwrap();
    assert!(model.contains(&not_mapped) && model.contains("<fixed name=\"cables\""), "{model}");
    // It reads back as the load of the rig.
    let back =
        ["rig", "from-mujoco", "bench.xml", "--joint", "joint", "--base", "base.toml", "--out", "back.toml"];
    done(&back);
    let back = Rig::load(&folder.join("back.toml")).unwrap();
    assert!((inertia_kg_m2(&back) / inertia_kg_m2(&rig) - 1.0).abs() < 1e-6);

    let into = ["--into", "arm26.xml", "--joint", "elbow", "--out", "arm.xml"];
    let output =
        done(&[["export", "mujoco", "found/rig.diagnosed.toml"].as_slice(), into.as_slice()].concat());
    assert!(output.lines().any(|line| line == not_mapped), "{output}");
    let [before, after] = ["arm26.xml", "arm.xml"].map(|name| fs::read_to_string(folder.join(name)).unwrap());
    let damping = rig.joint.load.unwrap().viscous_nm_s_per_rad;
    let joint = format!("<joint damping=\"{damping}\" frictionloss=\"0\" name=\"elbow\"/>");
    assert_eq!(after, before.replace("<joint name=\"elbow\"/>", &joint));

    let (status, _, errors) = bowden(folder, &["export", "mujoco", "none.toml", "--out", "none.xml"]);
    assert_eq!((status, errors.lines().count()), (2, 1), "{errors}");
    assert!(errors.contains("none.toml") && !folder.join("none.xml").exists(), "{errors}");
}
