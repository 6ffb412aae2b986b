//! SPI master: frames of 4 to 16 bits, 32-bit FIFOs, DMA requests (RM0440, SPI).
//!
//! A frame takes its bits at the baud rate; there is no gap between frames while the transmit FIFO holds data. Not
//! modelled: slave, half duplex, CRC, least significant bit first, I2S, and the LDMA bits of odd DMA counts.

use std::collections::VecDeque;

use super::NEVER;
use crate::error::{Refusal, only};

/// Bytes of each FIFO.
const FIFO_BYTES: usize = 4;
const ENABLE: u32 = 1 << 6;
const MASTER: u32 = 1 << 2;

/// A frame on the wires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Frame {
    /// What the master sends, right-aligned.
    pub mosi: u16,
    /// Bits.
    pub bits: u32,
    /// Cycle at which the first bit begins.
    pub start: u64,
    /// Cycle at which the last bit ends.
    pub end: u64,
}

/// How the clock line is set up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ClockMode {
    /// CPOL.
    pub idle_high: bool,
    /// CPHA.
    pub second_edge: bool,
    /// Cycles of HCLK a bit.
    pub cycles_per_bit: u64,
}

/// One SPI.
#[derive(Debug, Clone)]
pub(crate) struct Spi {
    /// Interrupt number.
    pub interrupt: u32,
    cr1: u32,
    cr2: u32,
    overrun: bool,
    transmit: VecDeque<u16>,
    receive: VecDeque<u16>,
    shifting: Option<Frame>,
    /// Frames on the wires so far.
    frames: u64,
}

impl Spi {
    /// An SPI behind a reset.
    pub(crate) fn new(interrupt: u32) -> Self {
        Self {
            interrupt,
            cr1: 0,
            cr2: 0x700,
            overrun: false,
            transmit: VecDeque::new(),
            receive: VecDeque::new(),
            shifting: None,
            frames: 0,
        }
    }

    /// Back to the reset state.
    pub(crate) fn reset(&mut self) {
        *self = Self { frames: self.frames, ..Self::new(self.interrupt) };
    }

    /// Bits of a frame.
    fn bits(&self) -> u32 {
        (self.cr2 >> 8 & 0xf) + 1
    }

    fn frame_bytes(&self) -> usize {
        if self.bits() > 8 { 2 } else { 1 }
    }

    /// Clock mode and speed.
    pub(crate) fn clock_mode(&self) -> ClockMode {
        ClockMode {
            idle_high: self.cr1 & 2 != 0,
            second_edge: self.cr1 & 1 != 0,
            cycles_per_bit: 2 << (self.cr1 >> 3 & 7),
        }
    }

    fn start_next(&mut self, now: u64) {
        if self.shifting.is_some() || self.cr1 & (ENABLE | MASTER) != ENABLE | MASTER {
            return;
        }
        if let Some(mosi) = self.transmit.pop_front() {
            let bits = self.bits();
            let end = now + u64::from(bits) * self.clock_mode().cycles_per_bit;
            self.shifting = Some(Frame { mosi: mosi & (0xffff >> (16 - bits)), bits, start: now, end });
        }
    }

    /// Cycle at which the frame on the wires ends.
    pub(crate) fn next_event(&self) -> u64 {
        self.shifting.map_or(NEVER, |frame| frame.end)
    }

    /// The frame that ends at or before `now`, if any; answer it with [`Self::finish`].
    pub(crate) fn due(&self, now: u64) -> Option<Frame> {
        self.shifting.filter(|frame| frame.end <= now)
    }

    /// Ends the frame on the wires with what the slave sent and starts the next.
    pub(crate) fn finish(&mut self, miso: u16) {
        let Some(frame) = self.shifting.take() else { return };
        self.frames += 1;
        if (self.receive.len() + 1) * self.frame_bytes() > FIFO_BYTES {
            self.overrun = true;
        } else {
            self.receive.push_back(miso & (0xffff >> (16 - frame.bits)));
        }
        self.start_next(frame.end);
    }

    fn receive_ready(&self) -> bool {
        let threshold = if self.cr2 & 1 << 12 != 0 { 1 } else { 2 };
        self.receive.len() * self.frame_bytes() >= threshold
    }

    fn transmit_ready(&self) -> bool {
        self.transmit.len() * self.frame_bytes() <= FIFO_BYTES / 2
    }

    /// Whether a DMA channel of the receive request may read.
    pub(crate) fn receive_request(&self) -> bool {
        self.cr2 & 1 != 0 && self.receive_ready()
    }

    /// Whether a DMA channel of the transmit request may write.
    pub(crate) fn transmit_request(&self) -> bool {
        self.cr2 & 2 != 0 && self.cr1 & ENABLE != 0 && self.transmit_ready()
    }

    /// Whether the interrupt line is high.
    pub(crate) fn line(&self) -> bool {
        let ready =
            self.receive_ready() && self.cr2 & 1 << 6 != 0 || self.transmit_ready() && self.cr2 & 1 << 7 != 0;
        ready || self.overrun && self.cr2 & 1 << 5 != 0
    }

    fn level(fifo: &VecDeque<u16>, frame_bytes: usize) -> u32 {
        match fifo.len() * frame_bytes {
            0 => 0,
            1 => 1,
            2 | 3 => 2,
            _ => 3,
        }
    }

    fn status(&self) -> u32 {
        let bytes = self.frame_bytes();
        let busy = self.cr1 & ENABLE != 0 && (self.shifting.is_some() || !self.transmit.is_empty());
        u32::from(self.receive_ready())
            | u32::from(self.transmit_ready()) << 1
            | u32::from(self.overrun) << 6
            | u32::from(busy) << 7
            | Self::level(&self.receive, bytes) << 9
            | Self::level(&self.transmit, bytes) << 11
    }

