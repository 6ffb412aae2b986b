//! Commands of the boot loader, one method each (AN3156).
//!
//! A command and a block of data are both a download: the device takes it, begins when it is asked for its status, and says in
//! the answer how long it will be busy.

use std::time::Duration;

use super::device::{DfuDevice, TransferError, request};
use super::status::{Code, State, Status};
use crate::error::FlashError;

/// First byte of the command that sets the address of the next block.
const SET_ADDRESS: u8 = 0x21;

/// First byte of the command that erases a page.
const ERASE: u8 = 0x41;

/// Number of a command in place of a block's.
const COMMAND: u16 = 0;

/// Number of the block at the address that was set; higher ones lie behind it.
const FIRST_BLOCK: u16 = 2;

/// How long the device may be busy with one command; to erase a page takes 25 ms (DS12288).
const PATIENCE: Duration = Duration::from_secs(5);

/// Attempts to bring the device to idle: out of a transfer, out of an error.
const ATTEMPTS: usize = 4;

/// A boot loader and what is being done with it.
pub struct Client<'d, D> {
    device: &'d mut D,
    /// Whether the flash is still as it was.
    whole: bool,
}

impl<'d, D: DfuDevice> Client<'d, D> {
    /// A client of a device in any state.
    pub fn new(device: &'d mut D) -> Self {
        Self { device, whole: true }
    }

    /// Bytes of a block at most.
    pub fn block_bytes(&self) -> usize {
        self.device.transfer_bytes()
    }

    /// Ends whatever was under way.
    ///
    /// # Errors
    /// [`FlashError::Refused`], if the device does not become idle; [`FlashError::Gone`].
    pub fn idle(&mut self) -> Result<(), FlashError> {
        let during = "a transfer is ended";
        let mut status = self.status(during)?;
        for _ in 0..ATTEMPTS {
            match status.state {
                State::Idle => return Ok(()),
                State::Error => self.send(request::CLEAR_STATUS, COMMAND, &[], during)?,
                State::DownloadIdle | State::UploadIdle => {
                    self.send(request::ABORT, COMMAND, &[], during)?;
                }
                _ => self.device.wait(status.wait.min(PATIENCE)),
            }
            status = self.status(during)?;
        }
        if status.state == State::Idle { Ok(()) } else { Err(refused(during, status)) }
    }

    /// Erases the page at `address`.
    ///
    /// # Errors
    /// What the device refuses, [`FlashError::Protected`] among it; [`FlashError::Gone`].
    pub fn erase(&mut self, address: u32) -> Result<(), FlashError> {
        self.whole = false;
        self.command(ERASE, address, &format!("the page at {address:#010x} is erased"))
    }

    /// Programs a block at `address`, which is erased.
    ///
    /// # Errors
    /// As [`Client::erase`].
    pub fn write(&mut self, address: u32, block: &[u8]) -> Result<(), FlashError> {
        let during = format!("address {address:#010x} is written");
        self.whole = false;
        // Each block has its address, so that it does not matter by which length the device multiplies the number of a short one.
        self.command(SET_ADDRESS, address, &during)?;
        self.download(FIRST_BLOCK, block, &during)
    }

    /// Reads `length` bytes from `address` on.
    ///
    /// # Errors
    /// As [`Client::erase`].
    pub fn read(&mut self, address: u32, length: usize) -> Result<Vec<u8>, FlashError> {
        let during = format!("address {address:#010x} is read");
        self.idle()?;
        self.command(SET_ADDRESS, address, &during)?;
        // An upload begins in idle only.
        self.send(request::ABORT, COMMAND, &[], &during)?;
        match self.device.receive(request::UPLOAD, FIRST_BLOCK, length) {
            Ok(bytes) if bytes.len() == length => Ok(bytes),
            Ok(_) | Err(TransferError::Stalled) => Err(refused(&during, self.status(&during)?)),
            Err(error) => Err(self.failure(error, &during)),
        }
    }

    /// Ends the boot loader; the processor goes on at the stack pointer and reset vector at `address`.
    ///
    /// # Errors
    /// What the device refuses. A device that goes away meanwhile is what was asked for.
    pub fn leave(&mut self, address: u32) -> Result<(), FlashError> {
        let during = "the boot loader is left";
        self.idle()?;
        self.command(SET_ADDRESS, address, during)?;
        self.send(request::DOWNLOAD, COMMAND, &[], during)?;
        match self.status(during) {
            Ok(status) if status.state == State::Error => Err(refused(during, status)),
            _ => Ok(()),
        }
    }

    fn command(&mut self, code: u8, address: u32, during: &str) -> Result<(), FlashError> {
        let mut command = [code, 0, 0, 0, 0];
        command[1..].copy_from_slice(&address.to_le_bytes());
        self.download(COMMAND, &command, during)
    }

    /// Sends a block and waits until the device is through with it.
    fn download(&mut self, number: u16, data: &[u8], during: &str) -> Result<(), FlashError> {
        match self.device.send(request::DOWNLOAD, number, data) {
            Ok(()) => {}
            Err(TransferError::Stalled) => return Err(refused(during, self.status(during)?)),
            Err(error) => return Err(self.failure(error, during)),
        }
        let mut waited = Duration::ZERO;
        loop {
            let status = self.status(during)?;
            match status.state {
                State::DownloadIdle if status.code == Code::OK => return Ok(()),
                State::DownloadBusy | State::DownloadSync if waited < PATIENCE => {
                    let wait = status.wait.clamp(Duration::from_millis(1), PATIENCE);
                    self.device.wait(wait);
                    waited += wait;
                }
                _ => return Err(refused(during, status)),
            }
        }
    }

    fn status(&mut self, during: &str) -> Result<Status, FlashError> {
        let answer = self
            .device
            .receive(request::GET_STATUS, 0, Status::BYTES)
            .map_err(|error| self.failure(error, during))?;
        Status::parse(&answer).ok_or_else(|| FlashError::Refused {
            during: during.to_owned(),
            answer: format!("{} bytes in place of a status", answer.len()),
        })
    }

    fn send(&mut self, request: u8, value: u16, data: &[u8], during: &str) -> Result<(), FlashError> {
        self.device.send(request, value, data).map_err(|error| self.failure(error, during))
    }

    fn failure(&self, error: TransferError, during: &str) -> FlashError {
        let during = during.to_owned();
        match error {
            TransferError::Gone => FlashError::Gone { during, whole: self.whole },
            TransferError::Stalled => {
                FlashError::Refused { during, answer: "that it does not know the request".to_owned() }
            }
            TransferError::Failed(reason) => FlashError::Usb { during, reason, whole: self.whole },
        }
    }
}

fn refused(during: &str, status: Status) -> FlashError {
    if status.code == Code::VENDOR {
        return FlashError::Protected;
    }
    let answer = match (status.code, status.state) {
        (Code::OK, State::DownloadBusy | State::DownloadSync) => {
            format!("that it is busy, for longer than {} s", PATIENCE.as_secs())
        }
        (Code::OK, state) => format!("that its state is {state:?}"),
        (code, _) => code.to_string(),
    };
    FlashError::Refused { during: during.to_owned(), answer }
}
