//! Each correction on the joint of `bowden-model` with the effect that it is for.
//!
//! *Ideal* is the same bench without the effect, *before* with it, *after* with effect and correction. The correction has to
//! take off at least 60 % of what the effect costs, `before - ideal`, where that is more than a tenth of the ideal, and never to
//! make it worse. Strengths are at least those that the catalogue takes for typical.

mod bench;

use bench::{Bench, joint};
use bowden_control::parameters::Parameters;
use bowden_control::tick::Command;
use bowden_control::tick_config;
use bowden_link::State;
use bowden_link::message::{Goal, Mode, Reference, Shape};
use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Target};
use bowden_model::effects::find;

fn effect(id: &str, parameters: &[(&str, f64)]) -> ActiveEffect {
    parameters.iter().fold(ActiveEffect::with_defaults(find(id).unwrap()), |effect, (name, value)| {
        effect.with(name, *value)
    })
}

fn generated(shape: Shape, amplitude: f32, frequency_hz: f32) -> Reference {
    Reference::Generated { shape, amplitude, offset: 0.0, frequency_hz }
}

/// References in position mode: smooth, with corners, fast.
fn motions() -> [Reference; 3] {
    [
        generated(Shape::Sine, 0.5, 0.2),
        generated(Shape::Triangle, 0.5, 0.25),
        generated(Shape::Sine, 0.3, 1.0),
    ]
}

/// So slow that the integral copes with most friction, and what is left is half a count of the encoder.
fn crawl() -> Reference {
    generated(Shape::Sine, 0.3, 0.05)
}

/// References in torque mode: with corners, slow.
fn pulls() -> [Reference; 2] {
    [generated(Shape::Triangle, 0.2, 0.25), generated(Shape::Sine, 0.2, 0.1)]
}

fn running(parameters: &Parameters, effects: &[ActiveEffect], mode: Mode, reference: Reference) -> Bench {
    let mut bench = Bench::ready(parameters.clone(), (joint(), effects));
    bench.refer(reference);
    bench.order(Goal::Run(mode));
    bench.run(2.0);
    bench
}

/// RMS over the next `ticks` of an error that is made from bench and reference.
fn rms(bench: &mut Bench, ticks: u32, error: impl Fn(&Bench, f64) -> f64) -> f64 {
    let mut squares = 0.0;
    for _ in 0..ticks {
        let output = bench.tick();
        squares += error(bench, f64::from(output.sample.reference_raw) / f64::from(1 << 20)).powi(2);
    }
    assert_eq!(bench.controller.state(), State::Run, "{:?}", bench.controller.fault());
    (squares / f64::from(ticks)).sqrt()
}

/// Error of the true joint angle, rad.
fn angle_error(bench: &Bench, reference: f64) -> f64 {
    bench.plant.theta_out_rad() - reference
}

/// Error of the torque that moves the load, N·m; in slow motion it is the one that holds the weight.
fn torque_error(bench: &Bench, reference: f64) -> f64 {
    const WEIGHT_NM: f64 = 2.5 * 9.806_65 * 0.03;
    WEIGHT_NM * bench.plant.theta_out_rad().sin() - reference
}

