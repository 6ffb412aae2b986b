//! Steps of the whole joint a second, one core: `cargo bench -p bowden-model --bench joint`.
//!
//! Motor, both tendons, arm and gravity along a lab session: slow sine, multisine, ramps and stairs, each a quarter. The
//! item count is the number of steps. A step costs a fixed part, motor, arm and pulleys, and a part in proportion to
//! the number of elements; the rows from 1 to 64 elements tell both.

use std::f64::consts::{PI, TAU};

use bowden_model::drive::BridgeInput;
use bowden_model::effect::ActiveEffect;
use bowden_model::effect_set::EffectSet;
use bowden_model::effects::find;
use bowden_model::friction_law::FrictionLaw;
use bowden_model::parameters::{
    JointParameters, LoadParameters, MotorParameters, PulleyParameters, SensorParameters, SheathParameters,
    TendonParameters,
};
use bowden_model::plant::{InputBoundary, OutputBoundary, Plant, PlantConfig, StepInput};
use bowden_model::transmission::Outside;
use divan::counter::ItemsCount;

/// Length of the session, s, and simulation step, s.
const SECONDS: f64 = 4.0;
const STEP_S: f64 = 2e-4;

fn main() {
    divan::main();
}

fn joint(elements: usize, friction: FrictionLaw, effects: &[&str]) -> PlantConfig {
    let parameters = JointParameters {
        motor: Some(MotorParameters {
            supply_v: 24.0,
            resistance_ohm: 2.0,
            inductance_h: 0.8e-3,
            torque_constant_nm_per_a: 0.03,
            gear_ratio: 30.0,
            rotor_inertia_kg_m2: 5e-6,
            viscous_nm_s_per_rad: 0.02,
        }),
        pulleys: Some(PulleyParameters { input_radius_m: 0.015, output_radius_m: 0.015 }),
        tendon: Some(TendonParameters { length_m: 1.0, axial_stiffness_n: 72_900.0, pretension_n: 30.0 }),
        sheath: Some(SheathParameters { wrap_angle_rad: PI, friction_coefficient: 0.12 }),
        load: Some(LoadParameters {
            mass_kg: 2.5,
            arm_m: 0.03,
            inertia_kg_m2: 0.0,
            viscous_nm_s_per_rad: 0.004,
        }),
        sensors: SensorParameters::default(),
        friction,
    };
    let typical = |id: &&str| ActiveEffect::with_defaults(find(id).expect("an effect of the catalogue"));
    let effects = effects.iter().map(typical).collect::<Vec<_>>();
    let effects = EffectSet::from_slice(&effects).expect("few effects");
    PlantConfig::new(parameters, elements, effects, InputBoundary::Motor, OutputBoundary::Arm)
        .expect("a complete bench")
}

/// Reference of the session, rad.
fn reference_rad(t_s: f64) -> f64 {
    let quarter = SECONDS / 4.0;
    let in_quarter = t_s % quarter;
    match (t_s / quarter) as u32 {
        0 => 0.7 * (TAU * in_quarter / quarter).sin(),
        1 => [2.0, 3.0, 5.0].iter().map(|n| 0.2 * (TAU * n * in_quarter / quarter).sin()).sum(),
        2 => 0.5 - (in_quarter / quarter - 0.5).abs(),
        _ => 0.2 * (4.0 * in_quarter / quarter).floor(),
    }
}

fn run(config: &PlantConfig) -> Plant {
    let mut plant = Plant::at_rest(config, 0.0, 0.0);
    for step in 0..steps() {
        let error = reference_rad(step as f64 * STEP_S) - plant.theta_in_rad();
        let duty = (10.0 * error - 0.1 * plant.omega_in_rad_s()).clamp(-1.0, 1.0);
        let input = StepInput {
            bridge: BridgeInput { duty, bus_v: 24.0, enabled: true },
            theta_in_rad: 0.0,
            theta_out_rad: 0.0,
            input_torque_nm: 0.0,
            loose_pulley: Outside::NOTHING,
            external_torque_nm: 0.0,
        };
        plant.step(config, &input, STEP_S);
    }
    plant
}

fn steps() -> usize {
    (SECONDS / STEP_S).round() as usize
}

#[divan::bench(args = [1, 4, 16, 32, 64])]
fn distributed(bencher: divan::Bencher, elements: usize) {
    let config = joint(elements, FrictionLaw::Distributed, &[]);
    bencher.counter(ItemsCount::new(steps())).bench(|| {
        let plant = run(&config);
        assert!(plant.theta_out_rad().is_finite());
        plant
    });
}

#[divan::bench]
fn lumped(bencher: divan::Bencher) {
    let config = joint(1, FrictionLaw::Lumped, &[]);
    bencher.counter(ItemsCount::new(steps())).bench(|| run(&config));
}

/// What a search simulates: four contacts, with what every bench has and with friction that changes at every step.
#[divan::bench(args = [&["presliding_compliance"] as &[&str], &["presliding_compliance", "sheath_stribeck_friction"]])]
fn searched(bencher: divan::Bencher, effects: &[&str]) {
    let config = joint(4, FrictionLaw::Distributed, effects);
    bencher.counter(ItemsCount::new(steps())).bench(|| run(&config));
}
