//! The way into the processor's own boot loader (AN2606), which takes an image over USB.
//!
//! It expects a processor as behind a reset: clocks, timers, USB and watchdog as they were. So the firmware resets, with a word kept for
//! the next start, which jumps before it has switched anything on. Bridge and gate driver have no clock and no output from the
//! reset on.

use cortex_m::peripheral::SCB;
use embassy_stm32::pac;

use crate::{bridge, retained};

/// Its vector table, at the beginning of the system memory (RM0440, memory organization).
const VECTORS: *const u32 = 0x1fff_0000 as *const u32;

/// Value of `MEM_MODE` that shows the system memory at address 0, as it is when the pin starts the boot loader.
const SYSTEM_MEMORY: u8 = 1;

/// Ends the run of the firmware.
pub fn leave() -> ! {
    bridge::off();
    defmt::info!("leaving for the boot loader");
    retained::leave();
    SCB::sys_reset()
}

/// Jumps if the run before asked for it; to be called before anything else.
pub fn enter_if_asked() {
    if !retained::is_leaving() {
        return;
    }
    // The next start is not to take this reset for an end by the firmware.
    pac::RCC.csr().modify(|flags| flags.set_rmvf(true));
    pac::RCC.apb2enr().modify(|clocks| clocks.set_syscfgen(true));
    pac::SYSCFG.memrmp().modify(|memory| memory.set_mem_mode(SYSTEM_MEMORY));
    #[expect(unsafe_code, reason = "the firmware is left for good")]
    // Safety: the system memory has a vector table there, no interrupt is enabled yet, and nothing of this run is used again.
    unsafe {
        (*SCB::PTR).vtor.write(VECTORS as u32);
        cortex_m::asm::bootload(VECTORS)
    }
}
