//! Power control, as far as run mode goes: backup domain access, USB Type-C pull-downs, boost, voltage detector (RM0440, PWR).
//!
//! The supply is fine or below every level of the detector; in between there is nothing.

use crate::error::{Refusal, only};

/// The PWR.
#[derive(Debug, Clone)]
pub(crate) struct Pwr {
    cr1: u32,
    cr2: u32,
    cr3: u32,
    cr5: u32,
}

impl Pwr {
    /// State behind a reset: range 1, normal mode.
    pub(crate) fn new() -> Self {
        Self { cr1: 0x200, cr2: 0, cr3: 0x8000, cr5: 0x100 }
    }

    /// Whether range 1 is in boost mode (R1MODE clear).
    pub(crate) fn boost(&self) -> bool {
        self.cr5 & 0x100 == 0
    }

    /// Whether the voltage detector is on (PVDE).
    pub(crate) fn detects_supply(&self) -> bool {
        self.cr2 & 1 != 0
    }

    /// Value of the register at `offset`; `supply_low` is what the voltage detector sees.
    pub(crate) fn read(&self, offset: u32, supply_low: bool) -> Result<u32, Refusal> {
        Ok(match offset {
            0x00 => self.cr1,
            0x08 => self.cr3,
            0x04 => self.cr2,
            0x14 => u32::from(supply_low && self.detects_supply()) << 11,
            0x0c | 0x10 => 0,
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
            0x04 => {
                only("CR2", value, 0xf)?;
                if value & 0xe == 0xe {
                    return Err(Refusal::because("CR2: the detector's external input (PLS 7) is not wired"));
                }
                self.cr2 = value;
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
