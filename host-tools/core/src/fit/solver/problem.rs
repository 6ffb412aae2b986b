//! What the optimiser is told: residuals and slopes at the places it asks for.
//!
//! Slopes cost a simulation or two each; of a guided motor, the rough ones of a coarse round the first pass alone. While a step keeps what
//! the slopes promised, those at the new place follow from what the step itself showed (Broyden's rank-one update, C. G. Broyden, Math. Comp.
//! 19, 1965):
//!
//! ```text
//! J' = J + (r' - r - J s) sᵀ / (sᵀ s)
//! ```
//!
//! with the step `s` from residuals `r` to `r'`. A step that keeps less than [`KEPT`] of it asks for slopes of its own place. So does every
//! step where a moment is fitted: what happens at one shows in few residuals, which say little of the way there.

use std::sync::{Mutex, PoisonError};

use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};
use rayon::prelude::*;

use super::{COARSE_STEP, Fit, left_over, spread, training_rows};
use crate::fit::free::Free;
use crate::fit::objective::Residuals;
use crate::progress::Progress;
use crate::simulation::Passes;

/// Part of the promised fall of the squared residuals that a step has to keep for its slopes to be carried on.
const KEPT: f64 = 0.25;

/// Steps over which slopes are carried on at most: on the way, and where the place is found, in which every other step has slopes of its
/// own. Carried on further there, fits stop beside the place: the play of a joint came out 3.4 % too small.
const CARRIED_ON: [usize; 2] = [10, 1];

/// Part of the step of their quotients within which slopes stand for those of a place nearby: they are means over as much on either side.
const NEARBY: f64 = 0.5;

/// A fit as the optimiser sees it.
pub(super) struct Problem<'a> {
    pub(super) fit: &'a Fit,
    /// After a request to end early there are no residuals any more, which ends the optimiser.
    pub(super) progress: &'a dyn Progress,
    pub(super) fixed: Vec<bool>,
    pub(super) step: f64,
    /// Factor of the priors: what a weighted residual is spread by. Where the model misses the data by twenty scales, a change
    /// that takes a scale off proves nothing against what is believed.
    pub(super) prior_weight: f64,
    /// Slopes over the first parameters that are taken as known.
    pub(super) known: Option<&'a DMatrix<f64>>,
    pub(super) x: DVector<f64>,
    pub(super) current: Option<Residuals>,
    /// Slopes at the place where the round begins.
    pub(super) begun: Option<Start>,
    /// Where the optimiser stood last.
    pub(super) stood: Mutex<Option<Place>>,
    /// The last place whose slopes were simulated.
    pub(super) simulated: Mutex<Option<Start>>,
}

/// A place, and the slopes that were simulated there.
pub(super) type Start = (DVector<f64>, DMatrix<f64>);

/// A place where the optimiser has stood.
pub(super) struct Place {
    x: DVector<f64>,
    residuals: Residuals,
    /// The same, weighted, with the priors.
    rows: DVector<f64>,
    slopes: DMatrix<f64>,
    /// Steps since the slopes were found by simulation.
    steps: usize,
}

impl Place {
    /// Slopes at `x`, where the weighted residuals are `rows`, by what the step there showed; `None` where the slopes here led astray.
    fn slopes_after_step(&self, x: &DVector<f64>, rows: &DVector<f64>) -> Option<DMatrix<f64>> {
        let step = x - &self.x;
        let square = step.norm_squared();
        if square == 0.0 {
            return None;
        }
        let predicted = &self.rows + &self.slopes * &step;
        let promised = self.rows.norm_squared() - predicted.norm_squared();
        let fallen = self.rows.norm_squared() - rows.norm_squared();
        (fallen >= KEPT * promised).then(|| {
            let mut slopes = self.slopes.clone();
            slopes.ger(square.recip(), &(rows - predicted), &step, 1.0);
            slopes
        })
    }
}

