//! Recordings of real benches, each replayed with physics fitted to the others, stay within the marks.
//!
//! The data lie in the folder that `BOWDEN_DATA` names, or beside the workspace in `shared/data`; where they are absent
//! the tests say so and pass. Bounds hold on both sides: a score far better than ever seen means that something else is
//! measured than before.

use std::path::PathBuf;

use bowden_core::diagnose::verdict::FoundLaw;
use bowden_real_data::study::RealStudy;
use bowden_real_data::{Mark, band_damper, cable_tool, cogging_motor, direct_drive, mean, servo_pendulum};

/// Folder of the data set, if it is there.
fn data(folder: &str) -> Option<PathBuf> {
    let beside = || [env!("CARGO_MANIFEST_DIR"), "..", "..", "..", "shared", "data"].iter().collect();
    let data = std::env::var_os("BOWDEN_DATA").map_or_else(beside, PathBuf::from);
    if data.join(folder).is_dir() {
        return Some(data);
    }
    eprintln!("skipped: no {folder} in {}; set BOWDEN_DATA to the folder of the data sets", data.display());
    None
}

fn within(mark: &Mark) {
    assert!(mark.met(), "{mark}");
    assert!(mark.score > 0.5 * mark.limit, "{mark}, but below half of it: is the same thing measured?");
}

/// Every study of `host-tools/studies` finds each of its recordings in the data set, and each is accepted by its rig.
#[test]
fn studies_and_data_sets_fit_together() {
    for (study, folder, benches, recordings) in [
        ("xl330-pendulum", servo_pendulum::FOLDER, 1, 11),
        (cable_tool::FOLDER, cable_tool::FOLDER, 4, 13),
        (cogging_motor::FOLDER, cogging_motor::FOLDER, 1, 3),
        (direct_drive::FOLDER, direct_drive::FOLDER, 2, 2),
        (band_damper::FOLDER, band_damper::FOLDER, 8, 8),
    ] {
        let Some(data) = data(folder) else { continue };
        let loaded = RealStudy::load(study, &data.join(folder)).unwrap();
        assert_eq!(loaded.size(), [benches, recordings], "{study}");
    }
}

#[test]
fn a_servo_pendulum_is_predicted_from_its_goal() {
    let Some(data) = data(servo_pendulum::FOLDER) else { return };
    let runs = servo_pendulum::load(&data).unwrap();
    assert_eq!(runs.len(), 11);
    let score =
        |physics| mean(servo_pendulum::held_out(&runs, physics, servo_pendulum::Split::Recording).unwrap());
    let all = score(servo_pendulum::Physics::All);
    within(&Mark { quantity: "angle error, rad", score: all, limit: servo_pendulum::LIMIT_RAD });
    // Without the friction that the mark demands it is missed: the test can fail.
    assert!(score(servo_pendulum::Physics::Viscous) > 1.3 * servo_pendulum::LIMIT_RAD);
}

#[test]
fn a_cable_driven_jaw_is_predicted_from_input_angle_and_load() {
    let Some(data) = data(cable_tool::FOLDER) else { return };
    let runs = cable_tool::load(&data, cable_tool::Load::Recorded).unwrap();
    assert_eq!(runs.full.len(), 13);
    let out =
        cable_tool::held_out(&runs, cable_tool::Physics::All, cable_tool::Calibration::PerTool).unwrap();
    let total = cable_tool::pooled(&out);
    within(&Mark { quantity: "jaw angle, rad", score: total.angle_rad, limit: cable_tool::LIMIT_RAD });
    within(&Mark { quantity: "input torque, N m", score: total.torque_nm, limit: cable_tool::LIMIT_NM });
}

