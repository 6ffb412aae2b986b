//! What recordings of a joint without tendons, whose motor drives it, do not tell of its parameters.
//!
//! Torque is not recorded: a motor twice as strong, with twice the inertia, weight and friction, moves alike. The torque that a duty stands for
//! is therefore taken from the rig file, and everything else is measured by it.

use bowden_model::channel::Channel;
use bowden_model::drive::pulley_torque_constant_nm_per_a;

use crate::joint_model::{GuidedBy, JointModel};
use crate::recording::Recording;
use crate::rig::RigParameter;

/// Back-EMF at the fastest motion, over the supply, from which on it tells the torque constant.
const SEEN_BACK_EMF: f64 = 0.05;

/// Time over which the fastest motion is taken, s: an encoder's count in it is a small step.
const SPEED_OVER_S: f64 = 0.1;

/// Parameters of `joint` that stay as its rig file states them; none if it has tendons.
///
/// - What the rig file states as zero: there is no weight, or no drag beside what a search may find.
/// - The arm where an inertia is stated beside the weight, or no weight: two numbers decide what a motion takes.
/// - The resistance where no current is recorded: it is the torque of the duty.
/// - The torque constant where another drag takes up its back-EMF, or nothing turns fast enough to show it.
pub(super) fn untold(joint: &JointModel, fitted: &[&Recording]) -> Vec<RigParameter> {
    let Some(GuidedBy { angle, .. }) = joint.guided_by else { return Vec::new() };
    let (Some(motor), load) = (joint.parameters.motor, joint.parameters.load) else { return Vec::new() };
    let mut untold: Vec<RigParameter> =
        ["load.mass_kg", "load.inertia_kg_m2", "load.viscous_nm_s_per_rad", "motor.viscous_nm_s_per_rad"]
            .into_iter()
            .filter_map(|name| RigParameter::parse(name).ok())
            .filter(|parameter| joint.value(parameter) == Some(0.0))
            .collect();
    let has_drag =
        motor.viscous_nm_s_per_rad > 0.0 || load.is_some_and(|load| load.viscous_nm_s_per_rad > 0.0);
    let fastest_rad_s = fitted.iter().map(|recording| fastest_rad_s(recording, angle)).fold(0.0, f64::max);
    let back_emf_v = pulley_torque_constant_nm_per_a(&motor) * fastest_rad_s;
    let current_is_recorded =
        fitted.iter().any(|recording| recording.channel(Channel::MotorCurrent).is_some());
    let further = [
        ("load.arm_m", load.is_some_and(|load| load.inertia_kg_m2 > 0.0 || load.mass_kg == 0.0)),
        ("motor.resistance_ohm", !current_is_recorded),
        ("motor.torque_constant_nm_per_a", has_drag || back_emf_v < SEEN_BACK_EMF * motor.supply_v),
    ];
    let further = further.into_iter().filter(|(_, is_untold)| *is_untold);
    untold.extend(further.filter_map(|(name, _)| RigParameter::parse(name).ok()));
    untold
}

/// Fastest motion of a recorded angle, rad/s.
fn fastest_rad_s(recording: &Recording, angle: Channel) -> f64 {
    let (Some(theta_rad), t_s) = (recording.channel(angle), recording.t_s()) else { return 0.0 };
    let mut from = 0;
    let mut fastest_rad_s = 0.0_f64;
    for to in 0..t_s.len() {
        while t_s[to] - t_s[from] > SPEED_OVER_S {
            from += 1;
        }
        if t_s[to] - t_s[from] > 0.5 * SPEED_OVER_S {
            fastest_rad_s =
                fastest_rad_s.max((theta_rad[to] - theta_rad[from]).abs() / (t_s[to] - t_s[from]));
        }
    }
    fastest_rad_s
}

#[cfg(test)]
mod tests {
    use crate::joint_model::JointModel;
    use crate::recording::Recording;
    use crate::rig::{Rig, RigParameter};
    use crate::study::Study;
    use crate::test_bench;

    fn joint(change: impl Fn(&mut Rig), recording: Recording) -> JointModel {
        let mut rig = test_bench::direct_rig();
        change(&mut rig);
        Study::of_bench(rig, vec![recording], Vec::new()).joint().unwrap()
    }

    fn moved(joint: &JointModel) -> Vec<String> {
        crate::fit::recalibrated::recalibrated(joint).iter().map(|free| free.path(joint)).collect()
    }

    #[test]
    fn of_a_source_of_torque_inertia_weight_and_drag_are_told() {
        let swung = || test_bench::turned(2000, &[]);
        let expected =
            ["motor.rotor_inertia_kg_m2", "load.mass_kg", "load.inertia_kg_m2", "load.viscous_nm_s_per_rad"];
        assert_eq!(moved(&joint(|_| (), swung())), expected);
        let without_weight = joint(|rig| rig.joint.load.as_mut().unwrap().mass_kg = 0.0, swung());
        assert_eq!(moved(&without_weight), [expected[0], expected[2], expected[3]]);
        // Weight on an arm that weighs nothing: the two tell themselves apart by inertia and torque.
        let pendulum = joint(|rig| rig.joint.load.as_mut().unwrap().inertia_kg_m2 = 0.0, swung());
        assert_eq!(moved(&pendulum), [expected[0], expected[1], "load.arm_m", expected[3]]);
    }

    /// 24 V, 0.05 V·s/rad of a motor that turns at up to 1.8 rad/s: 0.4 % of the supply. Behind a gear of 100 the same motor shows its
    /// back-EMF, unless a drag of its own takes that up.
    #[test]
    fn a_torque_constant_is_told_by_its_back_emf() {
        let of = |gear_ratio: f64, viscous: f64| {
            let change = |rig: &mut Rig| {
                let motor = rig.joint.motor.as_mut().unwrap();
                (motor.supply_v, motor.torque_constant_nm_per_a, motor.gear_ratio) = (24.0, 0.05, gear_ratio);
                motor.resistance_ohm = 6.0 * gear_ratio;
                rig.joint.load.as_mut().unwrap().viscous_nm_s_per_rad = viscous;
            };
            moved(&joint(change, test_bench::turned(2000, &[])))
        };
        let told = |names: &[String]| names.iter().any(|name| name == "motor.torque_constant_nm_per_a");
        assert!(!told(&of(1.0, 0.0)) && told(&of(100.0, 0.0)) && !told(&of(100.0, 0.02)));
    }

    #[test]
    fn with_tendons_nothing_is_untold_here() {
        let joint =
            Study::of_bench(test_bench::rig(), vec![test_bench::swung(100)], Vec::new()).joint().unwrap();
        assert_eq!(joint.guided_by, None);
        let pretension = RigParameter::parse("tendon.pretension_n").unwrap();
        assert!(joint.own.untold.iter().all(|parameter| *parameter == pretension));
    }
}
