//! Columns as numpy arrays that share the memory of the recording.

use numpy::ndarray::ArrayView1;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;

/// `values` as an array that cannot be written and keeps `owner` alive, without a copy.
///
/// `owner` is a frozen object whose columns are behind an `Arc`: they neither move nor change while it lives.
#[expect(unsafe_code, reason = "numpy is handed memory that Rust owns")]
pub fn shared<'py>(values: &[f64], owner: Bound<'py, PyAny>) -> Bound<'py, PyArray1<f64>> {
    // SAFETY: `owner` becomes the array's base and holds the memory of `values`, which nothing changes or moves: its class is frozen.
    let array = unsafe { PyArray1::borrow_from_array(&ArrayView1::from(values), owner) };
    // Nobody else can hold this array yet.
    let _ = array.readwrite().make_nonwriteable();
    array
}
