//! The flash that parameters and table are stored in, with words that a power cut left half written.
//!
//! Such a double word has two wrong bits or more: reading it raises ECCD and the NMI (RM0440, 5.3.4). The stores find their
//! way past damage by their checksums, so here a damaged double word reads as zeros, which are neither erased nor a record; the
//! set before it is found, and the next page that is opened erases it. Anywhere else an NMI of the flash ends the run.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_stm32::Peri;
use embassy_stm32::flash::{self, Blocking, Flash};
use embassy_stm32::pac::FLASH;
use embassy_stm32::peripherals;
use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Bytes that one set of check bits covers.
const WORD: u32 = 8;

/// Bytes of a page.
const PAGE: usize = 2048;

/// A store is being read.
static READING: AtomicBool = AtomicBool::new(false);

/// The NMI found damage in it.
static DAMAGED: AtomicBool = AtomicBool::new(false);

/// Why the flash could not be used.
#[derive(Clone, Copy, Debug)]
pub enum StoreFlashError {
    /// The stores are out of use: flash of one bank, or safe mode.
    Absent,
    /// The flash refused or failed.
    Flash,
}

impl NorFlashError for StoreFlashError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// The flash of the stores.
pub struct StoreFlash(Option<Flash<'static, Blocking>>);

impl StoreFlash {
    /// The flash, where it has two banks: with one, erasing would stop the control tick.
    pub fn new(flash: Peri<'static, peripherals::FLASH>, usable: bool) -> Self {
        Self(usable.then(|| Flash::new_blocking(flash)))
    }

    fn flash(&mut self) -> Result<&mut Flash<'static, Blocking>, StoreFlashError> {
        self.0.as_mut().ok_or(StoreFlashError::Absent)
    }
}

impl ErrorType for StoreFlash {
    type Error = StoreFlashError;
}

impl ReadNorFlash for StoreFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.flash()?;
        let end = offset.checked_add(bytes.len() as u32).filter(|end| *end as usize <= self.capacity());
        end.ok_or(StoreFlashError::Flash)?;
        // A line of the cache would hide the damage when it is read again.
        FLASH.acr().modify(|access| access.set_dcen(false));
        READING.store(true, Ordering::SeqCst);
        read_checked(offset, bytes);
        READING.store(false, Ordering::SeqCst);
        FLASH.acr().modify(|access| access.set_dcen(true));
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.as_ref().map_or(0, embedded_storage::nor_flash::ReadNorFlash::capacity)
    }
}

impl NorFlash for StoreFlash {
    const WRITE_SIZE: usize = WORD as usize;
    const ERASE_SIZE: usize = PAGE;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        self.flash()?.blocking_write(offset, bytes).map_err(|_| StoreFlashError::Flash)
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.flash()?.blocking_erase(from, to).map_err(|_| StoreFlashError::Flash)
    }
}

/// Reads with every double word fetched once and its check bits looked at; a copy may be fetched twice, or not at all.
fn read_checked(offset: u32, bytes: &mut [u8]) {
    let end = offset + bytes.len() as u32;
    let mut at = offset - offset % WORD;
    while at < end {
        let mut word = fetch(at);
        if was_damaged() {
            // The buffer of the last line raises nothing when it is read again (RM0440, 5.3.4): put another one into it.
            fetch(at ^ (PAGE as u32 / 2));
            was_damaged();
            word = [0; WORD as usize];
        }
        for (place, byte) in (at..).zip(word).filter(|(place, _)| (offset..end).contains(place)) {
            bytes[(place - offset) as usize] = byte;
        }
        at += WORD;
    }
}

/// The double word at `at`, below the capacity.
#[expect(unsafe_code, reason = "reads of the flash that the compiler may not leave out or move")]
fn fetch(at: u32) -> [u8; WORD as usize] {
    let place = (flash::FLASH_BASE + at as usize) as *const u32;
    // Safety: inside the flash, aligned, and any bits are a value.
    let halves = unsafe { [place.read_volatile(), place.add(1).read_volatile()] };
    let [a, b] = halves.map(u32::to_le_bytes);
    [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]]
}

/// Whether the read before met damage; forgets it.
fn was_damaged() -> bool {
    cortex_m::asm::dsb();
    let raised = clear_damage();
    cortex_m::asm::isb();
    DAMAGED.swap(false, Ordering::SeqCst) || raised
}

fn clear_damage() -> bool {
    let check = FLASH.eccr().read();
    if check.eccd() {
        FLASH.eccr().write_value(check);
    }
    check.eccd()
}

/// For the NMI: whether it came from a store that is being read; keeps that for the reader.
pub fn take_damage() -> bool {
    // The stores lie in bank 2, the code in bank 1. Before the start has set memory up, [`READING`] says nothing.
    let ours = FLASH.eccr().read().bk_ecc() && READING.load(Ordering::SeqCst) && clear_damage();
    if ours {
        DAMAGED.store(true, Ordering::SeqCst);
    }
    ours
}
