//! The library from outside, by subject. One program: each further one would link all of it once more.

mod hand_driven_cables;
mod neighbours;
mod recording_recover;
mod recording_round_trip;
mod recording_shared_data;
mod rig_document;
mod rig_laws;
mod rig_points;
mod rig_replay_keys;
mod survey;

/// Rig of a complete bench.
const BENCH: &str = include_str!("../rigs/bench.toml");
