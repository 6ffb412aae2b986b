//! DMA1 and DMA2: eight channels each, single and circular (RM0440, DMA).
//!
//! A beat takes no time; among requests that wait, the higher priority level and then the lower channel goes first.
//! Not modelled: memory to memory, unequal sizes of source and destination.

use crate::error::{Refusal, only};

/// Interrupt numbers of DMA1 channels 1 to 8 and DMA2 channels 1 to 8.
const INTERRUPTS: [u32; 16] = [11, 12, 13, 14, 15, 16, 17, 96, 56, 57, 58, 59, 60, 97, 98, 99];
/// Channels of one controller.
const CHANNELS: usize = 8;
const ENABLE: u32 = 1;
const CIRCULAR: u32 = 1 << 5;
const FROM_MEMORY: u32 = 1 << 4;

#[derive(Debug, Clone, Copy, Default)]
struct Channel {
    control: u32,
    count: u32,
    peripheral: u32,
    memory: u32,
    /// Count when the channel was enabled.
    reload: u32,
    /// Items moved since.
    moved: u32,
}

/// One item to move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Beat {
    /// Channel, 0 to 15 over both controllers.
    pub channel: usize,
    /// Where it is read.
    pub from: u32,
    /// Where it is written.
    pub to: u32,
    /// Bytes.
    pub size: usize,
}

/// Both controllers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Dma {
    channels: [Channel; 2 * CHANNELS],
    flags: [u32; 2],
    /// Channels that are enabled and have items left, and interrupt lines that are high: asked for far more often than they change.
    waiting: u32,
    lines: u128,
}

impl Dma {
    /// State behind a reset.
    pub(crate) fn new() -> Self {
        Self::default()
    }

    /// Resets one controller.
    pub(crate) fn reset(&mut self, controller: usize) {
        self.channels[controller * CHANNELS..(controller + 1) * CHANNELS].fill(Channel::default());
        self.flags[controller] = 0;
        self.follow_all();
    }

    /// Follows a change of `channel` or of its flags.
    fn follow(&mut self, channel: usize) {
        let Channel { control, count, .. } = self.channels[channel];
        let waits = control & ENABLE != 0 && count > 0;
        self.waiting = self.waiting & !(1 << channel) | u32::from(waits) << channel;
        let flags = self.flags[channel / CHANNELS] >> (4 * (channel % CHANNELS));
        let (line, high) = (INTERRUPTS[channel], control & flags & 0xe != 0);
        self.lines = self.lines & !(1 << line) | u128::from(high) << line;
    }

    fn follow_all(&mut self) {
        (0..2 * CHANNELS).for_each(|channel| self.follow(channel));
    }

    /// Channels that are enabled and have items left.
    pub(crate) fn waiting(&self) -> u32 {
        self.waiting
    }

    /// Priority level of `channel`, 3 the highest.
    pub(crate) fn level(&self, channel: usize) -> u32 {
        self.channels[channel].control >> 12 & 3
    }

    /// The next item of `channel`.
    pub(crate) fn beat(&self, channel: usize) -> Beat {
        let Channel { control, peripheral, memory, moved, .. } = self.channels[channel];
        let shift = control >> 8 & 3;
        let peripheral = peripheral + if control & 1 << 6 != 0 { moved << shift } else { 0 };
        let memory = memory + if control & 1 << 7 != 0 { moved << shift } else { 0 };
        let (from, to) = if control & FROM_MEMORY != 0 { (memory, peripheral) } else { (peripheral, memory) };
        Beat { channel, from, to, size: 1 << shift }
    }

    /// Counts an item of `channel` as moved.
    pub(crate) fn done(&mut self, channel: usize) {
        let state = &mut self.channels[channel];
        state.moved += 1;
        state.count -= 1;
        let shift = 4 * (channel % CHANNELS);
        let flags = &mut self.flags[channel / CHANNELS];
        if state.count == state.reload / 2 {
            *flags |= 5 << shift;
        }
        if state.count == 0 {
            *flags |= 3 << shift;
            if state.control & CIRCULAR != 0 {
                state.count = state.reload;
                state.moved = 0;
            }
        }
        self.follow(channel);
    }

    /// A bus error of `channel` (RM0440, DMA): TEIF, and the channel is off.
    pub(crate) fn fail(&mut self, channel: usize) {
        self.channels[channel].control &= !ENABLE;
        self.flags[channel / CHANNELS] |= 9 << (4 * (channel % CHANNELS));
        self.follow(channel);
    }

    /// Interrupt lines that are high.
    pub(crate) fn lines(&self) -> u128 {
        self.lines
    }

    fn locate(controller: usize, offset: u32) -> Result<(usize, u32), Refusal> {
        let at = offset.checked_sub(8).filter(|at| *at < 20 * CHANNELS as u32);
        let at = at.ok_or_else(|| Refusal::no_register(offset))?;
        Ok((controller * CHANNELS + at as usize / 20, at % 20))
    }

