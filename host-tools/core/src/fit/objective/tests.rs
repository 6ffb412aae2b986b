//! What is compared, and what is not.

use std::ops::Range;

use bowden_model::effect::Target;
use bowden_model::effects::find;

use super::*;
use crate::simulation::replay;
use crate::test_bench;

/// What a fit compares block by block is what stands in whole predictions, bit for bit: amplifiers that stop at zero, an angle
/// whose zero is free, and the torque that guides a motor among it.
#[test]
fn a_replay_compared_as_it_runs_is_compared_as_a_whole() {
    let samples = 2345;
    let mut recording = test_bench::swung(samples);
    let wave = |k: u32| 0.12 * (4e-3 * f64::from(k)).cos() + 0.05;
    recording.set(Channel::Duty, (0..samples).map(wave).collect());
    recording.set(Channel::BusVoltage, vec![24.0; samples as usize]);
    let mut model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
    model.free_offsets = vec![Channel::ThetaOut];
    let objective = Objective::new(&model, &[recording.clone(), recording], &[], true).unwrap();
    assert!(objective.datasets[0].cut_at_zero.contains(&Channel::F1));
    assert!(objective.scales().iter().any(|(series, _)| *series == Series::Guide));
    let as_it_runs = objective.residuals(&model).unwrap();
    assert_eq!(as_it_runs, objective.compare(&objective.predict(&model).unwrap()));
    assert_eq!(as_it_runs.values.len(), objective.entries().count());
    assert!(as_it_runs.values.iter().any(|value| value.abs() > 1.0));
}

/// A fit compares a joint without tendons where it is held to its recorded angle. What is shown of it is what a replay simulates that begins
/// where the recording does.
#[test]
fn of_a_joint_that_is_held_a_free_run_is_shown() {
    let friction =
        ActiveEffect::with_defaults(find("joint_coulomb_friction").unwrap()).with("torque_nm", 0.1);
    let recording = test_bench::turned(3000, &[friction]);
    let free = JointModel::from_rig(&test_bench::direct_rig(), &recording).unwrap();
    let held = free.clone().guided(&recording);
    let objective = Objective::new(&held, std::slice::from_ref(&recording), &[], true).unwrap();
    let angle = Series::Channel(Channel::ThetaOut);
    let rmse = |shown: &[Prediction]| objective.rmse(shown, angle, Part::Training);
    let mut predictions = objective.predict(&held).unwrap();
    let when_held = rmse(&predictions);
    let guide_nm = predictions[0].guide_nm.clone();
    objective.run_freely(&held, &mut predictions).unwrap();
    assert_eq!(predictions[0].guide_nm, guide_nm);
    let mut input = ReplayInput::new(&free, &recording).unwrap();
    let motion = objective.input(0).motion().unwrap();
    input.start_at(motion.theta_rad[0], motion.omega_rad_s[0]);
    let replayed = replay(&free, &input).unwrap();
    assert_eq!(predictions[0].channel(Channel::ThetaOut), replayed.channel(Channel::ThetaOut));
    let when_free = rmse(&predictions);
    assert!(when_free > 2.0 * when_held, "{when_held} and {when_free} rad");
    // A fit in free runs compares these, and no torque beside them.
    let free_runs = objective.freely(&held).unwrap();
    assert_eq!(free_runs.scales(), [(angle, objective.scale(angle))]);
    assert_eq!(
        free_runs.predict(&held).unwrap()[0].channel(Channel::ThetaOut),
        replayed.channel(Channel::ThetaOut)
    );
    let mut compared = [replayed];
    compared[0].guide_nm = vec![0.0; 3000];
    let compared = objective.compare(&compared).values;
    let of_angle = objective.entries().zip(compared).filter(|(entry, _)| entry.series == angle);
    assert_eq!(
        free_runs.residuals(&held).unwrap().values,
        of_angle.map(|(_, value)| value).collect::<Vec<_>>()
    );
    // With tendons nothing is replaced.
    let tendons = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(500)).unwrap();
    let objective = Objective::new(&tendons, &[test_bench::swung(500)], &[], true).unwrap();
    let mut predictions = objective.predict(&tendons).unwrap();
    let before = predictions.clone();
    objective.run_freely(&tendons, &mut predictions).unwrap();
    assert_eq!(predictions, before);
    assert!(objective.freely(&tendons).is_none());
}

