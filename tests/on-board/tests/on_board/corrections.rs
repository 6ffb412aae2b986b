//! Each correction once, set by `bowden params from-rig` with a rig file that states the true physics.

use std::env::temp_dir;
use std::fs;
use std::process;

use bowden_on_board_tests::corrections::{Errors, cases};
use bowden_on_board_tests::{Outcome, fail, image};

/// Whether the image and the control code alone come to the same error, within a part of it.
fn alike(errors: &Errors, part: f64) -> bool {
    (errors.on_image - errors.natively).abs() <= part * errors.natively
}

/// Runs the case `name` before and after; the correction takes off at least the part `least` of the error.
fn gains(name: &str, least: f64) -> Outcome {
    let Some(case) = cases::all().into_iter().find(|case| case.name == name) else {
        return fail(format!("no case {name}"));
    };
    let case = case.brief();
    let elf = image::firmware()?;
    let folder = temp_dir().join(format!("bowden-corrections-{}-{}", process::id(), name.replace(' ', "-")));
    let stored = case.stored(&elf)?;
    let corrected = case.truly_corrected(&elf, &stored, &folder);
    // Nothing in it is needed any more.
    let _ = fs::remove_dir_all(&folder);
    let before = case.errors(&elf, &stored)?;
    let after = case.errors(&elf, &corrected?)?;
    println!("{name}: before {before:.5?}, after {after:.5?}");
    assert!(alike(&before, 0.15) && alike(&after, 0.25), "{name}: {before:?}, {after:?}");
    assert!(after.on_image <= (1.0 - least) * before.on_image, "{name}: {before:?}, {after:?}");
    Ok(())
}

#[test]
fn corrections_of_the_motor_gain_what_they_gain_without_a_board() -> Outcome {
    gains("motor_coulomb_friction", 0.6)?;
    gains("motor_stribeck_friction", 0.5)?;
    gains("gear_load_friction", 0.45)?;
    gains("motor_cogging", 0.6)
}

#[test]
fn corrections_of_bridge_and_joint_gain_what_they_gain_without_a_board() -> Outcome {
    gains("drive_dead_zone", 0.6)?;
    gains("joint_coulomb_friction", 0.45)?;
    gains("joint_spring", 0.6)?;
    gains("joint_backlash", 0.5)
}

#[test]
fn corrections_of_the_sheaths_gain_what_they_gain_without_a_board() -> Outcome {
    gains("transmission_backlash", 0.6)?;
    gains("sheath_viscous_friction", 0.2)?;
    // Friction that falls within 4 mm/s makes the tendons stick and slip: nothing is gained, and little may be lost.
    gains("sheath_stribeck_friction", -0.1)?;
    gains("bending_friction", 0.3)?;
    // These two cost hardly anything here, 1.15 and 1.28 mrad where the joint without an effect has 1.15.
    gains("asymmetric_friction", -0.05)?;
    gains("wrap_angle_varies_with_pose", 0.0)
}

#[test]
fn corrections_of_the_sensors_gain_what_they_gain_without_a_board() -> Outcome {
    gains("encoder_eccentricity of the input pulley", 0.5)?;
    gains("encoder_eccentricity of the joint", 0.45)?;
    gains("sensor_gain_error of f2", 0.6)?;
    gains("sensor_offset of f2", 0.6)
}
