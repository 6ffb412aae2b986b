//! A study of three benches of one design, of which one hides something: what it is, and where.

use bowden_core::diagnose::diagnose;
use bowden_core::diagnose::verdict::Verdict;
use bowden_core::progress::Quiet;
use bowden_core::rig::{Rig, RigDocument};
use bowden_tests::studies::study_of;
use virtual_bench::{MotorCoulombFriction, TransmissionBacklash};

/// Taken for one that all benches have, the play of one takes too little off to be found.
#[test]
fn play_of_one_bench_is_found_on_that_bench() {
    let play = TransmissionBacklash { gap_rad: 0.03 };
    let (study, rig_toml) = study_of(311, [Vec::new(), vec![play.into()], Vec::new()]).unwrap();
    let diagnosed = diagnose(&study, &[], &Quiet).unwrap();
    let diagnosis = &diagnosed.findings.diagnosis;
    println!("{}", diagnosis.summary);
    let [effect] = &diagnosis.effects[..] else { panic!("{:?}", diagnosis.effects) };
    assert_eq!(diagnosis.verdict, Verdict::MissingPhysics);
    assert_eq!((effect.id.as_str(), effect.bench.as_deref()), ("transmission_backlash", Some("middle")));
    assert!(diagnosis.summary.contains("lacks transmission_backlash (middle):"), "{}", diagnosis.summary);
    assert!(effect.sentence.starts_with("On bench middle: "), "{}", effect.sentence);
    // Of its own held-out seconds, not of those of three benches.
    assert!(effect.heldout_improvement > 0.5, "{}", effect.heldout_improvement);
    let gap_rad = effect.parameters["gap_rad"].value;
    assert!((gap_rad / 0.03 - 1.0).abs() < 0.1, "{gap_rad}");
    let written = [0, 1, 2].map(|bench| {
        let mut document = RigDocument::parse(&rig_toml, "rig.toml").unwrap();
        diagnosed.write_into(bench, &mut document).unwrap();
        let rig = Rig::parse(&document.to_string(), "rig.diagnosed.toml").unwrap();
        rig.effects.iter().map(|effect| effect.descriptor().id).collect::<Vec<_>>()
    });
    // Where the sheaths are bent is written of each.
    assert_eq!(written[1], ["transmission_backlash", "straight_ends"]);
    assert!(written[0] == ["straight_ends"] && written[2] == written[0], "{written:?}");
}

#[test]
fn friction_of_all_benches_is_one_effect() {
    let friction = || vec![MotorCoulombFriction { torque_nm: 0.15, breakaway_rad: 1e-3 }.into()];
    let (study, _) = study_of(321, [friction(), friction(), friction()]).unwrap();
    let diagnosis = diagnose(&study, &[], &Quiet).unwrap().findings.diagnosis;
    println!("{}", diagnosis.summary);
    let [effect] = &diagnosis.effects[..] else { panic!("{:?}", diagnosis.effects) };
    assert_eq!((effect.id.as_str(), &effect.bench), ("motor_coulomb_friction", &None));
}

#[test]
fn benches_that_hide_nothing_have_no_effect_of_their_own() {
    let (study, _) = study_of(331, [Vec::new(), Vec::new(), Vec::new()]).unwrap();
    let diagnosis = diagnose(&study, &[], &Quiet).unwrap().findings.diagnosis;
    println!("{}", diagnosis.summary);
    assert_eq!((diagnosis.verdict, &diagnosis.effects[..]), (Verdict::Consistent, &[][..]));
    assert!(diagnosis.differing.is_empty(), "{:?}", diagnosis.differing);
}

/// The same benches in a study that says nothing of what each has for itself.
#[test]
fn benches_that_are_said_to_share_everything_are_told_what_they_do_not() {
    let (mut study, _) = study_of(331, [Vec::new(), Vec::new(), Vec::new()]).unwrap();
    study.benches.iter_mut().for_each(|bench| bench.own.clear());
    let diagnosis = diagnose(&study, &[], &Quiet).unwrap().findings.diagnosis;
    println!("{}", diagnosis.summary);
    assert!(diagnosis.effects.is_empty() && diagnosis.verdict != Verdict::Consistent);
    assert!(
        diagnosis.differing.iter().any(|name| name == "tendon.pretension_n"),
        "{:?}",
        diagnosis.differing
    );
    assert!(diagnosis.summary.contains("The benches differ in "), "{}", diagnosis.summary);
}
