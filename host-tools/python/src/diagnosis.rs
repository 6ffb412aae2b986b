//! Diagnoses.

use std::io::Write;
use std::path::PathBuf;

use bowden_core::diagnose::verdict::Trace;
use bowden_core::diagnose::{Asked, Diagnosed};
use bowden_core::output;
use bowden_core::report::files::{self, rig_files};
use bowden_core::report::render;
use bowden_core::rig::RigDocument;
use bowden_core::study::LoadedStudy;
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::errors::{Raise, raised};
use crate::hypothesis::NativeHypothesis;
use crate::rig::NativeRig;
use crate::study::NativeStudy;
use crate::work::run;

/// What a diagnosis yields, with the rig files that it was made of.
#[pyclass(frozen, name = "NativeDiagnosis", module = "bowden._bowden")]
pub struct NativeDiagnosis {
    diagnosed: Diagnosed,
    documents: Vec<RigDocument>,
    benches: Vec<String>,
    rig_files: Vec<String>,
}

/// Channel, unit, then arrays: time, measured, before, after, held out.
type TraceArrays<'py> = (
    String,
    String,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
);

#[pymethods]
impl NativeDiagnosis {
    /// `diagnosis.json`.
    #[getter]
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        serde_json::to_string_pretty(&self.diagnosed.findings.diagnosis)
            .map_err(|error| error.to_string())
            .or_raise(py)
    }

    /// What the report draws of the first recording.
    fn traces<'py>(&self, py: Python<'py>) -> Vec<TraceArrays<'py>> {
        self.diagnosed.findings.traces.iter().map(|trace| arrays_of(py, trace)).collect()
    }

    fn report_html(&self) -> String {
        render(&self.diagnosed.findings)
    }

    /// Writes the report.
    fn report(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        output::check_file(&path, &[]).or_raise(py)?;
        let html = render(&self.diagnosed.findings);
        output::write_file(&path, |file| file.write_all(html.as_bytes())).or_raise(py)
    }

    /// Name and diagnosed rig of every bench.
    fn rigs(&self, py: Python<'_>) -> PyResult<Vec<(String, NativeRig)>> {
        let mut rigs = Vec::with_capacity(self.documents.len());
        for (bench, (name, document)) in self.benches.iter().zip(&self.documents).enumerate() {
            let mut document = document.clone();
            self.diagnosed.write_into(bench, &mut document).or_raise(py)?;
            rigs.push((name.clone(), NativeRig::new(py, document)?));
        }
        Ok(rigs)
    }

    /// Writes what the command writes; returns where the report is.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<PathBuf> {
        output::prepare_folder(&folder, &[], &[]).or_raise(py)?;
        let mut documents = self.documents.clone();
        let names = self.rig_files.iter().map(String::as_str);
        let mut rigs: Vec<(&str, &mut RigDocument)> = names.zip(&mut documents).collect();
        files::save(&self.diagnosed, &mut rigs, &folder).or_raise(py)
    }
}

fn arrays_of<'py>(py: Python<'py>, trace: &Trace) -> TraceArrays<'py> {
    let of = |values: &[f64]| PyArray1::from_slice(py, values);
    (
        trace.channel.clone(),
        trace.unit.clone(),
        of(&trace.t_s),
        of(&trace.measured),
        of(&trace.before),
        of(&trace.after),
        PyArray1::from_slice(py, &trace.held_out),
    )
}

/// Diagnoses a study. After Ctrl-C the result holds what was found until then.
#[pyfunction]
#[pyo3(signature = (study, also, hypotheses, watcher=None, jobs=None))]
pub fn diagnose(
    py: Python<'_>,
    study: &Bound<'_, NativeStudy>,
    also: Vec<String>,
    hypotheses: Vec<Bound<'_, NativeHypothesis>>,
    watcher: Option<&Bound<'_, PyAny>>,
    jobs: Option<usize>,
) -> PyResult<NativeDiagnosis> {
    let LoadedStudy { study, documents, .. } = study.get().loaded();
    let effects: Vec<&str> = also.iter().map(String::as_str).collect();
    let stated = hypotheses.iter().map(|hypothesis| hypothesis.get().stated(py));
    let (hypotheses, exceptions): (Vec<_>, Vec<_>) =
        stated.collect::<PyResult<Vec<_>>>()?.into_iter().unzip();
    let asked = Asked { effects: &effects, hypotheses: &hypotheses };
    let (result, interrupted) = run(py, watcher, jobs, |progress| {
        bowden_core::diagnose::diagnose_hypotheses(study, &asked, progress)
    })?;
    if let Some(interrupted) = interrupted
        && !interrupted.is_instance_of::<pyo3::exceptions::PyKeyboardInterrupt>(py)
    {
        return Err(interrupted);
    }
    let diagnosed = result.map_err(|failure| {
        let error = raised(py, &failure);
        match exceptions.iter().find(|exception| exception.is_there()) {
            Some(exception) => exception.cause_of(py, error),
            None => error,
        }
    })?;
    let benches = study.benches.iter().map(|bench| bench.name.clone()).collect();
    Ok(NativeDiagnosis { diagnosed, documents: documents.clone(), benches, rig_files: rig_files(study) })
}
