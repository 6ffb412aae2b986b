//! Writes an image into the driver board.
//!
//! | module | what |
//! |---|---|
//! | [`image`] | what of an ELF goes into the flash, and whether it is for this board |
//! | [`probe`] | the way through a debug probe: write, verify, reset, log |
//! | [`dfu`] | the way through the processor's own boot loader, over USB |
//! | [`error`] | why it did not succeed |
//!
//! Both ways erase the pages that the image takes and no others, so that the board keeps its parameters and its ripple table.

#![forbid(unsafe_code)]

pub mod dfu;
pub mod error;
pub mod image;
pub mod probe;

pub use error::FlashError;
pub use image::Image;
