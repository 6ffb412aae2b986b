//! General-purpose I/O port: modes, output data, input levels (RM0440, GPIO registers).
//!
//! Not modelled: the lock register. Speed and output type are stored, an open drain output reads as its data bit.

use crate::error::Refusal;

/// What the mode register says of a pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mode {
    /// Digital input.
    Input,
    /// General-purpose output.
    Output,
    /// Alternate function with this number.
    Alternate(u8),
    /// Analog, the state after reset.
    Analog,
}

/// One port of 16 pins.
#[derive(Debug, Clone)]
pub(crate) struct Gpio {
    index: usize,
    moder: u32,
    otyper: u32,
    ospeedr: u32,
    pupdr: u32,
    odr: u16,
    afr: [u32; 2],
    /// Pins that something outside drives.
    driven: u16,
    /// Their levels.
    driven_levels: u16,
}

impl Gpio {
    /// Port `index` (A = 0) behind a reset, nothing connected.
    pub(crate) fn new(index: usize) -> Self {
        let (moder, ospeedr, pupdr) = match index {
            0 => (0xabff_ffff, 0x0c00_0000, 0x6400_0000),
            1 => (0xffff_febf, 0x0000_00c0, 0x0000_0100),
            _ => (0xffff_ffff, 0, 0),
        };
        Self { index, moder, otyper: 0, ospeedr, pupdr, odr: 0, afr: [0; 2], driven: 0, driven_levels: 0 }
    }

    /// Registers back to their reset values; what is connected stays.
    pub(crate) fn reset(&mut self) {
        *self = Self { driven: self.driven, driven_levels: self.driven_levels, ..Self::new(self.index) };
    }

    /// Mode of `pin`.
    pub(crate) fn mode(&self, pin: u8) -> Mode {
        match self.moder >> (2 * pin) & 3 {
            0 => Mode::Input,
            1 => Mode::Output,
            2 => Mode::Alternate((self.afr[usize::from(pin / 8)] >> (4 * (pin % 8)) & 0xf) as u8),
            _ => Mode::Analog,
        }
    }

    /// Level that `pin` drives as a general-purpose output, if it is one.
    pub(crate) fn output(&self, pin: u8) -> Option<bool> {
        (self.mode(pin) == Mode::Output).then_some(self.odr >> pin & 1 == 1)
    }

    /// Levels of all pins that are outputs; others are 0.
    pub(crate) fn outputs(&self) -> u16 {
        (0..16).fold(0, |levels, pin| levels | u16::from(self.output(pin) == Some(true)) << pin)
    }

    /// Drives `pin` from outside, or lets it go.
    pub(crate) fn drive(&mut self, pin: u8, level: Option<bool>) {
        let bit = 1 << pin;
        self.driven = if level.is_some() { self.driven | bit } else { self.driven & !bit };
        self.driven_levels =
            if level == Some(true) { self.driven_levels | bit } else { self.driven_levels & !bit };
    }

    /// Level at `pin`: its own output, what drives it, or its pull resistor.
    pub(crate) fn level(&self, pin: u8) -> bool {
        if let Some(level) = self.output(pin) {
            return level;
        }
        if self.driven >> pin & 1 == 1 {
            return self.driven_levels >> pin & 1 == 1;
        }
        self.pupdr >> (2 * pin) & 3 == 1
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&self, offset: u32) -> Result<u32, Refusal> {
        Ok(match offset {
            0x00 => self.moder,
            0x04 => self.otyper,
            0x08 => self.ospeedr,
            0x0c => self.pupdr,
            0x10 => (0..16)
                .filter(|pin| self.mode(*pin) != Mode::Analog && self.level(*pin))
                .fold(0, |levels, pin| levels | 1 << pin),
            0x14 => u32::from(self.odr),
            0x18 | 0x28 => 0,
            0x20 => self.afr[0],
            0x24 => self.afr[1],
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    /// Writes the register at `offset`.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        match offset {
            0x00 => self.moder = value,
            0x04 => self.otyper = value & 0xffff,
            0x08 => self.ospeedr = value,
            0x0c => self.pupdr = value,
            0x14 => self.odr = value as u16,
            0x18 => self.odr = self.odr & !((value >> 16) as u16) | value as u16,
            0x20 => self.afr[0] = value,
            0x24 => self.afr[1] = value,
            0x28 => self.odr &= !(value as u16),
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn set_wins_over_reset_and_only_outputs_drive() {
        let mut port = Gpio::new(2);
        port.write(0x18, 1 << 6).expect("BSRR");
        assert_eq!(port.output(6), None, "still analog");
        port.write(0x00, !(2 << 12)).expect("MODER");
        assert_eq!(port.output(6), Some(true));
        port.write(0x18, 1 << 22 | 1 << 6).expect("BSRR");
        assert_eq!(port.output(6), Some(true), "BS has priority over BR");
        port.write(0x28, 1 << 6).expect("BRR");
        assert_eq!(port.output(6), Some(false));
    }

    #[test]
    fn an_input_follows_its_driver_or_its_pull() {
        let mut port = Gpio::new(1);
        port.write(0x00, 0).expect("MODER");
        port.write(0x0c, 1 << 24).expect("PUPDR");
        assert!(port.level(12), "pulled up");
        port.drive(12, Some(false));
        assert_eq!(port.read(0x10).map(|idr| idr >> 12 & 1), Ok(0));
        port.drive(12, None);
        assert_eq!(port.read(0x10).map(|idr| idr >> 12 & 1), Ok(1));
    }

    #[test]
    fn debug_pins_start_as_alternate_function_zero() {
        assert_eq!(Gpio::new(0).mode(13), Mode::Alternate(0));
        assert_eq!(Gpio::new(1).mode(4), Mode::Alternate(0));
        assert_eq!(Gpio::new(3).mode(2), Mode::Analog);
    }
}
