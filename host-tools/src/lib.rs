//! The command `bowden`: what its command line accepts, what it shows, and how it ends. The work is done by `bowden_core` and,
//! with a driver board, by `bowden_host_link`.
#![forbid(unsafe_code)]

mod chart;
pub mod cli;
pub mod commands;
pub mod facts;
pub mod interrupt;
mod machine;
pub mod monitor;
pub mod progress;
mod usage;
