//! Result of a fit. What its slopes tell takes as many simulations as a step of the fit, and most fits of a search are only compared by their
//! residuals: it is found when it is asked for.

use std::fmt;
use std::sync::{Arc, Mutex, OnceLock};

use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::{DMatrix, DVector};

use super::problem::{Problem, Start};
use super::{FINE_STEP, Fit, standard_deviations};
use crate::fit::objective::Residuals;
use crate::joint_model::JointModel;
use crate::progress::{Progress, Quiet};

/// Result of a fit.
#[derive(Clone)]
pub struct Solution {
    /// Model with the fitted values.
    pub model: JointModel,
    /// Fitted values.
    pub values: Vec<f64>,
    /// Residuals of the fitted model.
    pub residuals: Residuals,
    slopes: Arc<Told>,
}

/// Slopes as far as they are known.
enum Told {
    /// From the beginning.
    Known(Slopes),
    /// Once somebody has asked.
    Asked(Box<End>, OnceLock<Slopes>),
}

/// What the slopes at the fitted values tell.
#[derive(Clone, Debug)]
pub struct Slopes {
    /// Standard deviations of the fitted values; `None` for a value at a bound.
    pub stds: Vec<Option<f64>>,
    /// Standard deviation of a weighted residual of the fitted model, at least 1: the weight of what is believed.
    pub spread: f64,
    /// Slopes of the weighted residuals over the optimiser's coordinates, training rows and priors; empty after a fit that only ranks.
    pub jacobian: DMatrix<f64>,
}

impl Slopes {
    /// Of a fit of so many values that only ranks, or that moves nothing.
    pub(super) fn none(values: usize, spread: f64) -> Self {
        Self { stds: vec![None; values], spread, jacobian: DMatrix::zeros(0, 0) }
    }
}

/// Where a fit ended.
pub(super) struct End {
    pub(super) fit: Fit,
    pub(super) fixed: Vec<bool>,
    pub(super) x: DVector<f64>,
    /// Slopes at `x`, where the fit simulated them already, or nearby.
    pub(super) begun: Option<Start>,
    pub(super) prior_weight: f64,
}

impl End {
    /// Simulates the slopes; `residuals` are those at `x`, of what was fitted first.
    fn slopes(&self, residuals: &Residuals, progress: &dyn Progress) -> Slopes {
        let Self { fit, fixed, x, begun, prior_weight } = self;
        let values = residuals.values.iter().copied().take(fit.objective.entries().count()).collect();
        let mut problem = Problem {
            fit,
            progress,
            fixed: fixed.clone(),
            step: FINE_STEP,
            prior_weight: *prior_weight,
            known: None,
            x: x.clone(),
            current: Some(Residuals { values }).filter(Residuals::is_finite),
            begun: begun.clone(),
            stood: Mutex::default(),
            simulated: Mutex::default(),
        };
        problem.weigh_priors();
        let jacobian = problem.jacobian().unwrap_or_else(|| DMatrix::zeros(0, fit.free.len()));
        let spread = problem.prior_weight;
        let stds = standard_deviations(&jacobian, fixed)
            .into_iter()
            .zip(fit.free.iter().zip(x.iter()))
            .map(|(std, (free, x))| std.map(|s| s * spread * free.slope_at(free.value_at(*x))))
            .collect();
        Slopes { stds, spread, jacobian }
    }
}

impl Solution {
    /// A fit that ended at `end`.
    pub(super) fn ended(model: JointModel, values: Vec<f64>, residuals: Residuals, end: End) -> Self {
        Self { model, values, residuals, slopes: Arc::new(Told::Asked(Box::new(end), OnceLock::new())) }
    }

    /// A fit whose slopes are known.
    pub(crate) fn with_slopes(
        model: JointModel,
        values: Vec<f64>,
        residuals: Residuals,
        slopes: Slopes,
    ) -> Self {
        Self { model, values, residuals, slopes: Arc::new(Told::Known(slopes)) }
    }