    /// Value of the register at `offset`, read with `size` bytes.
    pub(crate) fn read(&mut self, offset: u32, size: usize) -> Result<u32, Refusal> {
        Ok(match offset {
            0x00 => self.cr1,
            0x04 => self.cr2,
            0x08 => self.status(),
            0x0c => {
                self.overrun = false;
                let first = u32::from(self.receive.pop_front().unwrap_or(0));
                if size > 1 && self.bits() <= 8 {
                    first | u32::from(self.receive.pop_front().unwrap_or(0)) << 8
                } else {
                    first
                }
            }
            0x10 => 7,
            0x1c => 0,
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    /// Writes the register at `offset` with `size` bytes.
    pub(crate) fn write(&mut self, offset: u32, size: usize, value: u32, now: u64) -> Result<(), Refusal> {
        match offset {
            0x00 => {
                only("CR1", value, 0x037f)?;
                if value & ENABLE != 0 && value & MASTER == 0 {
                    return Err(Refusal::because("CR1: slave mode is not modelled"));
                }
                if (value ^ self.cr1) & 0x3f != 0 && self.cr1 & ENABLE != 0 && self.shifting.is_some() {
                    return Err(Refusal::because("CR1: mode and baud rate must not change during a frame"));
                }
                if value & ENABLE == 0 && self.shifting.is_some() {
                    return Err(Refusal::because("CR1: SPE must not be cleared during a frame (BSY)"));
                }
                self.cr1 = value;
                self.start_next(now);
            }
            0x04 => {
                only("CR2", value, 0x1fe7)?;
                if self.cr1 & ENABLE != 0 && (value ^ self.cr2) & 0x0f00 != 0 {
                    return Err(Refusal::because("CR2: DS must not change while SPE is set"));
                }
                // Sizes below 4 bits count as 8.
                self.cr2 = if value >> 8 & 0xf < 3 { value & !0xf00 | 0x700 } else { value };
            }
            0x08 => {}
            0x0c => {
                let packed = size > 1 && self.bits() <= 8;
                let words =
                    if packed { vec![value as u16 & 0xff, value as u16 >> 8] } else { vec![value as u16] };
                if (self.transmit.len() + words.len()) * self.frame_bytes() > FIFO_BYTES {
                    return Err(Refusal::because("DR: the transmit FIFO is full (TXE is 0)"));
                }
                self.transmit.extend(words);
                self.start_next(now);
            }
            0x1c => only("I2SCFGR", value, 0)?,
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 8 bits, FRXTH, BR = 6: 128 cycles a bit.
    fn enabled() -> Spi {
        let mut spi = Spi::new(35);
        spi.write(0x04, 4, 0x1700, 0).expect("CR2");
        spi.write(0x00, 4, 0x0300 | 6 << 3 | MASTER, 0).expect("CR1");
        spi.write(0x00, 4, 0x0300 | 6 << 3 | MASTER | ENABLE, 0).expect("CR1");
        spi
    }

    #[test]
    fn a_byte_takes_eight_bits_at_the_baud_rate() {
        let mut spi = enabled();
        assert_eq!(spi.read(0x08, 4), Ok(2), "TXE only");
        spi.write(0x0c, 1, 0xa5, 1000).expect("DR");
        assert_eq!(spi.next_event(), 1000 + 8 * 128);
        assert_eq!(spi.read(0x08, 4), Ok(0x82), "BSY and TXE");
        assert_eq!(spi.due(2023), None);
        assert_eq!(spi.due(2024).map(|frame| frame.mosi), Some(0xa5));
        spi.finish(0x3c);
        assert_eq!(spi.read(0x08, 4), Ok(0x0203), "RXNE, TXE, FRLVL 1/4");
        assert_eq!(spi.read(0x0c, 1), Ok(0x3c));
        assert_eq!(spi.read(0x08, 4), Ok(2));
    }

    #[test]
    fn halfword_stores_pack_two_bytes_low_byte_first() {
        let mut spi = enabled();
        spi.write(0x0c, 2, 0x2211, 0).expect("DR");
        assert_eq!(spi.due(1024).map(|frame| frame.mosi), Some(0x11));
        spi.finish(0xaa);
        assert_eq!(spi.due(2048).map(|frame| (frame.mosi, frame.start)), Some((0x22, 1024)));
        spi.finish(0xbb);
        assert_eq!(spi.read(0x0c, 2), Ok(0xbbaa));
    }

    #[test]
    fn a_full_receive_fifo_overruns() {
        let mut spi = enabled();
        for k in 0..5 {
            spi.write(0x0c, 1, 0, k * 2000).expect("DR");
            spi.finish(k as u16);
        }
        assert_eq!(spi.read(0x08, 4).map(|sr| sr & 0x0640), Ok(0x0640), "OVR, FRLVL full");
        assert_eq!(spi.read(0x0c, 1), Ok(0), "the oldest byte is kept");
    }

    #[test]
    fn mode_changes_in_a_frame_and_slave_mode_are_refused() {
        let mut spi = enabled();
        spi.write(0x0c, 1, 0, 0).expect("DR");
        assert!(spi.write(0x00, 4, 0x0300 | MASTER, 10).is_err(), "SPE cleared in a frame");
        assert!(Spi::new(35).write(0x00, 4, ENABLE, 0).is_err(), "slave");
        assert!(Spi::new(35).write(0x00, 4, 0x80, 0).is_err(), "LSBFIRST");
    }
}
