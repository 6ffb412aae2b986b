//! Clock recovery system: its settings are stored, HSI48 is exact as it is (RM0440, CRS).

use crate::error::{Refusal, only};

/// The CRS.
#[derive(Debug, Clone)]
pub(crate) struct Crs {
    cr: u32,
    cfgr: u32,
}

impl Crs {
    /// State behind a reset.
    pub(crate) fn new() -> Self {
        Self { cr: 0x4000, cfgr: 0x2022_bb7f }
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&self, offset: u32) -> Result<u32, Refusal> {
        Ok(match offset {
            0x00 => self.cr,
            0x04 => self.cfgr,
            0x08 => 0,
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    /// Writes the register at `offset`.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        match offset {
            0x00 => {
                only("CR", value, 0x7f60)?;
                self.cr = value;
            }
            0x04 => self.cfgr = value,
            0x0c => {}
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }
}
