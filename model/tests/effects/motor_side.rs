//! Signatures of the motor's effects.

use crate::joint::{IDLE, RADIUS_M, Run, STIFFNESS_N_PER_M, joint};
use crate::motor::{MOTOR, PULLEY_INERTIA_KG_M2, PULLEY_NM_PER_A};
use crate::near::near;
use bowden_model::drive::BridgeInput;
use bowden_model::dry_friction::{BuildUp, DryFriction};
use bowden_model::effect::{ActiveEffect, PRESLIDING_RAD};
use bowden_model::effects::find;
use bowden_model::parameters::{JointParameters, MotorParameters};
use bowden_model::plant::{InputBoundary, OutputBoundary, Plant, StepInput};
use bowden_model::transmission::Outside;

fn effect(id: &str) -> ActiveEffect {
    ActiveEffect::with_defaults(find(id).unwrap())
}

fn duty(duty: f64) -> StepInput {
    StepInput { bridge: BridgeInput { duty, bus_v: 24.0, enabled: true }, ..IDLE }
}

/// Motor alone on its pulley.
fn free_motor(effects: &[ActiveEffect], dt_s: f64) -> Run {
    let parameters = JointParameters {
        motor: Some(MOTOR),
        pulleys: None,
        tendon: None,
        sheath: None,
        load: None,
        ..joint(0.0)
    };
    Run::new(parameters, effects, (InputBoundary::Motor, OutputBoundary::Arm), dt_s)
}

/// Steady speed at a duty: k (V d - k ω)/R = b ω + τ.
fn steady_speed(duty: f64, viscous: f64, dry_nm: f64) -> f64 {
    (PULLEY_NM_PER_A * 24.0 * duty / 2.0 - dry_nm) / (viscous + PULLEY_NM_PER_A * PULLEY_NM_PER_A / 2.0)
}

/// Friction of every kind by the speed that is left.
#[test]
fn friction_costs_speed() {
    for (id, level, viscous, dry_nm) in [
        ("motor_coulomb_friction", 0.3, 0.02, 0.08),
        ("motor_viscous_friction", 0.3, 0.07, 0.0),
        // Seven times the speed of 0.2 rad/s and more: only the 0.04 N·m at speed are left.
        ("motor_stribeck_friction", 0.1, 0.02, 0.04),
        ("drive_dead_zone", 0.3, 0.02, PULLEY_NM_PER_A * 24.0 * 0.03 / 2.0),
    ] {
        let mut run = free_motor(&[effect(id)], 5e-4);
        run.until(5.0, |_| duty(level));
        near(id, run.plant.omega_out_rad_s(), steady_speed(level, viscous, dry_nm), 1e-6);
    }
}

/// Breakaway: the duty at which 0.08, 0.08 + 0.04 N·m are reached, and the 3 % below which the drive is dead. Below it, dry
/// friction gives way by its share of the presliding turn, and comes back from there.
#[test]
fn standstill_below_breakaway() {
    let stribeck = effect("motor_stribeck_friction");
    for (active, level, travel_rad) in [
        (effect("motor_coulomb_friction"), 0.08 * 2.0 / (PULLEY_NM_PER_A * 24.0), PRESLIDING_RAD),
        (stribeck, 0.12 * 2.0 / (PULLEY_NM_PER_A * 24.0), PRESLIDING_RAD),
        (stribeck.with("presliding_rad", 2e-3), 0.12 * 2.0 / (PULLEY_NM_PER_A * 24.0), 2e-3),
        (effect("drive_dead_zone"), 0.03, 0.0),
    ] {
        let id = active.descriptor().id;
        for sign in [1.0, -1.0] {
            let mut run = free_motor(&[active], 5e-4);
            // Led there within a second: a step of the duty would carry the rotor beyond.
            for (begun_s, from, share) in [(0.0, 0.0, 0.99), (2.0, 0.99, 0.0), (4.0, 0.0, -0.99)] {
                run.until(begun_s + 2.0, |t_s| {
                    duty(sign * level * (from + (share - from) * (t_s - begun_s).min(1.0)))
                });
                near(id, run.plant.theta_motor_rad(), sign * share * travel_rad, 1e-9);
            }
            run.until(8.0, |_| duty(sign * 1.01 * level));
            let slipped_rad = sign * run.plant.theta_motor_rad();
            assert!(slipped_rad > 2.0 * travel_rad + 1e-4, "{id}: {slipped_rad}");
        }
    }
}

