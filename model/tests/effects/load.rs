//! Signatures of the joint's effects, in the torque (F2 - F4) r2 that the cables bring.

use crate::joint::{IDLE, INERTIA_KG_M2, RADIUS_M, Run, STIFFNESS_N_PER_M, WEIGHT_NM, joint};
use crate::near::near;
use bowden_model::dry_friction::BuildUp;
use bowden_model::effect::{ActiveEffect, EffectState, JointPort};
use bowden_model::effects::find;
use bowden_model::load::GRAVITY_M_S2;
use bowden_model::plant::{InputBoundary, OutputBoundary, StepInput};

/// Both cables, N·m per radian of the joint.
const CABLES_NM_PER_RAD: f64 = 2.0 * STIFFNESS_N_PER_M * RADIUS_M * RADIUS_M;

fn run(effect: Option<&str>) -> Run {
    let effects: Vec<ActiveEffect> =
        effect.iter().map(|id| ActiveEffect::with_defaults(find(id).unwrap())).collect();
    Run::new(joint(0.0), &effects, (InputBoundary::Angle, OutputBoundary::Arm), 5e-4)
}

fn at(theta_in_rad: f64) -> StepInput {
    StepInput { theta_in_rad, ..IDLE }
}

fn torque_nm(run: &Run) -> f64 {
    let [_, f2, _, f4] = run.tensions_n();
    (f2 - f4) * RADIUS_M
}