/// A pendulum that swings by itself, of which the duty is zero: what guides it is compared in 0.15 % of 20 N·m.
#[test]
fn a_joint_that_nothing_drives_is_compared_in_a_share_of_the_stall_torque() {
    let t_s: Vec<f64> = (0..2000).map(|k| f64::from(k) * 2e-3).collect();
    let swing = t_s.iter().map(|t| 0.3 * (3.46 * t).cos()).collect();
    let recording =
        Recording::new("swing", t_s).with(Channel::ThetaOut, swing).with(Channel::Duty, vec![0.0; 2000]);
    let model = JointModel::from_rig(&test_bench::direct_rig(), &recording).unwrap().guided(&recording);
    let objective = Objective::new(&model, &[recording], &[], true).unwrap();
    assert!((objective.scale(Series::Guide) - 0.03).abs() < 1e-3);
    assert!(objective.residuals(&model).unwrap().is_finite());
}

/// What was not measured is not compared, but a winding heats whether its current was recorded or not.
#[test]
fn of_what_was_not_measured_the_current_alone_is_predicted() {
    let mut recording = test_bench::swung(2000);
    recording.set(Channel::Duty, vec![0.1; 2000]);
    recording.set(Channel::BusVoltage, vec![24.0; 2000]);
    let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
    let unmeasured = [Channel::MotorCurrent, Channel::ThetaMotor];
    assert!(unmeasured.iter().all(|channel| model.outputs.contains(channel)));
    let objective = Objective::new(&model, &[recording], &[], true).unwrap();
    let predictions = objective.predict(&model).unwrap();
    let is_predicted = |channel| predictions[0].channel(channel).is_some();
    assert_eq!(unmeasured.map(is_predicted), [true, false]);
}

/// Where the zero of an angle is free, another zero changes nothing, and where it is not, everything.
#[test]
fn a_free_zero_makes_no_difference() {
    let with_zero_at = |zero_rad: f64| {
        let theta_out_rad = |k: u32| 0.35 * (4e-3 * f64::from(k)).sin() + zero_rad;
        test_bench::swung(2345).with(Channel::ThetaOut, (0..2345).map(theta_out_rad).collect())
    };
    let (recording, shifted) = (with_zero_at(0.0), with_zero_at(0.1));
    let mut model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
    let mut seen = |free_offsets: &[Channel], recording: &Recording| {
        model.free_offsets = free_offsets.to_vec();
        let objective = Objective::new(&model, std::slice::from_ref(recording), &[], true).unwrap();
        let predictions = objective.predict(&model).unwrap();
        let rmse = objective.rmse(&predictions, Series::Channel(Channel::ThetaOut), Part::HeldOut);
        (rmse, objective.residuals(&model).unwrap().values)
    };
    let change = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let [(rmse, plain), (rmse_shifted, other)] =
        [&recording, &shifted].map(|recording| seen(&[Channel::ThetaOut], recording));
    assert!((rmse - rmse_shifted).abs() < 1e-9 && change(&plain, &other) < 1e-6);
    let (stated, all) = seen(&[], &recording);
    let (stated_shifted, all_shifted) = seen(&[], &shifted);
    assert!((stated_shifted - stated).abs() > 0.01 && change(&all, &all_shifted) > 1.0);
}

/// A nominal tendon pushes where the real one hangs slack and its amplifier reads zero. Only where it does is the
/// prediction cut.
#[test]
fn a_tension_that_stood_at_zero_is_predicted_at_zero() {
    let mut recording = test_bench::swung(2000);
    for (channel, rest) in Channel::TENSIONS.into_iter().zip([0.0, 2.0, 0.0, -0.1]) {
        let values = (0..2000).map(|k| if k % 2 == 0 { 0.0 } else { rest });
        let touched =
            values.enumerate().map(|(k, value)| if channel == Channel::F2 && k > 30 { 1.0 } else { value });
        recording.set(channel, touched.collect());
    }
    let mut model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
    model.parameters.tendon.as_mut().unwrap().pretension_n = 2.0;
    let objective = Objective::new(&model, &[recording], &[], true).unwrap();
    let predictions = objective.predict(&model).unwrap();
    let lowest = |channel: Channel| {
        predictions[0].channel(channel).unwrap().iter().copied().fold(f64::INFINITY, f64::min)
    };
    let plain = replay(&model, &objective.datasets[0].input).unwrap();
    for channel in Channel::TENSIONS {
        assert!(plain.channel(channel).unwrap().iter().any(|tension| *tension < -1.0), "{channel:?}");
    }
    assert_eq!([Channel::F1, Channel::F3].map(lowest), [0.0, 0.0]);
    // Hardly ever on zero, and below it.
    assert!([Channel::F2, Channel::F4].map(lowest).iter().all(|tension| *tension < -1.0));
    // A sensor that is found to read too little ends at the same zero.
    let mut offset = ActiveEffect::with_defaults(find("sensor_offset").unwrap()).with("offset", -1.0);
    offset.target = Target::One(Channel::F1);
    let seen = objective.residuals_seen_through(&predictions, offset).unwrap();
    model.effects.push(offset);
    assert_eq!(seen.values, objective.residuals(&model).unwrap().values);
}

