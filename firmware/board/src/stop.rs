//! The end of a run: motor off, words kept, reset.

use core::panic::PanicInfo;

use bowden_link::Fault;
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac;

use crate::{bridge, retained, store_flash};

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    bridge::off();
    cortex_m::interrupt::disable();
    match info.location() {
        Some(at) => {
            let file = at.file().rsplit('/').next().unwrap_or_default();
            retained::keep(Fault::Panic, format_args!("{} ({file}:{})", info.message(), at.line()));
        }
        None => retained::keep(Fault::Panic, format_args!("{}", info.message())),
    }
    SCB::sys_reset()
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
    SCB::sys_reset()
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
        SCB::sys_reset();
    }
    if pac::RCC.cifr().read().cssf() {
        bridge::off();
        retained::keep(Fault::ClockFailed, format_args!(""));
        // At 170 MHz no tick would be in time again; the next start finds out what runs.
        SCB::sys_reset();
    }
}