/// Slow motion sticks and slips, and what that leaves depends on where it sticks: the RMS over several amplitudes.
fn error(parameters: &Parameters, effects: &[ActiveEffect], mode: Mode, reference: Reference) -> f64 {
    let squares: Vec<f64> = nearby(reference)
        .into_iter()
        .map(|reference| {
            let mut bench = running(parameters, effects, mode, reference);
            let error = if mode == Mode::Position { angle_error } else { torque_error };
            rms(&mut bench, whole_periods(reference), error).powi(2)
        })
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Ticks of whole periods that take 5 s or more.
fn whole_periods(reference: Reference) -> u32 {
    const TICKS_PER_S: f32 = 1e4;
    let Reference::Generated { frequency_hz, .. } = reference else { panic!("{reference:?}") };
    (TICKS_PER_S * (5.0 * frequency_hz).ceil() / frequency_hz).round() as u32
}

/// A reference, or for a slow one references with amplitudes near its own.
fn nearby(reference: Reference) -> Vec<Reference> {
    const SLOW_HZ: f32 = 0.1;
    match reference {
        Reference::Generated { shape, amplitude, frequency_hz, .. } if frequency_hz <= SLOW_HZ => {
            [0.92, 0.97, 1.02, 1.07].map(|share| generated(shape, share * amplitude, frequency_hz)).to_vec()
        }
        _ => vec![reference],
    }
}

/// Errors of ideal, before and after.
fn errors(effect: ActiveEffect, on: &impl Fn(&mut Parameters), mode: Mode, reference: Reference) -> [f64; 3] {
    let off = Parameters::default();
    let mut parameters = off.clone();
    on(&mut parameters);
    let runs = [(&off, [].as_slice()), (&off, &[effect]), (&parameters, &[effect])];
    let errors = runs.map(|(parameters, effects)| error(parameters, effects, mode, reference));
    println!("{effect:?}, {mode:?} {reference:?}: ideal, before, after {errors:?}");
    errors
}

fn check(effect: ActiveEffect, on: impl Fn(&mut Parameters), mode: Mode, references: &[Reference]) {
    for reference in references {
        judge(errors(effect, &on, mode, *reference), &format!("{effect:?}, {reference:?}"));
    }
}

/// At least 60 % of the ideal gain where there is one, no loss elsewhere.
fn judge([ideal, before, after]: [f64; 3], what: &str) {
    if before - ideal > 0.1 * ideal {
        let gained = (before - after) / (before - ideal);
        assert!(gained >= 0.6, "{what}: {gained:.2} of the ideal gain");
    } else {
        assert!(after <= 1.1 * before.max(ideal), "{what}: {after} after {before}");
    }
}

/// Nothing is lost where there is little to gain.
fn check_crawl(effect: ActiveEffect, on: impl Fn(&mut Parameters)) {
    let [ideal, before, after] = errors(effect, &on, Mode::Position, crawl());
    assert!(after <= before.max(1.3 * ideal), "{effect:?}: {after} after {before}, ideal {ideal}");
}

/// Switches the correction of the motor's friction on.
fn motor_friction(coulomb: f32, excess: f32) -> impl Fn(&mut Parameters) {
    move |parameters| {
        let own = &mut parameters.correction.motor_friction;
        (own.enable, own.coulomb, own.excess) = (1.0, coulomb, excess);
    }
}

#[test]
fn dry_friction_of_the_motor_is_made_up_for() {
    for torque_nm in [0.08_f32, 0.2, 0.4] {
        let friction = effect("motor_coulomb_friction", &[("torque_nm", torque_nm.into())]);
        check(friction, motor_friction(torque_nm, 0.0), Mode::Position, &motions());
        check_crawl(friction, motor_friction(torque_nm, 0.0));
    }
    for torque_nm in [0.08_f32, 0.2] {
        let friction = effect("motor_coulomb_friction", &[("torque_nm", torque_nm.into())]);
        check(friction, motor_friction(torque_nm, 0.0), Mode::Torque, &pulls());
    }
    let falling = effect("motor_stribeck_friction", &[]);
    check(falling, motor_friction(0.04, 0.08), Mode::Position, &motions());
    check(falling, motor_friction(0.04, 0.08), Mode::Torque, &pulls());
}

/// Where the position loop sticks and slips, the correction helps but at a crawl, where it makes the slips larger.
#[test]
fn friction_that_makes_the_loop_stick_and_slip_costs_little_at_a_crawl_alone() {
    let falling = |coulomb_nm: f32, excess_nm: f32| {
        let values = [("excess_nm", excess_nm.into()), ("coulomb_nm", coulomb_nm.into())];
        (effect("motor_stribeck_friction", &values), motor_friction(coulomb_nm, excess_nm))
    };
    let (strong, on) = falling(0.1, 0.15);
    for reference in motions() {
        let [_, before, after] = errors(strong, &on, Mode::Position, reference);
        assert!(after < before, "{reference:?}: {after} after {before}");
    }
    for (coulomb_nm, excess_nm, cost) in [(0.04, 0.08, 1.1), (0.1, 0.15, 1.2)] {
        let (friction, on) = falling(coulomb_nm, excess_nm);
        let [_, before, after] = errors(friction, &on, Mode::Position, crawl());
        assert!(after < cost * before, "{after} after {before}");
    }
}

#[test]
fn friction_that_grows_with_the_load_is_made_up_for() {
    for coefficient in [0.1_f32, 0.3] {
        let friction = effect("gear_load_friction", &[("coefficient", coefficient.into())]);
        let on = |parameters: &mut Parameters| {
            let own = &mut parameters.correction.gear_friction;
            (own.enable, own.coefficient) = (1.0, coefficient);
        };
        check(friction, on, Mode::Position, &motions());
        check_crawl(friction, on);
        check(friction, on, Mode::Torque, &pulls());
    }
}

#[test]
fn cogging_is_cancelled() {
    for (amplitude_nm, periods, phase) in [(0.1_f32, 40.0_f32, 0.0_f32), (0.2, 14.0, 1.0)] {
        let ripple = effect(
            "motor_cogging",
            &[
                ("amplitude_nm", amplitude_nm.into()),
                ("cycles_per_turn", periods.into()),
                ("phase_rad", phase.into()),
            ],
        );
        // Either harmonic does it.
        let first = |parameters: &mut Parameters| {
            let own = &mut parameters.correction.cogging;
            (own.enable, own.amplitude_1, own.periods_1, own.phase_1) = (1.0, amplitude_nm, periods, phase);
        };
        let second = |parameters: &mut Parameters| {
            let own = &mut parameters.correction.cogging;
            (own.enable, own.amplitude_2, own.periods_2, own.phase_2) = (1.0, amplitude_nm, periods, phase);
        };
        check(ripple, first, Mode::Position, &motions());
        check(ripple, second, Mode::Position, &[crawl()]);
        check(ripple, first, Mode::Torque, &pulls());
    }
}

#[test]
fn the_dead_zone_of_the_bridge_is_crossed() {
    for duty in [0.01_f32, 0.03] {
        let zone = effect("drive_dead_zone", &[("duty", duty.into())]);
        let on = |parameters: &mut Parameters| {
            let own = &mut parameters.correction.dead_zone;
            (own.enable, own.duty) = (1.0, duty);
        };
        check(zone, on, Mode::Position, &motions());
        check_crawl(zone, on);
        check(zone, on, Mode::Torque, &pulls());
    }
}

#[test]
fn dry_friction_of_the_joint_is_made_up_for() {
    for torque_nm in [0.05_f32, 0.2] {
        let friction = effect("joint_coulomb_friction", &[("torque_nm", torque_nm.into())]);
        let on = |parameters: &mut Parameters| {
            let own = &mut parameters.correction.joint_friction;
            (own.enable, own.coulomb) = (1.0, torque_nm);
        };
        check(friction, on, Mode::Position, &motions());
        check_crawl(friction, on);
    }
    for torque_nm in [0.05_f32, 0.1] {
        let friction = |presliding_rad: f64| {
            let parameters = [("torque_nm", torque_nm.into()), ("presliding_rad", presliding_rad)];
            effect("joint_coulomb_friction", &parameters)
        };
        let on = |parameters: &mut Parameters| {
            let own = &mut parameters.correction.joint_friction;
            (own.enable, own.coulomb) = (1.0, torque_nm);
        };
        // A fiftieth of a milliradian is all or none.
        check(friction(2e-5), on, Mode::Torque, &pulls());
        // Where friction gives way, the arm of a slow sine hangs just where little friction is overcome, and the correction gains less.
        let [triangle, sine] = pulls();
        check(friction(5e-4), on, Mode::Torque, &[triangle]);
        let errors = errors(friction(5e-4), &on, Mode::Torque, sine);
        if torque_nm > 0.05 {
            judge(errors, "0.1 N·m that gives way");
        } else {
            let [_, before, after] = errors;
            assert!(after < 0.7 * before, "{torque_nm} N·m: {after} after {before}");
        }
    }
}

#[test]
fn a_spring_at_the_joint_is_carried() {
    let spring = effect("joint_spring", &[("rest_rad", 0.2)]);
    let on = |parameters: &mut Parameters| {
        let own = &mut parameters.correction.joint_spring;
        (own.enable, own.stiffness, own.rest) = (1.0, 0.3, 0.2);
    };
    check(spring, on, Mode::Position, &motions());
    check_crawl(spring, on);
    check(spring, on, Mode::Torque, &pulls());
}

#[test]
fn an_eccentric_encoder_is_read_right() {
    for amplitude_rad in [0.01_f32, 0.03] {
        let mut disc =
            effect("encoder_eccentricity", &[("amplitude_rad", amplitude_rad.into()), ("phase_rad", 1.0)]);
        disc.target = Target::One(Channel::ThetaIn);
        let on = |parameters: &mut Parameters| {
            let own = &mut parameters.correction.input_encoder;
            (own.enable, own.amplitude, own.phase) = (1.0, amplitude_rad, 1.0);
        };
        check(disc, on, Mode::Position, &motions());
        check_crawl(disc, on);
    }
    // That of the joint serves the compensator that learns the lag from both encoders.
    let mut disc = effect("encoder_eccentricity", &[("amplitude_rad", 0.02), ("phase_rad", 1.0)]);
    disc.target = Target::One(Channel::ThetaOut);
    let mut off = Parameters::default();
    off.compensator.source = 2.0;
    let mut on = off.clone();
    let own = &mut on.correction.joint_encoder;
    (own.enable, own.amplitude, own.phase) = (1.0, 0.02, 1.0);
    let [reference, ..] = motions();
    let runs = [(&off, [].as_slice()), (&off, &[disc]), (&on, &[disc])];
    let [ideal, before, after] =
        runs.map(|(parameters, effects)| error(parameters, effects, Mode::Position, reference));
    assert!(before > 1.1 * ideal && before - after > 0.6 * (before - ideal), "{ideal} {before} {after}");
}

#[test]
fn corrections_that_are_too_strong_cost_no_stability() {
    // A third too much of everything, on a joint that has all of it: better than nothing still.
    let effects = [
        effect("motor_coulomb_friction", &[("torque_nm", 0.1)]),
        effect("drive_dead_zone", &[("duty", 0.015)]),
        effect("joint_coulomb_friction", &[("torque_nm", 0.06)]),
        effect("motor_cogging", &[("amplitude_nm", 0.06)]),
    ];
    let mut parameters = Parameters::default();
    let own = &mut parameters.correction;
    (own.motor_friction.enable, own.motor_friction.coulomb) = (1.0, 0.133);
    (own.dead_zone.enable, own.dead_zone.duty) = (1.0, 0.02);
    (own.joint_friction.enable, own.joint_friction.coulomb) = (1.0, 0.08);
    (own.cogging.enable, own.cogging.amplitude_1) = (1.0, 0.08);
    for (mode, references) in [(Mode::Position, motions().as_slice()), (Mode::Torque, &pulls())] {
        for reference in references {
            let before = error(&Parameters::default(), &effects, mode, *reference);
            let after = error(&parameters, &effects, mode, *reference);
            println!("{mode:?} {reference:?}: before {before:.3e}, after {after:.3e}");
            assert!(after < before, "{reference:?}: {after} after {before}");
        }
    }
}

#[test]
fn corrections_may_be_switched_while_the_joint_moves() {
    let effects = [
        effect("motor_coulomb_friction", &[("torque_nm", 0.2)]),
        effect("drive_dead_zone", &[("duty", 0.03)]),
        effect("joint_coulomb_friction", &[("torque_nm", 0.1)]),
    ];
    let off = Parameters::default();
    let mut on = off.clone();
    let own = &mut on.correction;
    (own.motor_friction.enable, own.motor_friction.coulomb) = (1.0, 0.2);
    (own.dead_zone.enable, own.dead_zone.duty) = (1.0, 0.03);
    (own.joint_friction.enable, own.joint_friction.coulomb) = (1.0, 0.1);
    let [reference, ..] = motions();
    let mut bench = running(&off, &effects, Mode::Position, reference);
    let mut seconds = Vec::new();
    for second in 0..6 {
        let parameters = if second % 2 == 0 { &on } else { &off };
        bench.queues.commands.push_back(Command::Configure(tick_config(parameters).unwrap()));
        bench.run(0.5);
        seconds.push(rms(&mut bench, 20_000, angle_error));
    }
    println!("on, off, ...: {seconds:?}");
    for pair in seconds.chunks(2) {
        assert!(pair[0] < 0.4 * pair[1], "{seconds:?}");
    }
}

#[test]
fn play_is_crossed() {
    for (id, gaps) in [("transmission_backlash", [0.02_f32, 0.0]), ("joint_backlash", [0.0, 0.02])] {
        let on = |parameters: &mut Parameters| {
            let own = &mut parameters.correction.backlash;
            (own.enable, own.transmission_gap, own.joint_gap) = (1.0, gaps[0], gaps[1]);
        };
        check(effect(id, &[("gap_rad", 0.02)]), on, Mode::Position, &motions()[..1]);
    }
}

/// With friction that is not followed while the joint moves, which would take it in.
#[test]
fn sheath_friction_beyond_the_nominal_one_is_led() {
    let on = |set: fn(&mut Parameters)| {
        move |parameters: &mut Parameters| {
            parameters.sheath.adapts = 0.0;
            parameters.correction.sheath.enable = 1.0;
            set(parameters);
        }
    };
    let motion = &motions()[..1];
    check(effect("bending_friction", &[]), on(|p| p.correction.sheath.bending = 0.6), Mode::Position, motion);
    let viscous = effect("sheath_viscous_friction", &[("viscous_n_s_per_m", 200.0)]);
    check(viscous, on(|p| p.correction.sheath.viscous = 200.0), Mode::Position, motion);
    for (asymmetry, set) in [
        (0.4, (|p| p.correction.sheath.asymmetry = 0.4) as fn(&mut Parameters)),
        (-0.4, |p| p.correction.sheath.asymmetry = -0.4),
    ] {
        check(effect("asymmetric_friction", &[("asymmetry", asymmetry)]), on(set), Mode::Position, motion);
    }
    let pose = on(|p| p.correction.sheath.pose_slope = 1.0);
    check(effect("wrap_angle_varies_with_pose", &[]), pose, Mode::Position, motion);
    // Where the friction falls off within less speed, the tendons stick and slip.
    let falling = effect("sheath_stribeck_friction", &[("static_ratio", 1.4), ("speed_m_s", 0.01)]);
    let excess = on(|p| (p.correction.sheath.excess, p.correction.sheath.speed) = (0.4, 0.01));
    check(falling, excess, Mode::Position, motion);
}

#[test]
fn a_spring_that_is_not_there_does_not_push_the_joint_out_of_its_range() {
    let mut parameters = Parameters::default();
    parameters.limits.angle_maximum = 0.2;
    let own = &mut parameters.correction.joint_spring;
    // Stiffer than the weight, 0.736 N·m/rad: without the range it would carry the joint to 0.75 rad.
    (own.enable, own.stiffness) = (1.0, 2.0);
    let mut bench = Bench::ready(parameters, joint());
    bench.refer(Reference::Hold(0.1));
    bench.order(Goal::Run(Mode::Torque));
    let (mut told, mut largest) = (false, 0.0_f64);
    for _ in 0..30_000 {
        told |= bench.tick().sample.limits.contains(bowden_link::Limit::ReferenceRange);
        largest = largest.max(bench.plant.theta_out_rad());
    }
    // It comes to the limit with some speed, and swings back.
    assert!(told && largest < 0.4, "{told}, {largest} rad");
    assert!(bench.plant.theta_out_rad() < 0.27, "{} rad in the end", bench.plant.theta_out_rad());
    assert_eq!(bench.controller.state(), State::Run, "{:?}", bench.controller.fault());
}
