//! Long runs: a day of board time natively, ten minutes on the emulated board, and the end of every counter.
//!
//! Nothing may come to a stop, drift, grow or get lost. [`native`] drives the board's control and services on this machine, [`emulated`]
//! the release image; both hand back a list of [`check::Check`]s. `cargo xtask endure` runs them and writes `tests/docs/endurance.md`.

pub mod check;
pub mod drift;
pub mod emulated;
pub mod joint;
pub mod ledger;
pub mod memory;
pub mod native;
pub mod page;
