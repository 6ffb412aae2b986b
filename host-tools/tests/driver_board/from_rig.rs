//! Board parameters from a rig file: values by hand, all or nothing, and what the board cannot use.

use std::fs;
use std::time::Duration;

use bowden_core::outcome::FailureClass;
use bowden_core::rig::Rig;
use bowden_host_link::from_rig::{Transfer, Unused};
use bowden_host_link::sim::SimTransport;
use bowden_host_link::{Client, ParameterSet};
use bowden_link::ToBoard;
use tempfile::TempDir;

use crate::bowden;
use crate::fake::Fake;
use crate::mishaps::Mishaps;
use crate::wires::connect;

/// The bench as both boards have it by default, but for the resistance and what `more` says of effects.
pub fn rig(effects: &str, more: &str) -> String {
    format!(
        "schema = \"bowden-rig/1\"\nname = \"bench\"\n\
         [motor]\nsupply_v = 24.0\nresistance_ohm = 2.5\ninductance_h = 0.0008\ntorque_constant_nm_per_a = 0.03\n\
         gear_ratio = 30.0\nrotor_inertia_kg_m2 = 5.0e-6\nviscous_nm_s_per_rad = 0.02\n\
         [pulleys]\ninput_radius_m = 0.015\noutput_radius_m = 0.015\n\
         [tendon]\nlength_m = 1.0\naxial_stiffness_n = 72900.0\npretension_n = 30.0\n\
         [sheath]\nwrap_angle_rad = 3.141592653589793\nfriction_coefficient = 0.12\n\
         [simulation]\neffects = [{effects}]\n{more}"
    )
}

fn transfer(text: &str, recorded: &[(u16, f32)]) -> (Transfer, ParameterSet) {
    let (client, _) = connect(Fake::new(Mishaps::default()));
    let parameters = ParameterSet::read(&mut client.unwrap()).unwrap();
    let rig = Rig::parse(text, "rig.toml").unwrap();
    (Transfer::new(&rig, "rig.toml", &parameters, recorded).unwrap(), parameters)
}

/// Name and new value of every change, but for the resistance.
fn changes(text: &str) -> Vec<(String, f32)> {
    let (transfer, _) = transfer(text, &[]);
    let others = transfer.changes.into_iter().filter(|change| change.name != "motor.resistance");
    others.map(|change| (change.name, change.new)).collect()
}

fn folder_with(name: &str, text: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(name), text).unwrap();
    folder
}

#[test]
fn a_dry_run_shows_the_table_and_sets_nothing() {
    let text = rig(
        "\"motor_viscous_friction\", \"sensor_lag\"",
        "[effects.motor_viscous_friction]\nviscous_nm_s_per_rad = 0.01\n\
         [effects.sensor_lag]\nchannel = \"f1_n\"\ntime_constant_s = 0.02\n",
    );
    let folder = folder_with("rig.toml", &text);
    let arguments = ["params", "from-rig", "rig.toml", "--port", "sim", "--dry-run"];
    let (status, stdout, stderr) = bowden(folder.path(), &arguments);
    assert_eq!((status, stderr.as_str()), (0, ""));
    assert_eq!(
        stdout,
        "parameter         old   new   unit       from\n\
         motor.resistance  2.0   2.5   Ω          motor.resistance_ohm\n\
         motor.viscous     0.02  0.03  N·m·s/rad  motor.viscous_nm_s_per_rad, effects.motor_viscous_friction\n\
         not used: motor.supply_v: the board measures its supply\n\
         not used: motor.inductance_h: the board's current limit neglects the inductance\n\
         not used: effects.sensor_lag of f1_n: the board does not undo the lag of a sensor\n\
         2 parameters would be set\n"
    );
    let (status, stdout, _) = bowden(folder.path(), &["params", "--port", "sim", "from-rig", "rig.toml"]);
    assert_eq!(status, 0);
    let last = stdout.lines().last().unwrap();
    assert_eq!(last, "2 parameters set until the board is switched off; `store` keeps them");
}

