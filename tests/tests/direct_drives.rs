//! A diagnosis of joints without tendons, from torque and angle; the joints share no equation with the model.

use bowden_core::diagnose::verdict::Verdict;
use bowden_tests::direct_drives::{Examined, examine};
use virtual_bench::DirectKind;

fn examined(seed: u64, hidden: &[DirectKind]) -> Examined {
    let one = examine(seed, hidden).unwrap();
    let [given, _, diagnosed] = one.free_run_rad();
    println!("{hidden:?}: {}; {given:.4} to {diagnosed:.4} rad", one.said());
    one
}

/// Inertia, weight and drag of the rig file are off by 10 to 40 %, nothing is hidden.
#[test]
fn where_nothing_is_hidden_only_parameters_are_corrected() {
    let one = examined(110, &[]);
    assert!(one.is_right(), "{}", one.said());
    let fitted = |name: &str| {
        let found = one.diagnosis.recalibrated.iter().find(|parameter| parameter.parameter == name);
        found.unwrap_or_else(|| panic!("no {name}")).fitted
    };
    let viscous = fitted("load.viscous_nm_s_per_rad") / one.bench.viscous_nm_s_per_rad;
    assert!((viscous - 1.0).abs() < 0.05, "drag {viscous} times the true one");
    let [given, _, diagnosed] = one.free_run_rad();
    assert!(diagnosed < 0.1 * given, "{given} to {diagnosed} rad");
}

/// Dry friction and cogging at once. A free run of what is found, over another motion, stays within 20 mrad; of the rig as given it goes astray.
#[test]
fn dry_friction_and_cogging_are_found_together() {
    let one = examined(107, &[DirectKind::DryFriction, DirectKind::Cogging]);
    assert!(one.is_right(), "{}", one.said());
    let strength = one.strength_ratio().unwrap();
    assert!((strength - 1.0).abs() < 0.03, "friction {strength} times the true one");
    let [given, _, diagnosed] = one.free_run_rad();
    assert!(given > 1.0 && diagnosed < 0.02, "{given} to {diagnosed} rad");
}

/// Drag with the square of the speed has no name; its law is found.
#[test]
fn drag_with_the_square_of_speed_is_put_into_a_law() {
    let one = examined(105, &[DirectKind::Drag]);
    assert_eq!(one.diagnosis.verdict, Verdict::Unexplained);
    assert!(one.is_right(), "{}", one.said());
}

/// The motion hardly leaves one side of where the spring is at rest. Fitted with the slopes of the joint without it, a spring fell behind an end
/// stop there, beside which a law then made up for the rest: 2.3 rad in a free run.
#[test]
fn a_spring_that_is_bent_to_one_side_is_no_end_stop() {
    let one = examined(2504, &[DirectKind::Spring]);
    assert!(one.is_right(), "{}", one.said());
    let strength = one.strength_ratio().unwrap();
    assert!((strength - 1.0).abs() < 0.02, "spring {strength} times the true one");
    let [given, _, diagnosed] = one.free_run_rad();
    assert!(given > 1.0 && diagnosed < 0.02, "{given} to {diagnosed} rad");
}
