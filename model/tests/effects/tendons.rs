//! Signatures of the transmission's effects, in tensions of cables drawn through their sheaths.

use crate::joint::{IDLE, PRETENSION_N, RADIUS_M, Run, STIFFNESS_N_PER_M, joint};
use crate::near::near;
use bowden_model::effect::ActiveEffect;
use bowden_model::effects::find;
use bowden_model::friction_law::FrictionLaw;
use bowden_model::parameters::JointParameters;
use bowden_model::plant::{InputBoundary, OutputBoundary, StepInput};

const K_RAD: f64 = std::f64::consts::PI;

fn effect(id: &str) -> ActiveEffect {
    ActiveEffect::with_defaults(find(id).unwrap())
}

/// Both pulleys prescribed.
fn held(friction: f64, effects: &[ActiveEffect]) -> Run {
    Run::new(joint(friction), effects, (InputBoundary::Angle, OutputBoundary::Angle), 1e-3)
}

/// Both pulleys turn together at `speed_rad_s` for `time_s`.
fn draw(run: &mut Run, speed_rad_s: f64, time_s: f64) {
    let (t0, in0, out0) = (run.plant.t_s(), run.plant.theta_in_rad(), run.plant.theta_out_rad());
    run.until(t0 + time_s, |t| StepInput {
        theta_in_rad: in0 + speed_rad_s * (t - t0),
        theta_out_rad: out0 + speed_rad_s * (t - t0),
        ..IDLE
    });
}

/// Turns only the input to an angle, over a second.
fn stretch(run: &mut Run, theta_in_rad: f64) {
    let (t0, in0, out) = (run.plant.t_s(), run.plant.theta_in_rad(), run.plant.theta_out_rad());
    run.until(t0 + 1.0, |t| StepInput {
        theta_in_rad: in0 + (theta_in_rad - in0) * (t - t0),
        theta_out_rad: out,
        ..IDLE
    });
}

/// Friction exponents ln(F1/F2), ln(F4/F3) of the cables drawn towards + .
fn exponents(run: &Run) -> [f64; 2] {
    let [f1, f2, f3, f4] = run.tensions_n();
    [(f1 / f2).ln(), (f4 / f3).ln()]
}

/// Friction that does not scale with tension: without μ, F1 - F2 is the force itself. Viscous 60 N·s/m at 15 mm/s: 0.9 N, at
/// 30 mm/s 1.8 N; bending 0.6 N/rad over π.
#[test]
fn friction_forces_without_coulomb_friction() {
    for (id, speed, want_n) in [
        ("sheath_viscous_friction", 1.0, 0.9),
        ("sheath_viscous_friction", 2.0, 1.8),
        ("bending_friction", 1.0, 0.6 * K_RAD),
        ("bending_friction", 0.1, 0.6 * K_RAD),
    ] {
        for sign in [1.0, -1.0] {
            let mut run = held(0.0, &[effect(id)]);
            draw(&mut run, sign * speed, 1.0);
            let [f1, f2, f3, f4] = run.tensions_n();
            near(id, f1 - f2, sign * want_n, 1e-9);
            near(id, f4 - f3, sign * want_n, 1e-9);
        }
    }
}

/// Both kinds of friction together: dT/dφ = -(μ T + q) gives F1 + q/μ = e^{μK} (F2 + q/μ).
#[test]
fn bending_friction_adds_to_coulomb_friction() {
    let mut run = held(0.12, &[effect("bending_friction")]);
    draw(&mut run, 1.0, 1.0);
    let [f1, f2, ..] = run.tensions_n();
    near("ratio", (f1 + 5.0) / (f2 + 5.0), (0.12 * K_RAD).exp(), 1e-9);
}

