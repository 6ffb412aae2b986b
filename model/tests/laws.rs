//! Laws do what their formulas say: values by hand, and pulleys that are not round against the geometry of winding.

use bowden_model::effect::{ActiveEffect, Effect, MAX_PARAMETERS};
use bowden_model::effect_set::EffectSet;
use bowden_model::effects::CATALOGUE;
use bowden_model::friction_law::FrictionLaw;
use bowden_model::law::{Form, LAWS, Law, find};
use bowden_model::parameters::{
    JointParameters, LoadParameters, PulleyParameters, SensorParameters, TendonParameters,
};
use bowden_model::plant::{InputBoundary, OutputBoundary, Plant, PlantConfig, StepInput};

fn coefficients(values: &[f64]) -> [f64; MAX_PARAMETERS] {
    let mut all = [0.0; MAX_PARAMETERS];
    all[..values.len()].copy_from_slice(values);
    all
}

#[test]
fn forms_have_the_values_of_their_formulas() {
    for (form, p, x, want) in [
        (Form::Power, &[2.0, 3.0][..], -0.5, -0.25),
        (Form::EvenPower, &[2.0, 3.0], -0.5, 0.25),
        (Form::DirectedPower, &[2.0, 3.0, 0.5], -0.5, 0.125),
        (Form::DirectedPower, &[2.0, 3.0, 0.5], 0.5, 0.375),
        (Form::DirectedPower, &[2.0, 1.0, 0.5], 0.0, 0.0),
        (Form::Sign, &[2.0], -0.5, -2.0),
        (Form::Sign, &[2.0], 0.0, 0.0),
        (Form::PowerFromOne, &[2.0, 2.0], 0.5, -1.5),
        (Form::Wave, &[2.0, 3.0, 0.5], 0.0, 2.0 * 0.479_425_538_604_203),
        (Form::Oscillation, &[2.0, 0.25, 0.0], 1.0, 2.0),
        (Form::Bump, &[2.0, 0.3, 0.1, 2.0], 0.4, 2.0 * 0.367_879_441_171_442),
        // exp(-2^2) and exp(-2^3).
        (Form::Bump, &[2.0, 0.3, 0.1], 0.1, 2.0 * 0.018_315_638_888_734),
        (Form::Bump, &[2.0, 0.3, 0.1, 3.0], 0.1, 2.0 * 0.000_335_462_627_903),
        (Form::Ramp, &[2.0], -0.5, -1.0),
        (Form::Square, &[2.0], -0.5, 0.5),
        (Form::SignedSquare, &[2.0], -0.5, -0.5),
        (Form::Decay, &[2.0, 4.0], 4.0, 2.0 * 0.632_120_558_828_558),
        (Form::Decay, &[2.0, 4.0], -1.0, 0.0),
    ] {
        let found = form.value(&coefficients(p), x);
        assert!((found - want).abs() < 1e-12, "{form:?} at {x}: {found}, expected {want}");
    }
}

/// From rest the branch is `-a (1 - exp(-x / width))`; after a reversal at the end of a long way it falls from `-a` towards `a`,
/// by `2 a (1 - exp(-x / width))`. A step may be as long as it likes.
#[test]
fn a_loop_remembers_its_last_reversal() {
    let p = coefficients(&[2.0, 0.1]);
    for steps in [1, 7] {
        let mut memory = [0.0; bowden_model::effect::MAX_STATE];
        let mut goes = |from: f64, to: f64| {
            (1..=steps)
                .map(|k| {
                    let x = from + (to - from) * f64::from(k) / f64::from(steps);
                    Form::Hysteresis.remembered(&p, &mut memory, x)
                })
                .last()
                .unwrap()
        };
        goes(0.3, 0.3);
        assert!((goes(0.3, 0.4) + 2.0 * 0.632_120_558_828_558).abs() < 1e-12);
        assert!((goes(0.4, 5.0) + 2.0).abs() < 1e-12);
        assert!((goes(5.0, 4.9) - (-2.0 + 4.0 * 0.632_120_558_828_558)).abs() < 1e-12);
    }
}