    /// Value of the register at `offset` of `controller`.
    pub(crate) fn read(&self, controller: usize, offset: u32) -> Result<u32, Refusal> {
        if offset <= 4 {
            return Ok(if offset == 0 { self.flags[controller] } else { 0 });
        }
        let (channel, register) = Self::locate(controller, offset)?;
        let state = &self.channels[channel];
        Ok(match register {
            0x0 => state.control,
            0x4 => state.count,
            0x8 => state.peripheral,
            0xc => state.memory,
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    /// Writes the register at `offset` of `controller`.
    pub(crate) fn write(&mut self, controller: usize, offset: u32, value: u32) -> Result<(), Refusal> {
        if offset == 4 {
            let whole = (0..CHANNELS as u32).filter(|channel| value >> (4 * channel) & 1 == 1);
            let flags = whole.fold(value, |flags, channel| flags | 0xf << (4 * channel));
            self.flags[controller] &= !flags;
            // The global flag falls with the last of the others.
            for channel in 0..CHANNELS {
                if self.flags[controller] >> (4 * channel) & 0xe == 0 {
                    self.flags[controller] &= !(1 << (4 * channel));
                }
            }
            self.follow_all();
            return Ok(());
        }
        let (channel, register) = Self::locate(controller, offset)?;
        let state = &mut self.channels[channel];
        let enabled = state.control & ENABLE != 0;
        match register {
            0x0 => {
                only("CCR", value, 0x3fff)?;
                if value >> 8 & 3 != value >> 10 & 3 {
                    return Err(Refusal::because("CCR: unequal PSIZE and MSIZE are not modelled"));
                }
                if !enabled && value & ENABLE != 0 {
                    state.reload = state.count;
                    state.moved = 0;
                }
                state.control = value;
            }
            _ if enabled => {
                return Err(Refusal::because(
                    "CNDTR, CPAR and CMAR must not be written while the channel is enabled",
                ));
            }
            0x4 => state.count = value & 0xffff,
            0x8 => state.peripheral = value,
            0xc => state.memory = value,
            _ => return Err(Refusal::no_register(offset)),
        }
        self.follow(channel);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Channel 2 of DMA1: CCR at 0x1c, four halfwords from 0x40013000 to 0x20000100.
    fn reading(control: u32) -> Dma {
        let mut dma = Dma::new();
        dma.write(0, 0x20, 4).expect("CNDTR");
        dma.write(0, 0x24, 0x4001_300c).expect("CPAR");
        dma.write(0, 0x28, 0x2000_0100).expect("CMAR");
        dma.write(0, 0x1c, control | 0x0580 | ENABLE | 0xe).expect("CCR");
        dma
    }

    #[test]
    fn memory_advances_and_flags_come_at_half_and_end() {
        let mut dma = reading(0);
        let to: Vec<u32> = (0..4)
            .map(|k| {
                let beat = dma.beat(1);
                assert_eq!((beat.from, beat.size), (0x4001_300c, 2));
                dma.done(1);
                assert_eq!(dma.lines(), if k < 1 { 0 } else { 1 << 12 });
                beat.to
            })
            .collect();
        assert_eq!(to, [0x2000_0100, 0x2000_0102, 0x2000_0104, 0x2000_0106]);
        assert_eq!(dma.read(0, 0), Ok(0x70));
        assert_eq!(dma.waiting(), 0);
        dma.write(0, 4, 0x20).expect("IFCR TC");
        assert_eq!(dma.read(0, 0), Ok(0x50));
        dma.write(0, 4, 0x10).expect("IFCR GIF clears all of the channel");
        assert_eq!((dma.read(0, 0), dma.lines()), (Ok(0), 0));
    }

    #[test]
    fn a_circular_channel_starts_again() {
        let mut dma = reading(CIRCULAR);
        for _ in 0..4 {
            dma.done(1);
        }
        assert_eq!((dma.read(0, 0x20), dma.beat(1).to), (Ok(4), 0x2000_0100));
    }

    /// The flag of the error raises the line; neither outlives a reset of the controller.
    #[test]
    fn an_error_and_a_reset_leave_nothing_waiting() {
        let mut dma = reading(0);
        assert_eq!((dma.waiting(), dma.lines()), (1 << 1, 0));
        dma.fail(1);
        assert_eq!((dma.waiting(), dma.lines()), (0, 1 << 12));
        dma.reset(0);
        assert_eq!((dma.waiting(), dma.lines()), (0, 0));
        let mut dma = reading(0);
        dma.reset(1);
        assert_eq!(dma.waiting(), 1 << 1, "the other controller");
        dma.reset(0);
        assert_eq!(dma.waiting(), 0);
    }

    #[test]
    fn registers_of_an_enabled_channel_and_unequal_sizes_are_refused() {
        let mut dma = reading(0);
        assert!(dma.write(0, 0x20, 9).is_err());
        assert!(dma.write(0, 0x30, 0x100).is_err());
        assert!(dma.write(0, 0x30, 0x4000).is_err(), "memory to memory");
    }
}
