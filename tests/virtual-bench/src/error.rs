//! What can be wrong with a request to the bench.

use thiserror::Error;

/// A request the bench refuses; each says what was found, what would do, and what to change.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum BenchError {
    /// A parameter is outside its range.
    #[error("{name} is {got}, expected {expected}: correct it in the bench's configuration")]
    Parameter {
        /// The parameter as the configuration spells it.
        name: &'static str,
        /// Value found.
        got: f64,
        /// Range it must lie in.
        expected: &'static str,
    },
    /// The integration step is too long for the mesh and stiffnesses.
    #[error(
        "step_s is {step_s:e} s, expected at most {longest_s:.2e} s for {nodes} nodes: shorten the step or coarsen the mesh"
    )]
    Step {
        /// Step asked for \[s\].
        step_s: f64,
        /// Longest step that is stable \[s\].
        longest_s: f64,
        /// Masses a tendon.
        nodes: usize,
    },
    /// No effect has this id.
    #[error("no effect is called '{got}': run `virtual-bench effects` for the ids")]
    UnknownEffect {
        /// The id asked for.
        got: String,
    },
    /// An effect was given twice.
    #[error("effect '{id}' is given twice, expected once: leave one out")]
    DuplicateEffect {
        /// The id that occurs twice.
        id: &'static str,
    },
    /// An effect's strength is no usable number.
    #[error("strength {got} of effect '{id}' is out of range, expected 0 to 5 (1 is a clear fault)")]
    Strength {
        /// Id of the effect.
        id: String,
        /// Strength asked for.
        got: f64,
    },
    /// An effect cannot act on a bench that is stepped from outside.
    #[error("effect '{id}' needs a fixed sample rate, which a live bench has not: leave it out")]
    NotLive {
        /// Id of the effect.
        id: &'static str,
    },
    /// No motion has this name.
    #[error("no motion is called '{got}', expected one of {expected}")]
    UnknownMotion {
        /// The name asked for.
        got: String,
        /// All names.
        expected: String,
    },
    /// The state left all physical bounds.
    #[error("the simulation diverged at {at_s} s: weaken the effects or shorten step_s")]
    Diverged {
        /// Time at which a signal was no longer finite \[s\].
        at_s: f64,
    },
}

impl BenchError {
    pub(crate) fn parameter(name: &'static str, got: f64, expected: &'static str) -> Self {
        Self::Parameter { name, got, expected }
    }
}
