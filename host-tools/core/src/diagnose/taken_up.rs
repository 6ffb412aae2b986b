//! Nominal parameters that grow to take up what an effect does, where no tension shows which of the two it is.
//!
//! Both tensions of a tendon show what is lost along its sheath. From angles and a current alone, friction of the sheath is a torque against the
//! motion that grows with the load; where the load changes little beside the pretension, dry friction elsewhere is hardly anything else.
//! The weight of an arm that hangs is a spring, as far as its travel is short.

use bowden_model::effect::{ActiveEffect, Target};

use super::selection::Held;
use super::verdict::Recalibrated;
use crate::fit::calibrated::wrong_from;
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::rig::{RigParameter, Undecided};

/// A parameter, `SECTION.NAME`, and the effects that a larger value of it takes up.
struct TakesUp {
    parameter: &'static str,
    effects: &'static [&'static str],
}

/// All of them.
const TAKES_UP: [TakesUp; 2] = [
    TakesUp {
        parameter: "sheath.friction_coefficient",
        effects: &["motor_coulomb_friction", "gear_load_friction", "joint_coulomb_friction"],
    },
    TakesUp { parameter: "load.mass_kg", effects: &["joint_spring"] },
];

impl TakesUp {
    /// Those of its effects that are not among `named`.
    fn beside(&self, named: &[ActiveEffect]) -> Vec<&'static str> {
        let is_named = |id: &&str| named.iter().any(|effect| effect.descriptor().id == *id);
        self.effects.iter().copied().filter(|id| !is_named(id)).collect()
    }
}

/// The parameters of `fitted` that are larger than in `believed`, by more than what rig files are wrong about them anyway, with what
/// `believed` states, and with the effects that they may have taken up and that are not `named`. None where a recording holds a tension.
pub(super) fn taken_up(
    believed: &JointModel,
    fitted: &JointModel,
    named: &[ActiveEffect],
) -> Vec<(Held, Vec<&'static str>)> {
    let grown = |one: &TakesUp| {
        let parameter = RigParameter::parse(one.parameter).ok()?;
        let [before, now] = [believed, fitted].map(|model| model.value(&parameter));
        let has_grown = now? > (1.0 + wrong_from(one.parameter)) * before?;
        (has_grown && believed.tensions_unseen()).then_some(((parameter, before?), one.beside(named)))
    };
    TAKES_UP.iter().filter_map(grown).collect()
}

/// What else would fit of a bench: larger parameters, for which effects would stand as well according to `instead_of`; and all of `stated` that
/// the recordings do not settle. `model` is that of the rig file.
///
/// # Errors
/// As `instead_of`.
pub(super) fn undecided(
    model: &JointModel,
    recalibrated: &[&Recalibrated],
    named: &[ActiveEffect],
    stated: Vec<Undecided>,
    instead_of: impl Fn(Held, &[&str]) -> Result<Vec<ActiveEffect>, Failure>,
) -> Result<Vec<Undecided>, Failure> {
    let mut all = stated;
    for one in &TAKES_UP {
        let is_it = |fitted: &&&Recalibrated| fitted.parameter == one.parameter && fitted.bench.is_none();
        let (Some(fitted), Ok(parameter)) =
            (recalibrated.iter().find(is_it), RigParameter::parse(one.parameter))
        else {
            continue;
        };
        let is_judged =
            |stated: &Undecided| stated.parameter == one.parameter && one.effects.contains(&stated.effect);
        let before =
            all.iter().find(|stated| is_judged(stated)).map_or(fitted.nominal, |stated| stated.before);
        all.retain(|stated| !is_judged(stated));
        let since = Recalibrated { nominal: before, ..(*fitted).clone() };
        if model.tensions_unseen() && since.is_wrong() && since.change() > 0.0 {
            let rivals = instead_of((parameter, before), &one.beside(named))?;
            all.extend(rivals.iter().map(|effect| Undecided {
                parameter: one.parameter.to_owned(),
                before,
                effect: effect.descriptor().id,
                target: Target::None,
            }));
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use bowden_model::effects::find;

    use super::*;
    use crate::joint_model::PRETENSION;
    use crate::test_bench;

    const COEFFICIENT: &str = "sheath.friction_coefficient";
    const COULOMB: &str = "joint_coulomb_friction";

    fn model(unseen: bool, share: f64) -> JointModel {
        let mut model = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(10)).unwrap();
        model.own.untold.extend(RigParameter::parse(PRETENSION).ok().filter(|_| unseen));
        model.parameters.sheath.as_mut().unwrap().friction_coefficient *= share;
        model
    }

    fn effect(id: &str) -> ActiveEffect {
        ActiveEffect::with_defaults(find(id).unwrap())
    }

    #[test]
    fn a_larger_coefficient_is_held_at_what_the_rig_states_where_no_tension_shows_it() {
        let held = |unseen, share| taken_up(&model(unseen, 1.0), &model(unseen, share), &[effect(COULOMB)]);
        let stated = model(true, 1.0).parameters.sheath.unwrap().friction_coefficient;
        let ((parameter, value), effects) = held(true, 1.2).remove(0);
        assert_eq!((parameter.to_string().as_str(), value), (COEFFICIENT, stated));
        assert_eq!(effects, ["motor_coulomb_friction", "gear_load_friction"]);
        for (unseen, share) in [(true, 1.1), (true, 0.8), (false, 1.2)] {
            assert!(held(unseen, share).is_empty(), "{unseen}, {share}");
        }
    }

    /// What stands for a coefficient that was 0.10 and is `fitted` now, beside what is `named`, according to a rig file that had it undecided from
    /// `before` on.
    fn said(
        unseen: bool,
        fitted: f64,
        named: &[ActiveEffect],
        before: Option<f64>,
    ) -> Vec<(f64, &'static str)> {
        let fitted = Recalibrated {
            parameter: COEFFICIENT.to_owned(),
            bench: None,
            nominal: 0.10,
            fitted,
            std: Some(1e-3),
            unit: "1".into(),
            at_bound: false,
        };
        let stated = before.map(|before| Undecided {
            parameter: COEFFICIENT.to_owned(),
            before,
            effect: COULOMB,
            target: Target::None,
        });
        let stated = Vec::from_iter(stated);
        let instead_of = |(_, held): Held, ids: &[&str]| {
            assert_eq!(held, before.unwrap_or(0.10));
            Ok(ids.iter().filter(|id| **id == COULOMB).map(|id| effect(id)).collect())
        };
        let all = undecided(&model(unseen, 1.0), &[&fitted], named, stated, instead_of).unwrap();
        all.into_iter().map(|one| (one.before, one.effect)).collect()
    }

    #[test]
    fn what_fits_as_well_as_a_larger_coefficient_is_undecided_until_tensions_show_it() {
        assert_eq!(said(true, 0.12, &[], None), [(0.10, COULOMB)]);
        // No more than rig files are wrong anyway, less friction, friction that is named already, and tensions.
        assert_eq!(said(true, 0.11, &[], None), []);
        assert_eq!(said(true, 0.08, &[], None), []);
        assert_eq!(said(true, 0.12, &[effect(COULOMB)], None), []);
        assert_eq!(said(false, 0.12, &[], None), []);
        // The rig file has the larger coefficient by now.
        assert_eq!(said(true, 0.10, &[], Some(0.08)), [(0.08, COULOMB)]);
        assert_eq!(said(false, 0.10, &[], Some(0.08)), []);
    }
}