/// What the bench did in 0.4 s without a row is not known; 0.3 s later, when it has moved, it no longer matters.
#[test]
fn what_follows_a_gap_is_not_compared() {
    let whole = test_bench::swung(4000);
    let kept: Vec<usize> = (0..1500).chain(1900..4000).collect();
    let of = |values: &[f64]| kept.iter().map(|row| values[*row]).collect::<Vec<f64>>();
    let mut recording = Recording::new("gap", of(whole.t_s()));
    for channel in whole.channels() {
        recording.set(channel, of(whole.channel(channel).unwrap()));
    }
    let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
    let objective = Objective::new(&model, &[recording], &[], true).unwrap();
    let blocks: Vec<(usize, usize)> =
        objective.blocks(0).iter().map(|block| (block.start, block.end)).collect();
    // Lead-in until 0.3 s, the gap before sample 1500, samples 1500 to 1799 within 0.3 s of its end.
    assert_eq!(blocks.first(), Some(&(300, 350)));
    let holes = blocks.windows(2).filter(|pair| pair[0].1 != pair[1].0);
    assert_eq!(holes.collect::<Vec<_>>(), [[(1450, 1500), (1800, 1850)]]);
    assert_eq!(objective.residuals(&model).unwrap().values.len(), objective.entries().count());
    let notes: Vec<&str> = objective.notes().collect();
    assert!(notes.len() == 1 && notes[0].starts_with("gap: 0.30 of 4.00 s follow gaps"), "{notes:?}");
    let without = Objective::new(&model, &[whole], &[], true).unwrap();
    assert_eq!(without.notes().next(), None);
}

/// Behind a gap of 0.1 s the joint, which turned by 0.2 rad before, stands for 0.9 s and then goes on at 0.5 rad/s: two dead zones, 0.0204 rad, take
/// 41 samples. Where it stands to the end nothing is compared any more. Where all its motion is within 0.011 rad half of that is enough, 458 samples
/// at 0.012 rad/s. Another gap on the way begins the wait anew.
#[test]
fn a_joint_that_stands_behind_a_gap_is_compared_again_when_it_has_moved() {
    let begins = |before_rad: f64, goes_on_at: usize, rad_s: f64, lost_again: Range<usize>| {
        let mut recording = test_bench::swung(4000);
        let theta_rad = recording.t_s().iter().map(|t| {
            let goes_on_s = (t - 1e-3 * goes_on_at as f64).clamp(0.0, 0.5);
            before_rad * (t / 0.5).min(1.0) + rad_s * goes_on_s
        });
        let theta_rad = theta_rad.collect();
        recording.set(Channel::ThetaIn, theta_rad);
        let is_kept = |row: &usize| !(1000..1100).contains(row) && !lost_again.contains(row);
        let kept: Vec<usize> = (0..4000).filter(is_kept).collect();
        let of = |values: &[f64]| kept.iter().map(|row| values[*row]).collect::<Vec<f64>>();
        let mut gap = Recording::new("gap", of(recording.t_s()));
        for channel in recording.channels() {
            gap.set(channel, of(recording.channel(channel).unwrap()));
        }
        let model = JointModel::from_rig(&test_bench::rig(), &gap).unwrap();
        let objective = Objective::new(&model, &[gap], &[], true).unwrap();
        let begins = objective.blocks(0).iter().map(|block| block.start).find(|start| *start >= 1000);
        if begins.is_none() {
            let note = objective.notes().next().unwrap();
            assert!(note.contains("2.90 of 4.00 s follow gaps"), "{note}");
        }
        begins.map(|sample| kept[sample])
    };
    let far = begins(0.2, 2000, 0.5, 0..0).unwrap();
    assert!((2036..=2046).contains(&far), "{far}");
    assert_eq!(begins(0.2, 4000, 0.0, 0..0), None);
    let near = begins(0.005, 2000, 0.012, 0..0).unwrap();
    assert!((2453..=2464).contains(&near), "{near}");
    // After 0.018 rad; the dead zones behind it end before the 0.3 s do.
    let again = begins(0.2, 2000, 0.1, 2100..2180).unwrap();
    assert!((2480..=2481).contains(&again), "{again}");
}

