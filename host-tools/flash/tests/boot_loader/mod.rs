//! A boot loader of an STM32G474RE on the other end of the control transfers, after AN3156 (commands), AN2606 (memory), USB DFU 1.1
//! (states, A.1) and RM0440 (flash). It is stricter than the part: what the documents do not allow is an error.

use std::time::Duration;

use bowden_flash::dfu::{DfuDevice, TransferError};

const FLASH_START: u32 = 0x0800_0000;
const FLASH_BYTES: usize = 512 << 10;
const PAGE_BYTES: usize = 2048;
const TRANSFER_BYTES: usize = 2048;

/// Times of DS12288: a page is erased in 22 ms, a double word programmed in 82 us.
const ERASE: Duration = Duration::from_millis(22);
const PROGRAM_WORD: Duration = Duration::from_micros(82);

/// States by their numbers in USB DFU 1.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum State {
    Idle = 2,
    DownloadSync = 3,
    DownloadBusy = 4,
    DownloadIdle = 5,
    Manifest = 7,
    UploadIdle = 9,
    Error = 10,
}

/// Status by its number there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Code {
    Ok = 0x00,
    Target = 0x01,
    Program = 0x06,
    Vendor = 0x0b,
    Stalled = 0x0f,
}

/// What a download asked for.
#[derive(Clone, Debug)]
enum Job {
    SetAddress(u32),
    ErasePage(u32),
    Write { address: u32, bytes: Vec<u8> },
    Leave,
}

/// The emulated boot loader.
pub struct BootLoader {
    pub memory: String,
    pub flash: Vec<u8>,
    pub state: State,
    /// Where it jumped to.
    pub left_to: Option<u32>,
    /// Pages erased so far, by their addresses.
    pub erased: Vec<u32>,
    /// Transfers so far.
    pub transfers: usize,
    /// Transfer at which the cable is pulled.
    pub pulled_at: Option<usize>,
    /// What the operating system says then.
    pub pulled: TransferError,
    /// Read-out protection of level 1.
    pub protected: bool,
    /// Bits of a byte that programming leaves at one.
    pub stuck: Option<(u32, u8)>,
    /// Page that is write-protected: erasing it does nothing and is no error (AN3156).
    pub write_protected: Option<u32>,
    /// Every job takes for ever.
    pub hangs: bool,
    code: Code,
    pointer: u32,
    job: Option<Job>,
    after: (State, Code),
    now: Duration,
    busy_until: Duration,
}

impl BootLoader {
    /// As it enumerates: idle, its flash holding an older image, tables and parameters.
    pub fn new() -> Self {
        let old = |at: usize| (at.wrapping_mul(0x9e37_79b1) >> 13) as u8;
        Self {
            memory: "@Internal Flash   /0x08000000/256*02Kg".to_owned(),
            flash: (0..FLASH_BYTES).map(old).collect(),
            state: State::Idle,
            left_to: None,
            erased: Vec::new(),
            transfers: 0,
            pulled_at: None,
            pulled: TransferError::Gone,
            protected: false,
            stuck: None,
            write_protected: None,
            hangs: false,
            code: Code::Ok,
            pointer: FLASH_START,
            job: None,
            after: (State::Idle, Code::Ok),
            now: Duration::ZERO,
            busy_until: Duration::ZERO,
        }
    }

    /// Bytes of the flash from an address on.
    pub fn at(&self, address: u32, length: usize) -> &[u8] {
        let from = (address - FLASH_START) as usize;
        &self.flash[from..from + length]
    }

    fn stall<T>(&mut self) -> Result<T, TransferError> {
        (self.state, self.code) = (State::Error, Code::Stalled);
        Err(TransferError::Stalled)
    }

    fn transfer(&mut self) -> Result<(), TransferError> {
        self.transfers += 1;
        if self.pulled_at.is_some_and(|at| self.transfers >= at) {
            return Err(self.pulled.clone());
        }
        if self.left_to.is_some() { Err(TransferError::Gone) } else { Ok(()) }
    }

    fn download(&mut self, number: u16, data: &[u8]) -> Result<(), TransferError> {
        if !matches!(self.state, State::Idle | State::DownloadIdle) || data.len() > TRANSFER_BYTES {
            return self.stall();
        }
        let address = |bytes: &[u8]| u32::from_le_bytes([bytes[1], bytes[2], bytes[3], bytes[4]]);
        let job = match (number, data) {
            (_, []) => Job::Leave,
            (0, [0x21, ..]) if data.len() == 5 => Job::SetAddress(address(data)),
            (0, [0x41, ..]) if data.len() == 5 => Job::ErasePage(address(data)),
            // One byte 0x41 erases everything, 0x92 lifts the protection and erases everything: never for this purpose.
            (0, [0x41 | 0x92]) => panic!("everything would be erased"),
            (2.., _) if data.len() >= 2 => {
                let address = self.pointer + u32::from(number - 2) * data.len() as u32;
                Job::Write { address, bytes: data.to_vec() }
            }
            _ => return self.stall(),
        };
        (self.job, self.state) = (Some(job), State::DownloadSync);
        Ok(())
    }

