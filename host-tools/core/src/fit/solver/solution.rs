//! Result of a fit. What its slopes tell takes as many simulations as a step of the fit, and most fits of a search are only compared by their
//! residuals: it is found when it is asked for.

use std::fmt;
use std::sync::{Arc, OnceLock};

use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::{DMatrix, DVector};

use super::problem::Start;
use super::{Fit, standard_deviations};
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
    /// Where the fit ended; `None` where the slopes are known from the beginning.
    end: Option<Arc<End>>,
    slopes: Arc<OnceLock<Slopes>>,
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
    /// Slopes at `x`, where the fit simulated them already.
    pub(super) begun: Option<Start>,
    pub(super) prior_weight: f64,
}

impl End {
    /// Simulates the slopes; `residuals` are those at `x`, of what was fitted first.
    fn slopes(&self, residuals: &Residuals, progress: &dyn Progress) -> Slopes {
        let Self { fit, fixed, x, begun, prior_weight } = self;
        let values = residuals.values.iter().copied().take(fit.objective.entries().count()).collect();
        let at = (x.clone(), Some(Residuals { values }).filter(Residuals::is_finite));
        let mut problem = fit.problem(super::FINE_STEP, fixed, at, begun.clone(), *prior_weight, progress);
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
        Self { model, values, residuals, end: Some(Arc::new(end)), slopes: Arc::default() }
    }

    /// A fit whose slopes are known.
    pub(crate) fn with_slopes(
        model: JointModel,
        values: Vec<f64>,
        residuals: Residuals,
        slopes: Slopes,
    ) -> Self {
        Self { model, values, residuals, end: None, slopes: Arc::new(OnceLock::from(slopes)) }
    }

    /// What the slopes tell, simulated at the first call. No two calls may run at a time on threads of one pool.
    #[must_use]
    pub fn slopes(&self) -> &Slopes {
        self.slopes_watched(&Quiet)
    }

    /// The same; empty after a request to end early.
    pub(super) fn slopes_watched(&self, progress: &dyn Progress) -> &Slopes {
        self.slopes.get_or_init(|| match &self.end {
            Some(end) => end.slopes(&self.residuals, progress),
            None => Slopes::none(self.values.len(), 1.0),
        })
    }
}

impl fmt::Debug for Solution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Solution").field("values", &self.values).finish_non_exhaustive()
    }
}
