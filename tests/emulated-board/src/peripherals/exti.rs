//! External interrupts of GPIO lines 0 to 15 (RM0440, EXTI).
//!
//! Not modelled: events (EMR), lines above 15.

use crate::error::{Refusal, only};

const LINES: u32 = 0xffff;
/// Lines above 15 that are unmasked behind a reset: those of peripherals in stop modes, which are not modelled.
const RESET_MASK: u32 = 0x1f84_0000;

/// The EXTI.
#[derive(Debug, Clone)]
pub(crate) struct Exti {
    mask: u32,
    rising: u32,
    falling: u32,
    pending: u32,
}

impl Exti {
    /// State behind a reset.
    pub(crate) fn new() -> Self {
        Self { mask: 0, rising: 0, falling: 0, pending: 0 }
    }

    /// An edge at the pin that `line` is connected to.
    pub(crate) fn edge(&mut self, line: u8, level: bool) {
        let selected = if level { self.rising } else { self.falling };
        self.pending |= selected & 1 << line;
    }

    /// Interrupt lines that are high.
    pub(crate) fn lines(&self) -> u128 {
        let active = self.pending & self.mask;
        let single =
            (0..5).filter(|line| active >> line & 1 == 1).fold(0, |lines, line| lines | 1_u128 << (6 + line));
        single | u128::from(active & 0x03e0 != 0) << 23 | u128::from(active & 0xfc00 != 0) << 40
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&self, offset: u32) -> Result<u32, Refusal> {
        Ok(match offset {
            0x00 => self.mask | RESET_MASK,
            0x04 | 0x10 => 0,
            0x08 => self.rising,
            0x0c => self.falling,
            0x14 => self.pending,
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    /// Writes the register at `offset`.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        match offset {
            0x00 => {
                only("IMR1", value & !RESET_MASK, LINES)?;
                self.mask = value & LINES;
            }
            0x04 => only("EMR1", value, 0)?,
            0x08 => {
                only("RTSR1", value, LINES)?;
                self.rising = value;
            }
            0x0c => {
                only("FTSR1", value, LINES)?;
                self.falling = value;
            }
            0x10 => {
                only("SWIER1", value, LINES)?;
                self.pending |= value;
            }
            0x14 => self.pending &= !value,
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chosen_edge_pends_its_line() {
        let mut exti = Exti::new();
        exti.write(0x00, 1 << 12).expect("IMR1");
        exti.write(0x0c, 1 << 12).expect("FTSR1");
        exti.edge(12, true);
        assert_eq!(exti.lines(), 0);
        exti.edge(12, false);
        assert_eq!(exti.lines(), 1 << 40);
        exti.write(0x14, 1 << 12).expect("PR1");
        assert_eq!(exti.lines(), 0);
    }
}
