//! Failures as exceptions of the package.

use bowden_core::outcome::{Failure, FailureClass};
use pyo3::prelude::*;

/// The exception for a failure: `bowden.InputError` for unusable input, else `bowden.Error`; both carry the message whole and taken
/// apart.
pub fn raised(py: Python<'_>, failure: &Failure) -> PyErr {
    let name = match failure.class() {
        FailureClass::BadInput => "InputError",
        FailureClass::Failed => "Error",
    };
    let parts = failure.parts();
    let arguments = (failure.message(), parts.source, parts.line, parts.column, parts.hint);
    let exception = py
        .import("bowden.errors")
        .and_then(|errors| errors.getattr(name))
        .and_then(|class| class.call1(arguments));
    exception.map_or_else(|error| error, PyErr::from_value)
}

/// A result whose failure is raised.
pub trait Raise<T> {
    /// The value, or the exception.
    ///
    /// # Errors
    /// The exception of the failure.
    fn or_raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> Raise<T> for Result<T, Failure> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|failure| raised(py, &failure))
    }
}

impl<T> Raise<T> for Result<T, String> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|reason| raised(py, &Failure::bad_input(reason)))
    }
}
