//! An emulated joint driver board: runs the unmodified release ELF of the firmware with the virtual bench behind the
//! pins.
//!
//! The instruction set is Unicorn's; core peripherals, the STM32G474RE's peripherals, the parts on the board and a USB
//! host are modelled here. A register, bit, address or sequence that no model claims ends the run with an error that
//! names it, so nothing passes because it was ignored.
//!
//! # Time
//! Virtual time counts cycles of the core clock. A basic block costs the sum of its instructions' cycles by the
//! Cortex-M4 manual, each taken at its smallest; flash wait states, bus contention and lazy FP stacking are left out, so
//! cycles are a lower bound and instructions are exact. [`BoardBuilder::count_accesses`] adds an upper bound, with all of these at
//! their worst: [`WorstCall`], [`accesses`]. Interrupts are taken and accesses to registers are timed at the
//! borders of basic blocks. Everything is deterministic: equal ELF, seed and calls give an equal
//! [`Board::trace_hash`].
//!
//! # Example
//! ```no_run
//! use bowden_board::Board;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let elf = std::fs::read("bowden-firmware")?;
//! let mut board = Board::builder(&elf).seed(3).build()?;
//! board.run_until("USB port", |board| board.usb_ready(), 1.0)?;
//! board.usb_write(&[0]);
//! board.run_for(0.1)?;
//! println!("{:?} {:.3} rad", board.usb_read(), board.bench().theta_out_rad());
//! # Ok(())
//! # }
//! ```

#![forbid(unsafe_code)]
// Register fields read best as masks and shifts, each register in its own match arm, in the order of their offsets.
#![allow(clippy::verbose_bit_mask, clippy::match_same_arms)]

pub mod accesses;
mod analog;
mod block_costs;
mod board;
mod bus;
mod clock;
mod code_pages;
mod cost;
mod cpu;
mod elf;
mod encoders;
mod error;
mod exceptions;
mod faults;
mod machine;
mod measure;
mod memory_map;
mod peripherals;
mod processor_fault;
mod pty;
mod rig;
mod rtt;
mod scs;
mod trace;
mod usb_host;
mod wiring;

pub use board::{Board, BoardBuilder, FirmwareUse, PwmState, TickTiming};
pub use elf::ImageSizes;
pub use encoders::{COUNTS_PER_TURN, EncoderMounting, EncoderPart};
pub use error::BoardError;
pub use faults::{Altered, BridgeEvents, Cable, EncoderAt, Injection, Peaks, Rail, TensionAt};
pub use machine::Counters;
pub use measure::{Measurement, Spread, WorstCall};
pub use peripherals::flash::Torn;
pub use peripherals::rcc::ResetCause;
pub use pty::Terminal;
pub use rtt::{Level, LogLine};
pub use trace::{Edge, Pin};
pub use usb_host::DeviceIdentity;
pub use virtual_bench;
pub use wiring::TICK_MARKER;
