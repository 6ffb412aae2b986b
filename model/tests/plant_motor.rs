//! Motor, motor-driven joint and the convergence of the whole in time.

#[path = "common/joint.rs"]
mod joint;
#[path = "common/motor.rs"]
mod motor;
#[path = "common/near.rs"]
mod near;

use bowden_model::drive::{BridgeInput, Response};
use bowden_model::effect::{ActiveEffect, PRESLIDING_RAD};
use bowden_model::effect_set::EffectSet;
use bowden_model::effects;
use bowden_model::friction_law::FrictionLaw;
use bowden_model::parameters::{JointParameters, SensorParameters};
use bowden_model::plant::{InputBoundary, OutputBoundary, Plant, PlantConfig, PlantError, StepInput};
use joint::{IDLE, INERTIA_KG_M2, RADIUS_M, Run, STIFFNESS_N_PER_M, WEIGHT_NM, joint};
use motor::{MOTOR, PULLEY_INERTIA_KG_M2, PULLEY_NM_PER_A};
use near::near;

const MOTOR_AND_ARM: (InputBoundary, OutputBoundary) = (InputBoundary::Motor, OutputBoundary::Arm);

/// Torque of a stretch rate over that of a stretch in both ropes, s.
const ROPE_LOSS_S: f64 = 5e-4;

fn bare_motor() -> JointParameters {
    JointParameters {
        motor: Some(MOTOR),
        pulleys: None,
        tendon: None,
        sheath: None,
        load: None,
        sensors: SensorParameters::default(),
        friction: FrictionLaw::Distributed,
    }
}

fn duty(duty: f64) -> StepInput {
    StepInput { bridge: BridgeInput { duty, bus_v: 24.0, enabled: true }, ..IDLE }
}

/// Without load: ω = k V/(R b + k²), i = b ω/k with k = `k_t` N. A thousand time constants later only rounding is left.
#[test]
fn free_run() {
    for level in [1.0, -0.3] {
        let mut run = Run::new(bare_motor(), &[], MOTOR_AND_ARM, 5e-4);
        run.until(20.0, |_| duty(level));
        let speed = PULLEY_NM_PER_A * 24.0 * level / (2.0 * 0.02 + PULLEY_NM_PER_A * PULLEY_NM_PER_A);
        near("speed", run.plant.omega_out_rad_s(), speed, 1e-9);
        near("current", run.plant.current_a(), 0.02 * speed / PULLEY_NM_PER_A, 1e-9);
    }
}

/// Blocked: i = (V/R)(1 - e^{-t R/L}), in the end the stall current.
#[test]
fn blocked_motor_current() {
    let boundaries = (InputBoundary::Angle, OutputBoundary::Arm);
    for dt_s in [1e-4, 5e-5, 2.5e-5] {
        let mut run = Run::new(bare_motor(), &[], boundaries, dt_s);
        run.until(5e-4, |_| duty(1.0));
        let stall_a = 12.0;
        // Each half of a step takes x³/6 of what is left too little off, x = dt R/2L.
        let allowed_a = stall_a * (-1.0_f64).exp() * (dt_s / 5e-4).powi(2) / 24.0;
        near("after L/R", run.plant.current_a(), stall_a * (1.0 - (-1.0_f64).exp()), allowed_a);
        run.until(2e-2, |_| duty(1.0));
        near("stall", run.plant.current_a(), 12.0, 1e-9);
    }
    let mut run = Run::new(bare_motor(), &[], boundaries, 5e-4);
    run.until(0.1, |_| duty(1.0));
    near("stall at a step of one L/R", run.plant.current_a(), 12.0, 1e-9);
    run.until(0.1005, |_| StepInput {
        bridge: BridgeInput { duty: 1.0, bus_v: 24.0, enabled: false },
        ..IDLE
    });
    assert_eq!(run.plant.current_a(), 0.0);
}

/// Drag takes a speed to e^(-z) of it, z = kick b/I: to z³/6 for a short kick, to nothing for a long one; with a torque the speed ends at τ/b.
#[test]
fn drag_slows_by_the_exponential() {
    let inertia = 2e-3;
    for z in [0.01, 0.1, 0.5] {
        let kick_s = 1e-3;
        let drag = z * inertia / kick_s;
        let Response { kept, rad_s_per_nm } = Response::new(inertia, [drag, 0.0], kick_s);
        let beyond = kept - (-z).exp();
        assert!(beyond > 0.0 && beyond < z.powi(3) / 6.0, "{z}: {kept}");
        near("steady", rad_s_per_nm / (1.0 - kept), 1.0 / drag, 1e-12 / drag);
    }
    let long = Response::new(inertia, [1e6 * inertia / 1e-3, 0.0], 1e-3);
    assert!(long.kept > 0.0 && long.kept < 1e-11, "{long:?}");
}