/// Residuals that are recalled are those of a simulation, bit for bit, and belong to the joint that was asked for.
#[test]
fn what_was_simulated_lately_is_recalled_bit_for_bit() {
    let mut recording = test_bench::swung(2000);
    recording.set(Channel::F1, vec![30.0; 2000]);
    let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
    let with_effect = |strength: f64| {
        let mut effect = ActiveEffect::with_defaults(find("joint_coulomb_friction").unwrap());
        effect.parameters[0] = strength;
        JointModel { effects: vec![effect], ..model.clone() }
    };
    let joints = [model.clone(), with_effect(0.05), with_effect(0.06)];
    let objective = || Objective::new(&model, std::slice::from_ref(&recording), &[], true).unwrap();
    let simulated = joints.each_ref().map(|joint| objective().residuals(joint).unwrap());
    assert!(simulated[0] != simulated[1] && simulated[1] != simulated[2]);
    let asked_twice = objective();
    for _ in 0..2 {
        assert_eq!(joints.each_ref().map(|joint| asked_twice.residuals(joint).unwrap()), simulated);
    }
}

/// The clock of a bench begins at its first sample, whatever the recording's shows, and goes on in the recording that follows: friction that
/// drifts and tendons that creep are where one recording of both has them.
#[test]
fn recordings_that_follow_one_another_are_on_one_clock() {
    let whole = test_bench::swung(4000);
    let model = JointModel::from_rig(&test_bench::rig(), &whole).unwrap();
    let effect = |id: &str| ActiveEffect::with_defaults(find(id).unwrap());
    let drift = effect("friction_drift").with("rate_per_s", 0.2);
    let creep = effect("tendon_creep").with("time_constant_s", 1.5);
    let aged = JointModel { effects: vec![drift, creep], ..model.clone() };
    // Each half begins at rest, so that the second is compared with one that nothing but its age tells from the first.
    let half = |begun_s: f64| {
        let swung = test_bench::swung(2000);
        let t_s = swung.t_s().iter().map(|t_s| begun_s + t_s).collect();
        swung.channels().fold(Recording::new("half", t_s), |recording, channel| {
            recording.with(channel, swung.channel(channel).unwrap().to_vec())
        })
    };
    let seen = |begun_s: [f64; 2]| {
        let objective = Objective::new(&model, &[half(begun_s[0])], &[half(begun_s[1])], true).unwrap();
        assert_eq!(objective.begins_at_s(None), begun_s[0]);
        objective.predict(&aged).unwrap()
    };
    let f1_n = |predictions: &[Prediction], recording: usize| {
        predictions[recording].channel(Channel::F1).unwrap().to_vec()
    };
    let [plain, cut] = [seen([0.0, 0.0]), seen([5000.0, 7.0])];
    for recording in 0..2 {
        for (one, other) in f1_n(&plain, recording).iter().zip(f1_n(&cut, recording)) {
            assert!((one - other).abs() < 1e-6, "{one} and {other}");
        }
    }
    // What the pretension has lost in 1.999 s of creep by 15 %, before a sample has passed.
    let crept = 0.15 / 1.15 * (1.0 - (-1.15_f64 * 1.999 / 1.5).exp());
    let expected_n = test_bench::rig().joint.tendon.unwrap().pretension_n * (1.0 - crept);
    let begins_n = f1_n(&plain, 1)[0];
    assert!((begins_n - expected_n).abs() < 1e-6, "{begins_n} N, expected {expected_n}");
}
