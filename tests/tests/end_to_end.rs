//! From a bench to a result: forward run and replay of the same rig, and fits to recordings of another reality.

use bowden_core::fit::recalibrate::recalibrate;
use bowden_core::progress::Quiet;
use bowden_core::replay;
use bowden_core::rig::Rig;
use bowden_core::simulate::{Motion, Reference, RunOptions, run};
use bowden_core::study::Study;
use bowden_model::channel::Channel;
use bowden_tests::{recording_of, rms_difference};
use virtual_bench::{Case, MotionKind, Parameter, nominal_rig_toml};

fn nominal_rig() -> Rig {
    Rig::parse(&nominal_rig_toml("bench"), "rig.toml").unwrap()
}

#[test]
fn a_replay_of_a_forward_run_finds_the_same_tensions() {
    let rig = nominal_rig();
    let reference = Reference::of_motion(Motion::Lab, 16.0, 3);
    let recorded = run(&rig, &reference, RunOptions { seconds: 16.0, rate_hz: 1000.0, seed: 3 }).unwrap();
    let replayed = replay::predict(&rig, &recorded).unwrap();
    // Noise alone makes 0.1 N. The input end answers to the angle between two counts of 1.5 mrad: a count turned
    // against a stuck tendon of 73 N/mm is 1.7 N, of which the reconstruction leaves a third. The joint averages it.
    for (channel, limit) in [
        (Channel::F1, 0.7),
        (Channel::F2, 0.2),
        (Channel::F3, 0.7),
        (Channel::F4, 0.2),
        (Channel::ThetaOut, 0.8e-3),
        (Channel::MotorCurrent, 0.012),
    ] {
        let difference = rms_difference(channel, &recorded, &replayed);
        assert!(difference < limit, "{}: {difference}", channel.role());
    }

    // The comparison can fail: a rig with three times the friction answers otherwise.
    let mut wrong = rig;
    let sheath = wrong.joint.sheath.as_mut().unwrap();
    sheath.friction_coefficient *= 3.0;
    let replayed = replay::predict(&wrong, &recorded).unwrap();
    let difference = rms_difference(Channel::F2, &recorded, &replayed);
    assert!(difference > 1.0, "friction 0.36 for 0.12 leaves {difference} N");
}

#[test]
fn a_fit_to_the_virtual_bench_recovers_its_parameters() {
    // The virtual bench has no capstan equation: friction comes out of bristles and masses along the tendon.
    let case = Case::new("case", Vec::new(), 21, 0.0)
        .off(Parameter::FrictionCoefficient, 1.3)
        .off(Parameter::AxialStiffness, 0.85)
        .off(Parameter::Pretension, 0.9)
        .off(Parameter::TorqueConstant, 1.08)
        .off(Parameter::Mass, 1.06);
    let rig = Rig::parse(&case.rig_toml(), "rig.toml").unwrap();
    let recording = recording_of(&case.train(MotionKind::Lab, 20.0).unwrap());
    let result = recalibrate(&Study::of_bench(rig.clone(), vec![recording], Vec::new()), &Quiet).unwrap();
    let truth = case.truth_record();
    for (name, short, tolerance) in [
        ("sheath.friction_coefficient", "mu", 0.02),
        // The bristles give way before they slip, which a plain rig has only the tendons for.
        ("tendon.axial_stiffness_n", "ea", 0.03),
        ("tendon.pretension_n", "f0", 0.01),
        ("motor.torque_constant_nm_per_a", "kt", 0.025),
        ("motor.resistance_ohm", "res", 0.025),
        ("load.mass_kg", "m", 0.01),
    ] {
        let found = result.parameters.iter().find(|p| p.parameter.to_string() == name).unwrap();
        let expected = truth["true_over_nominal"][short].as_f64().unwrap();
        let ratio = found.fitted / found.nominal;
        assert!((ratio / expected - 1.0).abs() < tolerance, "{name}: {ratio} for {expected}");
    }
    for name in ["f1_n", "f2_n", "f3_n", "f4_n"] {
        let channel = result.channels.iter().find(|c| c.series.name() == name).unwrap();
        assert!(channel.after < 0.35 * channel.before, "{channel:?}");
    }
}

#[test]
fn a_seed_decides_every_bit() {
    let rig = nominal_rig();
    let forward = |seed| {
        let reference = Reference::of_motion(Motion::Multisine, 3.0, seed);
        run(&rig, &reference, RunOptions { seconds: 3.0, rate_hz: 1000.0, seed }).unwrap()
    };
    assert_eq!(forward(4), forward(4));
    assert_ne!(forward(4), forward(5));

    let fitted = || {
        recalibrate(&Study::of_bench(rig.clone(), vec![forward(4)], Vec::new()), &Quiet).unwrap().parameters
    };
    assert_eq!(fitted(), fitted());

    let bench = |seed| Case::new("case", Vec::new(), seed, 3.0).train(MotionKind::Multisine, 2.0).unwrap();
    assert_eq!(recording_of(&bench(4)), recording_of(&bench(4)));
    assert_ne!(recording_of(&bench(4)), recording_of(&bench(5)));
}
