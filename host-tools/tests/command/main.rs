//! The command as its users run it, by subject. One program: each further one would link the whole library once more.

mod bad_input;
#[path = "../common/mod.rs"]
mod common;
mod forward_run;
mod info;
mod investigate;
mod neighbours;
mod people;
mod recalibrate;
mod rig_roles;
#[path = "../common/screen.rs"]
#[expect(dead_code, reason = "another part of it is for the tests of the monitor")]
mod screen;
mod simulated_recordings;
mod study;
mod undecided;
