//! An STM32G474RE behind a debug probe: debug port and memory access port (Arm IHI 0031), the debug registers of the core (Arm DDI
//! 0403, `ARMv7-M`), its flash interface (RM0440), and as many instructions as an algorithm for that flash is made of. It is
//! stricter than the part: what the documents do not allow ends the test.

pub mod chip;
mod flash;
pub mod port;
mod thumb;
