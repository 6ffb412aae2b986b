//! Recordings as a whole: repeatability, mesh and step, sensors.

use virtual_bench::{
    BenchConfig, BenchError, ConcealedEffect, Drive, Motion, MotionKind, Recording, record, record_driven,
};

fn rms_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    (a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>() / a.len() as f64).sqrt()
}

fn lab(config: &BenchConfig, seed: u64) -> Recording {
    record(config, &[], &Motion::new(MotionKind::LabHeldout, 8.0, 2), seed).expect("a valid bench")
}

#[test]
fn equal_arguments_give_equal_recordings_and_seeds_change_noise_only() {
    let config = BenchConfig::default();
    let first = lab(&config, 1);
    assert_eq!(first, lab(&config, 1));
    let other = lab(&config, 2);
    assert_eq!(first.theta_ref_rad, other.theta_ref_rad);
    assert_eq!(first.theta_in_rad, other.theta_in_rad, "the encoder has no noise and nothing else differs");
    // Two independent noises of 0.1 N and 24 mN steps: sqrt(2)·0.1 = 0.141 N.
    let noise = rms_difference(&first.f1_n, &other.f1_n);
    assert!((noise - 0.141).abs() < 0.006, "{noise} N");
    let noise = rms_difference(&first.i_motor_a, &other.i_motor_a);
    assert!((noise - 0.01414).abs() < 6e-4, "{noise} A");
}

#[test]
fn finer_steps_and_meshes_agree() {
    // Driven by one duty record, so that differences are the plant's and not the controller's. Bound: tension within
    // half of the sensor noise, angles within the encoder's step.
    let quiet = BenchConfig { tension_noise_n: 0.0, current_noise_a: 0.0, ..BenchConfig::default() };
    let base = lab(&quiet, 1);
    for (step_s, nodes) in [(5e-6, 10), (5e-6, 20), (2.5e-6, 30)] {
        let config = BenchConfig { step_s, nodes, ..quiet.clone() };
        let finer = record_driven(&config, &[], Drive::Duty(&base.duty), 1).expect("a valid bench");
        for name in ["f1_n", "f2_n", "f3_n", "f4_n"] {
            let rms = rms_difference(base.column(name).unwrap_or(&[]), finer.column(name).unwrap_or(&[]));
            assert!(rms < 0.05, "{name}, step {step_s}, {nodes} nodes: {rms} N");
            assert!(rms > 0.0, "{name}: the finer run is the same run");
        }
        let rms = rms_difference(&base.theta_out_rad, &finer.theta_out_rad);
        assert!(rms < 1.5e-3, "step {step_s}, {nodes} nodes: {rms} rad");
    }
}

#[test]
fn a_step_too_long_for_the_mesh_is_refused() {
    let config = BenchConfig { nodes: 40, ..BenchConfig::default() };
    let refused = record(&config, &[], &Motion::new(MotionKind::Rest, 1.0, 1), 1);
    let Err(BenchError::Step { longest_s, .. }) = refused else { panic!("{refused:?}") };
    assert!(longest_s < 1e-5 && longest_s > 1e-6, "{longest_s}");
}

#[test]
fn readings_lie_on_the_grids_of_their_converters() {
    let recording = lab(&BenchConfig::default(), 4);
    let on_grid = |name: &str, lsb: f64| {
        for value in recording.column(name).unwrap_or(&[]) {
            let counts = value / lsb;
            assert!((counts - counts.round()).abs() < 1e-6, "{name}: {value} is {counts} steps of {lsb}");
        }
    };
    for name in ["theta_in_rad", "theta_out_rad"] {
        on_grid(name, std::f64::consts::TAU / 4096.0);
    }
    for name in ["f1_n", "f2_n", "f3_n", "f4_n"] {
        on_grid(name, 98.0665 / 4096.0);
        let column = recording.column(name).unwrap_or(&[]);
        assert!(column.iter().all(|f| (0.0..98.0665).contains(f)), "{name} leaves the range");
    }
    on_grid("duty", 5e-4);
    on_grid("i_motor_a", 4e-3);
    // At rest, before the motion begins at 0.4 s, the noise is what the data sheet says.
    let rest = &recording.f2_n[..400];
    let mean = rest.iter().sum::<f64>() / 400.0;
    let std = (rest.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / 399.0).sqrt();
    assert!((mean - 30.0).abs() < 0.02, "{mean}");
    assert!((std - 0.1).abs() < 0.012, "{std}");
}

