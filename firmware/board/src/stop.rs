//! The end of a run: motor off, words kept and logged, reset.

use core::arch::naked_asm;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use bowden_link::Fault;
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac;

use crate::{bridge, ccm, retained, store_flash};

// Microseconds since the start; 0 before the timer that counts them has its clock, for what ends a run that early is logged too.
defmt::timestamp!("{=u64:us}", {
    let counts = pac::RCC.apb1enr1().read().tim5en();
    if counts { embassy_time::Instant::now().as_micros() } else { 0 }
});

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

/// Opens the bridge, lets nothing close it again, and makes the code whole that keeping and logging a fault need: the start may not have
/// come to it.
fn make_safe() {
    bridge::off();
    cortex_m::interrupt::disable();
    ccm::fill_code();
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    make_safe();
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

/// Stack that [`processor_fault`] takes, with room to spare, bytes.
const ROOM: u32 = 1024;

/// Where the processor goes when it cannot go on: of a stack that has run over its end nothing is left for a function to stand on.
#[allow(unsafe_code, reason = "the entry of a vector, before there is a stack")]
#[unsafe(naked)]
#[unsafe(export_name = "HardFault")]
#[unsafe(link_section = ".HardFault.user")]
unsafe extern "C" fn hard_fault() -> ! {
    naked_asm!(
        "mrs r0, msp",
        "movw r1, #:lower16:_stack_end",
        "movt r1, #:upper16:_stack_end",
        "add.w r1, r1, #{room}",
        "cmp r0, r1",
        "bhs 0f",
        "movw r1, #:lower16:_stack_start",
        "movt r1, #:upper16:_stack_start",
        "msr msp, r1",
        "b {stack_overflow}",
        "0:",
        "b {processor_fault}",
        room = const ROOM,
        stack_overflow = sym stack_overflow,
        processor_fault = sym processor_fault,
    )
}

/// The stack is at its end, or so near that nothing more fits; it is taken anew from its start.
extern "C" fn stack_overflow(stack_pointer: u32) -> ! {
    make_safe();
    retained::keep(Fault::StackOverflow, format_args!("stack pointer {stack_pointer:#010x}"));
    reset_with(Fault::StackOverflow)
}

extern "C" fn processor_fault(frame: &ExceptionFrame) -> ! {
    make_safe();
    #[allow(unsafe_code, reason = "a register of the core")]
    // Safety: reading it changes nothing.
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    retained::keep(
        Fault::HardFault,
        format_args!("at {:#010x}, called from {:#010x}, CFSR {status:#010x}", frame.pc(), frame.lr()),
    );
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
        make_safe();
        let bank = if check.bk_ecc() { 2 } else { 1 };
        retained::keep(Fault::FlashDamaged, format_args!("bank {bank}, {:#x}", check.addr_ecc()));
        reset_with(Fault::FlashDamaged);
    }
    if pac::RCC.cifr().read().cssf() {
        make_safe();
        retained::keep(Fault::ClockFailed, format_args!(""));
        // At 170 MHz no tick would be in time again; the next start finds out what runs.
        reset_with(Fault::ClockFailed);
    }
}
