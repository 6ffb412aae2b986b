//! Debug support: device id and the bits that keep clocks on in sleep (RM0440, DBGMCU).

use crate::error::{Refusal, only};

/// Revision and device id of an STM32G471/473/474/483/484.
const IDCODE: u32 = 0x2003_6469;

/// The DBGMCU.
#[derive(Debug, Clone, Default)]
pub(crate) struct Dbgmcu {
    cr: u32,
    freeze: [u32; 3],
}

impl Dbgmcu {
    /// State behind a power-on reset.
    pub(crate) fn new() -> Self {
        Self::default()
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&self, offset: u32) -> Result<u32, Refusal> {
        Ok(match offset {
            0x00 => IDCODE,
            0x04 => self.cr,
            0x08..=0x10 => self.freeze[(offset as usize - 8) / 4],
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    /// Whether TIM1 stands while a debugger holds the core (APB2FZR, `DBG_TIM1_STOP`).
    pub(crate) fn stops_tim1(&self) -> bool {
        self.freeze[2] >> 11 & 1 == 1
    }

    /// Writes the register at `offset`. Of the freezing bits only that of TIM1 is modelled; the others are kept.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        match offset {
            0x04 => {
                only("CR", value, 7)?;
                self.cr = value;
            }
            0x08..=0x10 => self.freeze[(offset as usize - 8) / 4] = value,
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }
}