    /// What the slopes tell, simulated at the first call. That must not be one of several at a time on the threads of a pool: one would wait for
    /// another that waits for its thread.
    #[must_use]
    pub fn slopes(&self) -> &Slopes {
        self.slopes_watched(&Quiet)
    }

    /// The same; empty after a request to end early.
    pub(super) fn slopes_watched(&self, progress: &dyn Progress) -> &Slopes {
        match &*self.slopes {
            Told::Known(slopes) => slopes,
            Told::Asked(end, slopes) => slopes.get_or_init(|| end.slopes(&self.residuals, progress)),
        }
    }
}

impl fmt::Debug for Solution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Solution").field("values", &self.values).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;

    use crate::fit::free::Free;
    use crate::fit::objective::Objective;
    use crate::fit::solver::{
        COARSE_STEP, FINE_STEP, Known, solve_for_ranking, solve_in_rounds, training_rows,
    };
    use crate::joint_model::JointModel;
    use crate::recording::Recording;
    use crate::simulation::{ReplayInput, replay};
    use crate::test_bench;

    /// A bench whose pretension is a tenth more than stated, and tensions that ripple beside it by some scales.
    fn bench() -> (JointModel, Recording) {
        let mut recording = test_bench::swung(4000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let mut real = model.clone();
        real.parameters.tendon.as_mut().unwrap().pretension_n *= 1.1;
        let measured = replay(&real, &ReplayInput::new(&model, &recording).unwrap()).unwrap();
        for (channel, values) in measured.channels() {
            let ripple = if Channel::TENSIONS.contains(&channel) { 3.0 } else { 0.0 };
            let rippled =
                values.iter().enumerate().map(|(k, value)| value + ripple * (0.05 * k as f64).sin());
            recording.set(channel, rippled.collect());
        }
        (model, recording)
    }

    /// For one value `v` whose optimiser's coordinate is its logarithm: `σ = v s / |dr/d ln v|` with the spread `s` of a residual, and the
    /// slopes by differences ten times finer than those of the fit; what is held out tells nothing of it.
    #[test]
    fn the_standard_deviation_is_that_of_the_slopes_where_the_fit_ended() {
        let (model, recording) = bench();
        let free = [Free::nominal(&model, "tendon", "pretension_n").unwrap()];
        let alone = Objective::new(&model, std::slice::from_ref(&recording), &[], false).unwrap();
        let fit =
            |objective| solve_in_rounds(objective, &model, &free, 5, &[COARSE_STEP, FINE_STEP]).unwrap();
        let fitted = fit(&alone);
        let slopes = fitted.slopes();
        let rows_at = |ln: f64| {
            let mut joint = fitted.model.clone();
            joint.parameters.tendon.as_mut().unwrap().pretension_n *= ln.exp();
            training_rows(&alone, &alone.residuals(&joint).unwrap())
        };
        let pairs = rows_at(2e-3).into_iter().zip(rows_at(-2e-3));
        let square: f64 = pairs.map(|(after, before)| ((after - before) / 4e-3).powi(2)).sum();
        let expected = fitted.values[0] * slopes.spread / square.sqrt();
        let std = slopes.stds[0].unwrap();
        assert!((std / expected - 1.0).abs() < 0.01, "{std}, expected {expected}");
        assert!(slopes.spread > 1.2, "{}", slopes.spread);
        let judged =
            Objective::new(&model, std::slice::from_ref(&recording), std::slice::from_ref(&recording), false)
                .unwrap();
        assert_eq!((fit(&judged).slopes().stds[0], fit(&judged).slopes().spread), (Some(std), slopes.spread));
    }

    #[test]
    fn a_fit_that_ranks_has_no_slopes() {
        let (model, recording) = bench();
        let free = [Free::nominal(&model, "tendon", "pretension_n").unwrap()];
        let objective = Objective::new(&model, &[recording], &[], false).unwrap();
        let known = Known { jacobian: None, spread: 2.5 };
        let ranked = solve_for_ranking(&objective, &model, &free, 5, &known).unwrap();
        let slopes = ranked.slopes();
        assert_eq!((slopes.jacobian.len(), &slopes.stds[..], slopes.spread), (0, &[None][..], 2.5));
    }
}
