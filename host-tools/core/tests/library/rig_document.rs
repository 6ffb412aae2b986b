//! A rig file that is changed keeps its comments, and what is written reads back as the rig that was meant.

use bowden_core::outcome::FailureClass;
use bowden_core::rig::{ProportionalLaw, Rig, RigDocument, RigParameter};
use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Target};
use bowden_model::effects::{CATALOGUE, find};
use bowden_model::friction_law::FrictionLaw;
use bowden_model::parameters::NOMINAL_PARAMETERS;

const RIG: &str = r#"# Bench 3, second floor
schema = "bowden-rig/1"
name = "bench 3"

[motor]
supply_v = 24        # measured at the terminals
resistance_ohm = 2.0
inductance_h = 8e-4
torque_constant_nm_per_a = 0.03
gear_ratio = 30.0
rotor_inertia_kg_m2 = 5.0e-6
viscous_nm_s_per_rad = 0.02

[pulleys]
input_radius_m = 0.015
output_radius_m = 0.016

[tendon]
length_m = 1
axial_stiffness_n = 72_900
pretension_n = 30

[sheath]
wrap_angle_rad = 2.5
friction_coefficient = 0.12   # from the data sheet, odd spacing  kept

[load]
mass_kg = 2.5
arm_m = 0.03
inertia_kg_m2 = 0.0
viscous_nm_s_per_rad = 0.004

[simulation]
friction = "lumped"
effects = [] # none so far
elements = 24
step_s = 2.5e-4

[controller]
kind = "proportional"
gain_duty_per_rad = 8
duty_limit = 0.9
delay_s = 2e-3

[recording.columns]
t_s = { column = "time_ms", scale = 1e-3 }
theta_in_rad = { column = "deg", scale = 0.017453292519943295, offset = -0.5 }

[replay]
inputs = ["theta_ref_rad", "bus_v"]
outputs = ["f1_n", "theta_out_rad"]
"#;

fn document() -> RigDocument {
    RigDocument::parse(RIG, "rig.toml").unwrap()
}

fn with(id: &str, name: &str, value: f64, target: Target) -> ActiveEffect {
    let mut active = ActiveEffect::with_defaults(find(id).unwrap()).with(name, value);
    active.target = target;
    active
}

#[test]
fn every_key_arrives_where_it_belongs() {
    let rig = Rig::parse(RIG, "rig.toml").unwrap();
    assert_eq!(rig.name, "bench 3");
    assert_eq!(rig.joint.friction, FrictionLaw::Lumped);
    assert_eq!((rig.elements, rig.step_s), (24, 2.5e-4));
    let expected = ProportionalLaw { gain_duty_per_rad: 8.0, duty_limit: 0.9, delay_s: 2e-3 };
    assert_eq!(rig.controller, Some(expected));
    // Values in the order of the file, which is not the code's.
    let expected = [
        24.0, 2.0, 8e-4, 0.03, 30.0, 5e-6, 0.02, 0.015, 0.016, 1.0, 72_900.0, 30.0, 2.5, 0.12, 2.5, 0.03,
        0.0, 0.004,
    ];
    for (parameter, expected) in NOMINAL_PARAMETERS.iter().zip(expected) {
        assert_eq!(
            parameter.get(&rig.joint),
            Some(expected),
            "{}.{}",
            parameter.section,
            parameter.spec.name
        );
    }
    assert_eq!(rig.columns.time().apply(1500.0), 1.5);
    let (theta_in, mapped) = rig.columns.channel(Channel::ThetaIn);
    assert!(mapped && theta_in.column == "deg");
    assert!((theta_in.apply(180.0) - (std::f64::consts::PI - 0.5)).abs() < 1e-15);
    assert_eq!(rig.replay_inputs, Some(vec![Channel::ThetaRef, Channel::BusVoltage]));
    assert_eq!(rig.replay_outputs, Some(vec![Channel::F1, Channel::ThetaOut]));
}

