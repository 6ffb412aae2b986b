//! The Python module `bowden._bowden`: what the package `bowden` needs of `bowden-core`, and nothing of its own.
//!
//! Classes hold what the library holds; the package around them gives them types, documentation and pictures. Work runs in another
//! thread without the interpreter's lock (see [`work`]), failures become exceptions with file, line and advice (see [`errors`]).

#![expect(clippy::needless_pass_by_value, reason = "what Python hands over is extracted, and so owned")]

mod arrays;
mod diagnosis;
mod errors;
mod hypothesis;
mod neighbours;
mod recording;
mod rig;
mod study;
mod survey;
mod work;

/// The native part of the package `bowden`.
#[pyo3::pymodule]
mod _bowden {
    #[pymodule_export]
    use crate::diagnosis::{NativeDiagnosis, diagnose};
    #[pymodule_export]
    use crate::hypothesis::NativeHypothesis;
    #[pymodule_export]
    use crate::neighbours::{export_mujoco, rig_of_model};
    #[pymodule_export]
    use crate::recording::{NativeRecording, channels};
    #[pymodule_export]
    use crate::rig::NativeRig;
    #[pymodule_export]
    use crate::study::{NativeStudy, fit};
    #[pymodule_export]
    use crate::survey::{NativePlan, survey_one, survey_page, survey_program};
    #[pymodule_export]
    use crate::work::{replay, simulate};
}
