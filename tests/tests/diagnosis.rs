//! Whole diagnoses of the virtual bench: what is named, where, when, and what the written rig file predicts of a second
//! recording.
//!
//! The benches are a few per cent off their rig files, as real ones are. Each diagnosis tries the whole catalogue on 16 s.

use std::time::Instant;

use bowden_core::diagnose::diagnose;
use bowden_core::diagnose::verdict::{Diagnosis, FoundLaw, NamedEffect, Verdict};
use bowden_core::progress::Quiet;
use bowden_core::recording::Recording;
use bowden_core::replay;
use bowden_core::rig::{Rig, RigDocument};
use bowden_core::study::Study;
use bowden_model::channel::Channel;
use bowden_model::effects::find;
use bowden_model::parameters::{NOMINAL_PARAMETERS, UNITS_OF_STRENGTH};
use bowden_tests::prove::plan::plans;
use bowden_tests::prove::recorded::Recorded;
use bowden_tests::prove::truth::TRAINING_S;
use bowden_tests::{recording_of, rms_difference};
use virtual_bench::{
    Case, ConcealedEffect, EndStopContact, GearBacklash, JointBacklash, JointLaw, JointTorqueRipple,
    JointViscousFriction, MotionKind, MotorCoulombFriction, MotorStribeckFriction, Parameter, PretensionLoss,
    SensorGainError, TransmissionLaw, UnlistedJoint, UnlistedTransmission,
};

/// Length of the diagnosed recordings, s.
const SECONDS: f64 = 16.0;

/// Length where several things are hidden, s.
const LONG_S: f64 = 24.0;

/// Length of the second recordings, s.
const SECOND_SECONDS: f64 = 12.0;

struct Outcome {
    diagnosis: Diagnosis,
    /// Root mean square error of the four tensions in the second recording, N: rig as it was, diagnosed rig.
    nominal_n: f64,
    diagnosed_n: f64,
}

impl Outcome {
    fn of(case: &Case) -> Self {
        Self::asking(case, &[])
    }

    fn asking(case: &Case, asked: &[&str]) -> Self {
        Self::over(case, SECONDS, asked)
    }

    fn over(case: &Case, seconds: f64, asked: &[&str]) -> Self {
        Self::of_recorded(Recorded::Everything, case, seconds, asked, 0.0)
    }

    /// A bench of the proof.
    fn of_plan(seed: u64, name: &str, seconds: f64) -> Self {
        let plan = plans(seed).into_iter().find(|plan| plan.name == name).unwrap();
        Self::over(&plan.case().unwrap(), seconds, &[])
    }

    /// The clock of the training recording shows `begun_s` at its first sample.
    fn of_recorded(recorded: Recorded, case: &Case, seconds: f64, asked: &[&str], begun_s: f64) -> Self {
        let begun = Instant::now();
        let mut training = recorded.of(case.train(MotionKind::Lab, seconds).unwrap(), 1);
        training.t_s.iter_mut().for_each(|t_s| *t_s += begun_s);
        let training = recording_of(&training);
        let second = case.heldout(MotionKind::LabHeldout, SECOND_SECONDS, seconds).unwrap();
        let second = recording_of(&second);
        let rig = Rig::parse(&case.rig_toml(), "rig.toml").unwrap();
        let diagnosed =
            diagnose(&Study::of_bench(rig.clone(), vec![training], Vec::new()), asked, &Quiet).unwrap();
        let mut document = RigDocument::parse(&case.rig_toml(), "rig.toml").unwrap();
        diagnosed.write_into(0, &mut document).unwrap();
        let found = Rig::parse(&document.to_string(), "rig.diagnosed.toml").unwrap();
        let outcome = Self {
            diagnosis: diagnosed.findings.diagnosis,
            nominal_n: tension_error_n(&rig, &second),
            diagnosed_n: tension_error_n(&found, &second),
        };
        let d = &outcome.diagnosis;
        println!("{:?} in {:.0} s: {}", d.verdict, begun.elapsed().as_secs_f64(), d.summary);
        println!(
            "  second recording: {:.3} N with the rig, {:.3} N diagnosed",
            outcome.nominal_n, outcome.diagnosed_n
        );
        for effect in &d.effects {
            println!("  {} {:?} {:?} {:?}", effect.id, effect.onset_s, effect.channel, effect.parameters);
        }
        for round in &d.search {
            println!("  loss {:.3} before; tried:", round.loss_before);
            for tried in round.tried.iter().take(3) {
                println!("    {} promised {:.2} loss {:.3?}", tried.id, tried.promised, tried.loss);
            }
        }
        println!("  {:?}\n  {:?}", d.recalibrated, d.unexplained);
        outcome
    }

