//! Recalibration: nominal parameters fitted to recordings, with what the data can and cannot tell.

pub mod calibrated;
pub mod free;
pub mod free_run;
pub mod identifiability;
pub mod objective;
pub mod observed;
pub mod recalibrate;
pub mod recalibrated;
pub mod solver;
pub mod typical;
pub mod variation;