/// Simpson's rule over a thousand strips.
#[test]
fn integrals_are_those_of_the_values() {
    for (form, p) in [(Form::Wave, &[0.2, 7.0, 0.4][..]), (Form::Ramp, &[0.3])] {
        let p = coefficients(p);
        let (upper, strips) = (0.9, 1000);
        let width = upper / f64::from(strips);
        let sum: f64 = (0..strips)
            .map(|k| {
                let at = |part: f64| form.value(&p, width * (f64::from(k) + part));
                width / 6.0 * (at(0.0) + 4.0 * at(0.5) + at(1.0))
            })
            .sum();
        assert!((form.integral(&p, upper) - sum).abs() < 1e-12, "{form:?}");
    }
}

#[test]
fn every_law_has_one_name_and_its_own_coefficients_in_its_formula() {
    for (place, law) in LAWS.iter().enumerate() {
        let descriptor = law.descriptor();
        assert!(std::ptr::eq(find(descriptor.id).unwrap(), law));
        assert!(LAWS[..place].iter().all(|other| other.descriptor().id != descriptor.id));
        assert!(CATALOGUE.iter().all(|effect| effect.descriptor().id != descriptor.id));
        assert!(law.formula().contains(law.variable().name()), "{}", descriptor.id);
        for spec in descriptor.parameters {
            assert!(law.formula().contains(spec.name), "{}: {}", descriptor.id, spec.name);
        }
        let same = |other: &&Law| other.port() == law.port() && other.formula() == law.formula();
        assert_eq!(LAWS.iter().filter(same).count(), 1, "a rig file could not tell {}", descriptor.id);
    }
}

const RADIUS_M: f64 = 0.015;
const STIFFNESS_N: f64 = 50_000.0;

/// Two free tendons of 1 m between equal pulleys, both of which are turned as prescribed.
fn wound_by(law: &str, values: &[(&str, f64)]) -> PlantConfig {
    let mut active = ActiveEffect::with_defaults(find(law).unwrap());
    for (name, value) in values {
        active = active.with(name, *value);
    }
    let parameters = JointParameters {
        motor: None,
        pulleys: Some(PulleyParameters { input_radius_m: RADIUS_M, output_radius_m: RADIUS_M }),
        tendon: Some(TendonParameters { length_m: 1.0, axial_stiffness_n: STIFFNESS_N, pretension_n: 30.0 }),
        sheath: None,
        load: Some(LoadParameters { mass_kg: 1.0, ..LoadParameters::NONE }),
        sensors: SensorParameters::default(),
        friction: FrictionLaw::Lumped,
    };
    let effects = EffectSet::from_slice(&[active]).unwrap();
    PlantConfig::new(parameters, 4, effects, InputBoundary::Angle, OutputBoundary::Angle).unwrap()
}

fn turned(plant: &mut Plant, config: &PlantConfig, from: [f64; 2], to: [f64; 2], steps: usize) {
    let still = StepInput {
        bridge: bowden_model::drive::BridgeInput { duty: 0.0, bus_v: 0.0, enabled: false },
        theta_in_rad: 0.0,
        theta_out_rad: 0.0,
        input_torque_nm: 0.0,
        loose_pulley: bowden_model::transmission::Outside::NOTHING,
        external_torque_nm: 0.0,
    };
    for k in 1..=steps {
        let at = |end: usize| from[end] + (to[end] - from[end]) * k as f64 / steps as f64;
        let input = StepInput { theta_in_rad: at(0), theta_out_rad: at(1), ..still };
        plant.step(config, &input, 1e-3);
    }
    // One more step where it stands: radii are taken at its start.
    let input = StepInput { theta_in_rad: to[0], theta_out_rad: to[1], ..still };
    plant.step(config, &input, 1e-3);
}