    /// Names of all effects, in alphabetical order.
    fn ids(&self) -> Vec<&str> {
        let mut ids: Vec<&str> = self.diagnosis.effects.iter().map(|effect| effect.id.as_str()).collect();
        ids.sort_unstable();
        ids
    }

    /// The one effect that is named, which has to be this one.
    #[track_caller]
    fn names_only(&self, id: &str, component: &str) -> &NamedEffect {
        assert_eq!(self.diagnosis.verdict, Verdict::MissingPhysics);
        let [effect] = self.diagnosis.effects.as_slice() else {
            panic!("one effect expected: {:?}", self.diagnosis.effects)
        };
        assert_eq!((effect.id.as_str(), effect.component.as_str()), (id, component));
        effect
    }

    /// Nothing is named, and one law is stated, of `variable` at `port`, which the diagnosed rig simulates.
    #[track_caller]
    fn states_only(&self, port: &str, variable: &str) -> &FoundLaw {
        let diagnosis = &self.diagnosis;
        let [law] = &diagnosis.laws[..] else {
            panic!("{:?} beside {:?}", diagnosis.laws, diagnosis.effects)
        };
        assert_eq!((law.port.as_str(), &law.variables[..]), (port, &[variable.to_owned()][..]));
        assert_eq!((diagnosis.verdict, &diagnosis.effects[..]), (Verdict::Unexplained, &[][..]));
        let unexplained = diagnosis.unexplained.as_ref().unwrap();
        assert!(unexplained.modelled && unexplained.law.as_ref().unwrap().contains(&law.formula));
        assert_eq!(unexplained.component, law.component);
        assert!(diagnosis.summary.contains("a formula for it reduces"), "{}", diagnosis.summary);
        law
    }

    /// Asserts that the diagnosed rig leaves at most `share` of the rig's error in the second recording.
    #[track_caller]
    fn predicts_within(&self, share: f64) {
        let (before, after) = (self.nominal_n, self.diagnosed_n);
        assert!(after < share * before, "second recording: {before} N before, {after} N after");
    }
}

/// Replays time and inputs alone, and compares the tensions.
fn tension_error_n(rig: &Rig, recording: &Recording) -> f64 {
    let mut inputs = Recording::new("inputs", recording.t_s().to_vec());
    for channel in [Channel::ThetaIn, Channel::Duty, Channel::BusVoltage] {
        inputs.set(channel, recording.channel(channel).unwrap().to_vec());
    }
    let predicted = replay::predict(rig, &inputs).unwrap();
    let mean_square: f64 = Channel::TENSIONS
        .iter()
        .map(|channel| rms_difference(*channel, recording, &predicted).powi(2) / 4.0)
        .sum();
    mean_square.sqrt()
}

#[test]
fn dry_friction_of_the_motor() {
    let case = Case::new(
        "case",
        vec![MotorCoulombFriction { torque_nm: 0.15, breakaway_rad: 2e-3 }.into()],
        101,
        3.0,
    );
    let outcome = Outcome::of(&case);
    let effect = outcome.names_only("motor_coulomb_friction", "motor");
    assert_eq!(effect.onset_s, None);
    outcome.predicts_within(0.9);
}

/// A little of it is within what every bench has of dry friction, and taken for that until it shows where that ends.
#[test]
fn little_friction_of_the_motor_that_falls_with_speed() {
    let concealed = MotorStribeckFriction {
        coulomb_nm: 0.023,
        static_nm: 0.053,
        stribeck_rad_per_s: 0.06,
        breakaway_rad: 1.7e-3,
    };
    let outcome = Outcome::of(&Case::new("case", vec![concealed.into()], 110, 3.0));
    outcome.names_only("motor_stribeck_friction", "motor");
    outcome.predicts_within(1.0);
}

