//! `bowden effect new`: a law of a diagnosis becomes a file of the catalogue.
//!
//! The file that stands in `generated/` is what the command wrote. It is compiled here as `model` would compile it, and its own test
//! runs with these.

mod common;

/// The modules of `bowden-model` under the paths by which a file of the catalogue has them.
mod effect {
    pub use bowden_model::effect::*;
}
mod law {
    pub use bowden_model::law::*;
}
#[path = "generated/joint_oil_drag.rs"]
mod joint_oil_drag;

use std::fs;

use bowden_model::effect::{Effect, JointPort, MAX_STATE};
use common::bowden;

const BENCH: &str = r#"schema = "bowden-rig/1"

[pulleys]
input_radius_m = 0.015
output_radius_m = 0.016

[tendon]
length_m = 1
axial_stiffness_n = 72_900
pretension_n = 30
"#;

const LAW: &str = r#"
[[law]]
component = "joint"
port = "joint_friction_nm"
variables = ["omega_out_rad_s"]
formula = "amplitude_nm * abs(omega_out_rad_s)^exponent"
coefficients = { amplitude_nm = 0.083, exponent = 2.05 }
"#;

#[test]
fn the_file_is_the_one_that_is_compiled_here() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("rig.diagnosed.toml"), [BENCH, LAW].concat()).unwrap();
    let (status, said, error) = bowden(
        folder.path(),
        &["effect", "new", "--id", "joint_oil_drag", "--from", ".", "--out", "joint_oil_drag.rs"],
    );
    assert_eq!((status, error.as_str()), (0, ""));
    for line in ["mod joint_oil_drag;", "use joint_oil_drag::JOINT_OIL_DRAG;", "&JOINT_OIL_DRAG,"] {
        assert!(said.contains(line), "{said}");
    }
    let kept = include_str!("generated/joint_oil_drag.rs");
    assert_eq!(fs::read_to_string(folder.path().join("joint_oil_drag.rs")).unwrap(), kept);
}

/// At 0.5 rad/s the oil takes 0.083 * 0.5^2.05 = 0.02004 N·m, against the motion.
#[test]
fn the_effect_does_what_the_law_did() {
    let oil = &joint_oil_drag::JOINT_OIL_DRAG;
    let descriptor = oil.descriptor();
    assert_eq!((descriptor.id, oil.on_request()), ("joint_oil_drag", true));
    let mut port = JointPort {
        t_s: 0.0,
        dt_s: 1e-3,
        theta_rad: 0.1,
        omega_rad_s: -0.5,
        mass_kg: 1.0,
        torque_nm: 0.0,
        coulomb_nm: 0.0,
        presliding_rad: 5e-4,
        build_up: bowden_model::dry_friction::BuildUp::Linear,
        play_rad: 0.0,
    };
    oil.joint(&descriptor.defaults(), &mut [0.0; MAX_STATE], &mut port);
    assert!((port.coulomb_nm - 0.020_043).abs() < 1e-6 && port.torque_nm == 0.0, "{port:?}");
}

#[test]
fn what_cannot_be_made_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let rig = folder.path().join("rig.diagnosed.toml");
    for (law, arguments, want) in [
        (LAW, &["--id", "Oil"][..], "--id Oil: not a name for an effect"),
        (LAW, &["--id", "joint_spring"], "--id joint_spring: there is one with this name"),
        (LAW, &["--id", "oil", "--law", "2"], "law 2 is asked for, the file holds 1; give --law 1 to 1"),
        ("", &["--id", "oil"], "law 1 is asked for, the file holds no law"),
    ] {
        fs::write(&rig, [BENCH, law].concat()).unwrap();
        let (status, _, said) =
            bowden(folder.path(), &[&["effect", "new", "--from", "."], arguments].concat());
        assert!(status == 2 && said.contains(want) && said.lines().count() == 1, "{status}: {said}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is written");
    }
}
