//! Laws in a rig file: what is written reads back, and what cannot be run is refused with its place.

use bowden_core::rig::{Rig, RigDocument};
use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Effect, Target};
use bowden_model::law::LAWS;

const RIG: &str = r#"schema = "bowden-rig/1"

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
formula = "amplitude_nm*abs(omega_out_rad_s)^exponent"
coefficients = { amplitude_nm = 0.083, exponent = 2 }
units = { amplitude_nm = "N·m", exponent = "1" }
"#;

#[test]
fn a_law_is_read_with_its_coefficients() {
    let rig = Rig::parse(&format!("{RIG}{LAW}"), "rig.toml").unwrap();
    let [law] = &rig.effects[..] else { panic!("{:?}", rig.effects) };
    assert_eq!(law.descriptor().id, "law_joint_friction_by_speed");
    assert_eq!((law.parameters[0], law.parameters[1], law.target), (0.083, 2.0, Target::None));
}

#[test]
fn every_law_reads_back_as_it_was_written() {
    for law in &LAWS {
        let mut active = ActiveEffect::with_defaults(law);
        active.parameters[0] = 0.123;
        if let [.., last] = law.descriptor().channels {
            active.target = Target::One(*last);
        }
        let mut document = RigDocument::parse(RIG, "rig.toml").unwrap();
        document.add_effect(&active).unwrap();
        assert_eq!(document.rig().unwrap().effects, [active], "{document}");
        // Fitted again, it takes its own place.
        active.parameters[0] = 0.1;
        document.add_effect(&active).unwrap();
        assert_eq!(document.rig().unwrap().effects, [active], "{document}");
        document.clear_effects();
        assert_eq!(document.rig().unwrap().effects, []);
    }
}

/// Files of before a bump's edges had a steepness state 2 in its formula; fitted again, they state the coefficient.
#[test]
fn a_round_bump_may_state_its_steepness_in_the_formula() {
    let law = r#"
[[law]]
component = "joint"
port = "joint_friction_nm"
variables = ["theta_out_rad"]
formula = "amplitude_nm * exp(-((theta_out_rad - at_rad) / width_rad)^2)"
coefficients = { amplitude_nm = 0.1, at_rad = 0.3, width_rad = 0.2 }
"#;
    let mut document = RigDocument::parse(&format!("{RIG}{law}"), "rig.toml").unwrap();
    let [mut bump] = document.rig().unwrap().effects[..] else { panic!("{document}") };
    assert_eq!(bump.descriptor().id, "law_joint_friction_at_a_place");
    assert_eq!(bump.parameters[..4], [0.1, 0.3, 0.2, 2.0]);
    bump.parameters[3] = 4.0;
    document.add_effect(&bump).unwrap();
    assert_eq!(document.rig().unwrap().effects, [bump], "{document}");
    let twice = law.replace("0.2 }", "0.2, steepness = 4 }");
    let error = Rig::parse(&format!("{RIG}{twice}"), "rig.toml").unwrap_err();
    assert!(error.message().contains("unknown coefficient `steepness`"), "{}", error.message());
    let unstated = law.replace("-((", "-abs((").replace("^2", "^steepness");
    let error = Rig::parse(&format!("{RIG}{unstated}"), "rig.toml").unwrap_err();
    assert!(error.message().contains("[law.coefficients] lacks `steepness`"), "{}", error.message());
}

#[test]
fn one_law_may_act_on_two_sensors() {
    let law = LAWS.iter().find(|law| law.descriptor().id == "law_reading_sets_in").unwrap();
    let on = |channel| ActiveEffect { target: Target::One(channel), ..ActiveEffect::with_defaults(law) };
    let mut document = RigDocument::parse(RIG, "rig.toml").unwrap();
    let both = [on(Channel::F1), on(Channel::F3)];
    for active in &both {
        document.add_effect(active).unwrap();
    }
    assert_eq!(document.rig().unwrap().effects, both);
}

#[test]
fn what_cannot_be_run_is_refused_with_its_place() {
    for (from, to, want) in [
        (
            "joint_friction_nm",
            "joint_frictoin_nm",
            "rig.toml:14:8: unknown port `joint_frictoin_nm`; did you mean `joint_friction_nm`?",
        ),
        (
            "^exponent",
            "^2",
            "rig.toml:16:11: no formula `amplitude_nm*abs(omega_out_rad_s)^2` at port joint_friction_nm; expected one of `amplitude_nm * abs(omega_out_rad_s)^exponent`",
        ),
        (
            "\"joint\"",
            "\"motor\"",
            "rig.toml:13:13: component: got `motor`, port joint_friction_nm belongs to `joint`; correct one of them",
        ),
        (
            "[\"omega_out_rad_s\"]",
            "[\"t_s\"]",
            "rig.toml:15:14: variables: the formula depends on `omega_out_rad_s` alone; write that",
        ),
        (
            "exponent = 2 ",
            "exponent = 20 ",
            "rig.toml:17:51: law.coefficients.exponent: got 20, allowed 0.2 to 5; check value and unit",
        ),
        (", exponent = 2 ", " ", "rig.toml:17:16: [law.coefficients] lacks `exponent` (exponent, 1); add it"),
        (
            "\"N·m\"",
            "\"N·mm\"",
            "rig.toml:18:26: amplitude_nm: got the unit `N·mm`, the formula has it in `N·m`; convert the value",
        ),
        (
            "units = {",
            "channel = \"f1_n\"\nunits = {",
            "rig.toml:18:11: port joint_friction_nm has no channel; drop it",
        ),
        (
            "units = {",
            "colour = 3\nunits = {",
            "rig.toml:18:1: unknown key `colour` in [law]; expected one of channel",
        ),
    ] {
        let text = format!("{RIG}{}", LAW.replace(from, to));
        let error = Rig::parse(&text, "rig.toml").unwrap_err();
        assert!(error.message().starts_with(want), "got  {}\nwant {want}", error.message());
    }
}
