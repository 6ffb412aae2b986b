//! The host side of the driver board: client and session against a strict fake board, the commands over a pseudo
//! terminal, and the commands with the simulated board.
//!
//! No result depends on wall-clock time: see [`wires`] and [`pseudo_terminal`].

mod bench_run;
mod calibrate;
mod client;
#[path = "../common/mod.rs"]
mod common;
mod cuts;
mod evidence;
mod excitation;
#[path = "../common/excitation.rs"]
mod excitation_compared;
mod fake;
mod foxglove;
#[path = "../common/foxglove.rs"]
mod foxglove_client;
mod from_rig;
mod mishaps;
mod monitor;
mod ports;
mod pseudo_terminal;
mod replay_control;
mod replug;
mod ripple_table;
#[path = "../common/screen.rs"]
mod screen;
mod session;
mod simulated;
mod terminal;
mod wires;

use common::{bowden, command, result_of};
