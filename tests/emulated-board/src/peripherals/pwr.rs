//! Power control, as far as run mode goes: backup domain access, USB Type-C pull-downs, boost (RM0440, PWR).

use crate::error::{Refusal, only};

/// The PWR.
#[derive(Debug, Clone)]
pub(crate) struct Pwr {
    cr1: u32,
    cr3: u32,
    cr5: u32,
}

impl Pwr {
    /// State behind a reset: range 1, normal mode.
    pub(crate) fn new() -> Self {
        Self { cr1: 0x200, cr3: 0x8000, cr5: 0x100 }
    }

    /// Whether range 1 is in boost mode (R1MODE clear).
    pub(crate) fn boost(&self) -> bool {
        self.cr5 & 0x100 == 0
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&self, offset: u32) -> Result<u32, Refusal> {
        Ok(match offset {
            0x00 => self.cr1,
            0x08 => self.cr3,
            0x04 | 0x0c | 0x10 | 0x14 => 0,
            0x80 => self.cr5,
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    /// Writes the register at `offset`.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        match offset {
            0x00 => {
                only("CR1", value, 0x300)?;
                if value & 0x200 == 0 {
                    return Err(Refusal::because("CR1: only voltage range 1 is modelled"));
                }
                self.cr1 = value;
            }
            0x08 => {
                // EIWUL, UCPD1_STDBY and UCPD1_DBDIS; the pull-downs touch PB4 and PB6 only without supply.
                only("CR3", value, 0xe000)?;
                self.cr3 = value;
            }
            0x18 => {}
            0x80 => {
                only("CR5", value, 0x100)?;
                self.cr5 = value;
            }
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }
}