/// Fault 25 needs more than 2.5 R 0.4067 A, 0.1 of the bus and 0.14 V of an encoder's count, at 30 V 3.14 V and 1.02 V/Ω; R times the
/// limit of the current is what it gets.
#[test]
fn parameters_that_hide_an_open_lead_are_warned_of_in_one_line() {
    let warning = |reached: &str, needed: &str| {
        format!(
            "bowden: warning: an open motor lead can go unnoticed: motor.resistance times limits.current gives {reached} V at a bus \
             of 30 V, fault 25 needs more than {needed} V; raise limits.current, or lower supervisor.rest_current or \
             correction.dead_zone.limit\n"
        )
    };
    let folder =
        folder_with("rig.toml", &rig("", "").replace("resistance_ohm = 2.5", "resistance_ohm = 1.0"));
    let file = "schema = \"bowden-parameters/1\"\nmotor.resistance = 1.5\n";
    fs::write(folder.path().join("p.toml"), file).unwrap();
    for (arguments, stderr) in [
        (["set", "limits.current=2.0"].as_slice(), warning("4.0", "5.2")),
        (&["set", "limits.current=2.8"], String::new()),
        (
            &["set", "limits.current=2.0", "supervisor.rest_current=0.05", "correction.dead_zone.limit=0.05"],
            String::new(),
        ),
        (&["load", "p.toml"], warning("4.5", "4.7")),
        (&["from-rig", "rig.toml", "--dry-run"], warning("3.0", "4.2")),
        (&["from-rig", "rig.toml"], warning("3.0", "4.2")),
        (&["from-rig", "rig.toml", "--json"], warning("3.0", "4.2")),
        (&["store"], String::new()),
    ] {
        let all = [&["params", "--port", "sim"], arguments].concat();
        let (status, _, told) = bowden(folder.path(), &all);
        assert_eq!((status, told), (0, stderr), "{arguments:?}");
    }
}