/// A current that is shown 0.1 s late: at 0.1 turns/s the harmonic of 28 cycles, 17.6 rad/s, lags the holding current by
/// about one radian in the recordings, and tan(1.04) / 17.6 is 0.097 s.
#[test]
fn the_current_of_a_cogging_motor_is_predicted_from_its_angle() {
    use cogging_motor::{Physics, fit, held_out, load, pooled, ripple_ratio};
    let Some(data) = data(cogging_motor::FOLDER) else { return };
    let recordings = load(&data).unwrap();
    assert_eq!((recordings.turns.len(), recordings.maps.len()), (5, 3));
    let error_a = |physics| pooled(&recordings, &held_out(&recordings, physics), false);
    let late = error_a(Physics::Lag);
    assert!(late[0] > 0.1 && late[0] < 0.2, "{late:?}");
    assert!(late[1] > 0.06 && late[1] < 0.12, "{late:?}");
    assert!(late[0] < cogging_motor::LIMIT_A);
    // Without the lag the mark is missed: the test can fail.
    assert!(error_a(Physics::NoLag)[0] > cogging_motor::LIMIT_A);
    let fitted = recordings.without("", Physics::Lag);
    assert!((0.08..0.13).contains(&fitted.lag_s), "{}", fitted.lag_s);
    // Multiples of 7 pole pairs and of 12 slots; the third map counts its angles from the other half of the turn.
    let strongest: Vec<u32> = fitted.cogging().iter().take(5).map(|(cycles, ..)| *cycles).collect();
    assert_eq!(strongest, [7, 28, 14, 36, 12]);
    let shifts: Vec<f64> = recordings.maps.iter().map(|map| map.shift_rad).collect();
    assert_eq!(shifts, [0.0, 0.0, std::f64::consts::PI]);

    // What the drive's feed-forward changes is the motion: had the motor turned evenly, the compensated currents would
    // hardly be others, the uncompensated ones would.
    let ratio = ripple_ratio(&recordings);
    assert!(ratio > 0.3 && ratio < cogging_motor::LIMIT_RIPPLE, "{ratio}");
    for turn in &recordings.turns {
        let evenly = recordings.without(&turn.name, Physics::Lag).error_at_constant_speed_a(turn);
        assert_eq!(turn.compensated, evenly < 0.17, "{}: {evenly}", turn.name);
    }
    // A fit never sees a compensated turn.
    let compensated: Vec<_> = recordings.turns.iter().filter(|turn| turn.compensated).collect();
    assert_eq!(compensated.len(), 2);
    let maps: Vec<_> = recordings.maps.iter().collect();
    assert_ne!(fit(&compensated, &maps, &recordings.harmonics, Physics::Lag), fitted);
}

/// `bowden diagnose` from a rig file without any effect: what the fit above has, but for the offset that dry friction is in turns of one
/// direction.
#[test]
fn the_harmonics_of_a_cogging_motor_and_its_late_current_are_named() {
    let Some(data) = data(cogging_motor::FOLDER) else { return };
    let [study, ..] = cogging_motor::studies(&data).unwrap();
    let answer = study.diagnose().unwrap();
    println!("{}", answer.said());
    let diagnosis = &answer.diagnosis;
    let fit = &diagnosis.fit.channels["torque_in_nm"];
    // The rig file states a noise of 0.01 A.
    assert!(fit.after_rmse < 0.05 && fit.after_rmse > 0.01, "{fit:?}");
    // One turn is held out. The rush to its start, most of it in the first 0.3 s, is what the diagnosis does not compare.
    let [turn] = &answer.heldout[..] else { panic!("{:?}", answer.heldout) };
    let [stated, found] = [turn.stated, turn.found].map(|error| error.root_mean_square);
    assert!((stated / fit.before_rmse - 1.0).abs() < 0.1, "{turn:?}");
    assert!(found > fit.after_rmse && found < 0.4 * stated, "{turn:?}");
    let named = |id: &str| diagnosis.effects.iter().find(|effect| effect.id == id).unwrap();
    let cogging = named("motor_cogging");
    let harmonics = || std::iter::once(&cogging.parameters).chain(&cogging.further);
    for cycles in [7.0, 28.0, 14.0, 36.0, 12.0] {
        let near = |found: f64| (found / cycles - 1.0).abs() < 0.02;
        assert!(harmonics().any(|one| near(one["cycles_per_turn"].value)), "{cycles}: {cogging:?}");
    }
    assert!(harmonics().count() >= 6, "{cogging:?}");
    let lag = named("sensor_lag");
    assert_eq!(lag.channel.as_deref(), Some("torque_in_nm"));
    assert!((0.08..0.14).contains(&lag.parameters["time_constant_s"].value), "{lag:?}");
}

