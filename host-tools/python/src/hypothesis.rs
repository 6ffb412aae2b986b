//! Hypotheses: functions of Python as terms of the search.

use std::sync::{Arc, Mutex, PoisonError};

use bowden_core::hypothesis::{Coefficient, Function, Hypothesis, Statement};
use bowden_core::outcome::Failure;
use bowden_model::channel::Channel;
use bowden_model::law::{Port, Variable};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::errors::{Raise, raised};

/// Name, unit, smallest and largest value, starts.
type CoefficientParts = (String, String, f64, f64, Vec<f64>);

/// A function with what is stated about it; it never changes.
#[pyclass(frozen, name = "NativeHypothesis", module = "bowden._bowden")]
pub struct NativeHypothesis {
    name: String,
    port: Port,
    channel: Option<Channel>,
    variables: Vec<Variable>,
    coefficients: Vec<Coefficient>,
    ranges: Vec<Option<[f64; 2]>>,
    function: Py<PyAny>,
}

#[pymethods]
impl NativeHypothesis {
    /// `evaluate(columns, coefficients)` returns an array of `float64`, one value a point.
    #[new]
    fn new(
        py: Python<'_>,
        name: String,
        port: &str,
        channel: Option<&str>,
        variables: Vec<(String, Option<[f64; 2]>)>,
        coefficients: Vec<CoefficientParts>,
        evaluate: Py<PyAny>,
    ) -> PyResult<Self> {
        let known = |what: &str, got: &str, all: &[&str]| {
            let all = all.join(", ");
            Failure::bad_input(format!("hypothesis `{name}`: no {what} `{got}`; take one of {all}"))
        };
        let found = Port::ALL.into_iter().find(|known| known.name() == port);
        let port = found.ok_or_else(|| known("port", port, &Port::ALL.map(Port::name))).or_raise(py)?;
        let channel = match channel {
            None => None,
            Some(role) => {
                let roles = Channel::ALL.map(Channel::role);
                Some(Channel::from_role(role).ok_or_else(|| known("channel", role, &roles)).or_raise(py)?)
            }
        };
        let mut ranges = Vec::new();
        let mut of_port = Vec::new();
        for (variable, range) in variables {
            let names: Vec<&str> = port.variables().iter().map(|variable| variable.name()).collect();
            let what = format!("variable or coefficient at port {}", port.name());
            let found = Variable::from_name(&variable);
            of_port.push(found.ok_or_else(|| known(&what, &variable, &names)).or_raise(py)?);
            ranges.push(range);
        }
        let coefficient = |(name, unit, lower, upper, starts): CoefficientParts| Coefficient {
            name,
            unit,
            range: [lower, upper],
            starts,
        };
        let coefficients = coefficients.into_iter().map(coefficient).collect();
        let this = Self { name, port, channel, variables: of_port, coefficients, ranges, function: evaluate };
        this.stated(py).map(|_| this)
    }
}

impl NativeHypothesis {
    /// The hypothesis as an effect, and where an exception of its function is kept.
    ///
    /// # Errors
    /// The exception for what cannot be stated, and with it that of the function, if it raises one where it is first asked.
    pub fn stated(&self, py: Python<'_>) -> PyResult<(&'static Hypothesis, Raised)> {
        let exception = Raised::default();
        let function = PythonFunction { function: self.function.clone_ref(py), exception: exception.clone() };
        let stated = Hypothesis::new(Statement {
            name: self.name.clone(),
            port: self.port,
            channel: self.channel,
            variables: self.variables.clone(),
            coefficients: self.coefficients.clone(),
            ranges: self.ranges.clone(),
            function: Box::new(function),
        });
        match stated {
            Ok(hypothesis) => Ok((hypothesis, exception)),
            Err(failure) => Err(exception.cause_of(py, raised(py, &failure))),
        }
    }
}

/// The exception that a function has raised, if any.
#[derive(Clone, Default)]
pub struct Raised(Arc<Mutex<Option<PyErr>>>);

impl Raised {
    /// `error`, with the function's exception as its cause.
    pub fn cause_of(&self, py: Python<'_>, error: PyErr) -> PyErr {
        if let Some(cause) = self.0.lock().unwrap_or_else(PoisonError::into_inner).take() {
            error.set_cause(py, Some(cause));
        }
        error
    }

    /// Whether there is one.
    pub fn is_there(&self) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }
}

struct PythonFunction {
    function: Py<PyAny>,
    exception: Raised,
}

impl Function for PythonFunction {
    fn values(&self, columns: &[Vec<f64>], coefficients: &[f64]) -> Result<Vec<f64>, String> {
        Python::attach(|py| {
            let call = || -> PyResult<Vec<f64>> {
                let columns = columns.iter().map(|column| PyArray1::from_slice(py, column));
                let columns = PyList::new(py, columns.collect::<Vec<_>>())?;
                let values = self.function.call1(py, (columns, coefficients.to_vec()))?;
                let values: PyReadonlyArray1<'_, f64> = values.extract(py)?;
                Ok(values.as_slice()?.to_vec())
            };
            call().map_err(|error| {
                let kind =
                    error.get_type(py).name().map_or_else(|_| "error".to_owned(), |name| name.to_string());
                let reason = format!("its function raised {kind}: {}; correct the function", error.value(py));
                // Ctrl-C is not the function's.
                if error.is_instance_of::<PyException>(py) {
                    self.exception.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                }
                reason
            })
        })
    }
}