#[test]
fn a_file_without_optional_parts_has_the_documented_defaults() {
    let text = "schema = \"bowden-rig/1\"\n[pulleys]\ninput_radius_m = 0.02\noutput_radius_m = 0.02\n[tendon]\n\
                length_m = 1\naxial_stiffness_n = 1e5\npretension_n = 20\n";
    let rig = Rig::parse(text, "rig.toml").unwrap();
    assert_eq!((rig.elements, rig.step_s, rig.joint.friction), (16, 5e-4, FrictionLaw::Distributed));
    assert!(rig.effects.is_empty() && rig.controller.is_none());
    assert!(rig.joint.motor.is_none() && rig.joint.sheath.is_none() && rig.joint.load.is_none());
    assert_eq!(rig.joint.sensors.encoder_bits, 12);
    // Moved by hand: the input angle drives, and no motor's role is predicted.
    assert_eq!(rig.possible_inputs(), [Channel::ThetaIn]);
}

#[test]
fn a_fitted_value_changes_its_digits_and_nothing_else() {
    let mut document = document();
    document.set_nominal("sheath", "friction_coefficient", 0.107_3).unwrap();
    document.set_nominal("motor", "supply_v", 23.5).unwrap();
    let expected = RIG
        .replace("friction_coefficient = 0.12 ", "friction_coefficient = 0.1073 ")
        .replace("supply_v = 24 ", "supply_v = 23.5 ");
    assert_eq!(document.to_string(), expected);
    let mut meant = Rig::parse(RIG, "rig.toml").unwrap();
    meant.joint.sheath.as_mut().unwrap().friction_coefficient = 0.107_3;
    meant.joint.motor.as_mut().unwrap().supply_v = 23.5;
    assert_eq!(document.rig().unwrap(), meant);
}

#[test]
fn values_of_any_size_read_back_to_the_last_bit() {
    let mut document = document();
    for value in [1.0e-9, 4.940_656e-7, 1.0 / 3.0 * 1e-5, 0.1 + 0.2, 1.0] {
        document.set_nominal("motor", "rotor_inertia_kg_m2", value).unwrap();
        let read = document.rig().unwrap().joint.motor.unwrap().rotor_inertia_kg_m2;
        assert_eq!(read.to_bits(), value.to_bits(), "{value}");
    }
}

#[test]
fn every_effect_of_the_catalogue_can_be_added_and_reads_back() {
    assert!(!CATALOGUE.is_empty());
    let mut document = document();
    let mut meant = Rig::parse(RIG, "rig.toml").unwrap();
    for effect in CATALOGUE {
        let mut active = ActiveEffect::with_defaults(effect);
        for (value, spec) in active.parameters.iter_mut().zip(effect.descriptor().parameters) {
            *value = spec.lower + 0.3 * (spec.default - spec.lower);
        }
        document.add_effect(&active).unwrap();
        meant.effects.push(active);
    }
    assert_eq!(document.rig().unwrap(), meant);
    assert!(document.to_string().starts_with("# Bench 3, second floor\n"));
    assert!(document.to_string().contains("# from the data sheet, odd spacing  kept"));
    document.clear_effects();
    assert_eq!(document.rig().unwrap(), Rig::parse(RIG, "rig.toml").unwrap());
}

#[test]
fn an_effect_on_the_same_sensor_is_replaced_and_on_another_stands_beside_it() {
    let mut document = document();
    let on_f2 = |offset| with("sensor_offset", "offset", offset, Target::One(Channel::F2));
    let on_angle = with("sensor_offset", "offset", 0.05, Target::One(Channel::ThetaIn));
    document.add_effect(&on_f2(1.0)).unwrap();
    document.add_effect(&on_f2(2.0)).unwrap();
    assert_eq!(document.rig().unwrap().effects, [on_f2(2.0)]);
    document.add_effect(&on_angle).unwrap();
    document.add_effect(&on_f2(3.0)).unwrap();
    assert_eq!(document.rig().unwrap().effects, [on_f2(3.0), on_angle]);
    // All tensions include f2, which has an offset of its own.
    let before = document.to_string();
    let failure = document.add_effect(&with("sensor_offset", "offset", 1.0, Target::Tensions)).unwrap_err();
    assert_eq!(failure.class(), FailureClass::Failed);
    assert!(failure.message().contains("is described twice"), "{failure}");
    assert_eq!(document.to_string(), before);
}

