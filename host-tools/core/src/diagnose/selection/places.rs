//! Where a law that is confined to a place of an angle acts.
//!
//! It starts where most is left, which may be one edge of a range that rubs: the fit from there ends in an optimum that covers this edge alone.

use bowden_model::effect::ActiveEffect;
use bowden_model::law::{self, Form};

use super::{Fitted, PATIENCE, Search};
use crate::fit::solver::{FINE_STEP, Known, solve_for_ranking};
use crate::outcome::Failure;

/// Steepness of a range with edges.
const RANGE: f64 = 4.0;

/// Times that a bump may move.
const MOVES: usize = 3;

impl Search<'_> {
    /// `fitted`, a fit to convergence, with its newest effect moved while that predicts better, if it is a bump.
    pub(super) fn moved(&self, mut fitted: Fitted) -> Result<Fitted, Failure> {
        for _ in 0..MOVES {
            let found = fitted.newest();
            let mut is_moved = false;
            for other in beside(&found) {
                if self.progress.interrupted() {
                    return Ok(fitted);
                }
                let place = fitted.newest_place();
                let mut model = fitted.solution.model.clone();
                model.effects[place] = other;
                let free = fitted.layout.free(self.believed, &model);
                // At another place the slopes are others.
                let known = Known { jacobian: None, spread: fitted.solution.slopes().spread };
                let ranked = solve_for_ranking(self.objective, &model, &free, PATIENCE, &known)?;
                let ranked = self.judged(fitted.layout.clone(), ranked, false);
                if ranked.loss < fitted.loss {
                    let model = &ranked.solution.model;
                    let with = self.fit(fitted.layout.clone(), model, &[FINE_STEP, FINE_STEP])?;
                    if with.loss < fitted.loss {
                        fitted = with;
                        is_moved = true;
                    }
                }
            }
            if !is_moved {
                break;
            }
        }
        Ok(fitted)
    }
}

/// For a bump, ranges that keep one of its edges: half as wide again, and by three tenths narrower; none for what is no bump.
fn beside(found: &ActiveEffect) -> Vec<ActiveEffect> {
    if law::of(found).is_none_or(|law| law.form() != Form::Bump) {
        return Vec::new();
    }
    let [_, at_rad, width_rad, ..] = found.parameters;
    let range = |part: f64, widths: f64| {
        let moved = found.with("at_rad", at_rad + widths * width_rad).with("width_rad", part * width_rad);
        moved.with("steepness", RANGE)
    };
    vec![range(1.5, -0.5), range(1.5, 0.5), range(0.7, -0.3), range(0.7, 0.3)]
}

#[cfg(test)]
mod tests {
    use super::super::Asked;
    use super::*;
    use crate::diagnose::layout::Layout;
    use crate::fit::objective::Objective;
    use crate::fit::solver::COARSE_STEP;
    use crate::joint_model::JointModel;
    use crate::progress::Quiet;
    use crate::test_bench;

    /// A joint that rubs from -0.1 to 0.3 rad, found as a round bump on the lower edge: the fit from there ends elsewhere.
    #[test]
    fn a_bump_that_covers_one_edge_of_a_range_goes_on_to_the_other() {
        let recording = test_bench::swung(6000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let bump = |at_rad: f64, width_rad: f64, steepness: f64| {
            let law = ActiveEffect::with_defaults(law::find("law_joint_friction_at_a_place").unwrap());
            let sized = law.with("amplitude_nm", 0.3).with("at_rad", at_rad);
            sized.with("width_rad", width_rad).with("steepness", steepness)
        };
        let recording = test_bench::measured(&model, recording, &[bump(0.1, 0.2, 6.0)]);
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let asked = Asked::default();
        let search = Search { objective: &objective, believed: &model, asked: &asked, progress: &Quiet };
        let (layout, with) = Layout::of(&model).with(&model, bump(-0.1, 0.03, 2.0));
        let coarse = search.fit(layout, &with, &[COARSE_STEP]).unwrap();
        let finished = search.finish(&coarse).unwrap();
        let [_, at_rad, width_rad, ..] = finished.newest().parameters;
        assert!((at_rad - 0.1).abs() < 0.02 && (width_rad - 0.2).abs() < 0.02, "{:?}", finished.newest());
        assert!(finished.loss < 0.2 * coarse.loss, "{} to {}", coarse.loss, finished.loss);
    }
}