impl Problem<'_> {
    /// Weighs the priors by what the parameters cannot take off here: how far a fit still has to go says nothing of what will be left.
    pub(super) fn weigh_priors(&mut self) {
        let slopes = self.simulated_slopes().map(|(_, slopes)| slopes).or_else(|| self.slopes());
        let (Some(slopes), Some(current)) = (slopes, &self.current) else { return };
        let rows = DVector::from_vec(training_rows(&self.fit.objective, current));
        let data = slopes.rows(0, rows.len()).into_owned();
        let left = left_over(&data, rows);
        self.prior_weight = spread(&self.fit.objective, left.as_slice(), self.fit.free.len());
        self.begun = Some((self.x.clone(), slopes));
    }

    /// Where it stands, and the slopes that were found there by simulation, if they were.
    pub(super) fn simulated_slopes(&self) -> Option<Start> {
        let stood = self.stood.lock().unwrap_or_else(PoisonError::into_inner);
        let stood = stood.as_ref().filter(|place| place.steps == 0).map(|place| (&place.x, &place.slopes));
        let begun = self.begun.as_ref().map(|(x, slopes)| (x, slopes));
        let here = stood.into_iter().chain(begun).find(|(x, _)| **x == self.x);
        here.map(|(x, slopes)| (x.clone(), slopes.clone()))
    }

    /// Slopes that were simulated where it stands or, of a joint whose replays take two passes, within [`NEARBY`] of it in every coordinate. Where
    /// a moment is fitted they are those of its own place only.
    pub(super) fn slopes_nearby(&self) -> Option<Start> {
        if !Passes::are_two(&self.fit.model) || self.fit.free.iter().any(Free::is_moment) {
            return self.simulated_slopes();
        }
        let simulated = self.simulated.lock().unwrap_or_else(PoisonError::into_inner);
        let found = simulated.clone().or_else(|| self.begun.clone());
        let is_near = |(x, _): &Start| (x - &self.x).amax() <= NEARBY * self.step;
        found.filter(is_near).map(|(_, slopes)| (self.x.clone(), slopes))
    }

    /// `slopes` with the rows of the priors as they are weighed now.
    fn with_priors(&self, mut slopes: DMatrix<f64>) -> DMatrix<f64> {
        let first = slopes.nrows() - self.fit.free.len();
        for (j, free) in self.fit.free.iter().enumerate().filter(|(j, _)| !self.fixed[*j]) {
            slopes[(first + j, j)] = self.prior_weight * free.prior_slope();
        }
        slopes
    }

    fn residuals_at(&self, x: &DVector<f64>, passes: Passes) -> Option<Residuals> {
        if self.progress.interrupted() {
            return None;
        }
        self.fit.objective.residuals_in(passes, &self.fit.model_at(x)).ok().filter(Residuals::is_finite)
    }

    /// Column `j` of `known`, whose rows end with the priors of its own parameters.
    fn known_column(&self, known: &DMatrix<f64>, j: usize, rows: usize) -> DVector<f64> {
        let data = rows - self.fit.free.len();
        let mut column = known.column(j).rows(0, data).into_owned().resize_vertically(rows, 0.0);
        column[data + j] = self.prior_weight * self.fit.free[j].prior_slope();
        column
    }

    /// Weighted training residuals followed by the priors.
    fn weighted(&self, residuals: &Residuals, x: &DVector<f64>) -> DVector<f64> {
        let mut rows = training_rows(&self.fit.objective, residuals);
        let priors = self.fit.free.iter().zip(x.iter());
        rows.extend(priors.map(|(free, x)| self.prior_weight * free.prior_residual(*x)));
        DVector::from_vec(rows)
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.x.copy_from(x);
        // After a step that was no good the optimiser goes back.
        let stood = self.stood.get_mut().unwrap_or_else(PoisonError::into_inner);
        let back = stood.as_ref().filter(|place| place.x == *x).map(|place| place.residuals.clone());
        self.current = back.or_else(|| self.residuals_at(x, Passes::All));
    }

    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.current.as_ref().map(|residuals| self.weighted(residuals, &self.x))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let residuals = self.current.clone()?;
        let rows = self.weighted(&residuals, &self.x);
        let (slopes, steps) = match &self.begun {
            Some((x, slopes)) if *x == self.x => (self.with_priors(slopes.clone()), 0),
            _ => match self.carried_on(&rows) {
                Some(carried_on) => carried_on,
                None => (self.slopes()?, 0),
            },
        };
        if steps == 0 {
            let here = (self.x.clone(), slopes.clone());
            *self.simulated.lock().unwrap_or_else(PoisonError::into_inner) = Some(here);
        }
        let place = Place { x: self.x.clone(), residuals, rows, slopes: slopes.clone(), steps };
        *self.stood.lock().unwrap_or_else(PoisonError::into_inner) = Some(place);
        Some(slopes)
    }
}