#[test]
fn play_of_the_gear() {
    let case = Case::new("case", vec![GearBacklash { gap_rad: 0.035 }.into()], 112, 3.0);
    let outcome = Outcome::of(&case);
    let effect = outcome.names_only("gear_backlash", "motor");
    let found = effect.parameters["gap_rad"].value;
    assert!((found / 0.035 - 1.0).abs() < 0.1, "gap_rad: {found} for 0.035");
    outcome.predicts_within(0.9);
}

/// A contact that grows with the depth to the power of 1.5, and damps.
#[test]
fn stop_that_gives_way() {
    let concealed =
        EndStopContact { angle_rad: 0.43, side: 1.0, stiffness_nm_per_rad_1_5: 6.0, damping_s_per_rad: 0.37 };
    let outcome = Outcome::of(&Case::new("case", vec![concealed.into()], 112, 3.0));
    outcome.names_only("end_stop_contact", "joint");
    outcome.predicts_within(0.9);
}

/// The moment lies within a second that is fitted; the data say nothing of one in a second that is held out. It is told by the clock of the
/// recording, a piece of a longer one.
#[test]
fn lost_pretension() {
    let case = Case::new("case", vec![PretensionLoss { loss: 0.25, onset_s: 9.4 }.into()], 102, 3.0);
    let outcome = Outcome::of_recorded(Recorded::Everything, &case, SECONDS, &[], 5000.0);
    let effect = outcome.names_only("pretension_loss", "transmission");
    assert!((effect.onset_s.unwrap() - 5009.4).abs() < 0.1, "{:?}", effect.onset_s);
    assert!((effect.parameters["time_s"].value - 9.4).abs() < 0.1, "{:?}", effect.parameters);
    outcome.predicts_within(0.3);
}

#[test]
fn play_of_the_joint() {
    let case = Case::new("case", vec![JointBacklash { gap_rad: 0.035 }.into()], 103, 3.0);
    let outcome = Outcome::of(&case);
    let effect = outcome.names_only("joint_backlash", "joint");
    assert_eq!(effect.onset_s, None);
    outcome.predicts_within(0.9);
}

#[test]
fn wrong_gain_of_a_tension_sensor() {
    let concealed = SensorGainError { channel: virtual_bench::Channel::F2, error: -0.1 };
    let outcome = Outcome::of(&Case::new("case", vec![concealed.into()], 104, 3.0));
    let effect = outcome.names_only("sensor_gain_error", "sensors");
    assert_eq!(effect.channel.as_deref(), Some("f2_n"));
    outcome.predicts_within(0.7);
}

#[test]
fn nothing_concealed() {
    let outcome = Outcome::of(&Case::new("case", Vec::new(), 105, 3.0));
    assert_eq!(outcome.diagnosis.verdict, Verdict::Consistent);
    assert_eq!(outcome.diagnosis.effects, []);
    assert_eq!(outcome.diagnosis.unexplained, None);
    outcome.predicts_within(1.0);
}

/// Encoders and motor alone see little more than the product of friction and pretension. What moves along it makes up for what is
/// ordinary, and the tensions, which nobody recorded, with it.
#[test]
fn tensions_that_were_not_recorded_are_predicted_no_worse() {
    let concealed = JointViscousFriction { coefficient_nm_s_per_rad: 0.06 };
    let case = Case::new("case", vec![concealed.into()], 105, 3.0);
    let outcome = Outcome::of_recorded(Recorded::NoTensions, &case, SECONDS, &[], 0.0);
    outcome.names_only("joint_viscous_friction", "joint");
    assert!(outcome.diagnosis.complete && !outcome.diagnosis.summary.contains("stopped"));
    outcome.predicts_within(1.0);
}

/// A winding that warms up beside sheaths that bend with the pose: its resistance, recalibrated, had taken the place of the
/// warming, and how much a watt does is not in the rig file.
#[test]
fn what_a_parameter_had_taken_the_place_of_is_found_beside_another_effect() {
    let outcome = Outcome::of_plan(1, "pair/15", LONG_S);
    assert_eq!(outcome.ids(), ["winding_heating", "wrap_angle_varies_with_pose"]);
    let resistance = outcome.diagnosis.recalibrated.iter().find(|p| p.parameter == "motor.resistance_ohm");
    let resistance = resistance.unwrap();
    assert!((resistance.fitted / resistance.nominal - 1.0).abs() < 0.1, "{resistance:?}");
    outcome.predicts_within(0.5);
}

