//! Control of one joint for the driver board, without hardware: the same code, bit for bit, on the board and on any
//! other machine.
//!
//! | module | what |
//! |---|---|
//! | [`controller`] | one control tick: [`tick::TickInput`] in, [`tick::TickOutput`] out |
//! | [`scale`] | fixed-point quantities and gains |
//! | [`encoder`], [`tension`], [`supply`] | sensors, and whether they can be believed |
//! | [`winding`] | how hot the motor is |
//! | [`mod@reference`] | where the joint is to be |
//! | [`compensator`] | where the input pulley has to be for that |
//! | [`sheath`] | how much friction the sheaths have at the moment |
//! | [`observer`], [`drive`] | how the motor gets it there |
//! | [`correction`] | what a diagnosis found beyond the nominal joint |
//! | [`supervisor`] | states, and which fault counts in which |
//! | [`parameters`] | everything that can be set, in SI units |
//! | [`snapshot`] | the last ticks before a fault |
//! | [`conformance`] | a digest over many ticks, to compare machines |
//!
//! `README.md` has the signal flow, the table of scales and the table of faults.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(feature = "alloc")]
extern crate alloc;

pub mod channel_order;
pub mod compensator;
pub mod conformance;
pub mod controller;
pub mod correction;
pub mod detection;
pub mod drive;
pub mod encoder;
pub mod impedance;
pub mod motion_watch;
pub mod motor_circuit;
pub mod observer;
pub mod parameters;
pub mod reference;
pub mod restless_channels;
pub mod scale;
pub mod service;
pub mod sheath;
pub mod snapshot;
pub mod supervisor;
pub mod supply;
pub mod surplus_current;
pub mod tension;
pub mod tick;
pub mod watches;
pub mod winding;

pub use parameters::{reference_config, tick_config};

/// Digest of the sources of this crate and of `bowden-link`: equal digests compute equal outputs of equal inputs.
pub const SOURCE_DIGEST: [u8; 8] = u64_from_text(env!("BOWDEN_CONTROL_DIGEST")).to_be_bytes();

/// Number in decimal digits, which the build script wrote.
const fn u64_from_text(text: &str) -> u64 {
    let (digits, mut place, mut number) = (text.as_bytes(), 0, 0);
    while place < digits.len() {
        number = 10 * number + (digits[place] - b'0') as u64;
        place += 1;
    }
    number
}
