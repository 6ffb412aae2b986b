//! Hybrid and impedance mode on the virtual bench: a joint that is held, pushed, and let go.
//!
//! Letters: `M` friction torque of the sheaths, `k_T`, `T_i` gain and reset time of the torque loop, `d_p` damping of the pulley in it.

use std::f64::consts::{PI, TAU};

use bowden_control::parameters::Parameters;
use bowden_link::Limit;
use bowden_link::message::{Goal, Mode, Reference, Shape};
use bowden_paper::driven_joint::{DrivenJoint, parameters_of};
use virtual_bench::BenchConfig;

const TICK_S: f64 = 1e-4;
/// 2 F0 r mu K of the default bench \[Nm\].
const FRICTION_NM: f64 = 2.0 * 30.0 * 0.015 * 0.12 * PI;
/// `1 + k_T`.
const GAIN: f64 = 5.0;
/// Half a count of the joint's encoder \[rad\].
const HALF_COUNT_RAD: f64 = PI / 4096.0;
/// Half a code of a tension's converter, 98.0665 N in 12 bits, at the joint's pulley of 15 mm.
const HALF_CODE_NM: f64 = 0.5 * 98.0665 / 4096.0 * 0.015;
/// m g l \[Nm\].
const WEIGHT_NM: f64 = 2.5 * 9.81 * 0.03;

fn parameters(change: impl FnOnce(&mut Parameters)) -> Parameters {
    let mut parameters = parameters_of(&BenchConfig::default());
    change(&mut parameters);
    parameters
}

/// A joint that has followed `reference` for half a second.
fn running(mode: Mode, parameters: Parameters, reference: Reference) -> DrivenJoint {
    let mut joint = DrivenJoint::ready(&BenchConfig::default(), parameters, 401).expect("ready");
    joint.refer(reference).expect("in range");
    joint.order(Goal::Run(mode));
    wait(&mut joint, 0.5);
    joint
}

fn wait(joint: &mut DrivenJoint, seconds: f64) {
    for _ in 0..(seconds / TICK_S) as usize {
        joint.tick().expect("no fault");
    }
}

/// One tick with the joint in a firm hand at this angle; torque and power of the hand.
fn held_tick(joint: &mut DrivenJoint, place_rad: f64, speed_rad_s: f64) -> (f64, f64) {
    let bench = joint.bench();
    let (angle, speed) = (bench.theta_out_rad(), bench.omega_out_rad_per_s());
    let push_nm = 300.0 * (place_rad - angle) + 0.6 * (speed_rad_s - speed);
    joint.push(push_nm);
    joint.tick().expect("no fault");
    (push_nm, push_nm * joint.bench().omega_out_rad_per_s())
}

/// At rest the torque loop is as far off as a sheath that sticks lets it be: its integral has not yet moved the pulley by the
/// width `2 M` of the friction, `(1 + k_T + k_T t/T_i) e < 2 M`; and each of the two tensions is read to half a code.
#[test]
fn an_outer_torque_turns_the_joint_by_torque_over_stiffness() {
    const WAIT_S: f64 = 2.0;
    let torque_off_nm = 2.0 * FRICTION_NM / (GAIN + 4.0 * WAIT_S / 0.1) + 2.0 * HALF_CODE_NM;
    for stiffness in [1.0_f32, 2.0, 5.0, 16.0] {
        let own = parameters(|parameters| parameters.impedance.stiffness = stiffness);
        let mut joint = running(Mode::Impedance, own, Reference::Hold(0.0));
        let stiffness = f64::from(stiffness);
        let off_rad = torque_off_nm / stiffness + HALF_COUNT_RAD;
        for push_nm in [0.1, 0.2, 0.0, -0.2, 0.0] {
            joint.push(push_nm);
            wait(&mut joint, WAIT_S);
            let turned_rad = joint.bench().theta_out_rad();
            println!("{stiffness} N·m/rad, {push_nm} N·m: {:.2} mrad", 1e3 * turned_rad);
            assert!(
                (turned_rad - push_nm / stiffness).abs() < off_rad,
                "{stiffness} N·m/rad: {turned_rad} rad"
            );
        }
    }
}

