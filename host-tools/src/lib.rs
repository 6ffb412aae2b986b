//! Simulates, replays, fits and diagnoses recordings of tendon-driven joints, and makes them with the driver board.
#![forbid(unsafe_code)]

pub mod cli;
pub mod commands;
pub mod diagnose;
pub mod fit;
pub mod interrupt;
pub mod investigate;
pub mod joint_model;
pub mod link;
pub mod marks;
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
#[cfg(test)]
mod test_bench;
