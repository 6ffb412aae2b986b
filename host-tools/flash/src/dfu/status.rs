//! What a boot loader answers of its state (USB DFU 1.1, 6.1.2).

use std::fmt;
use std::time::Duration;

/// State of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Waits for anything.
    Idle,
    /// Has taken a block and begins with it when it is asked for its status.
    DownloadSync,
    /// Works on a block.
    DownloadBusy,
    /// Waits for another block.
    DownloadIdle,
    /// Has what it needs and leaves.
    Manifest,
    /// Waits to be asked for another block.
    UploadIdle,
    /// Has met an error.
    Error,
    /// A state that this program has no use for, by its number.
    Other(u8),
}

impl From<u8> for State {
    fn from(number: u8) -> Self {
        match number {
            2 => Self::Idle,
            3 => Self::DownloadSync,
            4 => Self::DownloadBusy,
            5 => Self::DownloadIdle,
            7 => Self::Manifest,
            9 => Self::UploadIdle,
            10 => Self::Error,
            other => Self::Other(other),
        }
    }
}

/// Status of the last request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code(pub u8);

impl Code {
    /// Done.
    pub const OK: Self = Self(0x00);
    /// Something of the vendor: of ST, that the flash is read-out protected (AN3156).
    pub const VENDOR: Self = Self(0x0b);
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = match self.0 {
            0x00 => "OK",
            0x01 => "errTARGET: the address is not one that it writes",
            0x02 => "errFILE",
            0x03 => "errWRITE: it cannot write",
            0x04 => "errERASE: it cannot erase",
            0x05 => "errCHECK_ERASED: the page is not erased",
            0x06 => "errPROG: programming failed",
            0x07 => "errVERIFY: what it programmed is not in the flash",
            0x08 => "errADDRESS: the address is out of range",
            0x0a => "errFIRMWARE",
            0x0b => "errVENDOR",
            0x0c => "errUSBR: USB reset",
            0x0d => "errPOR: it was switched on",
            0x0e => "errUNKNOWN",
            0x0f => "errSTALLEDPKT: an unexpected request",
            other => return write!(f, "status {other}"),
        };
        f.write_str(words)
    }
}

/// Answer to a request for the status.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status {
    /// Status of the last request.
    pub code: Code,
    /// Time until the next request for the status.
    pub wait: Duration,
    /// State that this request has led to.
    pub state: State,
}

impl Status {
    /// Bytes of the answer.
    pub const BYTES: usize = 6;

    /// Takes an answer apart; none if it is too short.
    pub fn parse(answer: &[u8]) -> Option<Self> {
        let [code, a, b, c, state, ..] = *answer else { return None };
        (answer.len() >= Self::BYTES).then(|| Self {
            code: Code(code),
            wait: Duration::from_millis(u32::from_le_bytes([a, b, c, 0]).into()),
            state: state.into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_is_taken_apart() {
        // bStatus, bwPollTimeout of three bytes, bState, iString.
        let status = Status::parse(&[0x01, 0x10, 0x27, 0x00, 10, 0]).unwrap();
        assert_eq!(
            (status.code, status.wait, status.state),
            (Code(1), Duration::from_secs(10), State::Error)
        );
        assert_eq!(Status::parse(&[0, 0, 0, 0, 2]), None);
    }
}