/// What multiplies μ or K, by the exponents of both cables.
#[test]
fn friction_exponents_tell_the_effect() {
    let a = 0.12 * K_RAD;
    // 1.6 times at standstill, e^{-(v/v_s)^1.5} of the excess at v_s = 3 mm/s and at a tenth of it.
    for (speed, excess) in [(0.2, (-1.0_f64).exp()), (0.02, (-(0.1_f64.powf(1.5))).exp()), (4.0, 0.0)] {
        let mut run = held(0.12, &[effect("sheath_stribeck_friction")]);
        draw(&mut run, speed, 1.0);
        for exponent in exponents(&run) {
            near(&format!("Stribeck at {speed}"), exponent / a, 1.0 + 0.6 * excess, 1e-6);
        }
    }
    let mut run = held(0.12, &[effect("asymmetric_friction")]);
    draw(&mut run, 0.5, 1.0);
    let [of_a, of_b] = exponents(&run);
    near("asymmetric, cable a", of_a / a, 1.2, 1e-9);
    near("asymmetric, cable b", of_b / a, 0.8, 1e-9);

    // Drift of 1 % a second, seen at the start of the last step.
    let mut run = held(0.12, &[effect("friction_drift")]);
    draw(&mut run, 0.1, 8.0);
    near("drift after 8 s", exponents(&run)[0] / a, 1.0 + 0.01 * 7.999, 1e-9);
    // 2 % of the rate are lost a second: the integral of 0.01 e^{-0.02 t}.
    let mut run = held(0.12, &[effect("friction_drift").with("fading_per_s", 0.02)]);
    draw(&mut run, 0.1, 8.0);
    let changed = 0.5 * (1.0 - (-0.02 * 7.999_f64).exp());
    near("fading drift after 8 s", exponents(&run)[0] / a, 1.0 + changed, 1e-9);

    // K = π + θ_out, at the start of the last step.
    let mut run = held(0.12, &[effect("wrap_angle_varies_with_pose")]);
    for (speed, theta) in [(0.5, 0.5), (-0.5, -0.5)] {
        draw(&mut run, speed, 1.0 + f64::from(u8::from(speed < 0.0)));
        near("angle", run.plant.theta_out_rad(), theta, 1e-9);
        near("pose", exponents(&run)[0] * speed.signum(), 0.12 * (K_RAD + theta - 1e-3 * speed), 1e-9);
    }

    // 1.5 rad more from 10 to 15 s.
    let mut run = held(0.12, &[effect("wrap_angle_disturbed")]);
    for (until_s, added_rad) in [(9.9, 0.0), (12.0, 1.5), (14.0, 1.5), (15.5, 0.0)] {
        let time_s = until_s - run.plant.t_s();
        draw(&mut run, 0.1, time_s);
        near(&format!("disturbed, {until_s} s"), exponents(&run)[0], 0.12 * (K_RAD + added_rad), 1e-9);
    }

    // For 100 s: half of the way after 1 s, all of it after 2 s and not after a tenth of the time.
    let mut run = held(0.12, &[effect("wrap_angle_disturbed").with("duration_s", 100.0)]);
    for (until_s, added_rad) in [(11.0, 0.75), (12.1, 1.5)] {
        let time_s = until_s - run.plant.t_s();
        draw(&mut run, 0.1, time_s);
        near(&format!("moved, {until_s} s"), exponents(&run)[0], 0.12 * (K_RAD + added_rad), 2e-4);
    }
}