/// At the speed at which the excess has fallen to 1/e the rotor keeps that speed under k (V d - k ω)/R = b ω + 0.04 + 0.08/e, whichever way
/// friction builds up.
#[test]
fn friction_that_falls_with_speed_is_at_its_level_in_steady_sliding() {
    for exponent in [0.0, 1.0] {
        let kind = effect("motor_stribeck_friction").with("presliding_exponent", exponent);
        let level_nm = 0.04 + 0.08 / std::f64::consts::E;
        let needed = 0.02 * 0.2 + level_nm;
        let level = (needed * 2.0 / PULLEY_NM_PER_A + PULLEY_NM_PER_A * 0.2) / 24.0;
        let mut run = free_motor(&[kind], 5e-4);
        // Led there from above: from below it would stick.
        run.until(20.0, |t_s| duty(level + 0.02 * (1.0 - t_s / 2.0).max(0.0)));
        near(&format!("exponent {exponent}"), run.plant.omega_out_rad_s(), 0.2, 1e-6);
    }
}

/// Dry friction that builds up ever more slowly gives way by `s ln 10` under nine tenths of it, in proportion by 0.9 `s`.
#[test]
fn friction_that_falls_with_speed_builds_up_in_either_way() {
    for (exponent, turns) in [(0.0, 0.9), (1.0, std::f64::consts::LN_10)] {
        let kind = effect("motor_stribeck_friction").with("presliding_rad", 2e-3);
        let mut run = free_motor(&[kind.with("presliding_exponent", exponent)], 5e-4);
        let breakaway = 0.12 * 2.0 / (PULLEY_NM_PER_A * 24.0);
        run.until(4.0, |t_s| duty(0.9 * breakaway * t_s.min(1.0)));
        near(&format!("exponent {exponent}"), run.plant.theta_motor_rad(), turns * 2e-3, 0.01 * turns * 2e-3);
    }
}

/// A motor that slides to and fro is held back by all of its friction but for the turns over which that builds up again:
/// from full friction one way to full friction the other, the work of a stroke of length A is τ (A - 2 s) for both kinds, since
/// ∫ 2 e^{-x/s} dx is 2 s too.
#[test]
fn presliding_takes_its_turn_from_the_work_of_a_stroke() {
    let kinds = [BuildUp::Linear, BuildUp::Exponential];
    for (travel_rad, build_up) in [1e-4, 5e-3].into_iter().flat_map(|s| kinds.map(|kind| (s, kind))) {
        let mut presliding = -1.0;
        let (step_rad, level_nm) = (1e-5, 0.08);
        let mut work_j = 0.0;
        for _ in 0..4000 {
            // Inertia so large that the speed is what it is.
            let friction = DryFriction { level_nm, sliding: 1.0, travel_rad, build_up };
            let speed_rad_s = friction.after_rad_s(&mut presliding, step_rad / 1e-3, 1e-12, 1e-3);
            near("speed", speed_rad_s, step_rad / 1e-3, 1e-9);
            work_j += level_nm * presliding * step_rad;
        }
        near("work", work_j, level_nm * (0.04 - 2.0 * travel_rad), 2.0 * level_nm * step_rad);
    }
}

/// A weight on frictionless cables: the motor must exceed it by c = 10 % before it rises and fall 10 % short before it
/// sinks; with exponent 2 and c = 1 by the torque in N·m of itself. Ramps of 1 %/s, breakaway seen within 1 % once the gear
/// has given way.
#[test]
fn gear_friction_grows_with_the_load() {
    let linear = effect("gear_load_friction");
    let quadratic = linear.with("coefficient", 1.0).with("exponent", 2.0);
    for (gear, sign) in [(linear, 1.0), (linear, -1.0), (quadratic, 1.0), (quadratic, -1.0)] {
        let mut parameters = joint(0.0);
        parameters.motor = Some(MOTOR);
        let boundaries = (InputBoundary::Motor, OutputBoundary::Arm);
        let mut run = Run::new(parameters, &[gear], boundaries, 5e-4);
        run.plant = Plant::at_rest(&run.config, 0.6, 0.6);
        run.plant.settle(&run.config, &IDLE);
        let carried_nm = run.plant.torque_in_nm(&run.config);
        let level = carried_nm * 2.0 / (PULLEY_NM_PER_A * 24.0);
        // Full current from the first step: the winding takes 0.5 ms, the gear holds that long with the rotor's inertia.
        run.until(0.05, |_| duty(level));
        let rest_rad = run.plant.theta_motor_rad();
        let start_s = run.plant.t_s();
        while (run.plant.theta_motor_rad() - rest_rad).abs() < 2.0 * PRESLIDING_RAD {
            let change = 1.0 + sign * 0.01 * (run.plant.t_s() - start_s);
            run.plant.step(&run.config, &duty(level * change), 5e-4);
            assert!(run.plant.t_s() < 60.0);
        }
        let torque_nm = PULLEY_NM_PER_A * run.plant.current_a();
        let share = if gear == linear { 0.1 } else { carried_nm };
        near("breakaway over weight", torque_nm / carried_nm, 1.0 + sign * share, 0.01);
    }
}