/// A reading that sets in over 9.8 s, up to 1.95 N, beside a spring: a wrong zero takes its place where a law of that sensor has to take off as
/// much as any law.
#[test]
fn a_reading_that_sets_in_is_no_wrong_zero() {
    let outcome = Outcome::of_plan(606, "mixed/01", TRAINING_S);
    assert_eq!(outcome.ids(), ["joint_spring"]);
    let [law] = &outcome.diagnosis.laws[..] else { panic!("{:?}", outcome.diagnosis.laws) };
    assert_eq!(law.channel.as_deref(), Some("f3_n"), "{law:?}");
    for (name, concealed, tolerance) in [("amplitude", 1.95, 0.15), ("time_constant_s", 9.8, 0.3)] {
        let found = law.coefficients[name].value;
        assert!((found / concealed - 1.0).abs() < tolerance, "{name}: {found} for {concealed}");
    }
    outcome.predicts_within(0.5);
}

/// Dry friction of the joint, a friction that prefers a direction and a wrong zero: none is worth its name alone, each is beside the others.
#[test]
fn what_is_worth_little_alone_is_found_beside_the_rest() {
    let outcome = Outcome::of_plan(606, "triple/00", LONG_S);
    assert_eq!(outcome.ids(), ["asymmetric_friction", "joint_coulomb_friction", "sensor_offset"]);
    outcome.predicts_within(0.5);
}

/// On this bench, whose tensions are noisy and whose parameters are wrong, an effect comes near the bar of the search, beside what
/// is ordinary and at its resolution, and takes less than a hundredth off the loss of the rig that is written.
#[test]
fn what_the_written_rig_does_not_gain_by_is_not_found() {
    let outcome = Outcome::of_plan(1, "parameters/23", TRAINING_S);
    assert_eq!(outcome.diagnosis.verdict, Verdict::Recalibrate);
    assert_eq!(outcome.diagnosis.effects, []);
}

#[test]
fn wrong_parameters_alone() {
    let case = Case::new("case", Vec::new(), 106, 3.0)
        .off(Parameter::FrictionCoefficient, 0.5)
        .off(Parameter::AxialStiffness, 1.3);
    let outcome = Outcome::of(&case);
    assert_eq!(outcome.diagnosis.verdict, Verdict::Recalibrate);
    assert_eq!(outcome.diagnosis.effects, []);
    for (path, ratio) in [("sheath.friction_coefficient", 0.5), ("tendon.axial_stiffness_n", 1.3)] {
        let found = outcome.diagnosis.recalibrated.iter().find(|p| p.parameter == path).unwrap();
        let found_ratio = found.fitted / found.nominal;
        assert!((found_ratio / ratio - 1.0).abs() < 0.06, "{path}: {found_ratio} for {ratio}");
    }
    outcome.predicts_within(0.5);
}

#[test]
fn physics_beyond_the_fixed_list_is_named_where_it_is_asked_for_and_only_there() {
    let ripple = JointTorqueRipple { peak_nm: 0.14, cycles_per_turn: 20.0, phase_rad: 1.0 };
    let case = Case::new("case", vec![ripple.into()], 108, 3.0);
    let asked = Outcome::asking(&case, &["joint_torque_ripple"]);
    let effect = asked.names_only("joint_torque_ripple", "joint");
    for (name, concealed, tolerance) in
        [("amplitude_nm", 0.14, 0.2 * 0.14), ("cycles_per_turn", 20.0, 0.03 * 20.0), ("phase_rad", 1.0, 0.3)]
    {
        let found = effect.parameters[name].value;
        assert!((found - concealed).abs() < tolerance, "{name}: {found} for {concealed}");
    }
    asked.predicts_within(0.9);

    let unasked = Outcome::of(&case);
    assert!(unasked.diagnosis.effects.iter().all(|effect| effect.id != "joint_torque_ripple"));
    let law = unasked.states_only("joint_torque_nm", "theta_out_rad");
    for (name, concealed, tolerance) in
        [("amplitude_nm", 0.14, 0.2 * 0.14), ("cycles_per_turn", 20.0, 0.03 * 20.0), ("phase_rad", 1.0, 0.3)]
    {
        let found = law.coefficients[name].value;
        assert!((found - concealed).abs() < tolerance, "{name}: {found} for {concealed}");
    }
}