/// Frictionless cables turned against a held joint: what tension does with stretch.
#[test]
fn stretch_tells_the_effect() {
    // Linear: 60 N and ±72.9 N/mm · 1.5 mm at 0.1 rad; cable b would push with 49.35 N, a slack one carries nothing.
    let linear_n = STIFFNESS_N_PER_M * RADIUS_M * 0.1;
    let mut run = held(0.0, &[]);
    stretch(&mut run, 0.1);
    near("linear, cable b", run.tensions_n()[2], PRETENSION_N - linear_n, 1e-9);
    let mut run = held(0.0, &[effect("tendon_slack")]);
    stretch(&mut run, 0.1);
    assert_eq!(run.tensions_n()[2..], [0.0, 0.0]);
    near("cable a pulls on", run.tensions_n()[0], PRETENSION_N + linear_n, 1e-9);
    stretch(&mut run, 0.0);
    run.tensions_n().iter().for_each(|f| near("back", *f, PRETENSION_N, 1e-9));

    // EA (1 + β (T/F0 - 1)): T = F0 (1 + (e^{β k x/F0} - 1)/β), β = 0.3.
    let mut run = held(0.0, &[effect("tendon_stiffening")]);
    stretch(&mut run, 0.04);
    let x = STIFFNESS_N_PER_M * RADIUS_M * 0.04 / PRETENSION_N;
    draw(&mut run, 0.0, 0.1);
    let [f1, _, f3, _] = run.tensions_n();
    near("stiffening, pulled", f1, PRETENSION_N * (1.0 + (0.3 * x).exp_m1() / 0.3), 1e-6);
    near("stiffening, released", f3, PRETENSION_N * (1.0 + (-0.3 * x).exp_m1() / 0.3), 1e-6);

    // EA (1 + β (1 + c/2) r / (1 + c |r|)) with β = 0.5: dT = k(T) dx in ten thousand midpoint steps. With c = 2/3 the closed form of the
    // released cable has a denominator β (1 + c/2) - c of zero.
    for levelling in [3.0, 2.0 / 3.0] {
        let levels = effect("tendon_stiffening").with("slope", 0.5).with("levelling", levelling);
        let mut run = held(0.0, &[levels]);
        stretch(&mut run, 0.04);
        draw(&mut run, 0.0, 0.1);
        let pulled_to = |x: f64| {
            let gain = |r: f64| 1.0 + 0.5 * (1.0 + 0.5 * levelling) * r / (1.0 + levelling * r.abs());
            let step = x / 1e4;
            PRETENSION_N * (0..10_000).fold(1.0, |t, _| t + step * gain(t + 0.5 * step * gain(t - 1.0) - 1.0))
        };
        let [f1, _, f3, _] = run.tensions_n();
        near(&format!("levelling {levelling}, pulled"), f1, pulled_to(x), 1e-6);
        near(&format!("levelling {levelling}, released"), f3, pulled_to(-x), 1e-6);
    }

    // Creep of 15 %: at held stretch T = T_0/(1 + ρ) in the end, on the way with the time constant τ/(1 + ρ).
    let mut run = held(0.0, &[effect("tendon_creep")]);
    draw(&mut run, 0.0, 8.0);
    let done = 1.0 - (-1.15_f64).exp();
    near("creep after τ", run.tensions_n()[0], PRETENSION_N * (1.0 - 0.15 / 1.15 * done), 2e-3);
    draw(&mut run, 0.0, 120.0);
    near("creep in the end", run.tensions_n()[0], PRETENSION_N / 1.15, 1e-5);
    let mut run = held(0.0, &[effect("tendon_creep").with("age_s", 8.0)]);
    draw(&mut run, 0.0, 1e-3);
    near("crept before", run.tensions_n()[0], PRETENSION_N * (1.0 - 0.15 / 1.15 * done), 2e-3);
    draw(&mut run, 0.0, 120.0);
    near("and on", run.tensions_n()[0], PRETENSION_N / 1.15, 1e-5);
    // At once, and as far 5 s after a clock that began at an age of 3 s.
    let mut run = held(0.0, &[effect("tendon_creep").with("age_s", 3.0)]);
    run.plant.set_time_s(5.0);
    run.plant.settle(&run.config, &IDLE);
    near("before the first step", run.tensions_n()[0], PRETENSION_N * (1.0 - 0.15 / 1.15 * done), 1e-9);

    // A fifth of the pretension after 10 s.
    let mut run = held(0.0, &[effect("pretension_loss")]);
    stretch(&mut run, 0.02);
    for (until_s, mean_n) in [(9.9, PRETENSION_N), (10.1, 0.8 * PRETENSION_N)] {
        let time_s = until_s - run.plant.t_s();
        draw(&mut run, 0.0, time_s);
        let sum: f64 = run.tensions_n().iter().sum();
        near(&format!("pretension at {until_s} s"), sum / 4.0, mean_n, 1e-9);
    }
}

