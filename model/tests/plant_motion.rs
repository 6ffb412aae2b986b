//! Arm on its cables: equilibrium, oscillation, drag, energy, static friction, boundaries.

#[path = "common/joint.rs"]
mod joint;
#[path = "common/near.rs"]
mod near;

use bowden_model::effect::ActiveEffect;
use bowden_model::effects;
use bowden_model::parameters::JointParameters;
use bowden_model::plant::{InputBoundary, OutputBoundary, StepInput};
use joint::{IDLE, INERTIA_KG_M2, PRETENSION_N, RADIUS_M, Run, STIFFNESS_N_PER_M, WEIGHT_NM, joint};
use near::near;

const ARM_BEHIND_ANGLE: (InputBoundary, OutputBoundary) = (InputBoundary::Angle, OutputBoundary::Arm);

/// Both cables, straight through: N·m per radian of the joint.
const STIFFNESS_NM_PER_RAD: f64 = 2.0 * STIFFNESS_N_PER_M * RADIUS_M * RADIUS_M;

/// Internal friction of the ropes, the time constant that `plant.rs` documents.
const ROPE_LOSS_S: f64 = 5e-4;

fn at(theta_in_rad: f64) -> StepInput {
    StepInput { theta_in_rad, ..IDLE }
}

fn without_viscous(mut joint: JointParameters) -> JointParameters {
    joint.load.as_mut().unwrap().viscous_nm_s_per_rad = 0.0;
    joint
}