#[test]
fn a_quasi_direct_drive_swings_as_its_reported_torque_says() {
    use direct_drive::{Physics, SWING_UP, Taken, errors_rad, load, models, shown};
    let Some(data) = data(direct_drive::FOLDER) else { return };
    let runs = load(&data).unwrap();
    assert_eq!(runs.len(), 2);
    assert_eq!(runs[0].name, SWING_UP);
    let errors = |physics, taken| errors_rad(&runs, &models(&runs, physics, taken).unwrap()).unwrap();
    let dry = errors(direct_drive::MARKED, Taken::Friction);
    let total = bowden_real_data::root_mean_square(dry.iter().copied());
    within(&Mark { quantity: "angle, rad", score: total, limit: direct_drive::LIMIT_RAD });
    // The friction of the other recording halves the error of the swing-up.
    assert!(dry[0] < 0.6 * errors(Physics::Frictionless, Taken::Friction)[0], "{dry:?}");
    // The other recording's weight does not carry over.
    assert!(errors(Physics::DryAndViscous, Taken::Everything).iter().all(|error| *error > 0.2));
    // Dry friction published for this actuator: 0.1839 N m.
    let own = models(&runs, Physics::Dry, Taken::Nothing).unwrap();
    let dry_nm = own[0].effects[0].parameters[0];
    assert!((dry_nm - 0.1839).abs() < 0.05, "{dry_nm}");
    let shown = shown(&data).unwrap();
    assert_eq!(shown[0].spikes, 0.0);
    assert!(shown[1].spike_share > 0.3 && shown[1].spikes < 0.1, "{shown:?}");
}

/// A pendulum that an actuator swings up, from a rig file without friction. What is named of friction takes, over the path of the pendulum, what
/// dry and viscous friction take that are fitted to the same recording by another optimiser; at rest, where the pendulum hardly is, it is between half
/// and twice what was published. Its free run is then predicted on seconds that were
/// held out. Of the recording under the position loop, whose torque is not what reached the pendulum, nothing is named; its free run is left with
/// less than dry friction of the swing-up, and weight and arm of its own, leave. Of both together dry friction is named, on the swing-up alone.
#[test]
fn the_friction_of_a_quasi_direct_drive_is_named() {
    use direct_drive::{
        MARKED, POSITION_LOOP, PUBLISHED_DRY_NM, Physics, SWING_UP, Taken, errors_rad, fitted_friction_nm,
        friction_over_path_nm, named_friction_nm,
    };
    let Some(data) = data(direct_drive::FOLDER) else { return };
    let runs = direct_drive::load(&data).unwrap();
    let place = |name: &str| runs.iter().position(|run| run.name == name).unwrap();
    let [swing_up, position_loop, both] = direct_drive::studies(&data).unwrap();
    let answer = swing_up.diagnose().unwrap();
    println!("{}", answer.said());
    let of_itself = direct_drive::models(&runs, Physics::DryAndViscous, Taken::Nothing).unwrap();
    let fitted = &of_itself[place(SWING_UP)];
    let over_path_nm =
        |friction_nm: &dyn Fn(f64, f64) -> f64| friction_over_path_nm(&data, SWING_UP, friction_nm).unwrap();
    let named_nm = over_path_nm(&|speed, torque| named_friction_nm(&answer.diagnosis, speed, torque));
    let fitted_nm = over_path_nm(&|speed, _| fitted_friction_nm(fitted, speed));
    assert!((named_nm / fitted_nm - 1.0).abs() < 0.15, "{named_nm} N·m named, {fitted_nm} N·m fitted");
    let at_rest_nm = named_friction_nm(&answer.diagnosis, 0.0, 0.0);
    assert!((0.5..2.0).contains(&(at_rest_nm / PUBLISHED_DRY_NM)), "{at_rest_nm} N·m at rest");
    let fit = &answer.diagnosis.fit.channels["theta_out_rad"];
    assert!(fit.free_run && fit.after_rmse < 0.3 * fit.recalibrated_rmse, "{fit:?}");
    assert!(fit.after_rmse < direct_drive::LIMIT_RAD, "{fit:?}");
    let by_others = direct_drive::models(&runs, MARKED, Taken::Friction).unwrap();
    let by_others_rad = errors_rad(&runs, &by_others).unwrap()[place(POSITION_LOOP)];
    let answer = position_loop.diagnose().unwrap();
    assert!(answer.diagnosis.effects.is_empty(), "{}", answer.said());
    assert!(answer.diagnosis.unexplained.is_some(), "{}", answer.said());
    let after_rad = answer.diagnosis.fit.channels["theta_out_rad"].after_rmse;
    assert!(after_rad < by_others_rad, "{after_rad} rad");
    // Together, the dry friction of the swing-up alone is named: the torque of the position loop is not what reached the pendulum.
    let answer = both.diagnose().unwrap();
    let [friction] = &answer.diagnosis.effects[..] else { panic!("{}", answer.said()) };
    let dry = ["motor_coulomb_friction", "joint_coulomb_friction"];
    assert!(dry.contains(&friction.id.as_str()), "{}", answer.said());
    assert_eq!(friction.bench.as_deref(), Some("swing-up"), "{}", answer.said());
    let torque_nm = friction.parameters["torque_nm"].value;
    assert!((torque_nm / fitted_nm - 1.0).abs() < 0.15, "{torque_nm} N·m, {fitted_nm} N·m fitted");
    assert!(answer.diagnosis.unexplained.is_some(), "{}", answer.said());
}

