//! Reproduces the experiments of Wu, Yin, Xu, Zhao, Han, Sensors 2020, 20(5), 1301.
//!
//! The firmware's own fixed-point controller drives the virtual bench, whose sheath friction comes out of masses, springs
//! and bristles and knows no equation of the paper. `cargo xtask paper` runs all experiments and writes
//! `host-tools/docs/paper.md` with its figures.
//!
//! | module | what |
//! |---|---|
//! | [`driven_joint`] | bench behind encoders and converters, with the controller |
//! | [`loop_run`] | a sine at the input pulley, recorded |
//! | [`friction`] | friction coefficients dry and greased |
//! | [`torque_phases`] | section 3.2, Fig. 4 |
//! | [`lubrication_and_radius`] | section 4.1, Fig. 5 to 8 |
//! | [`efficiency`] | section 4.2, Fig. 9 |
//! | [`sheath_motion`] | the sheaths moved at random |
//! | [`sheath_steps`] | the sheaths swung to and fro by pi |
//! | [`tracking_error`] | average torque tracking error, position error |
//! | [`disturbed_tracking`] | section 5.2, Fig. 11 and 12: setup and runner |
//! | [`beyond`] | the same with a controller that follows the friction of the sheaths |
//! | [`position`] | position mode while the sheaths are moved: frequencies, loads, pretensions, wrong parameters |
//! | [`wrap_step`] | torque error after a step of the wrap angle |
//! | [`tracking_methods`] | the ways to control the joint that are compared there |
//! | [`tracking_prediction`] | what the equations make of it |
//! | [`alternative_arms`] | other constants that fit there |
//! | [`page`], [`plots`] | `host-tools/docs/paper.md` and its figures |
#![forbid(unsafe_code)]

pub mod alternative_arms;
pub mod beyond;
pub mod disturbed_tracking;
pub mod driven_joint;
pub mod efficiency;
pub mod error;
pub mod friction;
pub mod loop_run;
pub mod lubrication_and_radius;
pub mod page;
pub mod plots;
pub mod position;
pub mod sheath_motion;
pub mod sheath_steps;
pub mod torque_phases;
pub mod tracking_error;
pub mod tracking_methods;
pub mod tracking_prediction;
pub mod wrap_step;
