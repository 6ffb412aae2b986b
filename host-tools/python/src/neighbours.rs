//! Rigs from other simulators' models, and what was found back to them.

use std::io::Write;
use std::path::{Path, PathBuf};

use bowden_core::neighbours::{Mapped, from_mjcf, from_urdf, into_mjcf, to_mjcf};
use bowden_core::output;
use pyo3::prelude::*;

use crate::errors::Raise;
use crate::rig::NativeRig;

/// Line, what stands there, what it becomes or why it is nothing, whether it becomes something.
type Statement = (Option<u32>, String, String, bool);

/// A rig of a model's joint, `kind` being `mujoco` or `urdf`; the angle of the joint's zero, and every statement.
#[pyfunction]
pub fn rig_of_model(
    py: Python<'_>,
    kind: &str,
    path: PathBuf,
    joint: &str,
    base: &Bound<'_, NativeRig>,
) -> PyResult<(NativeRig, f64, Vec<Statement>)> {
    let read = if kind == "urdf" { from_urdf } else { from_mjcf };
    let imported = py.detach(|| read(&path, joint)).or_raise(py)?;
    let document = imported.document(base.get().document().clone()).or_raise(py)?;
    Ok((NativeRig::new(py, document)?, imported.zero_rad, statements(&imported.mapped)))
}

/// Writes a MuJoCo model of a rig, or one that is there with the rig's values at a joint; returns every statement. Refuses to overwrite one of
/// the files `read`.
#[pyfunction]
#[pyo3(signature = (rig, path, into, joint, read))]
pub fn export_mujoco(
    py: Python<'_>,
    rig: &Bound<'_, NativeRig>,
    path: PathBuf,
    into: Option<PathBuf>,
    joint: Option<&str>,
    read: Vec<PathBuf>,
) -> PyResult<Vec<Statement>> {
    let inputs: Vec<&Path> = read.iter().map(PathBuf::as_path).collect();
    output::check_file(&path, &inputs).or_raise(py)?;
    let rig = rig.get().rig();
    let (text, mapped) = match (into, joint) {
        (Some(into), Some(joint)) => into_mjcf(rig, &into, joint).or_raise(py)?,
        (None, None) => to_mjcf(rig).or_raise(py)?,
        _ => return Err("into and joint belong together; give both or none".to_owned()).or_raise(py),
    };
    output::write_file(&path, |file| file.write_all(text.as_bytes())).or_raise(py)?;
    Ok(statements(&mapped))
}

fn statements(mapped: &[Mapped]) -> Vec<Statement> {
    let statement = |Mapped { line, says, becomes }: &Mapped| {
        let (Ok(what) | Err(what)) = becomes.clone();
        (*line, says.clone(), what, becomes.is_ok())
    };
    mapped.iter().map(statement).collect()
}