/// Solution at `until_s` from zero, by classic Runge-Kutta with steps of 10 µs.
fn runge_kutta<const N: usize>(until_s: f64, slope: impl Fn(f64, [f64; N]) -> [f64; N]) -> [f64; N] {
    let steps = (until_s / 1e-5).round();
    let h = until_s / steps;
    let ahead = |at: [f64; N], k: [f64; N], h: f64| std::array::from_fn(|i| at[i] + h * k[i]);
    let mut at = [0.0; N];
    for step in 0..steps as usize {
        let t = h * step as f64;
        let k1 = slope(t, at);
        let k2 = slope(t + 0.5 * h, ahead(at, k1, 0.5 * h));
        let k3 = slope(t + 0.5 * h, ahead(at, k2, 0.5 * h));
        let k4 = slope(t + h, ahead(at, k3, h));
        for i in 0..N {
            at[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
    at
}

/// Slope of the current, A/s, at a duty and a speed of the rotor.
fn current_slope(duty: f64, current_a: f64, omega_rad_s: f64) -> f64 {
    (duty * 24.0 - 2.0 * current_a - PULLEY_NM_PER_A * omega_rad_s) / 1e-3
}

/// Motor with the weight on its shaft: current, angle, speed.
fn pendulum(until_s: f64, duty: impl Fn(f64) -> f64) -> [f64; 3] {
    runge_kutta(until_s, |t, [current, theta, omega]| {
        let torque_nm = PULLEY_NM_PER_A * current - 0.024 * omega - WEIGHT_NM * theta.sin();
        [current_slope(duty(t), current, omega), omega, torque_nm / (PULLEY_INERTIA_KG_M2 + INERTIA_KG_M2)]
    })
}

/// Motor, elastic tendons without friction, and arm: current, angles of arm and rotor, speeds of both.
fn elastic_joint(until_s: f64, duty: impl Fn(f64) -> f64) -> [f64; 5] {
    let stiffness_nm_per_rad = 2.0 * STIFFNESS_N_PER_M * RADIUS_M * RADIUS_M;
    runge_kutta(until_s, |t, [current, arm, rotor, arm_rad_s, rotor_rad_s]| {
        let cable_nm = stiffness_nm_per_rad * (rotor - arm + ROPE_LOSS_S * (rotor_rad_s - arm_rad_s));
        let rotor_nm = PULLEY_NM_PER_A * current - 0.02 * rotor_rad_s - cable_nm;
        let arm_nm = cable_nm - 0.004 * arm_rad_s - WEIGHT_NM * arm.sin();
        [
            current_slope(duty(t), current, rotor_rad_s),
            arm_rad_s,
            rotor_rad_s,
            arm_nm / INERTIA_KG_M2,
            rotor_nm / PULLEY_INERTIA_KG_M2,
        ]
    })
}

/// Errors of the current, the angle of the arm and its speed after 1.5 s, with steps of `dt_s` or, as long on average, of half and one and
/// a half of it in turn. `want` is the solution at a time: current, angle, speed.
fn errors_of_steps(
    parameters: JointParameters,
    drive: impl Fn(f64) -> f64,
    want: impl Fn(f64) -> [f64; 3],
    [dt_s, uneven]: [f64; 2],
) -> [f64; 3] {
    let mut run = Run::new(parameters, &[], MOTOR_AND_ARM, dt_s);
    let mut last_s = 0.0;
    for step in 0..(1.5 / dt_s).round() as usize {
        last_s = dt_s * if step % 2 == 0 { 1.0 - uneven } else { 1.0 + uneven };
        // A duty that is held through a step is the one in its middle.
        run.plant.step(&run.config, &duty(drive(run.plant.t_s() + 0.5 * last_s)), last_s);
    }
    let [current_a, theta_rad, _] = want(1.5);
    // Speeds are those in the middle of a step.
    let [_, _, omega_rad_s] = want(1.5 - 0.5 * last_s);
    [
        (run.plant.current_a() - current_a).abs(),
        (run.plant.theta_out_rad() - theta_rad).abs(),
        (run.plant.omega_out_rad_s() - omega_rad_s).abs(),
    ]
}

/// Of second order in the step, even or not: a fifth of the step, at least a twelfth of the error.
#[track_caller]
fn assert_second_order(errors: impl Fn([f64; 2]) -> [f64; 3], allowed_at_1_ms: [f64; 3]) {
    for uneven in [0.0, 0.5] {
        let [coarse, fine] = [1e-3, 2e-4].map(|dt_s| errors([dt_s, uneven]));
        for i in 0..3 {
            assert!(uneven > 0.0 || coarse[i] < allowed_at_1_ms[i], "{coarse:?}");
            assert!(coarse[i] > 12.0 * fine[i], "not of second order at {uneven}: {coarse:?}, {fine:?}");
        }
    }
}

/// A motor that swings the weight directly.
#[test]
fn direct_pendulum_converges_to_runge_kutta() {
    let mut parameters = bare_motor();
    parameters.load = joint(0.0).load;
    let drive = |t: f64| 0.08 * (7.0 * t).cos();
    assert_second_order(
        |steps| errors_of_steps(parameters, drive, |t| pendulum(t, drive), steps),
        [1e-4, 1e-5, 1e-4],
    );
}

/// A motor that swings the arm by elastic tendons, which lose in themselves.
#[test]
fn elastic_joint_converges_to_runge_kutta() {
    let parameters = JointParameters { motor: bare_motor().motor, ..joint(0.0) };
    let drive = |t: f64| 0.05 * (7.0 * t).cos();
    let want = |t| {
        let [current_a, arm_rad, _, arm_rad_s, _] = elastic_joint(t, drive);
        [current_a, arm_rad, arm_rad_s]
    };
    assert_second_order(|steps| errors_of_steps(parameters, drive, want, steps), [5e-5, 1e-5, 5e-5]);
}

#[test]
fn motor_friction_holds_below_breakaway() {
    let dry = ActiveEffect::with_defaults(effects::find("motor_coulomb_friction").unwrap());
    let mut run = Run::new(bare_motor(), &[dry], MOTOR_AND_ARM, 5e-4);
    // Breakaway at τ R/(k V) = 0.08 · 2/(0.9 · 24) = 0.7407 % duty.
    run.until(2.0, |t| duty(0.5 * 0.0074 * t));
    assert!(run.plant.theta_out_rad() < PRESLIDING_RAD, "{} rad", run.plant.theta_out_rad());
    run.until(2.0 + 1.0, |_| duty(0.0080));
    assert!(run.plant.theta_out_rad() > 10.0 * PRESLIDING_RAD, "{} rad", run.plant.theta_out_rad());
}

/// With 0.03 N·m of a law by the sign of the speed beside 0.08 N·m of dry friction the motor breaks away at 0.11 N·m forwards and 0.05 N·m
/// backwards: at τ R/(k V) = 1.019 % and 0.463 % duty.
#[test]
fn motor_friction_by_the_sign_of_the_speed_moves_both_breakaways() {
    let dry = ActiveEffect::with_defaults(effects::find("motor_coulomb_friction").unwrap());
    let law = ActiveEffect::with_defaults(bowden_model::law::find("law_motor_friction_by_sign").unwrap())
        .with("amplitude_nm", 0.03);
    for (level, turns) in [(0.0095, false), (0.0110, true), (-0.0042, false), (-0.0052, true)] {
        let mut run = Run::new(bare_motor(), &[dry, law], MOTOR_AND_ARM, 5e-4);
        run.until(4.0, |t| duty(level * (0.5 * t).min(1.0)));
        let turned_rad = run.plant.theta_out_rad().abs();
        assert_eq!(turned_rad > 4.0 * PRESLIDING_RAD, turns, "{turned_rad} rad at duty {level}");
    }
}

/// A motor-driven joint at rest under a constant duty carries the weight: k i = (r1/r2) `T_out` without friction.
#[test]
fn motor_carries_the_weight_through_the_cables() {
    let mut parameters = joint(0.0);
    parameters.motor = Some(MOTOR);
    let mut run = Run::new(parameters, &[], MOTOR_AND_ARM, 5e-4);
    let level = 0.015;
    run.until(20.0, |_| duty(level));
    let torque_nm = PULLEY_NM_PER_A * level * 12.0;
    near("weight", WEIGHT_NM * run.plant.theta_out_rad().sin(), torque_nm, 1e-9);
    near("input torque", run.plant.torque_in_nm(&run.config), torque_nm, 1e-9);
    let lag = torque_nm / (2.0 * STIFFNESS_N_PER_M * RADIUS_M * RADIUS_M);
    near("stretch", run.plant.theta_in_rad() - run.plant.theta_out_rad(), lag, 1e-9);
}

/// Two runs of the same are the same to the last bit.
#[test]
fn runs_repeat_bit_for_bit() {
    let one = || {
        let mut parameters = joint(0.12);
        parameters.motor = Some(MOTOR);
        let mut run = Run::new(parameters, &[], MOTOR_AND_ARM, 5e-4);
        run.until(3.0, |t| duty(0.1 * (5.0 * t).sin()));
        run.plant
    };
    assert_eq!(one(), one());
}

/// The whole joint with distributed friction on a sine: halving the step at least halves the distance to a run of 15.6 µs,
/// over all samples of F1 to F4 and the angle. At 0.5 ms the tensions are within 0.02 N and the angle within 15 µrad, RMS.
#[test]
fn joint_with_distributed_friction_converges_in_time() {
    let trace = |dt_s: f64| -> Vec<[f64; 5]> {
        let boundaries = (InputBoundary::Angle, OutputBoundary::Arm);
        let mut run = Run::new(joint(0.12), &[], boundaries, dt_s);
        (1..=300)
            .map(|sample| {
                run.until(0.01 * f64::from(sample), |t| StepInput {
                    theta_in_rad: 0.5 * (1.0 - (std::f64::consts::TAU * 0.5 * t).cos()),
                    ..IDLE
                });
                let [f1, f2, f3, f4] = run.tensions_n();
                [f1, f2, f3, f4, run.plant.theta_out_rad()]
            })
            .collect()
    };
    let finest = trace(0.5e-3 / 32.0);
    let errors = [1e-3, 5e-4, 2.5e-4, 1.25e-4].map(|dt_s| {
        let mut sums = [0.0; 2];
        for (got, want) in trace(dt_s).iter().zip(&finest) {
            for i in 0..4 {
                sums[0] += (got[i] - want[i]).powi(2) / 1200.0;
            }
            sums[1] += (got[4] - want[4]).powi(2) / 300.0;
        }
        sums.map(f64::sqrt)
    });
    assert!(errors[1][0] < 0.02, "{errors:?} N, rad");
    assert!(errors[1][1] < 1.5e-5, "{errors:?} N, rad");
    for pair in errors.windows(2) {
        for (coarse, fine) in pair[0].iter().zip(pair[1]) {
            assert!(*coarse > 1.7 * fine, "not of first order: {errors:?} N, rad");
        }
    }
}

/// Parts that are missing for a run are named.
#[test]
fn missing_parts_are_refused() {
    let refuse = |parameters: JointParameters, input| {
        PlantConfig::new(parameters, 16, EffectSet::EMPTY, input, OutputBoundary::Arm).unwrap_err()
    };
    assert_eq!(refuse(joint(0.1), InputBoundary::Motor), PlantError::MotorMissing);
    let no_pulleys = JointParameters { pulleys: None, ..joint(0.1) };
    assert_eq!(refuse(no_pulleys, InputBoundary::Angle), PlantError::PulleysMissing);
    let nothing = JointParameters { motor: None, ..bare_motor() };
    assert_eq!(refuse(nothing, InputBoundary::Angle), PlantError::NothingToSimulate);
    let weightless = JointParameters { load: None, ..joint(0.1) };
    assert_eq!(refuse(weightless, InputBoundary::Angle), PlantError::InertiaMissing);
}

/// The stated stable step is safe: ten times the ring's length later nothing has grown, at the stiffest end (all sticks).
#[test]
fn stable_step_is_stable() {
    let mut parameters = joint(0.12);
    parameters.motor = Some(MOTOR);
    let probe = Run::new(parameters, &[], MOTOR_AND_ARM, 1e-4);
    let dt_s = probe.config.stable_step_s();
    // Sqrt(4 n k r²/I) of the arm with 16 contacts: 0.7/627 s.
    near("step", dt_s, 0.7 / (64.0 * STIFFNESS_N_PER_M * RADIUS_M * RADIUS_M / INERTIA_KG_M2).sqrt(), 1e-9);
    let mut run = Run::new(parameters, &[], MOTOR_AND_ARM, dt_s);
    run.plant = Plant::at_rest(&run.config, 0.0, 0.0);
    run.until(1.0, |t| duty(if t < 0.2 { 0.1 } else { 0.0 }));
    run.until(4.0, |_| duty(0.0));
    assert!(run.plant.omega_out_rad_s().abs() < 1e-3, "{} rad/s", run.plant.omega_out_rad_s());
    run.tensions_n().iter().for_each(|f| assert!((20.0..100.0).contains(f), "{f} N"));
}

/// An arm that is pushed through a play of pulley or gear drags both tendons along, and nothing holds the pulley: F1 = F3 at the
/// end of each step. A play that is looked at before the arm has moved leaves the pulley behind by a step, which is 0.4 N and
/// more here.
#[test]
fn inside_a_play_nothing_holds_the_pulley() {
    let find = |id: &str| ActiveEffect::with_defaults(effects::find(id).unwrap()).with("gap_rad", 0.2);
    for (play, input) in [
        (find("transmission_backlash"), InputBoundary::Angle),
        (find("gear_backlash").with("drag_behind", 0.0), InputBoundary::Motor),
    ] {
        let mut parameters = joint(0.12);
        parameters.motor = (input == InputBoundary::Motor).then_some(MOTOR);
        let mut run = Run::new(parameters, &[play], (input, OutputBoundary::Arm), 5e-4);
        for step in 1..=60 {
            run.until(5e-4 * f64::from(step), |_| StepInput { external_torque_nm: 0.6, ..duty(0.0) });
            let [f1, f2, f3, f4] = run.tensions_n();
            assert!((f1 - f3).abs() < 1e-9, "{}: {f1} and {f3} N", play.descriptor().id);
            // The sheaths alone hold the arm back.
            assert!(f2 < f4 || run.plant.omega_out_rad_s() <= 0.0, "{f2} and {f4} N");
        }
        assert!(run.plant.theta_out_rad() > 0.02, "{} rad", run.plant.theta_out_rad());
    }
}

/// Inside a play of the pulley the rotor turns as without cables, and an arm without friction of sheaths as without pulley.
#[test]
fn inside_a_play_of_the_pulley_rotor_and_arm_are_free() {
    let play =
        ActiveEffect::with_defaults(effects::find("transmission_backlash").unwrap()).with("gap_rad", 0.4);
    let mut parameters = joint(0.0);
    parameters.motor = Some(MOTOR);
    let mut run = Run::new(parameters, &[play], MOTOR_AND_ARM, 5e-4);
    let mut bare = Run::new(bare_motor(), &[], MOTOR_AND_ARM, 5e-4);
    let pushed_nm = 0.5;
    let (mut angle_rad, mut speed_rad_s) = (0.0_f64, 0.0_f64);
    for step in 1..=30 {
        let t_s = 5e-4 * f64::from(step);
        run.until(t_s, |_| StepInput { external_torque_nm: pushed_nm, ..duty(0.1) });
        bare.until(t_s, |_| duty(0.1));
        for _ in 0..500 {
            let torque_nm = pushed_nm - WEIGHT_NM * angle_rad.sin() - 0.004 * speed_rad_s;
            speed_rad_s += 1e-6 * torque_nm / INERTIA_KG_M2;
            angle_rad += 1e-6 * speed_rad_s;
        }
        near("rotor", run.plant.theta_motor_rad(), bare.plant.theta_motor_rad(), 1e-12);
        near("arm", run.plant.theta_out_rad(), angle_rad, 3e-6);
    }
    let lead_rad = run.plant.theta_motor_rad() - angle_rad;
    assert!(angle_rad > 0.03 && lead_rad.abs() < 0.2, "{angle_rad} rad, {lead_rad} rad apart");
}

/// An arm that flies through the play of its joint leaves pulley and tendons where they are.
#[test]
fn inside_a_play_of_the_joint_the_pulley_waits() {
    let play = ActiveEffect::with_defaults(effects::find("joint_backlash").unwrap()).with("gap_rad", 0.2);
    let mut run = Run::new(joint(0.3), &[play], (InputBoundary::Angle, OutputBoundary::Arm), 5e-4);
    let before_n = run.tensions_n();
    run.plant.set_speed_rad_s(6.0);
    for _ in 0..20 {
        run.plant.step(&run.config, &IDLE, 5e-4);
        assert_eq!(run.tensions_n(), before_n, "at {} rad", run.plant.theta_out_rad());
    }
    assert!(run.plant.theta_out_rad() > 0.05, "{} rad", run.plant.theta_out_rad());
}

/// Friction of the joint on a motor without tendons: ω = (k V/R - τ)/(b + k²/R).
#[test]
fn dry_friction_of_the_joint_slows_a_direct_drive() {
    let dry =
        ActiveEffect::with_defaults(effects::find("joint_coulomb_friction").unwrap()).with("torque_nm", 0.3);
    for sign in [1.0, -1.0] {
        let mut run = Run::new(bare_motor(), &[dry], MOTOR_AND_ARM, 5e-4);
        run.until(20.0, |_| duty(sign));
        let driving_nm = PULLEY_NM_PER_A * 24.0 / 2.0 - 0.3;
        let drag = 0.02 + PULLEY_NM_PER_A * PULLEY_NM_PER_A / 2.0;
        near("speed", sign * run.plant.omega_out_rad_s(), driving_nm / drag, 1e-9);
    }
}
