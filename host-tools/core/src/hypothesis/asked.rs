//! A function that is asked at knots: what it says is checked, and when it fails that is kept.

use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, OnceLock, PoisonError};

use bowden_model::effect::{MAX_PARAMETERS, ParameterSpec};
use bowden_model::law::Variable;

use super::Function;
use super::table::{Axis, Table};

/// A function that is asked at the knots of a grid.
pub(super) struct Asked {
    pub(super) function: Box<dyn Function>,
    pub(super) ranges: Vec<Option<[f64; 2]>>,
    /// What the variables did before there were knots.
    pub(super) seen: Mutex<Option<[[f64; 2]; 2]>>,
    pub(super) axes: OnceLock<Vec<Axis>>,
    pub(super) failure: Mutex<Option<String>>,
    /// Whether there is a failure: the function is not asked again.
    pub(super) failed: AtomicBool,
}

impl Asked {
    /// Widens what the variables have done by a point.
    pub(super) fn watch(&self, point: [f64; 2]) {
        if point.iter().all(|x| x.is_finite()) {
            let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
            let seen = seen.get_or_insert(point.map(|x| [x, x]));
            for ([low, high], x) in seen.iter_mut().zip(point) {
                (*low, *high) = (low.min(x), high.max(x));
            }
        }
    }
}

/// A curve through values at knots: its coefficients.
pub(super) struct Curve(pub(super) Axis);

impl Function for Curve {
    fn values(&self, columns: &[Vec<f64>], coefficients: &[f64]) -> Result<Vec<f64>, String> {
        let table = Table::new(vec![self.0.clone()], coefficients.to_vec());
        let table = table.ok_or_else(|| "a value of the curve is no number".to_owned())?;
        Ok(columns[0].iter().map(|x| table.at([*x, 0.0])).collect())
    }
}

/// Values of the function, all of them numbers, or what is wrong.
pub(super) fn checked_values(
    asked: &Asked,
    variables: &[Variable],
    specs: &[ParameterSpec],
    columns: &[Vec<f64>],
    coefficients: &[f64; MAX_PARAMETERS],
) -> Result<Vec<f64>, String> {
    let values = asked.function.values(columns, &coefficients[..specs.len()])?;
    if values.len() != columns[0].len() {
        return Err(format!("{} values for {} points; return one a point", values.len(), columns[0].len()));
    }
    let Some(bad) = values.iter().position(|value| !value.is_finite()) else { return Ok(values) };
    let at = variables.iter().zip(columns).map(|(variable, column)| (variable.name(), column[bad]));
    let with = specs.iter().zip(coefficients).map(|(spec, value)| (spec.name, *value));
    let shown: Vec<String> = at.chain(with).map(|(name, value)| format!("{name} = {value}")).collect();
    Err(format!("the function is {} at {}; let it be finite there", values[bad], shown.join(", ")))
}
