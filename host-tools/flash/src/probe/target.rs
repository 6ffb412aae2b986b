//! The board behind a probe: whether it is the right one, and an image into it.

use std::time::Duration;

use bowden_core::progress::{Progress, Quiet};
use probe_rs::flashing::{DownloadOptions, FlashProgress, ProgressEvent, ProgressOperation};
use probe_rs::probe::Probe;
use probe_rs::{Core, MemoryInterface, Permissions, Session};

use super::words;
use crate::dfu::write::compare;
use crate::error::FlashError;
use crate::image::{FLASH_BYTES, Image};

/// The board's processor, as probe-rs calls it.
const CHIP: &str = "STM32G474RETx";

/// Identity of the processor (RM0440, `DBGMCU_IDCODE`).
const IDENTITY: u64 = 0xe004_2000;

/// `DEV_ID` of an STM32G471, G473, G474, G483 and G484.
const DEVICE: u32 = 0x469;

/// Its bits in the register.
const DEVICE_BITS: u32 = 0xfff;

/// KiB of flash (RM0440, flash size data register).
const FLASH_SIZE: u64 = 0x1fff_75e0;

/// Option bytes as they are in force (RM0440, `FLASH_OPTR`).
const OPTIONS: u64 = 0x4002_2020;

/// Lowest byte of the option bytes where anybody may read the flash.
const UNPROTECTED: u32 = 0xaa;

/// Option bit of a flash of two banks.
const TWO_BANKS: u32 = 1 << 22;

/// Debug Halting Control and Status Register, and the value that switches halting debug off (ARMv7-M, C1.6.2).
const DHCSR: u64 = 0xe000_edf0;
const NO_DEBUG: u32 = 0xa05f_0000;

/// Debug Exception and Monitor Control Register, which catches resets and faults for a debugger.
const DEMCR: u64 = 0xe000_edfc;

/// How long a reset may take.
const RESET_PATIENCE: Duration = Duration::from_millis(500);

/// Bytes that are read back at once.
const BLOCK_BYTES: usize = 4096;

/// A board behind a probe.
pub struct Target {
    session: Session,
}

impl Target {
    /// Connects, and looks whether this is the board and whether its flash may be written. The processor runs on; probe-rs halts it for a moment to
    /// clear its breakpoints, which stops a joint that moves.
    ///
    /// # Errors
    /// [`FlashError::OtherChip`], [`FlashError::Protected`], [`FlashError::OneBank`]; [`FlashError::Probe`].
    pub fn attach(probe: Probe) -> Result<Self, FlashError> {
        let during = "connecting to the processor";
        let session =
            probe.attach(CHIP, Permissions::new()).map_err(|error| failure(during, true, &error))?;
        let mut target = Self { session };
        let identity = target.word(IDENTITY)? & DEVICE_BITS;
        if identity != DEVICE {
            return Err(FlashError::OtherChip { found: format!("its DEV_ID is {identity:#05x}") });
        }
        let options = target.word(OPTIONS)?;
        if options & 0xff != UNPROTECTED {
            return Err(FlashError::Protected);
        }
        let flash_kib = target.word(FLASH_SIZE)? & 0xffff;
        if flash_kib != FLASH_BYTES >> 10 {
            return Err(FlashError::OtherChip { found: format!("it has {flash_kib} KiB of flash") });
        }
        if options & TWO_BANKS == 0 {
            return Err(FlashError::OneBank);
        }
        Ok(target)
    }

    /// Resets the processor, writes an image, reads it back, and starts it. Pages that the image does not take keep their
    /// content. With `log` the log before is forgotten, so that only that of the image is read.
    ///
    /// # Errors
    /// [`FlashError::Differs`]; [`FlashError::Probe`].
    pub fn write(&mut self, image: &Image, log: bool, progress: &dyn Progress) -> Result<(), FlashError> {
        let mut loader = self.session.target().flash_loader();
        for run in image.runs() {
            loader
                .add_data(run.address.into(), &run.bytes)
                .map_err(|error| failure("preparing the image", true, &error))?;
        }
        let mut options = DownloadOptions::new();
        options.progress = FlashProgress::new(shown(progress));
        loader
            .commit(&mut self.session, options)
            .map_err(|error| failure("writing the flash", false, &error))?;
        let mut core = self.core(false)?;
        // Behind the reset no cache holds what was there before.
        core.reset_and_halt(RESET_PATIENCE)
            .map_err(|error| failure("resetting the processor", false, &error))?;
        progress.stage("verifying", image.bytes() as u64);
        read_back(&mut core, image, progress, |during, error| failure(during, false, error))?;
        let starting = |error| failure("starting the image, which is written", false, &error);
        if let Some(rtt) = image.rtt().filter(|_| log) {
            core.write_32(rtt.into(), &[0; 4]).map_err(starting)?;
        }
        core.run().map_err(starting)
    }