/// Mean of (F2 - F4) r2 - m g l sin θ near θ = 0 in slow passes, down and up, N·m.
fn drag_nm(effect: Option<&str>, speed_rad_s: f64) -> [f64; 2] {
    let mut run = run(effect);
    let leg_s = 1.0 / speed_rad_s;
    let mut means = [0.0; 2];
    for (leg, sign) in [(0.5, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let (from_s, from_rad) = (run.plant.t_s(), run.plant.theta_in_rad());
        let (mut sum, mut count) = (0.0, 0.0);
        while run.plant.t_s() < from_s + leg * leg_s - 1e-9 {
            let now_s = run.plant.t_s() + 5e-4 - from_s;
            run.plant.step(&run.config, &at(from_rad + sign * speed_rad_s * now_s), 5e-4);
            if run.plant.theta_out_rad().abs() < 0.1 {
                sum += torque_nm(&run) - WEIGHT_NM * run.plant.theta_out_rad().sin();
                count += 1.0;
            }
        }
        means[usize::from(sign > 0.0)] = sum / count;
    }
    means
}

/// Dry friction of 0.05 N·m: F2 - F4 jumps by 2 τ/r2 = 6.67 N between the directions, the same at every speed.
#[test]
fn coulomb_friction_is_a_jump_at_reversal() {
    for speed in [0.25, 0.5] {
        let [down, up] = drag_nm(Some("joint_coulomb_friction"), speed);
        let [plain_down, plain_up] = drag_nm(None, speed);
        near("up", up - plain_up, 0.05, 1e-4);
        near("down", down - plain_down, -0.05, 1e-4);
    }
}

/// Added viscous friction of 0.05 N·m·s/rad: in proportion to the speed, which stretch makes 1.3 % slower.
#[test]
fn viscous_friction_grows_with_speed() {
    for speed in [0.25, 0.5] {
        let [down, up] = drag_nm(Some("joint_viscous_friction"), speed);
        let [plain_down, plain_up] = drag_nm(None, speed);
        let slowed = 1.0 - WEIGHT_NM / CABLES_NM_PER_RAD;
        near("up", up - plain_up, 0.05 * speed * slowed, 2e-4);
        near("down", down - plain_down, -0.05 * speed * slowed, 2e-4);
    }
}

/// The weight pulls the arm through half the play on either side: at rest it hangs 10 mrad lower than without, and the
/// cables carry it all the same.
#[test]
fn backlash_drops_the_arm_by_half_the_gap() {
    for side in [1.0, -1.0] {
        let mut loose = run(Some("joint_backlash"));
        loose.until(4.0, |t| at(side * 0.4 * t.min(1.0)));
        let theta = loose.plant.theta_out_rad();
        near("carried", torque_nm(&loose), WEIGHT_NM * theta.sin(), 1e-6);
        let stretch_rad = torque_nm(&loose) / CABLES_NM_PER_RAD;
        near("angle", side * 0.4 - stretch_rad - theta, side * 0.01, 1e-6);
    }
}

/// An arm that flies freely through the play, its weight held from outside, comes back from the cables with its speed, less what
/// the ropes take in half a cycle of the ring, e^{-πζ} with ζ = 0.039: the pulley that it meets has no inertia.
#[test]
fn an_arm_rebounds_from_the_cables_behind_its_play() {
    for speed in [0.1, 0.3] {
        let play = ActiveEffect::with_defaults(find("joint_backlash").unwrap()).with("gap_rad", 0.1);
        let mut parameters = joint(0.0);
        parameters.load.as_mut().unwrap().viscous_nm_s_per_rad = 0.0;
        let mut run = Run::new(parameters, &[play], (InputBoundary::Angle, OutputBoundary::Arm), 1e-4);
        run.plant.set_speed_rad_s(speed);
        let mut slowest = speed;
        while run.plant.t_s() < 0.075 / speed + 0.1 {
            let weight_nm = WEIGHT_NM * run.plant.theta_out_rad().sin();
            run.plant.step(&run.config, &StepInput { external_torque_nm: weight_nm, ..at(0.0) }, 1e-4);
            slowest = slowest.min(run.plant.omega_out_rad_s());
        }
        near("speed after over before", -slowest / speed, (-0.039 * std::f64::consts::PI).exp(), 0.005);
    }
}

/// Static torque: weight, and the spring of 0.3 N·m/rad, the stop of 20 N·m/rad from 0.5 rad on, the added 0.5 kg after
/// 10 s.
#[test]
fn static_torque_shows_spring_stop_and_payload() {
    for (id, theta_in_rad) in
        [("joint_spring", 0.4), ("joint_spring", -0.4), ("end_stop_contact", 0.45), ("end_stop_contact", 0.8)]
    {
        let mut run = run(Some(id));
        run.until(6.0, |t| at(theta_in_rad * t.min(1.0)));
        let theta = run.plant.theta_out_rad();
        let added_nm = if id == "joint_spring" { 0.3 * theta } else { 20.0 * (theta - 0.5).max(0.0) };
        assert!(added_nm != 0.0 || theta < 0.5);
        near(id, torque_nm(&run), WEIGHT_NM * theta.sin() + added_nm, 1e-6);
    }
    let spring = ActiveEffect::with_defaults(find("joint_spring").unwrap()).with("rest_rad", 0.2);
    let mut sprung = Run::new(joint(0.0), &[spring], (InputBoundary::Angle, OutputBoundary::Arm), 5e-4);
    sprung.until(6.0, |t| at(0.4 * t.min(1.0)));
    let theta = sprung.plant.theta_out_rad();
    near("rest angle", torque_nm(&sprung), WEIGHT_NM * theta.sin() + 0.3 * (theta - 0.2), 1e-6);

    // Bent by 0.6 rad and more, a spring with 2/rad² is some two thirds stiffer.
    let mut hardened = Run::new(
        joint(0.0),
        &[spring.with("hardening_per_rad2", 2.0)],
        (InputBoundary::Angle, OutputBoundary::Arm),
        5e-4,
    );
    hardened.until(6.0, |t| at(-0.4 * t.min(1.0)));
    let theta = hardened.plant.theta_out_rad();
    let bent_rad = theta - 0.2;
    assert!(bent_rad < -0.55, "{bent_rad}");
    let spring_nm = 0.3 * bent_rad + 0.6 * bent_rad.powi(3);
    near("hardening", torque_nm(&hardened), WEIGHT_NM * theta.sin() + spring_nm, 1e-6);

    let mut run = run(Some("payload_change"));
    for (until_s, mass_kg) in [(9.9, 1.5), (16.0, 2.0)] {
        run.until(until_s, |t| at(0.4 * t.min(1.0)));
        let theta = run.plant.theta_out_rad();
        near("payload", torque_nm(&run), mass_kg * GRAVITY_M_S2 * 0.03 * theta.sin(), 1e-6);
    }
}

/// 0.2 rad deep in a stop of 20 N·m/rad at 0.1 rad: 4 N·m, √2 times that with the power of 1.5, a fifth more at 0.5 rad/s with 0.4 s/rad; nothing where the
/// arm leaves faster than the stop follows.
#[test]
fn a_stop_gets_stiffer_with_depth_and_damps() {
    let stop = ActiveEffect::with_defaults(find("end_stop_contact").unwrap())
        .with("stop_rad", -0.4)
        .with("exponent", 1.5)
        .with("damping_s_per_rad", 0.4);
    for (theta_rad, omega_rad_s, torque_nm) in [
        (-0.6, 0.0, 4.0 * 2.0_f64.sqrt()),
        (-0.6, -0.5, 4.8 * 2.0_f64.sqrt()),
        (-0.6, 3.0, 0.0),
        (-0.39, -0.5, 0.0),
        (0.6, 0.0, 0.0),
    ] {
        let mut port = JointPort {
            t_s: 0.0,
            dt_s: 1e-3,
            theta_rad,
            omega_rad_s,
            mass_kg: 1.0,
            torque_nm: 0.0,
            coulomb_nm: 0.0,
            presliding_rad: 1e-3,
            build_up: BuildUp::default(),
            play_rad: 0.0,
        };
        stop.effect.joint(&stop.parameters, &mut EffectState::default(), &mut port);
        near(&format!("{theta_rad} rad, {omega_rad_s} rad/s"), port.torque_nm, torque_nm, 1e-12);
    }
}

/// Added mass slows the ring: ω² I is the same stiffness, so the frequency falls with the root of the inertia.
#[test]
fn payload_slows_the_ring() {
    let cycles = |effects: &[ActiveEffect]| -> f64 {
        let mut run = Run::new(joint(0.0), effects, (InputBoundary::Angle, OutputBoundary::Arm), 1e-4);
        run.until(0.1, |_| at(0.0));
        run.plant.set_speed_rad_s(0.1);
        let mut times = Vec::new();
        while times.len() < 9 {
            let before = run.plant.theta_out_rad();
            run.plant.step(&run.config, &at(0.0), 1e-4);
            let now = run.plant.theta_out_rad();
            if before * now < 0.0 {
                times.push(run.plant.t_s() - now / run.plant.omega_out_rad_s());
            }
        }
        4.0 / (times[8] - times[0])
    };
    let heavier = ActiveEffect::with_defaults(find("payload_change").unwrap()).with("time_s", 0.0);
    let ratio = cycles(&[heavier]) / cycles(&[]);
    // The weight's own stiffness m g l is 1.3 % of the cables', the damping changes the frequency by 0.1 %.
    let cables = CABLES_NM_PER_RAD;
    let inertia = INERTIA_KG_M2 * 2.0 / 1.5;
    let want = ((cables + WEIGHT_NM * 2.0 / 1.5) / inertia / ((cables + WEIGHT_NM) / INERTIA_KG_M2)).sqrt();
    near("frequency", ratio, want, 1e-3);
}