/// Stiffness and damping that a hand feels that moves the joint to and fro by 0.15 rad at 1 Hz.
fn felt(stiffness: f32, damping: f32) -> [f64; 2] {
    const SIZE_RAD: f64 = 0.15;
    let own = parameters(|parameters| {
        parameters.impedance.stiffness = stiffness;
        parameters.impedance.damping = damping;
    });
    let mut joint = running(Mode::Impedance, own, Reference::Hold(0.0));
    let (mut spring, mut turn, mut drag, mut speed_square) = (0.0, 0.0, 0.0, 0.0);
    for tick in 0..40_000 {
        let time_s = f64::from(tick) * TICK_S;
        let grown = time_s.min(1.0);
        let (sine, cosine) = (TAU * time_s).sin_cos();
        held_tick(&mut joint, grown * SIZE_RAD * sine, grown * SIZE_RAD * TAU * cosine);
        if tick < 20_000 {
            continue;
        }
        let (angle, speed) = (joint.bench().theta_out_rad(), joint.bench().omega_out_rad_per_s());
        let torque_nm = joint.torque_out_nm() - WEIGHT_NM * angle.sin();
        spring -= torque_nm * angle;
        turn += angle * angle;
        drag -= torque_nm * speed;
        speed_square += speed * speed;
    }
    [spring / turn, drag / speed_square]
}

#[test]
fn a_hand_feels_the_damping_and_never_a_drive() {
    // Beside the damper: friction that the loop has not made up for, a square wave of at most M/(1 + k_T), and d_p/(1 + k_T).
    let most = 4.0 * FRICTION_NM / GAIN / (PI * 0.15 * TAU) + 0.2 / GAIN;
    for stiffness in [0.0, 3.0] {
        let [without, some, more] = [0.0, 0.05, 0.1].map(|damping| felt(stiffness, damping));
        println!("{stiffness} N·m/rad: {without:.3?}, {some:.3?}, {more:.3?}");
        assert!(without[1] > 0.0 && without[1] < most, "{stiffness} N·m/rad: {without:?}, at most {most}");
        for (felt, damping) in [(some, 0.05), (more, 0.1)] {
            let added = felt[1] - without[1];
            // 1 - k/k_tendon is 0.91 at 3 N·m/rad and k_tendon = 32.8 N·m/rad; the pulley crosses its dead zone besides.
            assert!((0.87..1.1).contains(&(added / damping)), "{stiffness} N·m/rad: {added} for {damping}");
        }
    }
    // The friction that takes part at 1 Hz is the same for both.
    let added = felt(3.0, 0.05)[0] - felt(1.0, 0.05)[0];
    assert!((1.8..2.2).contains(&added), "{added} for 2 N·m/rad more");
}

/// Work that a hand does which takes the joint away and back again, at several speeds; the joint gives none.
#[test]
fn the_joint_gives_no_energy_to_a_hand() {
    for mode in [Mode::Impedance, Mode::Hybrid] {
        for (frequency_hz, size_rad) in [(0.5, 0.2), (2.0, 0.1), (6.0, 0.03)] {
            let own = parameters(|parameters| {
                parameters.limits.contact_torque = 0.2;
                parameters.impedance.stiffness = 5.0;
            });
            let mut joint = running(mode, own, Reference::Hold(0.0));
            let mut work_j = 0.0;
            for tick in 0..(4.0 / frequency_hz / TICK_S) as usize {
                let phase = TAU * frequency_hz * tick as f64 * TICK_S;
                let speed = size_rad * TAU * frequency_hz * phase.sin();
                work_j += held_tick(&mut joint, size_rad * (1.0 - phase.cos()), speed).1 * TICK_S;
            }
            println!("{mode:?} {frequency_hz} Hz: {:.1} mJ", 1e3 * work_j);
            assert!(work_j > 0.0, "{mode:?} at {frequency_hz} Hz: {work_j} J");
        }
    }
}

const SINE: Reference =
    Reference::Generated { shape: Shape::Sine, amplitude: 0.25, offset: 0.0, frequency_hz: 0.5 };

/// How far the torque may be beyond its limit: friction that the loop has not made up for, `M/(1 + k_T)` as the joint is stopped
/// and twice of it where the hand turns the slip around, and `d_p ω/(1 + k_T)` of a hand that moves.
fn beyond_nm(reversals: f64, speed_rad_s: f64) -> f64 {
    (reversals * FRICTION_NM + 0.2 * speed_rad_s) / GAIN
}

