//! Each correction once, set by `bowden params from-rig` with a rig file that states the true physics.

use std::env::temp_dir;
use std::f64::consts::PI;
use std::fs;
use std::process;

use bowden_link::message::Mode;
use bowden_on_board_tests::corrections::{Errors, cases};
use bowden_on_board_tests::trial::{Trial, angle_error, error_of, sine};
use bowden_on_board_tests::{Outcome, fail, image};
use virtual_bench::{Channel, EncoderEccentricity};

/// Whether the image and the control code alone come to the same error, within a part of it.
fn alike(errors: &Errors, part: f64) -> bool {
    (errors.on_image - errors.natively).abs() <= part * errors.natively
}

/// Runs each case after its correction on the image, before it natively; the correction takes off at least the part of the error that stands
/// beside its name. The image without a correction runs the same code whatever the joint conceals: the first case shows what it is worth
/// (`cargo xtask corrections` runs all of them).
fn gain(cases_and_parts: &[(&str, f64)]) -> Outcome {
    let elf = image::firmware()?;
    for (position, (name, least)) in cases_and_parts.iter().enumerate() {
        let Some(case) = cases::all().into_iter().find(|case| case.name == *name) else {
            return fail(format!("no case {name}"));
        };
        let case = case.brief();
        let folder =
            temp_dir().join(format!("bowden-corrections-{}-{}", process::id(), name.replace(' ', "-")));
        let stored = case.stored(&elf)?;
        let corrected = case.truly_corrected(&elf, &stored, &folder);
        // Nothing in it is needed any more.
        let _ = fs::remove_dir_all(&folder);
        let before = case.natively(&stored)?;
        if position == 0 {
            let on_image = case.errors(&elf, &stored)?;
            assert!(alike(&on_image, 0.06), "{name}: {on_image:?}");
        }
        let after = case.errors(&elf, &corrected?)?;
        println!("{name}: before {before:.5}, after {after:.5?}");
        assert!(alike(&after, 0.12), "{name}: {before:?}, {after:?}");
        assert!(after.on_image <= (1.0 - least) * before, "{name}: {before:?}, {after:?}");
    }
    Ok(())
}

#[test]
fn corrections_of_the_motor_gain_what_they_gain_without_a_board() -> Outcome {
    gain(&[
        ("motor_coulomb_friction", 0.6),
        ("motor_stribeck_friction", 0.5),
        ("gear_load_friction", 0.45),
        ("motor_cogging", 0.6),
    ])
}

#[test]
fn corrections_of_bridge_and_joint_gain_what_they_gain_without_a_board() -> Outcome {
    gain(&[
        ("drive_dead_zone", 0.6),
        ("joint_coulomb_friction", 0.45),
        ("joint_spring", 0.6),
        ("joint_backlash", 0.5),
    ])
}

#[test]
fn corrections_of_the_sheaths_gain_what_they_gain_without_a_board() -> Outcome {
    gain(&[
        ("transmission_backlash", 0.6),
        ("sheath_viscous_friction", 0.2),
        // Friction that falls within 4 mm/s makes the tendons stick and slip: nothing is gained, and little may be lost.
        ("sheath_stribeck_friction", -0.1),
        ("bending_friction", 0.3),
        // These two cost hardly anything here, 1.15 and 1.28 mrad where the joint without an effect has 1.15.
        ("asymmetric_friction", -0.05),
        ("wrap_angle_varies_with_pose", 0.0),
    ])
}

#[test]
fn corrections_of_the_sensors_gain_what_they_gain_without_a_board() -> Outcome {
    gain(&[
        ("encoder_eccentricity of the input pulley", 0.5),
        ("encoder_eccentricity of the joint", 0.45),
        ("sensor_gain_error of f2", 0.6),
        ("sensor_offset of f2", 0.6),
    ])
}

/// Control code alone. The compensator that learns the lag from both encoders is late at 0.5 Hz, 4.3 mrad with centred encoders. A disc
/// that is off by 30 mrad adds an error, which at one phase takes off part of that: its correction gives those 4.3 mrad back, and no more.
#[test]
fn a_corrected_joint_encoder_follows_as_a_centred_one_does() -> Outcome {
    let mut centred = Trial::new(Mode::Position, sine(0.3, 0.5), 4.0);
    centred.parameters.compensator.source = 2.0;
    let rms_rad = |trial: &Trial| -> Outcome<f64> { Ok(error_of(&trial.natively()?, angle_error).rms) };
    let without_rad = rms_rad(&centred)?;
    let mut changes = Vec::new();
    for phase_rad in [0.0, 1.0, PI] {
        let disc = EncoderEccentricity { channel: Channel::ThetaOut, amplitude_rad: 0.03, phase_rad };
        let mut trial = Trial { effects: vec![disc.into()], ..centred.clone() };
        let with_rad = rms_rad(&trial)?;
        let own = &mut trial.parameters.correction.joint_encoder;
        (own.enable, own.amplitude, own.phase) = (1.0, 0.03, phase_rad as f32);
        let corrected_rad = rms_rad(&trial)?;
        println!(
            "{phase_rad:.1}: {without_rad:.5} without, {with_rad:.5} with, {corrected_rad:.5} corrected"
        );
        // What the correction leaves is 2 A² at most, 1.8 mrad, and here a tenth of it.
        assert!((corrected_rad - without_rad).abs() < 0.2e-3, "{phase_rad}: {corrected_rad}, {without_rad}");
        changes.push(with_rad - without_rad);
    }
    assert!(changes[1] < -0.5e-3 && changes[2] > 3e-3, "{changes:?}");
    Ok(())
}
