//! Control transfers to a boot loader.

use std::time::Duration;

/// Requests of the class (USB DFU 1.1, 3).
pub mod request {
    /// Data or a command to the device.
    pub const DOWNLOAD: u8 = 1;
    /// Data from the device.
    pub const UPLOAD: u8 = 2;
    /// Status, state, and the time until the next request.
    pub const GET_STATUS: u8 = 3;
    /// From an error back to idle.
    pub const CLEAR_STATUS: u8 = 4;
    /// Back to idle.
    pub const ABORT: u8 = 6;
}

/// Why a transfer did not go through.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TransferError {
    /// The device refuses it; its status says why.
    Stalled,
    /// The device is no longer there.
    Gone,
    /// Anything else, in the words of the operating system.
    Failed(String),
}

/// A boot loader.
pub trait DfuDevice {
    /// Name in messages.
    fn name(&self) -> &str;

    /// Memory that it gives access to, as its interface calls itself: `@Internal Flash   /0x08000000/256*02Kg`.
    fn memory(&self) -> &str;

    /// Bytes of a transfer at most.
    fn transfer_bytes(&self) -> usize;

    /// Class request to the interface with data to the device.
    ///
    /// # Errors
    /// See [`TransferError`].
    fn send(&mut self, request: u8, value: u16, data: &[u8]) -> Result<(), TransferError>;

    /// Class request to the interface with data from the device, `length` bytes at most.
    ///
    /// # Errors
    /// See [`TransferError`].
    fn receive(&mut self, request: u8, value: u16, length: usize) -> Result<Vec<u8>, TransferError>;

    /// Lets time pass.
    fn wait(&mut self, time: Duration);
}
