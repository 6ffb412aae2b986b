//! Why an experiment cannot be run or evaluated.

use std::fmt;

use bowden_link::FaultRecord;
use bowden_link::message::Refusal;
use bowden_model::paper::PaperError;
use virtual_bench::BenchError;

/// An experiment that did not come to its end.
#[derive(Debug, Clone, PartialEq)]
pub enum ExperimentError {
    /// The virtual bench refuses its configuration or a motion of its sheaths.
    Bench(BenchError),
    /// The parameters of the controller do not fit together.
    Parameters(Refusal),
    /// The equations refuse their parameters.
    Equations(PaperError),
    /// The controller did not become ready within the time that its supervisor allows.
    NotReady,
    /// The supervisor has stopped the joint.
    Stopped {
        /// What it found.
        fault: FaultRecord,
        /// Time on the bench's clock \[s\].
        at_s: f64,
    },
    /// A figure cannot be evaluated.
    Evaluation(&'static str),
}

impl fmt::Display for ExperimentError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bench(error) => write!(f, "virtual bench: {error}"),
            Self::Parameters(refusal) => write!(f, "parameters of the controller: {refusal:?}"),
            Self::Equations(error) => write!(f, "equations: {error}"),
            Self::NotReady => {
                write!(f, "the controller is not ready after its self test: look at its parameters")
            }
            Self::Stopped { fault, at_s } => write!(
                f,
                "the supervisor stopped the joint after {at_s:.3} s: {:?} on channel {}, got {}, limit {}",
                fault.fault, fault.channel, fault.got, fault.limit
            ),
            Self::Evaluation(what) => write!(f, "{what}"),
        }
    }
}

impl std::error::Error for ExperimentError {}

impl From<BenchError> for ExperimentError {
    fn from(error: BenchError) -> Self {
        Self::Bench(error)
    }
}

impl From<Refusal> for ExperimentError {
    fn from(refusal: Refusal) -> Self {
        Self::Parameters(refusal)
    }
}

impl From<PaperError> for ExperimentError {
    fn from(error: PaperError) -> Self {
        Self::Equations(error)
    }
}
