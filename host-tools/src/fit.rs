//! Recalibration: nominal parameters fitted to recordings, with what the data can and cannot tell.

pub mod free;
pub mod objective;
pub mod solver;