/// A spindle without motor, turned by a prescribed angle: what drives it carries the cables and its dry friction of
/// 0.08 N·m, in full some milliradians after each turn.
#[test]
fn spindle_friction_shows_in_the_driving_torque() {
    let boundaries = (InputBoundary::Angle, OutputBoundary::Arm);
    let mut run = Run::new(joint(0.12), &[effect("motor_coulomb_friction")], boundaries, 5e-4);
    for (to_rad, sign) in [(0.3, 1.0), (-0.3, -1.0), (0.1, 1.0)] {
        let (t0, from_rad) = (run.plant.t_s(), run.plant.theta_in_rad());
        run.until(t0 + 1.0, |t| StepInput {
            theta_in_rad: from_rad + (to_rad - from_rad) * (t - t0),
            ..IDLE
        });
        let added_nm = run.plant.driving_torque_nm(&run.config) - run.plant.torque_in_nm(&run.config);
        near("spindle", added_nm, sign * 0.08, 1e-12);
    }
}

/// Pushed to either side against a held joint, rotor and pulley come to stand half the 20 mrad apart.
#[test]
fn backlash_lets_the_rotor_turn_alone() {
    let mut parameters = joint(0.0);
    parameters.motor = Some(MOTOR);
    let boundaries = (InputBoundary::Motor, OutputBoundary::Angle);
    let mut run = Run::new(parameters, &[effect("gear_backlash")], boundaries, 5e-4);
    for sign in [1.0, -1.0, 1.0] {
        let until_s = run.plant.t_s() + 2.0;
        run.until(until_s, |_| duty(sign * 0.02));
        let lead_rad = run.plant.theta_motor_rad() - run.plant.theta_in_rad();
        near("lead of the rotor", lead_rad, sign * 0.01, 1e-9);
        // The cables carry k V d/R all the same.
        let torque_nm = run.plant.torque_in_nm(&run.config);
        near("torque", torque_nm, sign * PULLEY_NM_PER_A * 24.0 * 0.02 / 2.0, 1e-6);
        assert!(torque_nm.abs() > 100.0 * RADIUS_M * 0.1);
    }
}

/// A torque from outside turns the pulley inside the play until the cables balance it; the rotor stays where it is.
#[test]
fn inside_a_play_the_pulley_gives_way_and_not_the_rotor() {
    let mut parameters = joint(0.0);
    parameters.motor = Some(MOTOR);
    let boundaries = (InputBoundary::Motor, OutputBoundary::Angle);
    let mut run = Run::new(parameters, &[effect("gear_backlash")], boundaries, 5e-4);
    for outside_nm in [0.1, -0.05, 0.1] {
        let until_s = run.plant.t_s() + 0.5;
        let loose_pulley = Outside { torque_nm: outside_nm, stiffness_nm_per_rad: 0.0 };
        run.until(until_s, |_| StepInput { loose_pulley, ..duty(0.0) });
        near("torque of the cables", run.plant.torque_in_nm(&run.config), outside_nm, 1e-6);
        near("rotor", run.plant.theta_motor_rad(), 0.0, 1e-9);
        let turned_rad = run.plant.theta_in_rad();
        assert!(turned_rad * outside_nm > 0.0 && turned_rad.abs() < 0.01, "turned by {turned_rad} rad");
    }
}

/// What drags behind the play slows the pulley and not the rotor. A rotor alone reaches the speed that its own share leaves
/// it; a pulley pulled by the torque T against the cables' k goes T/k (1 - 1/(1 + k Δt/b)ⁿ) in n implicit steps.
#[test]
fn inside_a_play_rotor_and_pulley_are_dragged_by_their_shares() {
    const STEP_S: f64 = 5e-4;
    const STIFFNESS_NM_PER_RAD: f64 = 2.0 * STIFFNESS_N_PER_M * RADIUS_M * RADIUS_M;
    const TORQUE_NM: f64 = 0.05;
    let mut parameters = joint(0.0);
    parameters.motor = Some(MotorParameters { viscous_nm_s_per_rad: 0.2, ..MOTOR });
    let boundaries = (InputBoundary::Motor, OutputBoundary::Angle);
    for behind in [0.0, 0.25, 1.0] {
        let play = effect("gear_backlash").with("gap_rad", 0.4).with("drag_behind", behind);
        let mut run = Run::new(parameters, &[play], boundaries, STEP_S);
        run.until(0.3, |_| duty(0.02));
        let before_rad = run.plant.theta_motor_rad();
        run.until(0.3 + STEP_S, |_| duty(0.02));
        assert!(run.plant.inside_gear_play());
        let speed_rad_s = (run.plant.theta_motor_rad() - before_rad) / STEP_S;
        near("rotor", speed_rad_s, steady_speed(0.02, 0.2 * (1.0 - behind), 0.0), 1e-4);

        let mut run = Run::new(parameters, &[play], boundaries, STEP_S);
        let loose_pulley = Outside { torque_nm: TORQUE_NM, stiffness_nm_per_rad: 0.0 };
        run.until(10.0 * STEP_S, |_| StepInput { loose_pulley, ..duty(0.0) });
        let lag = 0.2 * behind / (0.2 * behind + STIFFNESS_NM_PER_RAD * STEP_S);
        let turned_rad = TORQUE_NM / STIFFNESS_NM_PER_RAD * (1.0 - lag.powi(10));
        near("pulley", run.plant.theta_in_rad(), turned_rad, 1e-6);
    }
}

