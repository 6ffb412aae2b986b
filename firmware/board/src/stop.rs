//! The end of a run: motor off, words kept and logged, reset.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use bowden_link::Fault;
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac;

use crate::{bridge, retained, store_flash};

/// The end was logged, or is being logged: if that fails, it is not tried again.
static LOGGED: AtomicBool = AtomicBool::new(false);

/// Logs the kept words and resets. They are kept before: the log may be what failed.
fn reset_with(fault: Fault) -> ! {
    if !LOGGED.load(Ordering::Relaxed) {
        LOGGED.store(true, Ordering::Relaxed);
        let text = retained::kept_text();
        defmt::error!("ended by {}: {=str}", fault, text.as_str());
    }
    SCB::sys_reset()
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    bridge::off();
    cortex_m::interrupt::disable();
    if LOGGED.load(Ordering::Relaxed) {
        // While the end was logged. What is kept says why it came to that.
        SCB::sys_reset();
    }
    match info.location() {
        Some(at) => {
            let file = at.file().rsplit('/').next().unwrap_or_default();
            retained::keep(Fault::Panic, format_args!("{} ({file}:{})", info.message(), at.line()));
        }
        None => retained::keep(Fault::Panic, format_args!("{}", info.message())),
    }
    reset_with(Fault::Panic)
}

#[exception]
#[allow(unsafe_code, reason = "the macro asks for an unsafe function")]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    bridge::off();
    // Safety: reading it changes nothing.
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    retained::keep(
        Fault::HardFault,
        format_args!("at {:#010x}, called from {:#010x}, CFSR {status:#010x}", frame.pc(), frame.lr()),
    );
    cortex_m::interrupt::disable();
    reset_with(Fault::HardFault)
}

/// Damaged flash (RM0440, 5.3.4), or the clock's security system (7.2.8): the crystal stopped, and the core goes on with 16 MHz.
/// Hardware has opened the bridge.
#[exception]
#[allow(unsafe_code, reason = "the macro asks for an unsafe function")]
unsafe fn NonMaskableInt() {
    if store_flash::take_damage() {
        return;
    }
    let check = pac::FLASH.eccr().read();
    if check.eccd() {
        bridge::off();
        let bank = if check.bk_ecc() { 2 } else { 1 };
        retained::keep(Fault::FlashDamaged, format_args!("bank {bank}, {:#x}", check.addr_ecc()));
        reset_with(Fault::FlashDamaged);
    }
    if pac::RCC.cifr().read().cssf() {
        bridge::off();
        retained::keep(Fault::ClockFailed, format_args!(""));
        // At 170 MHz no tick would be in time again; the next start finds out what runs.
        reset_with(Fault::ClockFailed);
    }
}