/// A pulley of radius `r (1 + A sin n θ)` has wound `r (θ + A / n (1 - cos n θ))` of cable; with the other pulley at rest,
/// cable a is shorter by that and b longer, and the torque is their difference times the radius where the pulley stands.
#[test]
fn a_pulley_that_is_not_round_winds_and_pulls_by_its_radius() {
    let (amplitude, cycles, theta_rad) = (0.15_f64, 8.0_f64, 0.05_f64);
    let values = [("amplitude", amplitude), ("cycles_per_turn", cycles), ("phase_rad", 0.0)];
    let angle = cycles * theta_rad;
    let wound_m = RADIUS_M * (theta_rad + amplitude / cycles * (1.0 - angle.cos()));
    let radius_m = RADIUS_M * (1.0 + amplitude * angle.sin());
    for (law, end) in [("law_output_radius_along_the_angle", 1), ("law_input_radius_along_the_angle", 0)] {
        let config = wound_by(law, &values);
        let mut plant = Plant::at_rest(&config, 0.0, 0.0);
        let mut to = [0.0; 2];
        to[end] = theta_rad;
        turned(&mut plant, &config, [0.0; 2], to, 50);
        let [f1, f2, f3, f4] = plant.end_tensions_n(&config);
        let sign = if end == 0 { 1.0 } else { -1.0 };
        let want = 2.0 * sign * STIFFNESS_N * wound_m;
        assert!(
            ((f1 - f3) / want - 1.0).abs() < 1e-9 && ((f2 - f4) / want - 1.0).abs() < 1e-9,
            "{law}: {f1} {f3}"
        );
        let torques = [plant.torque_in_nm(&config), plant.torque_out_nm(&config)];
        let at_radius = torques[end] / (want * radius_m);
        assert!((at_radius - 1.0).abs() < 1e-9, "{law}: {at_radius}");
        assert!((torques[1 - end] / (want * RADIUS_M) - 1.0).abs() < 1e-9, "the other pulley is round");
    }
}

#[test]
fn a_pulley_that_comes_back_has_wound_what_it_had() {
    let config = wound_by("law_output_radius_grows", &[("slope_per_rad", 0.3)]);
    let mut plant = Plant::at_rest(&config, 0.0, 0.2);
    let before = plant.end_tensions_n(&config);
    for _ in 0..200 {
        turned(&mut plant, &config, [0.0, 0.2], [0.0, 0.25], 7);
        turned(&mut plant, &config, [0.0, 0.25], [0.0, 0.2], 3);
    }
    for (now, before) in plant.end_tensions_n(&config).iter().zip(before) {
        assert!((now - before).abs() < 1e-6, "{now} N, at first {before} N");
    }
}

/// Three counts of a 12-bit encoder are 4.6 mrad: a branch of 2 mrad is the giving way of dry friction, one of 20 mrad is not.
#[test]
fn a_loop_narrower_than_an_encoder_shows_is_dry_friction() {
    let law = find("law_joint_torque_hysteresis").unwrap();
    let with = |width_rad: f64| law.is_hardly_there(&coefficients(&[0.04, width_rad]), 0.1);
    assert!(with(0.002) && !with(0.02));
}

/// At 1 rad/s, or 1 rad, the law and the effect of which it has the form are as large.
#[test]
fn a_power_that_is_nearly_in_proportion_is_an_effect_of_the_catalogue() {
    for (id, at, effect) in [
        ("law_joint_friction_by_speed", 1.07, Some(("joint_viscous_friction", 0.05))),
        ("law_motor_friction_by_speed", 0.92, Some(("motor_viscous_friction", 0.05))),
        ("law_joint_torque_by_angle", 1.0, Some(("joint_spring", -0.05))),
        // Before the gear a spring has no name.
        ("law_motor_torque_by_angle", 1.0, None),
        ("law_joint_friction_by_speed", 1.3, None),
        ("law_joint_friction_by_direction", 1.07, Some(("joint_viscous_friction", 0.05))),
    ] {
        let law = find(id).unwrap();
        let p = coefficients(&[0.05, at, 0.02]);
        assert_eq!(law.remainder(&p), effect, "{id}");
        assert_eq!(law.is_hardly_there(&p, 0.0), effect.is_some(), "{id}");
    }
    let one_way = coefficients(&[0.05, 1.0, 0.5]);
    assert!(!find("law_joint_friction_by_direction").unwrap().is_hardly_there(&one_way, 0.0));
}