/// A spring from outside, ten times as stiff as both tendons, holds the pulley inside the play where the cables balance it;
/// taken as a torque of the step before it would throw the pulley from one side of the play to the other.
#[test]
fn inside_a_play_a_stiff_spring_holds_the_pulley() {
    const SPRING_NM_PER_RAD: f64 = 10.0 * 2.0 * STIFFNESS_N_PER_M * RADIUS_M * RADIUS_M;
    let mut parameters = joint(0.0);
    parameters.motor = Some(MOTOR);
    let boundaries = (InputBoundary::Motor, OutputBoundary::Angle);
    let mut run = Run::new(parameters, &[effect("gear_backlash")], boundaries, 5e-4);
    for target_rad in [0.004, -0.003, 0.002] {
        let mut before_nm = f64::INFINITY;
        for _ in 0..200 {
            let torque_nm = SPRING_NM_PER_RAD * (target_rad - run.plant.theta_in_rad());
            let loose_pulley = Outside { torque_nm, stiffness_nm_per_rad: SPRING_NM_PER_RAD };
            run.plant.step(&run.config, &StepInput { loose_pulley, ..duty(0.0) }, 5e-4);
            let left_nm = (SPRING_NM_PER_RAD * (target_rad - run.plant.theta_in_rad())
                - run.plant.torque_in_nm(&run.config))
            .abs();
            assert!(left_nm <= before_nm + 1e-9, "{left_nm} N·m after {before_nm} N·m");
            before_nm = left_nm;
        }
        assert!(before_nm < 1e-6, "{before_nm} N·m out of balance");
        near("rotor", run.plant.theta_motor_rad(), 0.0, 1e-9);
    }
}

/// At a mean speed Ω the ripple A sin(nΩt) meets the rotor's inertia, its damping and the winding: amplitude of the speed
/// A/|jnΩ I + b + k²/(R + jnΩ L)|. Linear in A, which the 0.5 % of speed ripple justify; 1 % for the explicit step.
#[test]
fn cogging_ripples_the_speed() {
    let mut run = free_motor(&[effect("motor_cogging")], 2e-5);
    run.until(2.0, |_| duty(0.4));
    let (mut low, mut high, mut sum) = (f64::MAX, f64::MIN, 0.0);
    for _ in 0..20_000 {
        run.plant.step(&run.config, &duty(0.4), 2e-5);
        let omega = run.plant.omega_out_rad_s();
        (low, high, sum) = (low.min(omega), high.max(omega), sum + omega);
    }
    let ripple_rad_s = 40.0 * sum / 20_000.0;
    let electric = PULLEY_NM_PER_A * PULLEY_NM_PER_A / (4.0 + (ripple_rad_s * 1e-3).powi(2));
    let real = 0.02 + electric * 2.0;
    let imaginary = ripple_rad_s * PULLEY_INERTIA_KG_M2 - electric * ripple_rad_s * 1e-3;
    near("ripple", 0.5 * (high - low) / (0.1 / real.hypot(imaginary)), 1.0, 0.01);
}

/// A blocked motor at V settles where R = `R_0` (1 + g V²/R), and gets there with the time constant, here 0.5 s.
#[test]
fn winding_heats_up() {
    let hot = effect("winding_heating").with("time_constant_s", 0.5);
    let parameters = JointParameters {
        motor: Some(MOTOR),
        pulleys: None,
        tendon: None,
        sheath: None,
        load: None,
        ..joint(0.0)
    };
    let mut run = Run::new(parameters, &[hot], (InputBoundary::Angle, OutputBoundary::Arm), 5e-4);
    run.until(0.05, |_| duty(0.2));
    // After a tenth of the time constant the resistance has risen by at most g i² R t/τ = 0.05 · 11.52 · 0.1 of itself.
    let early = run.plant.current_a() / 2.4;
    assert!((0.94..0.96).contains(&early), "{early} of the cold current");
    run.until(15.0, |_| duty(0.2));
    let resistance_ohm = 1.0 + (1.0 + 2.0 * 0.05 * 4.8_f64.powi(2)).sqrt();
    near("current", run.plant.current_a(), 4.8 / resistance_ohm, 1e-6);
}