    fn upload(&mut self, number: u16, length: usize) -> Result<Vec<u8>, TransferError> {
        if !matches!(self.state, State::Idle | State::UploadIdle) || number < 2 || length > TRANSFER_BYTES {
            return self.stall();
        }
        if self.protected {
            (self.state, self.code) = (State::Error, Code::Vendor);
            return Err(TransferError::Stalled);
        }
        let from = self.pointer as usize + usize::from(number - 2) * length - FLASH_START as usize;
        let Some(bytes) = self.flash.get(from..from + length) else {
            (self.state, self.code) = (State::Error, Code::Target);
            return Err(TransferError::Stalled);
        };
        self.state = State::UploadIdle;
        Ok(bytes.to_vec())
    }

    /// A job begins when the host asks for the status, not before.
    fn status(&mut self) -> Result<Vec<u8>, TransferError> {
        let mut wait = Duration::ZERO;
        match self.state {
            State::DownloadSync => match self.job.take() {
                Some(Job::Leave) => {
                    self.state = State::Manifest;
                    self.left_to = Some(self.pointer);
                }
                Some(job) => {
                    let (time, code) = self.work(&job);
                    let after = if code == Code::Ok { State::DownloadIdle } else { State::Error };
                    (self.state, self.after) = (State::DownloadBusy, (after, code));
                    self.busy_until = if self.hangs { Duration::MAX } else { self.now + time };
                    wait = time.max(Duration::from_millis(1));
                }
                None => return self.stall(),
            },
            State::DownloadBusy if self.hangs => wait = Duration::from_millis(100),
            State::DownloadBusy if self.now < self.busy_until => return self.stall(),
            State::DownloadBusy => (self.state, self.code) = self.after,
            _ => {}
        }
        let wait = (wait.as_micros().div_ceil(1000) as u32).to_le_bytes();
        Ok(vec![self.code as u8, wait[0], wait[1], wait[2], self.state as u8, 0])
    }

    /// Time that a job takes, and how it ends.
    fn work(&mut self, job: &Job) -> (Duration, Code) {
        let in_flash = |address: u32, length: usize| {
            (address as usize).checked_sub(FLASH_START as usize).filter(|from| from + length <= FLASH_BYTES)
        };
        match job {
            Job::SetAddress(address) => {
                if in_flash(*address, 1).is_none() {
                    return (Duration::ZERO, Code::Target);
                }
                self.pointer = *address;
                (Duration::ZERO, Code::Ok)
            }
            Job::ErasePage(_) | Job::Write { .. } if self.protected => (Duration::ZERO, Code::Vendor),
            Job::ErasePage(address) => {
                let Some(from) = in_flash(*address, 1) else { return (Duration::ZERO, Code::Target) };
                let page = from - from % PAGE_BYTES;
                self.erased.push(FLASH_START + page as u32);
                if self.write_protected != Some(FLASH_START + page as u32) {
                    self.flash[page..page + PAGE_BYTES].fill(0xff);
                }
                (ERASE, Code::Ok)
            }
            Job::Write { address, bytes } => {
                let Some(from) = in_flash(*address, bytes.len()) else {
                    return (Duration::ZERO, Code::Target);
                };
                if !address.is_multiple_of(8) || !bytes.len().is_multiple_of(8) {
                    return (Duration::ZERO, Code::Program);
                }
                let cells = &mut self.flash[from..from + bytes.len()];
                // A double word that is not erased is not programmed (RM0440, PROGERR).
                if cells.iter().any(|byte| *byte != 0xff) {
                    return (PROGRAM_WORD, Code::Program);
                }
                cells.copy_from_slice(bytes);
                if let Some((place, bits)) = self.stuck
                    && let Some(cell) = place.checked_sub(*address).and_then(|at| cells.get_mut(at as usize))
                {
                    *cell |= bits;
                }
                (PROGRAM_WORD * (bytes.len() / 8) as u32, Code::Ok)
            }
            Job::Leave => (Duration::ZERO, Code::Ok),
        }
    }
}

impl DfuDevice for BootLoader {
    fn name(&self) -> &'static str {
        "boot loader 205939885533"
    }

    fn memory(&self) -> &str {
        &self.memory
    }

    fn transfer_bytes(&self) -> usize {
        TRANSFER_BYTES
    }

    fn send(&mut self, request: u8, value: u16, data: &[u8]) -> Result<(), TransferError> {
        self.transfer()?;
        match (request, self.state) {
            (1, _) => self.download(value, data),
            (4, State::Error) => {
                (self.state, self.code) = (State::Idle, Code::Ok);
                Ok(())
            }
            (6, State::Idle | State::DownloadIdle | State::UploadIdle) => {
                self.state = State::Idle;
                Ok(())
            }
            _ => self.stall(),
        }
    }

    fn receive(&mut self, request: u8, value: u16, length: usize) -> Result<Vec<u8>, TransferError> {
        self.transfer()?;
        match request {
            2 => self.upload(value, length),
            3 if length == 6 => self.status(),
            _ => self.stall(),
        }
    }

    fn wait(&mut self, time: Duration) {
        self.now += time;
    }
}