#[test]
fn a_rig_that_agrees_with_the_board_changes_nothing() {
    // Within the precision of the parameter, an encoder's count and a step of the converter's zero.
    let text =
        rig("\"sensor_offset\"", "[effects.sensor_offset]\nchannel = \"theta_in_rad\"\noffset = 7e-4\n")
            .replace("resistance_ohm = 2.5", "resistance_ohm = 2.0000001");
    let folder = folder_with("rig.toml", &text);
    let (status, stdout, stderr) =
        bowden(folder.path(), &["params", "--port", "sim", "from-rig", "rig.toml"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    assert!(stdout.starts_with("no parameter changes\nnot used: motor.supply_v"), "{stdout}");
    assert!(stdout.ends_with("0 parameters set until the board is switched off; `store` keeps them\n"));
}

#[test]
fn sensors_are_corrected_by_gain_and_zero() {
    // f2 of the fake shows 0.03 (c - 600). It shows 1.25 x + 1.2: x = 0.024 (c - 640).
    let gain = "[effects.sensor_gain_error]\nchannel = \"f2_n\"\ngain = 1.25\n";
    let offset = "[effects.sensor_offset]\nchannel = \"f2_n\"\noffset = 1.2\n";
    let tables = format!("{gain}{offset}");
    let corrected =
        |zero: f32| vec![("tension.f2.zero".to_owned(), zero), ("tension.f2.gain".to_owned(), 0.024)];
    assert_eq!(changes(&rig("\"sensor_gain_error\", \"sensor_offset\"", &tables)), corrected(640.0));
    // The other way round it shows 1.25 (x + 1.2): x = 0.024 (c - 650).
    assert_eq!(changes(&rig("\"sensor_offset\", \"sensor_gain_error\"", &tables)), corrected(650.0));
    // The joint's encoder of the fake shows -(c - 2000) 2π/4096; 0.1 rad are 65.19 counts: zero 1934.81. The input's
    // shows (c - 1000) 2π/4096; -1.6 rad are -1043.03 counts: -43.03, a turn further 4052.97.
    let turned = "[[effects.sensor_offset]]\nchannel = \"theta_out_rad\"\noffset = 0.1\n\
                  [[effects.sensor_offset]]\nchannel = \"theta_in_rad\"\noffset = -1.6\n";
    let expected = [("encoder.input.zero", 4053.0), ("encoder.joint.zero", 1935.0)];
    assert_eq!(
        changes(&rig("\"sensor_offset\"", turned)),
        expected.map(|(name, value)| (name.to_owned(), value))
    );
    // 0.067155 A are ten codes.
    let current = "[effects.sensor_offset]\nchannel = \"i_motor_a\"\noffset = 0.067155\n";
    let expected = [("bridge.current_zero".to_owned(), 2057.5)];
    assert_eq!(changes(&rig("\"sensor_offset\"", current)), expected);
    let all = "[effects.sensor_gain_error]\nchannel = \"tensions\"\ngain = 2.0\n";
    let names: Vec<String> =
        changes(&rig("\"sensor_gain_error\"", all)).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["tension.f1.gain", "tension.f2.gain", "tension.f3.gain", "tension.f4.gain"]);
}

#[test]
fn errors_of_sensors_are_relative_to_the_parameters_of_the_recording() {
    let text = rig("\"sensor_gain_error\"", "[effects.sensor_gain_error]\nchannel = \"f2_n\"\ngain = 1.25\n");
    let (_, parameters) = transfer(&text, &[]);
    let gain = parameters.find("tension.f2.gain").unwrap().index;
    // Recorded with 0.0375 N a code, the board has 0.03 by now, which is right.
    let (transfer, _) = transfer(&text, &[(gain, 0.0375)]);
    assert!(transfer.changes.iter().all(|change| change.index != gain), "{transfer:?}");
}

#[test]
fn what_the_board_cannot_use_is_said_with_the_reason() {
    let text = rig(
        "\"sensor_gain_error\", \"winding_heating\", \"motor_viscous_friction\"",
        "[[effects.sensor_gain_error]]\nchannel = \"theta_in_rad\"\ngain = 1.1\n\
         [[effects.sensor_gain_error]]\nchannel = \"torque_in_nm\"\ngain = 1.1\n\
         [load]\nmass_kg = 2.5\narm_m = 0.03\ninertia_kg_m2 = 0.0\nviscous_nm_s_per_rad = 0.004\n",
    );
    let without_motor = {
        let (start, end) = (text.find("[motor]").unwrap(), text.find("[pulleys]").unwrap());
        text[..start].to_owned() + &text[end..]
    };
    let (transfer, _) = transfer(&without_motor, &[]);
    let expected = [
        ("load.mass_kg", "this firmware has no parameter `load.mass`"),
        ("load.arm_m", "this firmware has no parameter `load.arm`"),
        ("load.inertia_kg_m2", "this firmware has no parameter `load.inertia`"),
        ("load.viscous_nm_s_per_rad", "the board does not feed viscous friction of the joint forward"),
        ("effects.sensor_gain_error of theta_in_rad", "the gain of an encoder is fixed"),
        ("effects.sensor_gain_error of torque_in_nm", "the board computes this torque from the tensions"),
        ("effects.winding_heating", "the board has no model of the winding's temperature"),
        ("effects.motor_viscous_friction", "the rig has no [motor] whose viscous friction it adds to"),
    ];
    let expected =
        expected.map(|(source, reason)| Unused { source: source.to_owned(), reason: reason.to_owned() });
    assert_eq!(transfer.unused, expected);
    assert_eq!(transfer.changes, []);
}

/// What another explanation would make wrong does not reach the board.
#[test]
fn the_board_keeps_what_the_recordings_did_not_settle() {
    let settled = rig("", "").replace("output_radius_m = 0.015", "output_radius_m = 0.0146");
    assert_eq!(changes(&settled), [("pulley.output_radius".to_owned(), 0.0146)]);
    let undecided = "[[undecided]]\nparameter = \"pulleys.output_radius_m\"\nbefore = 0.015\n\
                     effect = \"encoder_eccentricity\"\nchannel = \"theta_out_rad\"\n";
    let text = settled + undecided;
    assert_eq!(changes(&text), []);
    let (transfer, _) = transfer(&text, &[]);
    let unused = transfer.unused.iter().find(|unused| unused.source == "pulleys.output_radius_m").unwrap();
    assert!(unused.reason.contains("encoder_eccentricity (theta_out_rad)"), "{}", unused.reason);
}

#[test]
fn effects_become_corrections_of_the_board() {
    let text = rig(
        "\"motor_coulomb_friction\", \"motor_stribeck_friction\", \"motor_cogging\", \"sheath_stribeck_friction\", \
         \"bending_friction\", \"encoder_eccentricity\", \"gear_load_friction\"",
        "[effects.motor_coulomb_friction]\ntorque_nm = 0.25\n\
         [effects.motor_stribeck_friction]\nexcess_nm = 0.4\nspeed_rad_s = 0.5\ncoulomb_nm = 0.125\n\
         [effects.motor_cogging]\namplitude_nm = 0.0625\ncycles_per_turn = 14.0\nphase_rad = -1.5\n\
         [effects.sheath_stribeck_friction]\nstatic_ratio = 1.5\nspeed_m_s = 0.25\nexponent = 2.0\n\
         [effects.bending_friction]\nfriction_n_per_rad = 0.75\n\
         [effects.gear_load_friction]\ncoefficient = 0.1\nexponent = 2.0\n\
         [[effects.encoder_eccentricity]]\nchannel = \"theta_in_rad\"\namplitude_rad = 0.0625\nphase_rad = 2.0\n\
         [[effects.encoder_eccentricity]]\nchannel = \"theta_motor_rad\"\namplitude_rad = 0.01\n",
    );
    let folder = folder_with("rig.toml", &text);
    let arguments = ["params", "from-rig", "rig.toml", "--port", "sim", "--dry-run"];
    let (status, stdout, stderr) = bowden(folder.path(), &arguments);
    assert_eq!((status, stderr.as_str()), (0, ""));
    let words: Vec<Vec<&str>> =
        stdout.lines().map(|line| line.split_whitespace().take(3).collect()).collect();
    // The friction at speed of both effects is added: 0.25 + 0.125.
    for (name, old, new) in [
        ("correction.motor_friction.enable", "0.0", "1.0"),
        ("correction.motor_friction.coulomb", "0.0", "0.375"),
        ("correction.motor_friction.excess", "0.0", "0.4"),
        ("correction.motor_friction.speed", "0.2", "0.5"),
        ("correction.cogging.enable", "0.0", "1.0"),
        ("correction.cogging.amplitude_1", "0.0", "0.0625"),
        ("correction.cogging.periods_1", "40.0", "14.0"),
        ("correction.cogging.phase_1", "0.0", "-1.5"),
        ("correction.sheath.enable", "0.0", "1.0"),
        ("correction.sheath.excess", "0.0", "0.5"),
        ("correction.sheath.speed", "0.003", "0.25"),
        ("correction.sheath.exponent", "1.5", "2.0"),
        ("correction.sheath.bending", "0.0", "0.75"),
        ("correction.input_encoder.enable", "0.0", "1.0"),
        ("correction.input_encoder.amplitude", "0.0", "0.0625"),
        ("correction.input_encoder.phase", "0.0", "2.0"),
    ] {
        assert!(words.contains(&vec![name, old, new]), "{name}: {stdout}");
    }
    assert!(stdout.ends_with(
        "not used: effects.encoder_eccentricity of theta_motor_rad: the board has no encoder on the rotor\n\
         not used: effects.gear_load_friction: the board knows friction in proportion to the torque only, the exponent is 2\n\
         limited: correction.motor_friction.limit: 0.5 of 0.6750 act; raise it if the joint may have more\n\
         limited: correction.input_encoder.limit: 0.05 of 0.0625 act; raise it if the joint may have more\n\
         limited: sheath.adapts: while it is 1 the board follows all friction of the sheaths as mu K, and correction.sheath does not \
         act; where the sheaths do not move, params set sheath.adapts=0.0 lets it act\n\
         17 parameters would be set\n"
    ), "{stdout}");
    // The fake has no corrections.
    let (transfer, _) = transfer(&rig("\"joint_spring\"", ""), &[]);
    let reason = "this firmware has no parameter `correction.joint_spring.enable`".to_owned();
    assert_eq!(transfer.unused.last(), Some(&Unused { source: "effects.joint_spring".to_owned(), reason }));
}

#[test]
fn friction_of_sheaths_is_limited_only_where_the_board_follows_it_by_itself() {
    let limited = |effects: &str, adapts: f32| {
        let mut client =
            Client::connect(Box::new(SimTransport::new()), "sim", Duration::from_secs(1)).unwrap();
        let parameters = ParameterSet::read(&mut client).unwrap();
        let index = parameters.find("sheath.adapts").unwrap().index;
        let parameters = parameters.with(&[(index, adapts)]);
        let rig = Rig::parse(&rig(effects, ""), "rig.toml").unwrap();
        let transfer = Transfer::new(&rig, "rig.toml", &parameters, &[]).unwrap();
        transfer.limited.into_iter().map(|limit| limit.source).collect::<Vec<_>>()
    };
    assert_eq!(limited("\"sheath_viscous_friction\"", 1.0), ["sheath.adapts"]);
    assert_eq!(limited("\"sheath_viscous_friction\"", 0.0), [""; 0]);
    assert_eq!(limited("\"motor_cogging\"", 1.0), [""; 0]);
}

#[test]
fn a_refusal_leaves_the_board_as_it_was() {
    let text = rig("", "").replace("gear_ratio = 30.0", "gear_ratio = 29.0");
    let text = text.replace("pretension_n = 30.0", "pretension_n = 28.0");
    let (transfer, _) = transfer(&text, &[]);
    let names: Vec<&str> = transfer.changes.iter().map(|change| change.name.as_str()).collect();
    assert_eq!(names, ["motor.resistance", "motor.gear_ratio", "tendon.pretension"]);
    // Half of the answers are lost on the way as well.
    for lose_answers in [None, Some(2)] {
        let fixed_parameter = Some("tendon.pretension");
        let (client, fake) =
            connect(Fake::new(Mishaps { lose_answers, fixed_parameter, ..Mishaps::default() }));
        let mut client = client.unwrap();
        let parameters = ParameterSet::read(&mut client).unwrap();
        let failure = parameters.replace(&mut client, &transfer.values()).unwrap_err();
        assert_eq!(failure.class(), FailureClass::Failed);
        assert_eq!(
            failure.message(),
            "tendon.pretension: the board refused 28.0: this changes with the bridge off only; stop first; \
             nothing was changed"
        );
        assert_eq!(ParameterSet::read(&mut client).unwrap(), parameters);
        assert!(fake.borrow().count(|message| matches!(message, ToBoard::WriteParameter { .. })) >= 4);
        fake.borrow_mut().mishaps.fixed_parameter = None;
        parameters.replace(&mut client, &transfer.values()).unwrap();
        let fake = fake.borrow();
        let values =
            ["motor.resistance", "motor.gear_ratio", "tendon.pretension"].map(|name| fake.value(name));
        assert_eq!(values, [2.5, 29.0, 28.0]);
    }
}

#[test]
fn unusable_input_is_refused_in_one_line() {
    let folder =
        folder_with("rig.toml", &rig("", "").replace("resistance_ohm = 2.5", "resistance_ohm = 250.0"));
    fs::write(folder.path().join("other.toml"), "schema = \"bowden-parameters/1\"\n").unwrap();
    for (arguments, expected) in [
        (["from-rig", "none.toml"].as_slice(), "none.toml: cannot be read: no such file or directory"),
        (
            &["from-rig", "other.toml"],
            "other.toml:1:10: schema: got `bowden-parameters/1`, expected `bowden-rig/1`",
        ),
        (
            &["from-rig", "rig.toml", "--dry-run"],
            "rig.toml: motor.resistance_ohm: motor.resistance: got 250.0, allowed 0.05 to 100.0 Ω; check value and unit",
        ),
        (
            &["from-rig", "rig.toml", "--recorded-with", "rig.toml"],
            "rig.toml:1:10: schema: got \"bowden-rig/1\", expected",
        ),
    ] {
        let (status, stdout, stderr) =
            bowden(folder.path(), &[&["params", "--port", "sim"], arguments].concat());
        assert_eq!((status, stdout.as_str(), stderr.lines().count()), (2, "", 1), "{stderr}");
        assert!(stderr.starts_with(&format!("bowden: {expected}")), "{stderr}");
    }
    let (status, _, stderr) = bowden(folder.path(), &["params", "from-rig", "rig.toml"]);
    assert_eq!((status, stderr.lines().count()), (2, 1), "{stderr}");
    assert!(stderr.contains("was not provided: port;"), "{stderr}");
}
