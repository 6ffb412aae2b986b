//! System configuration: EXTI port selection, what breaks the advanced timers; all else reads its reset value (RM0440, SYSCFG).
//!
//! RAM has no parity errors here, and a core that locks up ends the run.

use crate::error::{Refusal, only};

/// The SYSCFG.
#[derive(Debug, Clone, Default)]
pub(crate) struct Syscfg {
    memrmp: u32,
    exticr: [u32; 4],
    cfgr1: u32,
    cfgr2: u32,
}

impl Syscfg {
    /// State behind a reset.
    pub(crate) fn new() -> Self {
        Self::default()
    }

    /// Port (A = 0) that EXTI line `line` (0 to 15) looks at.
    pub(crate) fn exti_port(&self, line: u8) -> usize {
        (self.exticr[usize::from(line / 4)] >> (4 * (line % 4)) & 0xf) as usize
    }

    /// Whether two wrong bits of the flash break (ECCL).
    pub(crate) fn breaks_by_flash(&self) -> bool {
        self.cfgr2 & 8 != 0
    }

    /// Whether a supply below the level of the voltage detector breaks (PVDL).
    pub(crate) fn breaks_by_supply(&self) -> bool {
        self.cfgr2 & 4 != 0
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&self, offset: u32) -> Result<u32, Refusal> {
        Ok(match offset {
            0x00 => self.memrmp,
            0x18 => 0,
            0x1c => self.cfgr2,
            0x04 => self.cfgr1,
            0x08..=0x14 => self.exticr[(offset as usize - 8) / 4],
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    /// Writes the register at `offset`.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        match offset {
            0x00 => {
                // What is seen at address 0: the flash or, for the boot loader, the system memory. Nothing here reads there.
                only("MEMRMP", value, 1)?;
                self.memrmp = value;
            }
            0x04 => {
                // BOOSTEN and ANASWVDD act on analog switches at low supply only.
                only("CFGR1", value, 0x300)?;
                self.cfgr1 = value;
            }
            0x08..=0x14 => self.exticr[(offset as usize - 8) / 4] = value & 0xffff,
            0x1c => {
                only("CFGR2", value, 0xf)?;
                // Set by software, cleared by reset only.
                self.cfgr2 |= value;
            }
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }
}
