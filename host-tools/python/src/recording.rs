//! Recordings.

use std::path::PathBuf;

use bowden_core::recording::{ReadOptions, Recording};
use bowden_model::channel::Channel;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::arrays::shared;
use crate::errors::Raise;
use crate::rig::NativeRig;

/// A recording; it never changes.
#[pyclass(frozen, name = "NativeRecording", module = "bowden._bowden")]
pub struct NativeRecording {
    recording: Recording,
}

impl NativeRecording {
    /// The class around a recording.
    pub const fn new(recording: Recording) -> Self {
        Self { recording }
    }

    /// The recording.
    pub const fn recording(&self) -> &Recording {
        &self.recording
    }
}

/// What a rig says of the columns of its recordings.
fn options(rig: Option<&Bound<'_, NativeRig>>) -> ReadOptions {
    let columns = rig.map(|rig| rig.get().rig().columns.clone()).unwrap_or_default();
    ReadOptions { columns, only: None }
}

#[pymethods]
impl NativeRecording {
    #[staticmethod]
    #[pyo3(signature = (path, rig=None))]
    fn load(py: Python<'_>, path: PathBuf, rig: Option<&Bound<'_, NativeRig>>) -> PyResult<Self> {
        let options = options(rig);
        py.detach(|| Recording::load(&path, &options)).or_raise(py).map(Self::new)
    }

    #[staticmethod]
    #[pyo3(signature = (source, columns, rig=None))]
    fn from_columns(
        py: Python<'_>,
        source: &str,
        columns: Vec<(String, Option<PyReadonlyArray1<'_, f64>>)>,
        rig: Option<&Bound<'_, NativeRig>>,
    ) -> PyResult<Self> {
        let mut slices = Vec::with_capacity(columns.len());
        for (name, values) in &columns {
            let values = values.as_ref().map(|array| array.as_slice()).transpose()?;
            slices.push((name.as_str(), values));
        }
        Recording::from_columns(source, &slices, &options(rig)).or_raise(py).map(Self::new)
    }

    #[getter]
    fn source(&self) -> &str {
        self.recording.source()
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.recording.notes().to_vec()
    }

    #[getter]
    fn channels(&self) -> Vec<&'static str> {
        self.recording.channels().map(Channel::role).collect()
    }

    #[getter]
    fn t_s(this: Bound<'_, Self>) -> Bound<'_, PyArray1<f64>> {
        shared(this.get().recording.t_s(), this.clone().into_any())
    }

    /// Values of a channel; `None` where it was not recorded or there is no such channel.
    fn channel<'py>(this: Bound<'py, Self>, name: &str) -> Option<Bound<'py, PyArray1<f64>>> {
        let values = this.get().recording.channel(Channel::from_role(name)?)?;
        Some(shared(values, this.clone().into_any()))
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.recording.save(&path)).or_raise(py)
    }

    fn __len__(&self) -> usize {
        self.recording.len()
    }
}

/// Role and unit of every channel that a recording may hold.
#[pyfunction]
pub fn channels() -> Vec<(&'static str, &'static str)> {
    Channel::ALL.into_iter().map(|channel| (channel.role(), channel.unit())).collect()
}
