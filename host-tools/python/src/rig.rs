//! Rigs.

use std::path::PathBuf;

use bowden_core::recording::TIME_ROLE;
use bowden_core::rig::{Rig, RigDocument, RigParameter};
use pyo3::prelude::*;

use crate::errors::Raise;

/// A rig file in memory; it never changes.
#[pyclass(frozen, name = "NativeRig", module = "bowden._bowden")]
#[derive(Clone)]
pub struct NativeRig {
    document: RigDocument,
    rig: Rig,
}

impl NativeRig {
    /// A rig of a file's text.
    ///
    /// # Errors
    /// The exception for what the file may not say.
    pub fn new(py: Python<'_>, document: RigDocument) -> PyResult<Self> {
        let rig = document.rig().or_raise(py)?;
        Ok(Self { document, rig })
    }

    /// The rig.
    pub const fn rig(&self) -> &Rig {
        &self.rig
    }

    /// Its file.
    pub const fn document(&self) -> &RigDocument {
        &self.document
    }
}

#[pymethods]
impl NativeRig {
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        Self::new(py, RigDocument::load(&path).or_raise(py)?)
    }

    #[staticmethod]
    fn parse(py: Python<'_>, text: &str, source: &str) -> PyResult<Self> {
        Self::new(py, RigDocument::parse(text, source).or_raise(py)?)
    }

    #[getter]
    fn text(&self) -> String {
        self.document.to_string()
    }

    #[getter]
    fn name(&self) -> &str {
        &self.rig.name
    }

    #[getter]
    fn effects(&self) -> Vec<&'static str> {
        self.rig.effects.iter().map(|active| active.descriptor().id).collect()
    }

    /// Column of a file for every role that the rig maps.
    #[getter]
    fn columns(&self) -> Vec<(&'static str, String)> {
        let time = self.rig.columns.time.iter().map(|source| (TIME_ROLE, source.column.clone()));
        let channels = self.rig.columns.channels.iter();
        time.chain(channels.map(|(channel, source)| (channel.role(), source.column.clone()))).collect()
    }

    /// Value of a parameter; `None` where the rig lacks the part.
    fn value(&self, py: Python<'_>, name: &str) -> PyResult<Option<f64>> {
        Ok(RigParameter::parse(name).or_raise(py)?.get(&self.rig))
    }

    fn with_value(&self, py: Python<'_>, name: &str, value: f64) -> PyResult<Self> {
        let parameter = RigParameter::parse(name).or_raise(py)?;
        let mut document = self.document.clone();
        document.set(&parameter, value).or_raise(py)?;
        Self::new(py, document)
    }

    /// The rig without an effect, or without its laws; `None` where it has no such effect.
    fn without(&self, py: Python<'_>, id: &str) -> PyResult<Option<Self>> {
        let mut document = self.document.clone();
        document.remove_effect(id).then(|| Self::new(py, document)).transpose()
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        self.document.save(&path).or_raise(py)
    }
}