#[test]
fn the_hysteresis_of_a_band_damper_is_predicted_from_its_displacement() {
    use band_damper::{Physics, Slip, held_out, load, pooled, scores, with_slip_of_others};
    let Some(data) = data(band_damper::FOLDER) else { return };
    let recordings = load(&data).unwrap();
    assert_eq!(recordings.full.len(), 8);
    let friction_n = |models: &[_]| pooled(&scores(&recordings, models).unwrap()).friction_n;
    let models = held_out(&recordings, Physics::ElasticLooseLate).unwrap();
    let own = friction_n(&models);
    within(&Mark { quantity: "friction force, N", score: own, limit: band_damper::LIMIT_N });
    // Without play, and with the slip force of the others, the mark is missed: the test can fail.
    assert!(friction_n(&held_out(&recordings, Physics::Elastic).unwrap()) > band_damper::LIMIT_N);
    for slip in [Slip::Shared, Slip::AsAtRest] {
        let told = with_slip_of_others(&recordings, &models, slip);
        assert!(friction_n(&told) > 1.5 * band_damper::LIMIT_N);
    }
    // A shift of the band ends by whole samples fits data set 1 best at 45 ms, the others at none.
    for lever in recordings.levers.iter().zip(&recordings.shown) {
        let (lever, shown) = lever;
        let late_ms = 1e3 * lever.lag_s;
        let expected = if shown.name.starts_with("d1__") { 40.0..50.0 } else { 0.0..8.0 };
        assert!(expected.contains(&late_ms), "{}: {late_ms}", shown.name);
        assert!((1.85..2.05).contains(&lever.ratio), "{}: {}", shown.name, lever.ratio);
    }
}

/// The drum of these two runs slips at other forces forwards and backwards, by what the medians of the friction force show without a model.
#[test]
fn slip_of_a_damper_that_differs_with_the_direction_is_a_law_of_its_sign() {
    let Some(data) = data(band_damper::FOLDER) else { return };
    let shown = band_damper::shown(&data).unwrap();
    let study = RealStudy::load(band_damper::FOLDER, &data.join(band_damper::FOLDER)).unwrap();
    let answer = study.of_benches(&["run-6", "run-7"]).unwrap().diagnose().unwrap();
    println!("{}", answer.said());
    assert!(answer.diagnosis.effects.is_empty(), "{}", answer.said());
    assert_eq!(answer.diagnosis.laws.len(), 2, "{}", answer.said());
    for (bench, recording) in [
        ("run-6", "d2__char__0.25Hz36lbtension1amplitude"),
        ("run-7", "d3__char__0.5Hz30lbtension0.5amplitude"),
    ] {
        let of_bench = |law: &&FoundLaw| law.bench.as_deref() == Some(bench);
        let law = answer.diagnosis.laws.iter().find(of_bench).unwrap();
        assert_eq!(law.port, "joint_friction_nm", "{}", law.sentence);
        assert_eq!(law.formula, "amplitude_nm * sign(omega_out_rad_s)", "{}", law.sentence);
        let one = shown.iter().find(|one| one.name == recording).unwrap();
        let [forwards, backwards] = one.sliding.map(|sliding| sliding.unwrap().friction_n);
        let shown_nm = 0.5 * (forwards + backwards) * band_damper::TORQUE_NM_PER_N;
        let ratio = law.coefficients["amplitude_nm"].value / shown_nm;
        assert!((0.65..1.35).contains(&ratio), "{bench}: {ratio} of {shown_nm} N·m");
    }
}
