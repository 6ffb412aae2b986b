//! Reproduces the experiments of Wu, Yin, Xu, Zhao, Han, Sensors 2020, 20(5), 1301.
//!
//! The firmware's own fixed-point controller drives the virtual bench, whose sheath friction comes out of masses, springs
//! and bristles and knows no equation of the paper. `cargo xtask paper` runs all experiments and writes
//! `host-tools/docs/paper.md` with its figures.
//!
//! | module | what |
//! |---|---|
//! | [`driven_joint`] | bench behind encoders and converters, with the controller |
//! | [`sheath_motion`] | the sheaths moved at random |
//! | [`tracking_error`] | average torque tracking error, position error |
//! | [`disturbed_tracking`] | section 5.2, Fig. 11 and 12: setup and runner |
//! | [`tracking_methods`] | the ways to control the joint that are compared there |
#![forbid(unsafe_code)]

pub mod disturbed_tracking;
pub mod driven_joint;
pub mod error;
pub mod sheath_motion;
pub mod tracking_error;
pub mod tracking_methods;