impl Problem<'_> {
    /// Steps over which slopes are carried on at most.
    fn most_steps(&self) -> usize {
        if self.fit.free.iter().any(Free::is_moment) {
            return 0;
        }
        CARRIED_ON[usize::from(self.step < COARSE_STEP)]
    }

    /// Slopes here, where the weighted residuals are `rows`, by the step from where the optimiser stood last, and over how many steps they
    /// are then carried on.
    fn carried_on(&self, rows: &DVector<f64>) -> Option<(DMatrix<f64>, usize)> {
        let stood = self.stood.lock().unwrap_or_else(PoisonError::into_inner);
        let place = stood.as_ref().filter(|place| place.steps < self.most_steps())?;
        Some((place.slopes_after_step(&self.x, rows)?, place.steps + 1))
    }

    /// Longest first step, in units of the optimiser: by it the coordinate that the residuals answer to least may change by `reach`, and the
    /// residuals by that much at least. Longer ones run into the bounds of what shows little, and stay there.
    pub(super) fn first_step(&mut self, reach: f64) -> f64 {
        if self.begun.is_none() {
            self.begun = self.slopes().map(|slopes| (self.x.clone(), slopes));
        }
        let Some((x, slopes)) = &self.begun else { return reach };
        let norms = slopes.column_iter().map(|column| if column.norm() > 0.0 { column.norm() } else { 1.0 });
        let norms = DVector::from_iterator(slopes.ncols(), norms);
        let longest = reach * norms.min().max(1.0);
        // The optimiser measures it by where it stands, if that is not the origin.
        let from_origin = x.component_mul(&norms).norm();
        if from_origin > 0.0 { longest / from_origin } else { longest }
    }

    /// Slopes of the weighted residuals.
    pub(super) fn slopes(&self) -> Option<DMatrix<f64>> {
        let is_fine = self.step < COARSE_STEP;
        let passes = if is_fine { Passes::All } else { Passes::roughly(&self.fit.model) };
        let in_passes = |x: &DVector<f64>| Some(self.weighted(&self.residuals_at(x, passes)?, x));
        let here = match passes {
            Passes::All => self.weighted(self.current.as_ref()?, &self.x),
            Passes::First | Passes::Rough => in_passes(&self.x)?,
        };
        let columns: Option<Vec<DVector<f64>>> = (0..self.fit.free.len())
            .into_par_iter()
            .map(|j| {
                if self.fixed[j] {
                    return Some(DVector::zeros(here.len()));
                }
                let free = &self.fit.free[j];
                if let Some(known) = self.known.filter(|known| j < known.ncols()) {
                    return Some(self.known_column(known, j, here.len()));
                }
                let at = |step: f64| {
                    let mut x = self.x.clone();
                    x[j] += step;
                    in_passes(&x)
                };
                let [before, ahead] =
                    [-self.step, self.step].map(|step| free.at_bound(free.value_at(self.x[j] + step)));
                // A step ahead alone takes curvature for slope, and a valley is left half-way: in the rounds that find the place
                // the quotient is symmetric. So it is where a moment lies too late, which only a step back changes.
                let symmetric = is_fine || free.is_moment();
                if symmetric && !before && !ahead {
                    return Some((at(self.step)? - at(-self.step)?) / (2.0 * self.step));
                }
                // Step away from the nearer bound.
                let step = if ahead { -self.step } else { self.step };
                Some((at(step)? - &here) / step)
            })
            .collect();
        Some(DMatrix::from_columns(&columns?))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use bowden_model::channel::Channel;
    use nalgebra::{DMatrix, DVector};

    use super::{NEARBY, Place, Problem};
    use crate::fit::free::Free;
    use crate::fit::objective::{Objective, Residuals};
    use crate::fit::solver::{FINE_STEP, Fit};
    use crate::joint_model::JointModel;
    use crate::progress::Quiet;
    use crate::test_bench;

    /// Residuals `[x² - 4, 3 x + y]` at a place, with their slopes there.
    fn place(x: f64, y: f64) -> Place {
        let slopes = DMatrix::from_row_slice(2, 2, &[2.0 * x, 0.0, 3.0, 1.0]);
        let residuals = Residuals { values: Vec::new() };
        Place { x: DVector::from_vec(vec![x, y]), residuals, rows: rows(x, y), slopes, steps: 0 }
    }

    fn rows(x: f64, y: f64) -> DVector<f64> {
        DVector::from_vec(vec![x * x - 4.0, 3.0 * x + y])
    }

    /// From (3, -9) along x to 2.2 the square falls at 5.2 a unit, the secant of x² there; across the step nothing was seen.
    #[test]
    fn slopes_after_a_step_are_those_that_the_step_showed() {
        let there = DVector::from_vec(vec![2.2, -9.0]);
        let slopes = place(3.0, -9.0).slopes_after_step(&there, &rows(2.2, -9.0)).unwrap();
        let expected = DMatrix::from_row_slice(2, 2, &[5.2, 0.0, 3.0, 1.0]);
        assert!((&slopes - &expected).norm() < 1e-12, "{slopes}");
    }

    #[test]
    fn slopes_that_led_astray_are_not_carried_on() {
        let there = DVector::from_vec(vec![2.2, -9.0]);
        assert!(
            place(3.0, -9.0)
                .slopes_after_step(&DVector::from_vec(vec![3.0, -9.0]), &rows(3.0, -9.0))
                .is_none()
        );
        // The squares were promised to fall from 25 by 25 - (5 - 6 * 0.8)² - 2.4² = 19.2, and 26.9 are left.
        assert!(place(3.0, -9.0).slopes_after_step(&there, &DVector::from_vec(vec![4.6, -2.4])).is_none());
    }

    /// Of a motor with recorded duty, whose replays take two passes, and of a prescribed angle.
    #[test]
    fn slopes_of_a_place_nearby_stand_for_those_here_where_a_replay_takes_two_passes() {
        let found_away = |duty: Option<f64>, steps: f64| {
            let mut recording = test_bench::swung(1000);
            if let Some(duty) = duty {
                recording.set(Channel::Duty, vec![duty; 1000]);
                recording.set(Channel::BusVoltage, vec![24.0; 1000]);
            }
            let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
            let free = ["pretension_n", "axial_stiffness_n"]
                .map(|name| Free::nominal(&model, "tendon", name).unwrap())
                .to_vec();
            let objective = Objective::new(&model, &[recording], &[], false).unwrap();
            let slopes = DMatrix::from_element(3, 2, 7.0);
            let problem = Problem {
                fit: &Fit { objective, model, free },
                progress: &Quiet,
                fixed: vec![false; 2],
                step: FINE_STEP,
                prior_weight: 1.0,
                known: None,
                x: DVector::from_vec(vec![0.3 + steps * FINE_STEP, 0.1]),
                current: None,
                begun: Some((DVector::from_vec(vec![0.3, 0.1]), slopes.clone())),
                stood: Mutex::default(),
                simulated: Mutex::default(),
            };
            let nearby = problem.slopes_nearby();
            assert!(nearby.iter().all(|(x, found)| *x == problem.x && *found == slopes));
            nearby.is_some()
        };
        assert!(found_away(Some(0.1), 0.0) && found_away(Some(0.1), -0.9 * NEARBY));
        assert!(!found_away(Some(0.1), 1.1 * NEARBY));
        assert!(found_away(None, 0.0) && !found_away(None, 0.9 * NEARBY));
    }
}