#[test]
fn a_held_joint_gets_its_limit_and_no_more_then_follows_the_hand_and_comes_back() {
    for limit_nm in [0.1, 0.2, 0.4] {
        let own = parameters(|parameters| parameters.limits.contact_torque = limit_nm);
        let mut joint = running(Mode::Hybrid, own, Reference::Hold(0.0));
        let limit_nm = f64::from(limit_nm);
        joint.refer(SINE).expect("in range");
        // Held at zero for two periods.
        let (mut most_nm, mut mean_nm, mut looks) = (0.0_f64, 0.0, 0.0);
        for tick in 0..40_000 {
            held_tick(&mut joint, 0.0, 0.0);
            most_nm = most_nm.max(joint.torque_out_nm().abs());
            // The reference is at its extremes: 0.25 rad are 8 N·m of the tendons.
            if tick > 15_000 && (tick % 10_000 - 5000_i32).abs() < 1000 {
                mean_nm += joint.torque_out_nm().abs();
                looks += 1.0;
            }
        }
        mean_nm /= looks;
        println!("{limit_nm:.1} N·m: held {most_nm:.3}, mean {mean_nm:.3}");
        assert!(most_nm < limit_nm + beyond_nm(1.0, 0.0), "held with {most_nm} N·m");
        assert!((mean_nm - limit_nm).abs() < 0.01, "{mean_nm} N·m");
        // The hand takes the joint along, up to 0.63 rad/s.
        for tick in 0..20_000 {
            let phase = PI * f64::from(tick) * TICK_S;
            held_tick(&mut joint, 0.2 * (1.0 - phase.cos()), 0.2 * PI * phase.sin());
            most_nm = most_nm.max(joint.torque_out_nm().abs());
        }
        println!("moved {most_nm:.3}");
        assert!(most_nm < limit_nm + beyond_nm(2.0, 0.2 * PI), "moved with {most_nm} N·m");
        // Let go, with 0.2 rad to go: it is where its reference is within half a second, and was never faster than allowed.
        joint.push(0.0);
        let (mut fastest, mut largest_rad) = (0.0_f64, 0.0_f64);
        for tick in 0..30_000 {
            let output = joint.tick().expect("no fault");
            fastest = fastest.max(joint.bench().omega_out_rad_per_s().abs());
            if tick > 10_000 && limit_nm > 0.15 {
                let error = joint.bench().theta_out_rad() - DrivenJoint::reference(&output);
                largest_rad = largest_rad.max(error.abs());
            }
        }
        println!("back {:.1} mrad, {fastest:.2} rad/s", 1e3 * largest_rad);
        assert!(fastest < 3.0, "{fastest} rad/s");
        assert!(largest_rad < 0.012, "{limit_nm} N·m: {largest_rad} rad");
    }
}

/// Without tensions at the joint the torque is as good as a count of its encoder, 2 EA r²/L of 1.5 mrad. The estimate comes late
/// where a moving joint is stopped at once: for 0.1 s the torque was up to 0.37 N·m above its limit.
#[test]
fn without_tensions_at_the_joint_its_torque_is_held_within_a_count() {
    for fitted in [1.0, 0.0] {
        let own = parameters(|parameters| {
            parameters.limits.contact_torque = 0.3;
            parameters.tension.fitted = fitted;
        });
        let mut joint = running(Mode::Hybrid, own, Reference::Hold(0.0));
        joint.refer(SINE).expect("in range");
        let (mut most_nm, mut mean_nm) = (0.0_f64, 0.0);
        for tick in 0..20_000 {
            held_tick(&mut joint, 0.0, 0.0);
            most_nm = most_nm.max(joint.torque_out_nm().abs());
            let at_extreme = (5000..7000).contains(&(tick % 10_000));
            mean_nm += if at_extreme { joint.torque_out_nm().abs() / 4000.0 } else { 0.0 };
        }
        println!("tensions {fitted}: {most_nm:.3} N·m at most, {mean_nm:.3} in the mean");
        let count_nm = 32.8 * TAU / 4096.0;
        assert!((mean_nm - 0.3).abs() < 2.0 * count_nm && most_nm < 0.75, "{mean_nm}, {most_nm} N·m");
    }
}

/// The limit may be changed while the joint is held.
#[test]
fn the_limit_follows_its_parameter_while_the_joint_is_held() {
    let mut joint = running(Mode::Hybrid, parameters(|_| ()), Reference::Hold(0.0));
    joint.refer(Reference::Hold(0.4)).expect("in range");
    for limit_nm in [0.3_f32, 0.1, 0.5] {
        joint
            .configure(parameters(|parameters| parameters.limits.contact_torque = limit_nm))
            .expect("in range");
        for _ in 0..10_000 {
            held_tick(&mut joint, 0.0, 0.0);
        }
        let torque_nm = joint.torque_out_nm();
        println!("{limit_nm} N·m: {torque_nm:.3}");
        assert!((torque_nm - f64::from(limit_nm)).abs() < 0.02, "{torque_nm} of {limit_nm} N·m");
    }
}

/// Within the limit the mode is position mode, to the bit.
#[test]
fn a_free_joint_is_as_in_position_mode() {
    let duties = |mode| {
        let mut joint = running(mode, parameters(|_| ()), Reference::Hold(0.0));
        joint.refer(SINE).expect("in range");
        let sample = |joint: &mut DrivenJoint| {
            let sample = joint.tick().expect("no fault").sample;
            assert!(!sample.limits.contains(Limit::OutputTorque));
            sample.duty_raw
        };
        (0..30_000).map(|_| sample(&mut joint)).collect::<Vec<_>>()
    };
    assert!(duties(Mode::Hybrid) == duties(Mode::Position));
}
