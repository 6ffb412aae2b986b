//! Differences made by hand, whose place, period and size are known.

use std::f64::consts::TAU;

use bowden_model::channel::Channel;
use bowden_model::effect::Component;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::locate::{Answer, component};
use super::samples::{Left, Samples, Variable};
use super::shape::{Factor, Shape, best_spot};
use super::structure::{frequencies_hz, strongest};
use super::{Unexplained, described, far_off};
use crate::fit::objective::{Objective, Series};
use crate::joint_model::JointModel;
use crate::simulation::{ReplayInput, replay};
use crate::test_bench;

/// Rows of a table: 40 s.
const ROWS: usize = 4000;

/// Slow and fast sines over ±0.75 rad, as a lab would.
fn theta_rad() -> Vec<f64> {
    (0..ROWS)
        .map(|k| {
            let t_s = 0.01 * k as f64;
            0.5 * (TAU * 0.083 * t_s).sin() + 0.25 * (TAU * 0.37 * t_s + 1.0).sin()
        })
        .collect()
}

fn current_a() -> Vec<f64> {
    (0..ROWS).map(|k| 0.6 * (TAU * 0.4 * 0.01 * k as f64).sin()).collect()
}

/// White noise of one scale.
fn noise(seed: u64) -> Vec<f64> {
    let mut random = Pcg64::new(u128::from(seed), 3);
    (0..ROWS).map(|_| StandardNormal.sample(&mut random)).collect()
}

fn left(channel: Channel, values: Vec<f64>) -> Left {
    // A scale of half a unit: what is 1 in scales is 0.5 N.
    let plain = values.iter().map(|value| 0.5 * value).collect();
    Left { series: Series::Channel(channel), scale: 0.5, soft: values, plain }
}

fn sum(a: &[f64], b: impl Iterator<Item = f64>) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

fn samples(left: Vec<Left>) -> Samples {
    Samples::of_one_recording(&theta_rad(), &current_a(), left)
}

fn told(samples: &Samples) -> Unexplained {
    let found = strongest(samples).expect("structure");
    described(samples, None, samples.of(found.series).unwrap(), &[(found.shape, found.fitted)])
}

/// The joint of radius r between two cables of stiffness k, held at the input: a torque d on the arm turns it by
/// d/(2 k r²), which slackens one cable by d/(2r) and tightens the other by as much. Friction that takes g off cable a
/// before the joint leaves the torque of the load alone, so that the joint turns by g/(2 k r) and both cables lose g/2.
#[test]
fn what_acts_at_the_joint_opposes_the_cables_and_what_acts_before_it_does_not() {
    let pattern: Vec<f64> = (0..200).map(|k| (0.1 * f64::from(k)).sin()).collect();
    let (torque_nm, radius_m, lost_n) = (0.12, 0.015, 8.0);
    let scaled = |factor: f64| -> Vec<f64> { pattern.iter().map(|p| factor * p).collect() };
    let answers_of = |f2_n: &[f64], f4_n: &[f64], theta_rad: &[f64]| {
        let answer =
            |channel, strength, pattern| Answer { series: Series::Channel(channel), strength, pattern };
        component(&[
            answer(Channel::F2, 3.0, f2_n),
            answer(Channel::F4, 2.9, f4_n),
            answer(Channel::ThetaOut, 1.0, theta_rad),
        ])
        .unwrap()
        .0
    };
    let each_n = torque_nm / (2.0 * radius_m);
    assert_eq!(answers_of(&scaled(-each_n), &scaled(each_n), &scaled(0.004)), Component::Joint);
    assert_eq!(
        answers_of(&scaled(-lost_n / 2.0), &scaled(-lost_n / 2.0), &scaled(-0.004)),
        Component::Transmission
    );
}