/// k (`θ_in` - θ) = m g l sin θ, by bisection.
fn hanging_angle_rad(theta_in_rad: f64) -> f64 {
    let (mut low, mut high) = (0.0, theta_in_rad);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if STIFFNESS_NM_PER_RAD * (theta_in_rad - middle) > WEIGHT_NM * f64::sin(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// The arm comes to rest where the cables carry its weight; rope loss leaves e^{-30} of the first swing after 5 s.
#[test]
fn arm_comes_to_rest_where_the_cables_carry_it() {
    let mut run = Run::new(joint(0.0), &[], ARM_BEHIND_ANGLE, 5e-4);
    run.until(5.0, |t| at(0.6 * t.min(1.0)));
    near("angle", run.plant.theta_out_rad(), hanging_angle_rad(0.6), 1e-9);
    let [f1, f2, f3, f4] = run.tensions_n();
    near("cable a", f1, f2, 1e-9);
    near("cable b", f3, f4, 1e-9);
    near("mean tension", 0.5 * (f1 + f3), PRETENSION_N, 1e-9);
}

/// `settle` finds the same place at once, with 2^-40 of the imbalance left, and with friction a place inside the band.
#[test]
fn settle_balances_the_weight() {
    for friction in [0.0, 0.12] {
        let mut run = Run::new(joint(friction), &[], ARM_BEHIND_ANGLE, 5e-4);
        run.plant = bowden_model::plant::Plant::at_rest(&run.config, 0.6, 0.6);
        run.plant.settle(&run.config, &at(0.6));
        let weight_nm = WEIGHT_NM * run.plant.theta_out_rad().sin();
        near("torque", run.plant.torque_out_nm(&run.config), weight_nm, 1e-9);
        if friction == 0.0 {
            near("angle", run.plant.theta_out_rad(), hanging_angle_rad(0.6), 1e-9);
        }
        // It stays there.
        let settled_rad = run.plant.theta_out_rad();
        run.until(0.5, |_| at(0.6));
        near("half a second later", run.plant.theta_out_rad(), settled_rad, 1e-9);
    }
}

/// Frequency (rad/s) and decay rate (1/s) of the free ring about the hanging position, from zero crossings and from the
/// speeds there, over ten cycles.
fn ring(dt_s: f64) -> (f64, f64) {
    let mut run = Run::new(without_viscous(joint(0.0)), &[], ARM_BEHIND_ANGLE, dt_s);
    // A thousandth of a radian: sin θ is θ to 1e-7.
    run.plant.set_speed_rad_s(0.1);
    let mut crossings: Vec<(f64, f64)> = Vec::new();
    let mut before = 0.0;
    while crossings.len() < 21 {
        run.plant.step(&run.config, &at(0.0), dt_s);
        let now = run.plant.theta_out_rad();
        if before * now < 0.0 {
            let speed = run.plant.omega_out_rad_s();
            crossings.push((run.plant.t_s() - now / speed, speed.abs()));
        }
        before = now;
    }
    let (first, last) = (crossings[0], crossings[20]);
    let time_s = last.0 - first.0;
    (20.0 * std::f64::consts::PI / time_s, (first.1 / last.1).ln() / time_s)
}

/// ω² = (2 k r² + m g l)/I; the rope loss adds the damping torque τ 2kr² ω, so the decay rate is σ = τ 2 k r²/2I and
/// the ring has sqrt(ω² - σ²). The error of both falls with the square of the step, and the decay of 6.1 1/s is met to 0.1 % at 0.5 ms; a drag
/// of -K ω dt would take 6 1/s from it.
#[test]
fn ring_has_the_frequency_and_decay_of_theory() {
    let decay_per_s = 0.5 * ROPE_LOSS_S * STIFFNESS_NM_PER_RAD / INERTIA_KG_M2;
    let square = (STIFFNESS_NM_PER_RAD + WEIGHT_NM) / INERTIA_KG_M2;
    let frequency_rad_s = (square - decay_per_s * decay_per_s).sqrt();
    let errors = [1e-3, 5e-4, 2.5e-4, 1.25e-4].map(|dt_s| {
        let (frequency, decay) = ring(dt_s);
        (frequency / frequency_rad_s - 1.0, decay / decay_per_s - 1.0)
    });
    near("frequency at 0.5 ms", errors[1].0, 0.0, 3e-4);
    near("decay at 0.5 ms", errors[1].1, 0.0, 1e-3);
    for pair in errors.windows(2) {
        assert!(pair[0].0.abs() > 3.6 * pair[1].0.abs(), "frequency: {errors:?}");
    }
}

/// In slow steady motion (F2 - F4) r2 is gravity and b ω, nothing else: half the difference of the passes there and back at
/// one angle over the speed is the drag. The rope loss carries τ m g l of it, because the stretch changes with the weight's
/// moment, and the joint is slower than the input by m g l/2kr². A cable torque taken between the moves of the two pulleys acts as a drag of
/// -K ω dt, -16 mN·m·s/rad at 0.5 ms against the nominal 4. Friction in the sheath does not change what reaches the joint.
#[test]
fn regress_no_spurious_drag_in_steady_motion() {
    for friction in [0.0, 0.12] {
        for dt_s in [5e-4, 1e-3] {
            for speed_rad_s in [0.25, 0.5] {
                let mut run = Run::new(joint(friction), &[], ARM_BEHIND_ANGLE, dt_s);
                // A triangle of ±1 rad; torque where the joint passes zero, well after each turn.
                let period_s = 4.0 / speed_rad_s;
                let triangle = |t: f64| {
                    let phase = (t / period_s).fract();
                    4.0 * if phase < 0.25 {
                        phase
                    } else if phase < 0.75 {
                        0.5 - phase
                    } else {
                        phase - 1.0
                    }
                };
                let mut sums = [(0.0, 0.0); 2];
                while run.plant.t_s() < 1.75 * period_s {
                    let before = run.plant.theta_out_rad();
                    run.plant.step(&run.config, &at(triangle(run.plant.t_s() + dt_s)), dt_s);
                    let theta = run.plant.theta_out_rad();
                    if theta.abs() < 0.2 && run.plant.t_s() > 0.25 * period_s {
                        let [_, f2, _, f4] = run.tensions_n();
                        let drag_nm = (f2 - f4) * RADIUS_M - WEIGHT_NM * theta.sin();
                        let sum = &mut sums[usize::from(theta > before)];
                        sum.0 += drag_nm;
                        sum.1 += 1.0;
                    }
                }
                let drag = 0.5 * (sums[1].0 / sums[1].1 - sums[0].0 / sums[0].1) / speed_rad_s;
                let want = 0.004 * (1.0 - WEIGHT_NM / STIFFNESS_NM_PER_RAD) - ROPE_LOSS_S * WEIGHT_NM;
                near(&format!("μ {friction}, dt {dt_s}, {speed_rad_s} rad/s"), drag, want, 0.05 * 0.004);
            }
        }
    }
}

/// Kinetic energy, weight and both springs, J. `Σ c T²/2` over the segments, half ones at the ends.
fn energy_j(run: &Run) -> f64 {
    let parts = run.config.transmission().unwrap();
    let mesh = parts.mesh();
    let n = mesh.elements();
    let stretch_j = |tendon: &bowden_model::sheath::Tendon| -> f64 {
        (0..=n)
            .map(|j| {
                let share = if j == 0 || j == n { 0.5 } else { 1.0 };
                0.5 * share / (n as f64 * STIFFNESS_N_PER_M) * tendon.tension_n(mesh, j).powi(2)
            })
            .sum()
    };
    let state = run.plant.transmission().unwrap();
    0.5 * INERTIA_KG_M2 * run.plant.omega_out_rad_s().powi(2)
        + WEIGHT_NM * (1.0 - run.plant.theta_out_rad().cos())
        + stretch_j(state.tendon(0))
        + stretch_j(state.tendon(1))
}

/// Work of the input, less what is stored, less b ω² and the rope loss, is what the sheaths take: never negative, and
/// in one slow cycle M = 2 F0 r μK over both ways of the input beyond the dead zones.
#[test]
fn sheath_friction_takes_energy_and_never_gives() {
    for friction in [0.0, 0.12] {
        let dt_s = 1e-4;
        let mut run = Run::new(joint(friction), &[], ARM_BEHIND_ANGLE, dt_s);
        let start_j = energy_j(&run);
        let (mut work_j, mut lost_j, mut largest_j, mut cycle_j) = (0.0, 0.0, 0.0_f64, [0.0; 3]);
        let sine = |t: f64| 0.5 * (std::f64::consts::TAU * 0.25 * t).sin();
        for step in 0..100_000 {
            let before = (run.plant.theta_in_rad(), run.plant.torque_in_nm(&run.config));
            run.plant.step(&run.config, &at(sine(run.plant.t_s() + dt_s)), dt_s);
            let torque_nm = 0.5 * (before.1 + run.plant.torque_in_nm(&run.config));
            work_j += torque_nm * (run.plant.theta_in_rad() - before.0);
            let omega = run.plant.omega_out_rad_s();
            let lag = run.plant.omega_in_rad_s() - omega;
            // The rope loss drives the joint with τk·lag; it takes τk·lag² in all, of which the input gives lag ω_in.
            lost_j += dt_s * (0.004 * omega * omega - ROPE_LOSS_S * STIFFNESS_NM_PER_RAD * lag * omega);
            let sheath_j = work_j - (energy_j(&run) - start_j) - lost_j;
            assert!(sheath_j >= largest_j - 2e-4, "step {step}: {sheath_j} J after {largest_j} J");
            largest_j = largest_j.max(sheath_j);
            if step % 40_000 == 20_000 - 1 {
                cycle_j[step / 40_000] = sheath_j;
            }
        }
        let per_cycle_j = cycle_j[2] - cycle_j[1];
        // Dead zone at no load 20.4 mrad (23); the weight's 0.2 N·m change its share little.
        let m_nm = 2.0 * PRETENSION_N * RADIUS_M * friction * std::f64::consts::PI;
        let dead_zone_rad = 2.0 * PRETENSION_N / (STIFFNESS_N_PER_M * RADIUS_M)
            * (0.5 * friction * std::f64::consts::PI).tanh();
        let want_j = 2.0 * m_nm * (1.0 - dead_zone_rad);
        near("friction work of a cycle", per_cycle_j, want_j, 0.005 * want_j + 2e-5);
    }
}

/// Dry friction of the joint is a spring below breakaway, `τ_c` over its presliding turn beside the cables; the arm slides above;
/// and a swing comes to rest where its energy is spent, but for the presliding turn that springs back.
#[test]
fn dry_friction_gives_way_then_slides_and_stops_a_swing() {
    let travel_rad = 4e-4;
    let dry = ActiveEffect::with_defaults(effects::find("joint_coulomb_friction").unwrap())
        .with("torque_nm", 0.3)
        .with("presliding_rad", travel_rad);
    let mut run = Run::new(joint(0.0), &[dry], ARM_BEHIND_ANGLE, 5e-4);
    run.until(2.0, |t| StepInput { external_torque_nm: 0.14 * t.min(1.0), ..at(0.0) });
    let stiffness = STIFFNESS_NM_PER_RAD + WEIGHT_NM;
    near("given way", run.plant.theta_out_rad(), 0.14 / (0.3 / travel_rad + stiffness), 1e-7);
    run.until(4.0, |_| StepInput { external_torque_nm: 0.5, ..at(0.0) });
    assert!(run.plant.theta_out_rad() > 2.0 * travel_rad, "{} rad", run.plant.theta_out_rad());
    for speed in [0.5, 1.0] {
        let mut run = Run::new(joint(0.0), &[dry], ARM_BEHIND_ANGLE, 5e-4);
        run.plant.set_speed_rad_s(speed);
        let mut farthest_rad = 0.0_f64;
        for _ in 0..4000 {
            run.plant.step(&run.config, &at(0.0), 5e-4);
            farthest_rad = farthest_rad.max(run.plant.theta_out_rad());
        }
        // I v²/2 = τ (x - travel/2) + k x²/2; up to one step at the first speed is lost.
        let spent_j = 0.5 * INERTIA_KG_M2 * speed * speed + 0.5 * 0.3 * travel_rad;
        let want_rad = ((0.09 + 2.0 * stiffness * spent_j).sqrt() - 0.3) / stiffness;
        near("stopping angle", farthest_rad, want_rad, speed * 5e-4);
        let back_rad = farthest_rad - run.plant.theta_out_rad();
        assert!((0.0..=2.0 * travel_rad).contains(&back_rad), "{back_rad} rad back from {farthest_rad}");
        assert!(run.plant.omega_out_rad_s().abs() < 1e-3, "{} rad/s", run.plant.omega_out_rad_s());
    }
}

/// With a friction of 0.3 N·m and a law of 0.1 N·m by the sign of the speed the joint holds from -0.2 to 0.4 N·m, and a swing comes to rest where
/// its energy is spent against 0.4 N·m forwards and 0.2 N·m backwards.
#[test]
fn friction_by_the_sign_of_the_speed_holds_and_slides_by_its_sum_with_dry_friction() {
    let (dry_nm, more_nm, travel_rad) = (0.3, 0.1, 4e-4);
    let dry = ActiveEffect::with_defaults(effects::find("joint_coulomb_friction").unwrap())
        .with("torque_nm", dry_nm)
        .with("presliding_rad", travel_rad);
    let law = ActiveEffect::with_defaults(bowden_model::law::find("law_joint_friction_by_sign").unwrap())
        .with("amplitude_nm", more_nm);
    for (pushed_nm, slides) in [(0.38, false), (0.43, true), (-0.18, false), (-0.23, true)] {
        let mut run = Run::new(joint(0.0), &[dry, law], ARM_BEHIND_ANGLE, 5e-4);
        run.until(3.0, |t| StepInput { external_torque_nm: pushed_nm * t.min(1.0), ..at(0.0) });
        let turned_rad = run.plant.theta_out_rad();
        assert_eq!(turned_rad.abs() > travel_rad, slides, "{turned_rad} rad by {pushed_nm} N·m");
    }
    for (speed, slip_nm) in [(1.0, dry_nm + more_nm), (-1.0, dry_nm - more_nm)] {
        let mut run = Run::new(joint(0.0), &[dry, law], ARM_BEHIND_ANGLE, 5e-4);
        run.plant.set_speed_rad_s(speed);
        let mut farthest_rad = 0.0_f64;
        for _ in 0..4000 {
            run.plant.step(&run.config, &at(0.0), 5e-4);
            farthest_rad = farthest_rad.max(speed * run.plant.theta_out_rad());
        }
        // I v²/2 = τ x - τ_c travel/2 + k x²/2; up to one step at the first speed is lost.
        let stiffness = STIFFNESS_NM_PER_RAD + WEIGHT_NM;
        let spent_j = 0.5 * INERTIA_KG_M2 + 0.5 * dry_nm * travel_rad;
        let want_rad = ((slip_nm * slip_nm + 2.0 * stiffness * spent_j).sqrt() - slip_nm) / stiffness;
        near("stopping angle", farthest_rad, want_rad, 5e-4);
    }
}

/// A joint without weight carries exactly the torque from outside and its own viscous friction, for any mesh, motion and
/// step, also where the input turns much faster than the joint can follow elastically.
#[test]
fn torque_boundary_carries_the_torque_from_outside() {
    for friction in [0.0, 0.12, 0.4] {
        for (elements, dt_s, speed) in
            [(16, 5e-4, 1.0), (16, 2e-3, 1.0), (64, 2e-3, 1.0), (1, 2e-3, 1.0), (64, 2e-3, 8.0)]
        {
            let boundaries = (InputBoundary::Angle, OutputBoundary::Torque);
            let mut run = Run::new(joint(friction), &[], boundaries, dt_s);
            run.config = bowden_model::plant::PlantConfig::new(
                joint(friction),
                elements,
                bowden_model::effect_set::EffectSet::EMPTY,
                boundaries.0,
                boundaries.1,
            )
            .unwrap();
            run.plant = bowden_model::plant::Plant::at_rest(&run.config, 0.0, 0.0);
            while run.plant.t_s() < 4.0 {
                let t = run.plant.t_s() + dt_s;
                let input = StepInput {
                    external_torque_nm: -0.4 * (1.3 * speed * t).sin(),
                    ..at(0.5 * (std::f64::consts::PI * speed * t).sin())
                };
                run.plant.step(&run.config, &input, dt_s);
                let carried_nm = run.plant.torque_out_nm(&run.config) - 0.004 * run.plant.omega_out_rad_s();
                // Within the 1e-8 rad at which the balance is called found, times the stiffest end.
                near(
                    &format!("μ {friction}, n {elements}, dt {dt_s}, {t} s"),
                    carried_nm,
                    -input.external_torque_nm,
                    1e-8 * 2.0 * elements as f64 * STIFFNESS_NM_PER_RAD,
                );
            }
        }
    }
}