/// A part has several harmonics of cogging; what is there is told by its periods, as a fit finds them anew.
#[test]
fn an_instance_of_an_effect_is_replaced_and_another_stands_beside_it() {
    let harmonic = |cycles: f64, amplitude_nm: f64| {
        with("motor_cogging", "cycles_per_turn", cycles, Target::None).with("amplitude_nm", amplitude_nm)
    };
    let mut document = document();
    for one in [harmonic(7.0, 0.8), harmonic(28.0, 0.5), harmonic(12.0, 0.2), harmonic(28.1, 0.6)] {
        document.add_effect(&one).unwrap();
    }
    let expected = [harmonic(7.0, 0.8), harmonic(28.1, 0.6), harmonic(12.0, 0.2)];
    assert_eq!(document.rig().unwrap().effects, expected, "{document}");
    let text = document.to_string().replace("cycles_per_turn = 12.0", "cycles_per_turn = 7.2");
    let refused = Rig::parse(&text, "rig.toml").unwrap_err();
    assert_eq!(refused.class(), FailureClass::BadInput);
    assert!(
        refused
            .message()
            .ends_with("described twice; let `cycles_per_turn` differ by 5 % at least, or keep one table"),
        "{refused:?}"
    );
}

#[test]
fn channels_may_be_named_alone_as_a_list_or_as_tensions() {
    let targets = |channel: &str| -> Vec<Target> {
        let text = RIG.replace("effects = []", "effects = [\"sensor_offset\"]")
            + &format!("[effects.sensor_offset]\noffset = 0.5\nchannel = {channel}\n");
        Rig::parse(&text, "rig.toml").unwrap().effects.iter().map(|effect| effect.target).collect()
    };
    assert_eq!(targets("\"f3_n\""), [Target::One(Channel::F3)]);
    assert_eq!(targets("\"tensions\""), [Target::Tensions]);
    assert_eq!(targets("[\"f1_n\", \"f2_n\", \"f3_n\", \"f4_n\"]"), [Target::Tensions]);
    assert_eq!(
        targets("[\"f1_n\", \"theta_in_rad\"]"),
        [Target::One(Channel::F1), Target::One(Channel::ThetaIn)]
    );
}

#[test]
fn values_that_no_rig_file_may_hold_are_not_written() {
    let mut document = document();
    for (section, name, value, part) in [
        ("sheath", "friction_coefficient", 2.5, "2.5 is outside 0 to 2"),
        ("sheath", "friction_coefficient", f64::NAN, "NaN is outside 0 to 2"),
        ("sheath", "mu", 0.1, "no such parameter"),
    ] {
        let failure = document.set_nominal(section, name, value).unwrap_err();
        assert!(failure.message().contains(part), "{failure}");
        assert_eq!(failure.class(), FailureClass::Failed);
    }
    assert_eq!(document.to_string(), RIG);
}

/// How dry friction builds up has two kinds and nothing between them, in a file as for `--set`.
#[test]
fn a_kind_is_one_of_those_that_there_are() {
    let mut document = document();
    document.add_effect(&with("joint_coulomb_friction", "presliding_exponent", 1.0, Target::None)).unwrap();
    let mut rig = document.rig().unwrap();
    let between = document.to_string().replace("presliding_exponent = 1.0", "presliding_exponent = 0.5");
    let failure = Rig::parse(&between, "rig.toml").unwrap_err();
    let line = between.lines().position(|line| line.starts_with("presliding_exponent")).unwrap() + 1;
    let reason = "effects.joint_coulomb_friction.presliding_exponent: got 0.5, expected 0 or 1; correct it";
    assert_eq!(failure.message(), format!("rig.toml:{line}:23: {reason}"));

    let kind = RigParameter::parse("effects.joint_coulomb_friction.presliding_exponent").unwrap();
    assert!(kind.set(&mut rig, 0.5).unwrap_err().ends_with("got 0.5, expected 0 or 1"));
    kind.set(&mut rig, 0.0).unwrap();
    assert_eq!(rig.effects[0].parameters[2], 0.0);
}