#[test]
fn a_channel_that_nobody_joins_is_a_sensor_and_torque_and_current_together_are_the_motor() {
    let answer = |series, strength| Answer { series, strength, pattern: &[1.0, -1.0] };
    let channel = Series::Channel;
    let found = |answers: &[Answer<'_>]| component(answers).unwrap().0;
    let alone = [
        (channel(Channel::F1), 5.0),
        (channel(Channel::F2), 0.1),
        (channel(Channel::ThetaOut), 0.2),
        (Series::Guide, -0.3),
    ];
    assert_eq!(found(&alone.map(|(series, strength)| answer(series, strength))), Component::Sensors);
    let motor = [(Series::Guide, 0.4), (channel(Channel::MotorCurrent), 0.3), (channel(Channel::F1), 0.2)];
    assert_eq!(found(&motor.map(|(series, strength)| answer(series, strength))), Component::Motor);
}

/// A wave of amplitude 2 in noise of 1 holds 2 of 3 squared scales.
#[test]
fn a_pattern_locked_to_position_is_found_with_its_period() {
    let wave = |phase: f64| theta_rad().into_iter().map(move |theta| 2.0 * (27.0 * theta + phase).sin());
    let samples = samples(vec![
        left(Channel::F2, sum(&noise(1), wave(0.4))),
        left(Channel::F4, sum(&noise(2), wave(0.4).map(|value| -value))),
        left(Channel::ThetaOut, noise(3)),
    ]);
    let told = told(&samples);
    assert_eq!(
        (told.component.as_str(), told.depends_on.as_slice()),
        ("joint", &["theta_out_rad".to_owned()][..])
    );
    let period_rad = told.period_rad.expect("a period");
    assert!((period_rad * 27.0 / TAU - 1.0).abs() < 0.01, "period {period_rad} rad");
    let form = told.free_form.expect("a form");
    assert!((form.heldout_share - 2.0 / 3.0).abs() < 0.06, "share {}", form.heldout_share);
    // 0.5 N a scale: sqrt(3) scales before, 1 scale after.
    assert!(
        (form.heldout_rms_before - 0.866).abs() < 0.05 && (form.heldout_rms_after - 0.5).abs() < 0.03,
        "{form:?}"
    );
    let highest = form.points.iter().map(|point| point[1]).fold(0.0, f64::max);
    assert!((highest - 1.0).abs() < 0.15, "the form reaches {highest} N");
}

#[test]
fn an_oscillation_of_one_channel_is_a_sensors_with_its_frequency() {
    let hum = (0..ROWS).map(|k| 1.5 * (TAU * 13.3 * 0.01 * k as f64 + 1.0).sin());
    let others = [Channel::F1, Channel::F2, Channel::F4].map(|channel| left(channel, noise(channel as u64)));
    let samples = samples([others.to_vec(), vec![left(Channel::F3, sum(&noise(9), hum))]].concat());
    let told = told(&samples);
    assert_eq!((told.component.as_str(), told.channel.as_str()), ("sensors", "f3_n"));
    assert_eq!(told.depends_on, ["t_s"]);
    let hz = told.frequency_hz.expect("a frequency");
    assert!((hz - 13.3).abs() < 0.02, "{hz} Hz");
}

/// Six periods in the 40 s, beside a motion of 0.083 and 0.37 Hz.
#[test]
fn a_slow_swing_is_among_the_frequencies_that_laws_start_from() {
    let swing = |k: usize| 1.5 * (TAU * 0.143 * 0.01 * k as f64 + 1.0).sin();
    let rows = [Channel::F2, Channel::F4]
        .map(|channel| left(channel, sum(&noise(channel as u64), (0..ROWS).map(swing))));
    let samples = samples(rows.to_vec());
    for of in [None, Some(Series::Channel(Channel::F4))] {
        let found = frequencies_hz(&samples, of);
        assert!(found.iter().any(|hz| (hz - 0.143).abs() < 0.002), "{found:?} Hz");
    }
}

/// A motion of 0.25 and 0.75 Hz passes everything again after 4 s. So does 3.25 Hz, thirteen times in 4 s; 3.4 Hz does not.
#[test]
fn an_oscillation_is_told_from_what_a_repeated_motion_leaves_in_every_period() {
    let turn = |hz: f64, k: usize| (TAU * hz * 0.01 * k as f64 + 0.5).sin();
    let theta_rad: Vec<f64> = (0..ROWS).map(|k| 0.4 * turn(0.25, k) + 0.2 * turn(0.75, k)).collect();
    let nearest_hz = |hz: f64| {
        let swing = (0..ROWS).map(|k| 1.5 * turn(hz, k));
        let rows = vec![left(Channel::F3, sum(&noise(9), swing))];
        let samples = Samples::of_one_recording(&theta_rad, &current_a(), rows);
        let off_hz = frequencies_hz(&samples, None).into_iter().map(|found| (found - hz).abs());
        off_hz.fold(f64::INFINITY, f64::min)
    };
    assert!(nearest_hz(3.4) < 0.01, "{} Hz", nearest_hz(3.4));
    assert!(nearest_hz(3.25) > 0.02, "{} Hz", nearest_hz(3.25));
}

/// A current that is read 2 % too small at all times is a gain.
#[test]
fn what_is_in_proportion_to_the_current_all_the_time_is_no_swing() {
    let gain = current_a().into_iter().map(|current_a| 3.0 * current_a);
    let samples = samples(vec![left(Channel::MotorCurrent, sum(&noise(11), gain))]);
    for shape in [
        Shape::Wave { of: Variable::Time, rate: 0.7, waves: 1, times: Factor::Current },
        Shape::Curve { of: Variable::Time, nodes: 0, times: Factor::Current },
    ] {
        let fitted = shape.fit(&samples, &samples.left[0].soft).unwrap();
        assert!(fitted.share() < 0.01 && fitted.removed() < 0.02, "{shape:?}: {}", fitted.removed());
    }
}

#[test]
fn a_bump_is_drawn_where_it_is_and_as_high_as_it_is() {
    let bump = theta_rad().into_iter().map(|theta| 4.0 * (-((theta - 0.2) / 0.06_f64).powi(2)).exp());
    let samples = samples(vec![left(Channel::F1, sum(&noise(4), bump)), left(Channel::F3, noise(5))]);
    let shape = Shape::Curve { of: Variable::ThetaOut, nodes: 40, times: Factor::One };
    let fitted = shape.fit(&samples, &samples.left[0].soft).unwrap();
    let drawn = shape.drawn(&samples, &fitted, 1.0);
    let (at, height) = drawn.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    // A node every 0.0385 rad.
    assert!((at - 0.2).abs() < 0.04 && (height - 4.0).abs() < 0.8, "{height} at {at} rad");
    assert!(fitted.share() > 0.3 && shape.fit(&samples, &samples.left[1].soft).unwrap().share() < 0.05);
}

/// A cable that rubs while it passes 0.1 rad, half a width of 0.12 rad: the tension before the spot holds as much more while the
/// angle grows as less while it falls, after Dahl over 4 mrad, and the cables beyond it answer together. The mean of
/// `(1 − x²)⁴` is 128/315, of which amplitude 4 makes 6.5 squared scales beside the 1 of the noise; where a reversal falls into
/// the spot there is less of it.
#[test]
fn what_rubs_at_one_place_is_found_there() {
    let theta_rad = theta_rad();
    let rubs = |size: f64| {
        let (mut last_rad, mut sign) = (0.0, 0.0);
        let force = move |theta_rad: &f64| {
            let turned_rad: f64 = theta_rad - last_rad;
            sign = turned_rad.signum() + (sign - turned_rad.signum()) * (-turned_rad.abs() / 4e-3).exp();
            last_rad = *theta_rad;
            let x = (theta_rad - 0.1) / 0.12;
            if x.abs() < 1.0 { size * sign * (1.0 - x * x).powi(2) } else { 0.0 }
        };
        theta_rad.iter().map(force).collect::<Vec<f64>>().into_iter()
    };
    let samples = samples(vec![
        left(Channel::F1, sum(&noise(11), rubs(4.0))),
        left(Channel::F2, sum(&noise(12), rubs(-2.0))),
        left(Channel::F4, sum(&noise(13), rubs(-2.0))),
        left(Channel::ThetaOut, noise(14)),
    ]);
    let told = told(&samples);
    assert_eq!((told.component.as_str(), told.channel.as_str()), ("transmission", "f1_n"));
    assert_eq!(told.depends_on, ["theta_in_rad", "omega_in_rad_s"]);
    let form = told.free_form.expect("a form");
    let share = 16.0 * 128.0 / 315.0 / (16.0 * 128.0 / 315.0 + 1.0);
    let found = form.heldout_share;
    assert!(found < share && found > share - 0.12, "share {found} for at most {share}");
    let middle = |points: &[[f64; 2]]| points[points.len() / 2];
    let (forward, backward) = (middle(&form.points), middle(&form.points_backwards));
    assert!((forward[0] - 0.1).abs() < 0.03, "middle {} rad", forward[0]);
    // 0.5 N a scale.
    assert!((forward[1] - 2.0).abs() < 0.25 && forward[1] == -backward[1], "{forward:?} {backward:?}");
}

/// A place that is passed one way alone could as well push that way always.
#[test]
fn a_spot_is_looked_for_where_it_is_passed_both_ways() {
    let there_and_back: Vec<f64> = (0..800_i32).map(|k| f64::from(400 - (k - 400).abs()) / 400.0).collect();
    let values = vec![1.0; 800];
    let turning: Vec<f64> = (0..800).map(|k| if k < 400 { 1.0 } else { -1.0 }).collect();
    assert!(best_spot(&there_and_back, &turning, &values, 0.1).is_some());
    assert_eq!(best_spot(&there_and_back, &[1.0; 800], &values, 0.1), None);
}

/// A torque constant that swings by a share s makes the torque wrong by s times what the current makes.
#[test]
fn a_swing_that_grows_with_the_current_is_the_motors() {
    let swing = current_a().into_iter().enumerate().map(|(k, current_a)| {
        let t_s = 0.01 * k as f64;
        3.0 * (TAU * t_s / 9.0).sin() * current_a
    });
    let mut torque = left(Channel::F1, sum(&noise(6), swing));
    torque.series = Series::Guide;
    let samples = samples(vec![torque, left(Channel::F1, noise(7)), left(Channel::F2, noise(8))]);
    let told = told(&samples);
    assert_eq!((told.component.as_str(), told.channel.as_str()), ("motor", "motor_torque_nm"));
    assert_eq!(told.depends_on, ["t_s", "i_motor_a"]);
    let hz = told.frequency_hz.expect("a frequency");
    assert!((hz - 1.0 / 9.0).abs() < 0.002, "{hz} Hz");
}

#[test]
fn noise_and_what_held_out_data_do_not_confirm_are_no_structure() {
    for seed in 10..15 {
        let loud: Vec<f64> = noise(seed).into_iter().map(|value| 2.5 * value).collect();
        let found = strongest(&samples(vec![left(Channel::F1, loud), left(Channel::F2, noise(seed + 100))]));
        assert!(found.is_none(), "{:?}", found.map(|found| found.shape));
    }
    // Eighty numbers fitted to 2700 rows of noise make the others worse by 80/2700, and would have taken 2 % off their own.
    let samples_of_noise = samples(vec![left(Channel::F1, noise(30))]);
    let shape = Shape::Curve { of: Variable::ThetaIn, nodes: 40, times: Factor::Direction };
    let share = shape.fit(&samples_of_noise, &samples_of_noise.left[0].soft).unwrap().share();
    assert!((-0.06..-0.01).contains(&share), "share {share}");
    // In the fitted seconds alone.
    let theta_rad = theta_rad();
    let seen = theta_rad
        .iter()
        .enumerate()
        .map(|(k, theta)| if (k / 100) % 3 == 2 { 0.0 } else { 3.0 * (20.0 * theta).sin() });
    assert!(strongest(&samples(vec![left(Channel::F1, sum(&noise(20), seen))])).is_none());
}

/// Two recordings that swing at 20 Hz in one of them: fitted to each by itself, it is how that motion rings.
#[test]
fn what_swings_in_one_recording_of_several_is_no_structure() {
    let swing = |k: usize| 2.0 * (TAU * 20.0 * 0.01 * k as f64).sin();
    let of = |second: f64| {
        let values = |seed: u64, size: f64| -> Vec<f64> {
            noise(seed).iter().enumerate().map(|(k, noise)| noise + size * swing(k)).collect()
        };
        let first = samples(vec![left(Channel::F2, values(31, 1.0))]);
        let second = samples(vec![left(Channel::F2, values(32, second))]);
        strongest(&first.followed_by(second)).map(|found| found.shape)
    };
    assert_eq!(of(0.0), None);
    assert!(matches!(of(1.0), Some(Shape::Wave { of: Variable::Time, .. })), "in both");
}

/// Tensions that are half as high again as they are read stand tens of scales off in every block.
#[test]
fn a_rig_that_is_far_off_leaves_something_and_the_right_one_does_not() {
    let mut recording = test_bench::swung(8000);
    let bench = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
    let measured = replay(&bench, &ReplayInput::new(&bench, &recording).unwrap()).unwrap();
    for (channel, values) in measured.channels() {
        recording.set(channel, values.to_vec());
    }
    let objective = Objective::new(&bench, &[recording], &[], true).unwrap();
    assert_eq!(far_off(&objective, None, &bench).unwrap(), None);
    let mut tight = bench.clone();
    tight.parameters.tendon.as_mut().unwrap().pretension_n *= 1.5;
    let left = far_off(&objective, None, &tight).unwrap().unwrap();
    // Tensions, and the torque that they make: tighter tendons rub more.
    assert_eq!(left.component, "transmission", "{}", left.sentence);
}
