//! Moments of effects that begin at one, found again once all effects are known.
//!
//! While much is missing an effect is laid where it also takes off some of that: a pretension that was lost before a drag was known came
//! out two seconds late. No small step leads a moment back, and what the wrong one leaves shows nowhere else, so that nothing more is found.

use super::{Chosen, Explanation, Fitted, Search, instances, is_further, remove};
use crate::diagnose::onset::moment_of;
use crate::diagnose::policy::POLICY;
use crate::fit::solver::{COARSE_STEP, FINE_STEP};
use crate::outcome::Failure;

impl Search<'_> {
    /// Looks for the moments of all effects again while more is left than noise, and returns whether one has moved.
    pub(super) fn find_moments_again(&self, now: &mut Explanation) -> Result<bool, Failure> {
        let mut has_moved = false;
        // What moves is appended, so that the places of the effects before it do not change.
        for index in (0..now.chosen.len()).rev() {
            let is_open = now.fit.loss > POLICY.noise_loss && !self.progress.interrupted();
            if is_open && moment_of(&now.chosen[index].effect).is_some() && !is_further(&now.chosen, index) {
                has_moved |= self.find_moment_of(index, now)?;
            }
        }
        Ok(has_moved)
    }

    fn find_moment_of(&self, index: usize, now: &mut Explanation) -> Result<bool, Failure> {
        let Explanation { fit: present, chosen } = now;
        let effect = chosen[index].effect;
        let instances = instances(chosen, index);
        let (layout, without) = present.without(&instances);
        let rest = self.fit(layout, &without, &[COARSE_STEP, FINE_STEP])?;
        let fits = self.one_of(&rest, |start| start.is_beside(&effect), present.loss)?;
        let Some(found) = fits.into_iter().find(|fitted| fitted.finished) else { return Ok(false) };
        let found = self.with_ordinary(found)?;
        let is_better = |loss: f64, others_loss: f64| POLICY.worth_having(loss, others_loss, instances.len());
        let [before, after] = [present as &Fitted, &found].map(|fitted| fitted.loss_on(effect.bench));
        if !is_better(before, after) || !self.holds_across_recordings(present, &found, is_better)? {
            return Ok(false);
        }
        let others = std::mem::take(&mut chosen[index].others);
        remove(chosen, &instances);
        chosen.push(Chosen::newest_of(&found, &rest, others));
        *present = found;
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::ActiveEffect;
    use bowden_model::effects::find;

    use super::super::{Asked, Policy};
    use super::*;
    use crate::diagnose::layout::Layout;
    use crate::fit::objective::Objective;
    use crate::joint_model::JointModel;
    use crate::progress::Quiet;
    use crate::test_bench;

    fn effect(id: &str) -> ActiveEffect {
        ActiveEffect::with_defaults(find(id).unwrap())
    }

    /// A weight that was taken off after 3.6 s, laid six seconds late: there the fit ends, and from there it does not come back by itself.
    #[test]
    fn a_moment_is_found_again_beside_what_was_missing_before() {
        const TAKEN_OFF_S: f64 = 3.6;
        let recording = test_bench::swung(12_000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let taken_off = effect("payload_change").with("change_kg", -0.5).with("time_s", TAKEN_OFF_S);
        let spring = effect("joint_spring").with("stiffness_nm_per_rad", 0.5);
        let recording = test_bench::measured(&model, recording, &[taken_off, spring]);
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let asked = Asked::default();
        let search = Search { objective: &objective, believed: &model, asked: &asked, progress: &Quiet };
        let nothing = search.fit(Layout::of(&model), &model, &[COARSE_STEP]).unwrap();
        let late = taken_off.with("change_kg", -0.2).with("time_s", TAKEN_OFF_S + 6.0);
        let (layout, with) = nothing.layout.with(&model, late);
        let first = search.fit(layout, &with, &[COARSE_STEP, FINE_STEP]).unwrap();
        let (layout, with) = first.layout.with(&first.solution.model, spring);
        let both = search.fit(layout, &with, &[COARSE_STEP, FINE_STEP]).unwrap();
        let loss_before = both.loss;
        let time_s = |chosen: &Chosen| chosen.effect.parameters[moment_of(&chosen.effect).unwrap()];
        let chosen = vec![
            Chosen::newest_of(&first, &nothing, Vec::new()),
            Chosen::newest_of(&both, &first, Vec::new()),
        ];
        let mut now = Explanation { fit: both, chosen };
        assert!((time_s(&now.chosen[0]) - TAKEN_OFF_S).abs() > 1.0, "{} s", time_s(&now.chosen[0]));

        search.add_names(&mut now, &mut Vec::new(), Policy::worth_naming).unwrap();
        let [springy, lighter] = &now.chosen[..] else { panic!("{}", now.chosen.len()) };
        assert_eq!(springy.effect.descriptor().id, "joint_spring");
        assert!((time_s(lighter) - TAKEN_OFF_S).abs() < 0.1, "{} s", time_s(lighter));
        assert_eq!(now.fit.newest(), lighter.effect);
        assert!(now.fit.loss < 0.5 * loss_before, "{loss_before} to {}", now.fit.loss);
        assert!(!search.find_moments_again(&mut now).unwrap());
    }
}
