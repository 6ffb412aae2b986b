//! The way through the processor's own boot loader, over USB (AN2606, AN3156, `DfuSe` in UM0424, USB DFU 1.1).
//!
//! | module | what |
//! |---|---|
//! | [`device`] | control transfers to a boot loader, whatever is behind them |
//! | [`status`] | what it answers of its state |
//! | [`layout`] | the pages of its flash |
//! | [`client`] | its commands, one method each |
//! | [`write`](mod@write) | an image, from the first check to the jump into it |
//! | [`usb`] | boot loaders that are plugged in |

pub mod client;
pub mod device;
pub mod layout;
pub mod status;
pub mod usb;
pub mod write;

pub use device::{DfuDevice, TransferError};
pub use write::write;

/// USB vendor of the boot loader: ST.
pub const VENDOR: u16 = 0x0483;

/// USB product of the boot loader.
pub const PRODUCT: u16 = 0xdf11;
