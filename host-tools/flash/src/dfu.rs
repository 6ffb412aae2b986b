//! The way through the processor's own boot loader, over USB (AN2606, AN3156, `DfuSe` in UM0424, USB DFU 1.1).
//!
//! | module | what |
//! |---|---|
//! | [`device`] | control transfers to a boot loader, whatever is behind them |
//! | [`status`] | what it answers of its state |
//! | [`layout`] | the pages of its flash |
//! | [`client`] | its commands, one method each |
//! | [`write`](mod@write) | an image, from the first check to the jump into it |
//! | [`plugged`] | which board, where several are plugged in |
//! | [`serial_number`] | serial numbers of a board and of its boot loader |
//! | [`change`] | a board from its firmware to its boot loader and back |
//! | [`usb`] | what is plugged into this machine |

pub mod change;
pub mod client;
pub mod device;
pub mod layout;
pub mod plugged;
pub mod serial_number;
pub mod status;
pub mod usb;
pub mod write;

pub use change::{InBootLoader, open, send};
pub use device::{DfuDevice, TransferError};
pub use plugged::{Plugged, Usb};
pub use usb::NativeUsb;
pub use write::write;

/// USB vendor of the boot loader: ST.
pub const VENDOR: u16 = 0x0483;

/// USB product of the boot loader.
pub const PRODUCT: u16 = 0xdf11;
