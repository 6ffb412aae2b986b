//! Independent watchdog on LSI at 32 kHz (RM0440, IWDG).
//!
//! Prescaler and reload take effect at once, so the update flags always read 0. Not modelled: the window.

use super::NEVER;
use crate::error::Refusal;

/// Frequency of LSI \[Hz\].
const LSI_HZ: f64 = 32_000.0;
const LARGEST_RELOAD: u32 = 0xfff;

/// The IWDG.
#[derive(Debug, Clone)]
pub(crate) struct Watchdog {
    prescaler: u32,
    reload: u32,
    unlocked: bool,
    /// Cycle at which it resets the part; [`NEVER`] before its start.
    deadline: u64,
}

impl Watchdog {
    /// The watchdog behind a reset, stopped.
    pub(crate) fn new() -> Self {
        Self { prescaler: 0, reload: LARGEST_RELOAD, unlocked: false, deadline: NEVER }
    }

    /// Time from a reload to the reset \[s\]: `(RL + 1)·4·2^PR/32 kHz`.
    pub(crate) fn timeout_s(&self) -> f64 {
        f64::from(self.reload + 1) * f64::from(4_u32 << self.prescaler.min(6)) / LSI_HZ
    }

    fn restart(&mut self, now: u64, hclk_hz: u64) {
        self.deadline = now + (self.timeout_s() * hclk_hz as f64).round() as u64;
    }

    /// Cycle at which it resets the part.
    pub(crate) fn next_event(&self) -> u64 {
        self.deadline
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&self, offset: u32) -> Result<u32, Refusal> {
        Ok(match offset {
            0x00 | 0x0c => 0,
            0x04 => self.prescaler,
            0x08 => self.reload,
            0x10 => LARGEST_RELOAD,
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    /// Writes the register at `offset`.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: u64, hclk_hz: u64) -> Result<(), Refusal> {
        if offset != 0 && !self.unlocked {
            return Err(Refusal::because("the register is protected: write 0x5555 to KR first"));
        }
        match offset {
            0x00 => {
                self.unlocked = value == 0x5555;
                match value {
                    0xcccc => self.restart(now, hclk_hz),
                    0xaaaa if self.deadline != NEVER => self.restart(now, hclk_hz),
                    0xaaaa | 0x5555 | 0 => {}
                    _ => return Err(Refusal::because("KR takes 0x5555, 0xaaaa or 0xcccc")),
                }
            }
            0x04 => self.prescaler = value & 7,
            0x08 => self.reload = value & LARGEST_RELOAD,
            _ => return Err(Refusal::because("the window (WINR) is not modelled")),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_bites_after_reload_plus_one_periods() {
        let mut dog = Watchdog::new();
        dog.write(0x00, 0x5555, 0, 1_000_000).expect("KR");
        dog.write(0x04, 1, 0, 1_000_000).expect("PR");
        dog.write(0x08, 399, 0, 1_000_000).expect("RLR");
        assert_eq!(dog.next_event(), NEVER);
        dog.write(0x00, 0xcccc, 500, 1_000_000).expect("KR");
        // 400 periods of 8/32 kHz are 100 ms, 100000 cycles at 1 MHz.
        assert_eq!(dog.next_event(), 100_500);
        dog.write(0x00, 0xaaaa, 90_000, 1_000_000).expect("KR");
        assert_eq!(dog.next_event(), 190_000);
        assert!(dog.write(0x08, 1, 90_000, 1_000_000).is_err(), "protected again");
    }
}
