//! What the processor is like: clock source and option bytes.

use bowden_link::message::{Chip, ClockSource};
use embassy_stm32::pac;

/// State of the processor at the start (option bytes: RM0440, `FLASH_OPTR`).
pub fn state(clock: ClockSource, restarts: u8) -> Chip {
    let options = pac::FLASH.optr().read();
    Chip {
        clock,
        flash_banks: if options.dbank() { 2 } else { 1 },
        brown_out_level: options.bor_lev(),
        restarts,
    }
}
