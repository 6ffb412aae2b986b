//! DMA request multiplexer (RM0440, DMAMUX). Not modelled: synchronisation and request generators.

use crate::error::{Refusal, only};

/// Event generation enable: kept, generates nothing without synchronisation.
const EVENT_GENERATION: u32 = 1 << 9;

/// The DMAMUX: one request id a channel; DMA1 channel 1 is 0, DMA2 channel 1 is 8.
#[derive(Debug, Clone, Default)]
pub(crate) struct Dmamux {
    channels: [u32; 16],
}

impl Dmamux {
    /// State behind a reset.
    pub(crate) fn new() -> Self {
        Self::default()
    }

    /// Request of `channel`.
    pub(crate) fn request(&self, channel: usize) -> u32 {
        self.channels[channel] & 0x7f
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&self, offset: u32) -> Result<u32, Refusal> {
        match offset {
            0x00..=0x3c => Ok(self.channels[offset as usize / 4]),
            0x80 => Ok(0),
            _ => Err(Refusal::no_register(offset)),
        }
    }

    /// Writes the register at `offset`.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        match offset {
            0x00..=0x3c => {
                only("CxCR", value, 0x7f | EVENT_GENERATION)?;
                self.channels[offset as usize / 4] = value;
                Ok(())
            }
            0x84 => Ok(()),
            _ => Err(Refusal::no_register(offset)),
        }
    }
}
