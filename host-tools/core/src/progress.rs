//! Progress of long work, and the wish to end it early.

/// Receives the progress of long work; may be called from several threads.
pub trait Progress: Sync {
    /// A stage begins that consists of so many steps; 0 if the number is not known.
    fn stage(&self, name: &str, steps: u64);

    /// So many steps of the stage are done.
    fn advance(&self, steps: u64);

    /// Whether the user wants the work to end with what there is.
    fn interrupted(&self) -> bool {
        false
    }
}

/// Shows nothing.
#[derive(Clone, Copy, Debug)]
pub struct Quiet;

impl Progress for Quiet {
    fn stage(&self, _name: &str, _steps: u64) {}
    fn advance(&self, _steps: u64) {}
}
