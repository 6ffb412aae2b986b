//! Empties the log's buffer before start-up gets to it.
//!
//! RTT's block is a variable with a first value (defmt-rtt, `_SEGGER_RTT`), which start-up copies word by word: first how far the
//! program has written, then how far the probe has read. Behind a reset both still say where the run before ended, and a probe that
//! looks between the two copies takes all from there to the end of the buffer for new. With both zero before, and at once, there is
//! no such moment. What the probe had not read by then is lost; why a run ended is kept elsewhere ([`crate::retained`]).
#![expect(unsafe_code, reason = "what runs before variables have values is not written in Rust")]

use core::arch::global_asm;

// Called by the reset handler of cortex-m-rt. Behind the block's name of 16 bytes,
// two counts, and name, buffer and size of the channel stand the two words, at 36.
global_asm!(
    ".section .text.__pre_init, \"ax\"",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    "ldr r0, =_SEGGER_RTT",
    "movs r1, #0",
    "strd r1, r1, [r0, #36]",
    "bx lr",
    ".size __pre_init, . - __pre_init",
    ".ltorg",
);
