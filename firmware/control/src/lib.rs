//! Driver board of one joint: the parts that need no hardware, so that they run and are tested on any machine.
//!
//! There is no image for the board yet; `README.md` of this crate says what exists and what does not.
#![no_std]
#![forbid(unsafe_code)]

pub mod encoder;