#[test]
fn sheath_friction_opens_a_hysteresis_of_the_capstan_ratio() {
    let recording = record(&BenchConfig::default(), &[], &Motion::new(MotionKind::Sine, 10.0, 1), 1)
        .expect("a valid bench");
    let capstan = (0.12 * std::f64::consts::PI).exp();
    let mut tight = Vec::new();
    let mut loose = Vec::new();
    for k in 50..recording.len() - 50 {
        let speed = (recording.theta_in_rad[k + 50] - recording.theta_in_rad[k - 50]) * 10.0;
        let ratio = recording.f1_n[k] / recording.f2_n[k];
        if speed > 0.2 {
            tight.push(ratio);
        } else if speed < -0.2 {
            loose.push(ratio);
        }
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    assert!((mean(&tight) / capstan - 1.0).abs() < 0.01, "pulled in: {}", mean(&tight));
    assert!((mean(&loose) * capstan - 1.0).abs() < 0.01, "let out: {}", mean(&loose));
}

#[test]
fn strength_zero_changes_nothing_at_all() {
    // The effect's code runs, its physics is neutral: bit for bit the recording without effects. This ties the loop
    // with node effects to the loop without.
    let config = BenchConfig::default();
    let motion = Motion::new(MotionKind::Triangle, 2.0, 3);
    let plain = record(&config, &[], &motion, 1).expect("a valid bench");
    for id in ConcealedEffect::IDS {
        let effect = ConcealedEffect::drawn(id, 0.0, 9).expect("a known id");
        let recording = record(&config, &[effect], &motion, 1).expect("a valid bench");
        assert_eq!(recording, plain, "{id}");
    }
}

#[test]
fn an_effect_given_twice_or_unknown_is_refused() {
    let effect = ConcealedEffect::drawn("joint_spring", 1.0, 1).expect("a known id");
    let motion = Motion::new(MotionKind::Rest, 1.0, 1);
    let twice = record(&BenchConfig::default(), &[effect.clone(), effect], &motion, 1);
    assert_eq!(twice, Err(BenchError::DuplicateEffect { id: "joint_spring" }));
    assert!(matches!(ConcealedEffect::drawn("spring", 1.0, 1), Err(BenchError::UnknownEffect { .. })));
    assert!(matches!(ConcealedEffect::drawn("joint_spring", f64::NAN, 1), Err(BenchError::Strength { .. })));
}

#[test]
fn a_bench_is_a_few_per_cent_off_its_rig_file() {
    let nominal = BenchConfig::default();
    let benches: Vec<BenchConfig> = (0..300).map(|seed| nominal.perturbed(seed, 3.0)).collect();
    let spread = |of: fn(&BenchConfig) -> f64| {
        let ratios: Vec<f64> = benches.iter().map(|bench| of(bench) / of(&nominal) - 1.0).collect();
        (ratios.iter().map(|r| r * r).sum::<f64>() / ratios.len() as f64).sqrt()
    };
    // Standard deviations with 300 draws are known to 4 %, the cut at 2.5 takes 1 %.
    for (name, found, asked) in [
        ("mu", spread(|b| b.friction_coefficient), 0.06),
        ("EA", spread(|b| b.axial_stiffness_n), 0.03),
        ("F0", spread(|b| b.pretension_n), 0.03),
        ("R", spread(|b| b.resistance_ohm), 0.018),
        ("kt", spread(|b| b.torque_constant_nm_per_a), 0.018),
        ("m", spread(|b| b.mass_kg), 0.0075),
    ] {
        assert!((found / asked - 1.0).abs() < 0.15, "{name}: {found} against {asked}");
    }
    assert_eq!(nominal.perturbed(5, 3.0), nominal.perturbed(5, 3.0));
}
