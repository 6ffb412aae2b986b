//! What survives a reset: why the run before this one ended, and its last ticks.
//!
//! The memory is not cleared at start. All of it is atomics, for which any bits are a valid value, and it is believed only
//! where magic words and plausibility say so.

use core::cell::UnsafeCell;
use core::fmt::{self, Write};
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};

use bowden_control::service::PANIC_TEXT;
use bowden_control::snapshot::Snapshot;
use bowden_link::Fault;
use bowden_link::message::Boot;
use embassy_stm32::pac;
use heapless::String;

const MAGIC: u32 = 0xb0bd_fa17;

/// Memory that is kept through a reset.
pub struct Retained {
    /// [`MAGIC`] if the rest was written by [`keep`].
    magic: AtomicU32,
    /// Number of the fault.
    fault: AtomicU8,
    /// Length of the text.
    length: AtomicU8,
    text: [AtomicU8; PANIC_TEXT],
    /// Restarts since a host was there, under [`COUNTED`].
    restarts: AtomicU32,
    /// [`LEAVING`] if the next start is for the boot loader.
    leaving: AtomicU32,
    /// The last ticks.
    pub snapshot: Snapshot,
}

/// The next start is for the boot loader.
const LEAVING: u32 = 0xb0bd_df11;

/// Upper three bytes of [`Retained::restarts`], if it is one.
const COUNTED: u32 = 0xb0bd_5a00;

struct Place(UnsafeCell<MaybeUninit<Retained>>);

#[expect(unsafe_code, reason = "memory that nobody initialises")]
// Safety: only shared references to atomics are made from it.
unsafe impl Sync for Place {}

#[expect(unsafe_code, reason = "a section that start-up leaves alone")]
#[unsafe(link_section = ".uninit.retained")]
static RETAINED: Place = Place(UnsafeCell::new(MaybeUninit::uninit()));

/// The memory.
#[expect(unsafe_code, reason = "memory that nobody initialises")]
pub fn memory() -> &'static Retained {
    // Safety: every bit pattern is a valid `Retained`, RAM has some, and nobody holds a unique reference.
    unsafe { &*RETAINED.0.get().cast::<Retained>() }
}

/// What ended the run before.
#[derive(Default)]
pub struct Ended {
    /// Fault, if it ended by one.
    pub fault: Option<Fault>,
    /// Words of a panic or a processor fault.
    pub text: String<PANIC_TEXT>,
}

/// Keeps that the next start is for the boot loader.
pub fn leave() {
    memory().leaving.store(LEAVING, Ordering::Relaxed);
}

/// Whether this start is for the boot loader; forgets it. Memory holds anything behind power-on, where nobody asked.
pub fn is_leaving() -> bool {
    let asked = memory().leaving.swap(0, Ordering::Relaxed) == LEAVING;
    asked && pac::RCC.csr().read().sftrstf()
}

/// What started this run; forgets it.
pub fn boot_cause() -> Boot {
    let flags = pac::RCC.csr().read();
    let boot = if flags.borrstf() {
        Boot::Power
    } else if flags.iwdgrstf() {
        Boot::Watchdog
    } else if flags.sftrstf() {
        Boot::Software
    } else {
        Boot::Pin
    };
    pac::RCC.csr().modify(|flags| flags.set_rmvf(true));
    boot
}

/// Counts this start: how many in a row ended by the firmware or the watchdog before a host was there.
pub fn count_restart(boot: Boot) -> u8 {
    let kept = &memory().restarts;
    let before = kept.load(Ordering::Relaxed);
    let before = if before & !0xff == COUNTED { before as u8 } else { 0 };
    let restarts = match boot {
        Boot::Software | Boot::Watchdog => before.saturating_add(1),
        Boot::Power | Boot::Pin => 0,
    };
    kept.store(COUNTED | u32::from(restarts), Ordering::Relaxed);
    restarts
}

/// A host is there, so that restarts are no secret.
pub fn host_is_there() {
    memory().restarts.store(COUNTED, Ordering::Relaxed);
}

/// Takes what was kept and makes room for the next. The snapshot stays, frozen, if a fault ended the run before.
pub fn take(boot: Boot) -> Ended {
    let kept = memory();
    let known = kept.magic.swap(0, Ordering::Relaxed) == MAGIC;
    let mut ended = Ended::default();
    match boot {
        Boot::Watchdog => ended.fault = Some(Fault::Watchdog),
        Boot::Software if known => {
            ended.fault = Fault::from_number(kept.fault.load(Ordering::Relaxed));
            ended.text = kept_text();
        }
        _ => {}
    }
    if ended.fault.is_some() && kept.snapshot.is_plausible() {
        kept.snapshot.freeze();
    } else {
        kept.snapshot.clear();
    }
    ended
}

/// The words that are kept.
pub fn kept_text() -> String<PANIC_TEXT> {
    let kept = memory();
    let length = usize::from(kept.length.load(Ordering::Relaxed)).min(PANIC_TEXT);
    // Kept as ASCII.
    kept.text[..length].iter().map(|byte| char::from(byte.load(Ordering::Relaxed))).collect()
}

/// Keeps a fault and its words for the run after this one.
pub fn keep(fault: Fault, words: fmt::Arguments<'_>) {
    let kept = memory();
    kept.snapshot.freeze();
    kept.fault.store(fault as u8, Ordering::Relaxed);
    kept.length.store(0, Ordering::Relaxed);
    // What does not fit is cut off.
    let _ = Text(kept).write_fmt(words);
    kept.magic.store(MAGIC, Ordering::Relaxed);
}

struct Text(&'static Retained);

impl Write for Text {
    fn write_str(&mut self, words: &str) -> fmt::Result {
        for character in words.chars() {
            let length = self.0.length.load(Ordering::Relaxed);
            let place = self.0.text.get(usize::from(length)).ok_or(fmt::Error)?;
            let byte = if character.is_ascii() { character as u8 } else { b'?' };
            place.store(byte, Ordering::Relaxed);
            self.0.length.store(length + 1, Ordering::Relaxed);
        }
        Ok(())
    }
}