/// Tendons mounted 1 mm too long, 0.177 mm more than the pretension stretches: the input turns through 2 · 11.8 mrad before
/// one or the other cable pulls, and then with EA/L.
#[test]
fn loose_tendons_leave_free_play() {
    let loose_m = 1e-3 - PRETENSION_N / STIFFNESS_N_PER_M;
    let mut run = held(0.12, &[effect("tendon_slack").with("looseness_m", 1e-3)]);
    for theta in [0.8, -0.8, 0.5] {
        stretch(&mut run, theta * loose_m / RADIUS_M);
        run.tensions_n().iter().for_each(|f| near("inside the play", *f, 0.0, 1e-9));
    }
    for (theta, cable) in [(1.5, 0), (-1.5, 2), (1.5, 0)] {
        stretch(&mut run, theta * loose_m / RADIUS_M);
        let tensions = run.tensions_n();
        // Pulled from zero: T_in = u (EA/L) a/(1 - e^{-a}), less the mesh's 5e-5.
        let a = 0.12 * K_RAD;
        let want_n = 0.5 * loose_m * STIFFNESS_N_PER_M * a / -(-a).exp_m1();
        near("pulls", tensions[cable] / want_n, 1.0, 1e-4);
        near("hangs", tensions[2 - cable], 0.0, 1e-9);
    }
}

/// Play of 20 mrad at the input pulley: the input turns that much farther between two equal torques of either sign.
#[test]
fn backlash_widens_the_loop_by_the_gap() {
    let torque_at = |effects: &[ActiveEffect], theta: f64| {
        let mut run = held(0.0, effects);
        for to in [0.03, -0.03, theta] {
            stretch(&mut run, to);
            // At standstill the play settles over 40 steps.
            draw(&mut run, 0.0, 1.0);
        }
        run.plant.torque_in_nm(&run.config)
    };
    let play = [effect("transmission_backlash")];
    for (theta, reach) in [(0.03, 0.02), (-0.03, -0.02), (0.005, 0.0), (0.0, 0.0)] {
        near(&format!("at {theta} rad"), torque_at(&play, theta), torque_at(&[], reach), 1e-9);
    }
}

/// Drawn back by δ, the friction has done 63 % of its turn from limit to limit: 1 - 2/e of the opposite limit. At
/// μK = 0.01 stretch takes up under 0.5 % of the travel.
#[test]
fn presliding_rounds_the_corner_over_its_displacement() {
    let (delta_m, friction) = (5e-5, 0.01 / K_RAD);
    let mut run = held(friction, &[effect("presliding_compliance")]);
    let difference = |run: &Run| run.tensions_n()[0] - run.tensions_n()[1];
    draw(&mut run, 0.01, 20.0 * delta_m / RADIUS_M / 0.01);
    let limit_n = difference(&run);
    near("limit", limit_n, 0.01 * PRETENSION_N, 1e-3);
    draw(&mut run, -0.001, delta_m / RADIUS_M / 0.001);
    near("turned by δ", -difference(&run) / limit_n, 1.0 - 2.0 / 1.0_f64.exp(), 0.02);
    // Rigid contacts have long reached the other limit.
    let mut run = held(friction, &[]);
    draw(&mut run, 0.01, 20.0 * delta_m / RADIUS_M / 0.01);
    draw(&mut run, -0.001, delta_m / RADIUS_M / 0.001);
    near("rigid", -difference(&run) / limit_n, 1.0, 1e-3);
}

/// On a lumped rig the effect is the distributed simulation itself; on a distributed one it is nothing.
#[test]
fn distributed_friction_replaces_the_lumped_law() {
    let boundaries = (InputBoundary::Angle, OutputBoundary::Arm);
    let run = |friction: FrictionLaw, effects: &[ActiveEffect]| {
        let parameters = JointParameters { friction, ..joint(0.12) };
        let mut run = Run::new(parameters, effects, boundaries, 5e-4);
        run.until(1.7, |t| StepInput { theta_in_rad: 0.4 * (4.0 * t).sin(), ..IDLE });
        (run.tensions_n(), run.config.transmission().unwrap().mesh().elements())
    };
    let distributed = run(FrictionLaw::Distributed, &[]);
    let lumped = run(FrictionLaw::Lumped, &[]);
    assert_eq!((distributed.1, lumped.1), (16, 1));
    assert!((distributed.0[0] - lumped.0[0]).abs() > 0.01);
    let effect = [effect("distributed_friction")];
    assert_eq!(run(FrictionLaw::Lumped, &effect), distributed);
    assert_eq!(run(FrictionLaw::Distributed, &effect), distributed);
}
