//! Simulates, replays, fits and diagnoses recordings of tendon-driven joints.
//!
//! Without command line, terminal or port: [`progress::Progress`] carries progress to whoever shows it, and back whether the
//! work is to end early.
#![forbid(unsafe_code)]

pub mod diagnose;
pub mod effect_source;
pub mod fit;
pub mod formula;
mod guarded;
pub mod hypothesis;
pub mod joint_model;
pub mod neighbours;
pub mod outcome;
pub mod output;
pub mod progress;
pub mod reconstruct;
pub mod recording;
pub mod replay;
pub mod report;
pub mod rig;
pub mod simulate;
pub mod simulation;
pub mod study;
pub mod survey;
#[cfg(test)]
mod test_bench;
