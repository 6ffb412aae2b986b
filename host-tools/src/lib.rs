//! Simulates, replays, fits and diagnoses recordings of tendon-driven joints.
#![forbid(unsafe_code)]

pub mod cli;
pub mod commands;
pub mod outcome;
pub mod output;
pub mod progress;
pub mod recording;
pub mod rig;
pub mod fit;
pub mod joint_model;
pub mod marks;
pub mod reconstruct;
pub mod replay;
pub mod simulate;
pub mod simulation;
pub mod diagnose;
pub mod report;