    /// Compares the flash with an image, while the processor runs. A target that holds another one is let go as it runs.
    ///
    /// # Errors
    /// [`FlashError::OtherImage`]; [`FlashError::Unread`].
    pub fn holding(mut self, image: &Image) -> Result<Self, FlashError> {
        let unread = |during: &str, error: &dyn std::error::Error| FlashError::Unread {
            during: during.to_owned(),
            reason: words(error),
        };
        let compared = self.core(true).and_then(|mut core| read_back(&mut core, image, &Quiet, unread));
        match compared {
            Ok(()) => Ok(self),
            Err(error) => {
                self.let_go();
                Err(match error {
                    FlashError::Differs { address, found, expected } => {
                        FlashError::OtherImage { address, found, expected }
                    }
                    other => other,
                })
            }
        }
    }

    /// Ends the debugging of a processor that runs, without the end of the session of probe-rs, which halts it for a moment: that stops a joint.
    pub(super) fn let_go(mut self) {
        if let Ok(mut core) = self.core(true) {
            // A board that is gone has nothing to be switched off.
            let _ = core.write_word_32(DEMCR, 0).and_then(|()| core.write_word_32(DHCSR, NO_DEBUG));
        }
        std::mem::forget(self.session);
    }

    /// The one core.
    pub(super) fn core(&mut self, whole: bool) -> Result<Core<'_>, FlashError> {
        self.session.core(0).map_err(|error| failure("connecting to the core", whole, &error))
    }

    fn word(&mut self, address: u64) -> Result<u32, FlashError> {
        let during = format!("reading address {address:#010x}");
        self.core(true)?.read_word_32(address).map_err(|error| failure(&during, true, &error))
    }
}

/// Compares the flash with an image, piece by piece; `failed` names a piece that cannot be read.
fn read_back(
    core: &mut Core<'_>,
    image: &Image,
    progress: &dyn Progress,
    failed: impl Fn(&str, &dyn std::error::Error) -> FlashError,
) -> Result<(), FlashError> {
    for run in image.runs() {
        for (index, block) in run.bytes.chunks(BLOCK_BYTES).enumerate() {
            let address = run.address + (index * BLOCK_BYTES) as u32;
            let mut found = vec![0; block.len()];
            core.read(address.into(), &mut found)
                .map_err(|error| failed(&format!("reading address {address:#010x}"), &error))?;
            compare(address, block, &found)?;
            progress.advance(block.len() as u64);
        }
    }
    Ok(())
}

fn failure(during: &str, whole: bool, error: &dyn std::error::Error) -> FlashError {
    FlashError::Probe { during: during.to_owned(), reason: words(error), whole }
}

/// Hands the progress of probe-rs on.
fn shown(progress: &dyn Progress) -> impl FnMut(ProgressEvent) {
    let mut totals = Vec::new();
    move |event| match event {
        ProgressEvent::AddProgressBar { operation, total } => {
            totals.push((title(operation), total.unwrap_or(0)));
        }
        ProgressEvent::Started(operation) => {
            let total =
                totals.iter().find(|(name, _)| *name == title(operation)).map_or(0, |(_, total)| *total);
            progress.stage(title(operation), total);
        }
        ProgressEvent::Progress { size, .. } => progress.advance(size),
        _ => {}
    }
}

fn title(operation: ProgressOperation) -> &'static str {
    match operation {
        ProgressOperation::Fill => "reading",
        ProgressOperation::Erase => "erasing",
        ProgressOperation::Program => "writing",
        ProgressOperation::Verify => "verifying",
    }
}