/// Drag with the square of speed looks like viscous friction with a wrong speed; the exponent says that it is not. The bench puts
/// 0.08 N·m at 1 rad/s. Viscous friction alone would leave an exponent of 1.
#[test]
fn drag_with_the_square_of_speed_is_put_into_a_formula() {
    let drag = UnlistedJoint { law: JointLaw::SquareDrag, size_nm: 0.08, place: 0.0 };
    let outcome = Outcome::of(&Case::new("case", vec![drag.into()], 114, 3.0));
    let law = outcome.states_only("joint_friction_nm", "omega_out_rad_s");
    let found = |name: &str| law.coefficients[name].value;
    assert!((found("exponent") - 2.0).abs() < 0.25, "{:?}", law.coefficients);
    assert!((found("amplitude_nm") - 0.08).abs() < 0.01, "{:?}", law.coefficients);
    outcome.predicts_within(0.5);
}

/// Drag of 0.15 N·m at 1 rad/s in positive direction and none in the other: half of it in the mean, all of it asymmetric.
#[test]
fn drag_in_one_direction_is_put_into_a_formula() {
    let valve = UnlistedJoint { law: JointLaw::OneWayDrag, size_nm: 0.15, place: 0.0 };
    let outcome = Outcome::of(&Case::new("case", vec![valve.into()], 116, 3.0));
    let law = outcome.states_only("joint_friction_nm", "omega_out_rad_s");
    let found = |name: &str| law.coefficients[name].value;
    for (name, concealed, tolerance) in
        [("amplitude_nm", 0.075, 0.01), ("exponent", 1.0, 0.15), ("asymmetry", 1.0, 0.15)]
    {
        assert!((found(name) - concealed).abs() < tolerance, "{name}: {} for {concealed}", found(name));
    }
    outcome.predicts_within(0.5);
}

#[test]
fn an_output_pulley_that_is_not_round_is_put_into_a_formula() {
    let lobes =
        UnlistedTransmission { law: TransmissionLaw::OutputLobes, size: 0.12, place: 6.0, phase_rad: 0.4 };
    let outcome = Outcome::of(&Case::new("case", vec![lobes.into()], 115, 3.0));
    let law = outcome.states_only("output_radius", "theta_out_rad");
    for (name, concealed, tolerance) in
        [("amplitude", 0.12, 0.02), ("cycles_per_turn", 6.0, 0.4), ("phase_rad", 0.4, 0.15)]
    {
        let found = law.coefficients[name].value;
        assert!((found - concealed).abs() < tolerance, "{name}: {found} for {concealed}");
    }
    outcome.predicts_within(0.5);
}

/// The held-out recording tells that the friction changed, and not what is written: that is 1.5 times the rig's 0.12, as in the recording that is
/// fitted.
#[test]
fn parameters_that_change_between_recordings_are_told_and_chosen_by_those_that_are_fitted() {
    let changed = Case::new("case", Vec::new(), 109, 1.0).off(Parameter::FrictionCoefficient, 1.5);
    let as_stated = Case::new("case", Vec::new(), 109, 1.0);
    let training = recording_of(&changed.train(MotionKind::Lab, SECONDS).unwrap());
    let heldout = recording_of(&as_stated.heldout(MotionKind::LabHeldout, SECOND_SECONDS, SECONDS).unwrap());
    let rig = Rig::parse(&as_stated.rig_toml(), "rig.toml").unwrap();
    let found = diagnose(&Study::of_bench(rig, vec![training], vec![heldout]), &[], &Quiet)
        .unwrap()
        .findings
        .diagnosis;
    let unexplained = found.unexplained.unwrap();
    assert_eq!((found.verdict, &found.effects[..]), (Verdict::Unexplained, &[][..]));
    assert_eq!(
        (unexplained.component.as_str(), &unexplained.depends_on[..]),
        ("transmission", &["recording".to_owned()][..])
    );
    let friction = found.recalibrated.iter().find(|p| p.parameter == "sheath.friction_coefficient").unwrap();
    assert!((friction.fitted / 0.18 - 1.0).abs() < 0.02, "{friction:?}");
}

