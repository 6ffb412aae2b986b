//! Benches of other sizes and proportions than the nominal one.

use bowden_tests::other_benches::{drawn, examine};

/// Their sheaths are bent elsewhere than those of the nominal bench. Taken to be bent evenly from pulley to pulley, they had tendons that stiffen
/// beside what they hide.
#[test]
fn where_a_sheath_is_bent_is_not_taken_for_tendons_that_stiffen() {
    for (number, place, hidden) in [(104, 4, "presliding_compliance"), (205, 5, "motor_cogging")] {
        let examined = examine(drawn(number, place).unwrap()).unwrap();
        assert_eq!(examined.hidden(), Some(hidden));
        assert!(examined.is_right(), "{number}: {}", examined.said());
        let bends =
            &examined.diagnosis.ordinary.iter().find(|one| one.id == "straight_ends").unwrap().parameters;
        // The bench leaves 8 to 20 % straight before its first bend and 14 % behind the last.
        assert!((0.08..0.22).contains(&bends["straight_share"]), "{number}: {bends:?}");
        let stiffness =
            examined.diagnosis.recalibrated.iter().find(|one| one.parameter == "tendon.axial_stiffness_n");
        let ratio = stiffness.unwrap().fitted / examined.case.truth.axial_stiffness_n;
        assert!((0.95..1.05).contains(&ratio), "{number}: {ratio} of the stiffness");
    }
}
