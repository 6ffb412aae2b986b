//! Studies, and the fit of one.

use std::path::PathBuf;

use bowden_core::fit::objective::Series;
use bowden_core::fit::recalibrate::{Recalibration, recalibrate};
use bowden_core::rig::{Assignment, RigParameter};
use bowden_core::study::{LoadedStudy, Role, Study};
use pyo3::prelude::*;
use serde_json::json;

use crate::errors::{Raise, raised};
use crate::recording::NativeRecording;
use crate::rig::NativeRig;
use crate::work::run;

/// Benches and recordings that are explained together.
#[pyclass(frozen, name = "NativeStudy", module = "bowden._bowden")]
pub struct NativeStudy {
    loaded: LoadedStudy,
}

impl NativeStudy {
    /// The study with its files.
    pub const fn loaded(&self) -> &LoadedStudy {
        &self.loaded
    }
}

/// One bench as Python hands it over: name, rig, parameters of its own.
type GivenBench<'py> = (String, Bound<'py, NativeRig>, Vec<String>);

/// One recording as Python hands it over: samples, bench, whether it is held out, what was different in it.
type GivenRecording<'py> = (Bound<'py, NativeRecording>, String, bool, Vec<(String, f64)>);

#[pymethods]
impl NativeStudy {
    #[new]
    fn new(
        py: Python<'_>,
        name: &str,
        benches: Vec<GivenBench<'_>>,
        recordings: Vec<GivenRecording<'_>>,
    ) -> PyResult<Self> {
        let mut loaded = LoadedStudy::empty(name);
        for (name, rig, own) in benches {
            let own: Result<Vec<RigParameter>, String> =
                own.iter().map(|path| RigParameter::parse(path)).collect();
            loaded.add_bench(&name, rig.get().document().clone(), own.or_raise(py)?).or_raise(py)?;
        }
        for (recording, bench, heldout, set) in recordings {
            let assigned = |(path, value): &(String, f64)| {
                Ok(Assignment { parameter: RigParameter::parse(path)?, value: *value })
            };
            let set: Result<Vec<Assignment>, String> = set.iter().map(assigned).collect();
            let role = if heldout { Role::HeldOut } else { Role::Training };
            let recording = recording.get().recording().clone();
            loaded.add_recording(recording, &bench, role, set.or_raise(py)?).or_raise(py)?;
        }
        Ok(Self { loaded })
    }

    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| LoadedStudy::load(&path)).or_raise(py).map(|loaded| Self { loaded })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.loaded.study.name
    }

    #[getter]
    fn benches(&self) -> Vec<String> {
        self.loaded.study.benches.iter().map(|bench| bench.name.clone()).collect()
    }

    fn rig(&self, py: Python<'_>, bench: usize) -> PyResult<NativeRig> {
        NativeRig::new(py, self.loaded.documents[bench].clone())
    }

    /// Samples, bench and whether it is held out, of every recording.
    #[getter]
    fn recordings(&self) -> Vec<(NativeRecording, String, bool)> {
        let benches = &self.loaded.study.benches;
        let of = |listed: &bowden_core::study::StudyRecording| {
            let recording = NativeRecording::new(listed.recording.clone());
            (recording, benches[listed.bench].name.clone(), listed.role == Role::HeldOut)
        };
        self.loaded.study.recordings.iter().map(of).collect()
    }

    /// What was lost or repaired in the recordings.
    #[getter]
    fn notes(&self) -> Vec<String> {
        let recordings = self.loaded.study.recordings.iter();
        recordings.flat_map(|listed| listed.recording.notes().to_vec()).collect()
    }
}

/// Recalibrates the nominal parameters; the result as JSON, and the fitted rig of every bench.
#[pyfunction]
#[pyo3(signature = (study, watcher=None, jobs=None))]
pub fn fit(
    py: Python<'_>,
    study: &Bound<'_, NativeStudy>,
    watcher: Option<&Bound<'_, PyAny>>,
    jobs: Option<usize>,
) -> PyResult<(String, Vec<NativeRig>)> {
    let loaded = study.get().loaded();
    let (result, interrupted) = run(py, watcher, jobs, |progress| recalibrate(&loaded.study, progress))?;
    // There is no part of a fit that could be handed back.
    if let Some(interrupted) = interrupted {
        return Err(interrupted);
    }
    let result = result.map_err(|failure| raised(py, &failure))?;
    let mut rigs = Vec::with_capacity(loaded.documents.len());
    for (bench, document) in loaded.documents.iter().enumerate() {
        let mut document = document.clone();
        result.write_to(bench, &mut document).or_raise(py)?;
        rigs.push(NativeRig::new(py, document)?);
    }
    Ok((described(&result, &loaded.study), rigs))
}

fn described(result: &Recalibration, study: &Study) -> String {
    let parameters: Vec<_> = result
        .parameters
        .iter()
        .map(|fitted| {
            json!({
                "parameter": fitted.parameter.to_string(),
                "bench": fitted.bench.map(|bench| study.benches[bench].name.clone()),
                "unit": fitted.unit,
                "nominal": fitted.nominal,
                "fitted": fitted.fitted,
                "std": fitted.std,
                "at_bound": fitted.at_bound,
            })
        })
        .collect();
    let channels: Vec<_> = result
        .channels
        .iter()
        .map(|channel| {
            let unit = match channel.series {
                Series::Channel(channel) => channel.unit(),
                Series::Guide => "N m",
            };
            json!({
                "channel": channel.series.name(),
                "unit": unit,
                "before_rmse": channel.before,
                "after_rmse": channel.after,
            })
        })
        .collect();
    let groups: Vec<String> = result.groups.iter().map(ToString::to_string).collect();
    json!({ "parameters": parameters, "channels": channels, "groups": groups, "unseen": result.unseen })
        .to_string()
}