#[test]
fn a_parameter_that_is_not_searched_is_not_reported() {
    // The looseness of a slack tendon keeps its default; what is reported are the parameters that were fitted.
    let case = Case::new("case", vec![ConcealedEffect::drawn("tendon_slack", 1.5, 7).unwrap()], 107, 3.0);
    let outcome = Outcome::of(&case);
    let effect = outcome.names_only("tendon_slack", "transmission");
    let searched = find("tendon_slack").unwrap().descriptor().parameters.iter().filter(|spec| spec.searched);
    assert!(effect.parameters.keys().eq(searched.map(|spec| spec.name)), "{:?}", effect.parameters);
    outcome.predicts_within(0.9);
}

/// However many threads share the work, what is said is the same to the last digit.
#[test]
fn the_number_of_threads_changes_nothing() {
    const SHORT_S: f64 = 8.0;
    let case = Case::new("case", vec![PretensionLoss { loss: 0.25, onset_s: 4.0 }.into()], 113, 3.0);
    let training = recording_of(&case.train(MotionKind::Lab, SHORT_S).unwrap());
    let rig = Rig::parse(&case.rig_toml(), "rig.toml").unwrap();
    let study = Study::of_bench(rig, vec![training], Vec::new());
    let found = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| diagnose(&study, &[], &Quiet).unwrap().findings)
    };
    let alone = found(1);
    assert_eq!(alone.diagnosis.verdict, Verdict::MissingPhysics);
    assert_eq!(alone, found(3));
}

/// A finger that is a twentieth as strong as the bench, at the same angles, duties and currents: every force and torque in its
/// file and its recording is a twentieth. What is said of it is said of the bench, with a twentieth of the torque.
#[test]
fn a_weaker_joint_is_diagnosed_as_the_strong_one_is() {
    const SHARE: f64 = 0.05;
    let case = Case::new(
        "case",
        vec![MotorCoulombFriction { torque_nm: 0.15, breakaway_rad: 2e-3 }.into()],
        101,
        3.0,
    );
    let strong = recording_of(&case.train(MotionKind::Lab, SECONDS).unwrap());
    let mut weak = Recording::new("finger", strong.t_s().to_vec());
    for channel in Channel::ALL {
        if let Some(values) = strong.channel(channel) {
            let scaled = Channel::TENSIONS.contains(&channel) || channel == Channel::BusVoltage;
            weak.set(
                channel,
                values.iter().map(|value| if scaled { SHARE * value } else { *value }).collect(),
            );
        }
    }
    let rig = Rig::parse(&finger(&case.rig_toml(), SHARE), "finger.toml").unwrap();
    let found =
        diagnose(&Study::of_bench(rig, vec![weak], Vec::new()), &[], &Quiet).unwrap().findings.diagnosis;
    println!("{}\n  {:?}", found.summary, found.effects);
    let [effect] = found.effects.as_slice() else { panic!("one effect expected: {:?}", found.effects) };
    assert_eq!(effect.id, "motor_coulomb_friction");
    let torque_nm = effect.parameters["torque_nm"].value;
    assert!((torque_nm / (0.15 * SHARE) - 1.0).abs() < 0.15, "{torque_nm} N·m");
}

/// The rig file with every force, torque, voltage and resistance times `share`.
fn finger(rig_toml: &str, share: f64) -> String {
    let scaled = |name: &str| {
        let nominal = NOMINAL_PARAMETERS.iter().find(|parameter| parameter.spec.name == name);
        name.starts_with("tension_") || nominal.is_some_and(|p| UNITS_OF_STRENGTH.contains(&p.spec.unit))
    };
    let line = |line: &str| match line.split_once(" = ") {
        Some((name, value)) if scaled(name) => {
            format!("{name} = {:?}\n", share * value.parse::<f64>().unwrap())
        }
        _ => format!("{line}\n"),
    };
    rig_toml.lines().map(line).collect()
}
