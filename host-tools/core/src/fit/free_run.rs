//! Last fit of a joint without tendons, to free runs: they are what will be simulated. It goes on from where a fit of the guided joint ended.

use super::free::Free;
use super::objective::Objective;
use super::solver::{FINE_STEP, Solution, solve_rounds_watched};
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::progress::Progress;
use crate::rig::RigParameter;

/// Steps of the difference quotients, one round each. Over ten seconds a swing of half a hertz gets ahead by a third of a radian when the
/// inertia is 2 % off: the finer step stays where the angle answers in proportion.
const STEPS: [f64; 2] = [FINE_STEP, 0.1 * FINE_STEP];

/// Fits `free`, which start at `found`, to `free_runs`. Of effects is believed what the guided joint told of them, the standard deviations
/// `stds` in the order of `free`: friction at rest, say, shows in the torque of a joint that comes to rest and hardly in a swing.
///
/// The standard deviations of the result take recordings that were fitted twice for two: where both fits tell the same of an effect, they
/// are too small by a factor of √2.
///
/// # Errors
/// When the model cannot be driven; exit status 1 when `progress` asks for an early end.
pub fn solve_freely(
    free_runs: &Objective,
    found: &JointModel,
    free: &[Free],
    stds: &[Option<f64>],
    patience: usize,
    progress: &dyn Progress,
) -> Result<Solution, Failure> {
    let free = believing(free, found, stds);
    solve_rounds_watched(free_runs, found, &free, patience, &STEPS, progress)
}

/// The same parameters, those of effects believed to be what was found.
fn believing(free: &[Free], found: &JointModel, stds: &[Option<f64>]) -> Vec<Free> {
    let mut free = free.to_vec();
    for (free, std) in free.iter_mut().zip(stds) {
        if let (Some(RigParameter::Effect { .. }), Some(std)) = (free.parameter(found), std) {
            *free = free.believed_as_found(*std);
        }
    }
    free
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::ActiveEffect;
    use bowden_model::effects::find;

    use super::*;
    use crate::joint_model::OwnParameter;
    use crate::progress::Quiet;
    use crate::test_bench;

    /// What two sources tell of one number, each with the same standard deviation, lies half-way between, and is known better by √2. Without the
    /// guided joint's word the free run's stands.
    #[test]
    fn what_the_guided_joint_told_weighs_as_much_as_its_deviation_says() {
        let friction = |torque_nm: f64| {
            ActiveEffect::with_defaults(find("joint_coulomb_friction").unwrap()).with("torque_nm", torque_nm)
        };
        let recording = test_bench::turned(500, &[friction(0.1)]);
        let mut model = JointModel::from_rig(&test_bench::direct_rig(), &recording).unwrap();
        model.effects.push(friction(0.1));
        let held = model.guided(&recording);
        let objective = Objective::new(&held, &[recording], &[], false).unwrap();
        let free_runs = objective.freely(&held).unwrap();
        let fit = |start_nm: f64, std: Option<f64>| {
            let mut found = held.clone();
            found.effects[0] = friction(start_nm);
            let torque = Free::effect(&found, 0, 0).unwrap();
            assert_eq!(torque.spec().name, "torque_nm");
            let fitted = solve_freely(&free_runs, &found, &[torque], &[std], 8, &Quiet).unwrap();
            (fitted.values[0], fitted.slopes().stds[0].unwrap())
        };
        let (alone_nm, std_nm) = fit(0.1, None);
        assert!((alone_nm - 0.1).abs() < 0.2 * std_nm, "{alone_nm} ± {std_nm} N m");
        let told_nm = 0.1 + 4.0 * std_nm;
        let (alone_nm, _) = fit(told_nm, None);
        assert!((alone_nm - 0.1).abs() < 0.2 * std_nm, "{alone_nm} ± {std_nm} N m");
        let (both_nm, both_std_nm) = fit(told_nm, Some(std_nm));
        assert!((both_nm - (0.1 + 2.0 * std_nm)).abs() < 0.2 * std_nm, "{both_nm} ± {std_nm} N m");
        assert!((both_std_nm * 2.0_f64.sqrt() / std_nm - 1.0).abs() < 0.1, "{both_std_nm} of {std_nm} N m");
    }

    /// What a bench has for itself of an effect as well, and no parameter of the rig.
    #[test]
    fn effects_are_believed_whoever_has_them() {
        let friction = find("joint_coulomb_friction").unwrap();
        let recording = test_bench::turned(10, &[]);
        let mut model = JointModel::from_rig(&test_bench::direct_rig(), &recording).unwrap();
        model.effects.push(ActiveEffect::with_defaults(friction).with("torque_nm", 0.1));
        let parameter = RigParameter::Effect { descriptor: friction.descriptor(), index: 0 };
        model.own.values.push(OwnParameter { bench: 0, parameter, value: None });
        let free = [
            Free::effect(&model, 0, 0).unwrap(),
            Free::own(&model, 0).unwrap(),
            Free::nominal(&model, "load", "inertia_kg_m2").unwrap(),
        ];
        let believed = believing(&free, &model, &[Some(0.02); 3]);
        for (before, after) in free.iter().zip(&believed).take(2) {
            assert_eq!(before.prior_slope(), 0.0);
            // A standard deviation away from what was found is one.
            let x = 0.02 / after.slope_at(0.1);
            assert!((after.prior_residual(x) - 1.0).abs() < 1e-12);
        }
        assert_eq!(believed[2].prior_slope(), free[2].prior_slope());
    }
}
