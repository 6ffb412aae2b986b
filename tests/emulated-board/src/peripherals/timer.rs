//! Basic and general-purpose timers: up counting, update and compare interrupts (RM0440, TIM2 to TIM7, TIM15 to TIM17).
//!
//! Not modelled: input capture, output pins, slave modes, DMA requests, one-pulse mode, other count directions, and a
//! trigger output other than the reset value. Compare modes are stored; only the flags have an effect.

use super::NEVER;
use crate::error::{Refusal, only};

const UPDATE_DISABLE: u32 = 1 << 1;
const UPDATE_REQUEST_SOURCE: u32 = 1 << 2;
const AUTO_RELOAD_PRELOAD: u32 = 1 << 7;

/// A timer that counts up.
#[derive(Debug, Clone)]
pub(crate) struct Timer {
    /// Interrupt number.
    pub interrupt: u32,
    channels: usize,
    largest: u32,
    cr1: u32,
    dier: u32,
    sr: u32,
    ccmr: [u32; 2],
    ccer: u32,
    prescaler: u32,
    prescaler_active: u32,
    reload: u32,
    reload_active: u32,
    compare: [u32; 4],
    /// Cycle at which the count was `segment_count`; prescaler and reload have not changed since.
    segment_start: u64,
    segment_count: u64,
    /// Count without wrap up to which flags are set.
    seen: u64,
    /// Cycle of the next flag that raises the interrupt: the core asks for it far more often than it changes.
    due: u64,
}

impl Timer {
    /// A timer behind a reset; `bits` 16 or 32.
    pub(crate) fn new(interrupt: u32, channels: usize, bits: u32) -> Self {
        let largest = u32::MAX >> (32 - bits);
        Self {
            interrupt,
            channels,
            largest,
            cr1: 0,
            dier: 0,
            sr: 0,
            ccmr: [0; 2],
            ccer: 0,
            prescaler: 0,
            prescaler_active: 0,
            reload: largest,
            reload_active: largest,
            compare: [0; 4],
            segment_start: 0,
            segment_count: 0,
            seen: 0,
            due: NEVER,
        }
    }

    /// Back to the reset state.
    pub(crate) fn reset(&mut self) {
        *self = Self::new(self.interrupt, self.channels, u32::BITS - self.largest.leading_zeros());
    }

    fn runs(&self) -> bool {
        self.cr1 & 1 != 0
    }

    fn period(&self) -> u64 {
        u64::from(self.reload_active) + 1
    }

    /// Count without wrap at `now`.
    fn total(&self, now: u64) -> u64 {
        let ticks = if self.runs() {
            (now.saturating_sub(self.segment_start)) / (u64::from(self.prescaler_active) + 1)
        } else {
            0
        };
        self.segment_count + ticks
    }

    fn cycle_of(&self, total: u64) -> u64 {
        self.segment_start + (total - self.segment_count) * (u64::from(self.prescaler_active) + 1)
    }

    fn count(&self, now: u64) -> u32 {
        (self.total(now) % self.period()) as u32
    }

    fn preload_waits(&self) -> bool {
        self.prescaler != self.prescaler_active || self.reload != self.reload_active
    }

    fn load(&mut self) {
        self.prescaler_active = self.prescaler;
        self.reload_active = self.reload;
    }

    fn restart(&mut self, cycle: u64, count: u32) {
        self.segment_start = cycle;
        self.segment_count = u64::from(count);
        self.seen = self.segment_count;
    }

    /// Sets the flags of all counts behind `seen` and up to `total`.
    fn mark(&mut self, total: u64) {
        let period = self.period();
        if total / period > self.seen / period && self.cr1 & UPDATE_DISABLE == 0 {
            self.sr |= 1;
        }
        for channel in 0..self.channels {
            let compare = u64::from(self.compare[channel]);
            // Matches up to x: those at compare, compare + period, ...
            let matches = |x: u64| if x >= compare { (x - compare) / period + 1 } else { 0 };
            if compare < period && matches(total) > matches(self.seen) {
                self.sr |= 2 << channel;
            }
        }
        self.seen = total;
    }

    /// Brings flags and count up to `now`.
    pub(crate) fn advance(&mut self, now: u64) {
        if self.runs() {
            self.follow(now);
            self.due = self.next_flag();
        }
    }

    fn follow(&mut self, now: u64) {
        loop {
            let total = self.total(now);
            let overflow = (self.seen / self.period() + 1) * self.period();
            if !self.preload_waits() || total < overflow || self.cr1 & UPDATE_DISABLE != 0 {
                self.mark(total);
                return;
            }
            self.mark(overflow);
            let at = self.cycle_of(overflow);
            self.load();
            self.restart(at, 0);
        }
    }

    /// Cycle of the next flag that raises the interrupt.
    pub(crate) fn next_event(&self) -> u64 {
        self.due
    }

    fn next_flag(&self) -> u64 {
        if !self.runs() {
            return NEVER;
        }
        let waiting = self.dier & !self.sr;
        let period = self.period();
        let base = self.seen / period * period;
        let mut next = NEVER;
        if waiting & 1 != 0 && self.cr1 & UPDATE_DISABLE == 0 {
            next = self.cycle_of(base + period);
        }
        for channel in 0..self.channels {
            let compare = u64::from(self.compare[channel]);
            if waiting >> (channel + 1) & 1 == 1 && compare < period {
                let at = if base + compare > self.seen { base + compare } else { base + compare + period };
                next = next.min(self.cycle_of(at));
            }
        }
        next
    }

    /// Whether the interrupt line is high.
    pub(crate) fn line(&self) -> bool {
        self.sr & self.dier & 0x1f != 0
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&mut self, offset: u32, now: u64) -> Result<u32, Refusal> {
        self.advance(now);
        Ok(match offset {
            0x00 => self.cr1,
            0x04 | 0x08 | 0x14 => 0,
            0x0c => self.dier,
            0x10 => self.sr,
            0x18 => self.ccmr[0],
            0x1c => self.ccmr[1],
            0x20 => self.ccer,
            0x24 => self.count(now),
            0x28 => self.prescaler,
            0x2c => self.reload,
            0x34..=0x40 if offset as usize / 4 - 13 < self.channels => self.compare[offset as usize / 4 - 13],
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    /// Writes the register at `offset`.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: u64) -> Result<(), Refusal> {
        self.advance(now);
        let written = self.store(offset, value, now);
        self.due = self.next_flag();
        written
    }

    fn store(&mut self, offset: u32, value: u32, now: u64) -> Result<(), Refusal> {
        match offset {
            0x00 => {
                only("CR1", value, 0x87)?;
                if (self.cr1 ^ value) & 1 != 0 {
                    let count = self.count(now);
                    self.restart(now, count);
                }
                self.cr1 = value;
            }
            0x04 => only("CR2", value, 0)?,
            0x08 => only("SMCR", value, 0)?,
            0x0c => {
                only("DIER", value, (2 << self.channels) - 1)?;
                self.dier = value;
            }
            0x10 => self.sr &= value,
            0x14 => {
                only("EGR", value, 1)?;
                if value & 1 != 0 && self.cr1 & UPDATE_DISABLE == 0 {
                    self.load();
                    self.restart(now, 0);
                    if self.cr1 & UPDATE_REQUEST_SOURCE == 0 {
                        self.sr |= 1;
                    }
                }
            }
            0x18 | 0x1c if self.channels > 0 => {
                if value & 0x0303 != 0 {
                    return Err(Refusal::because("CCMR: input capture is not modelled"));
                }
                self.ccmr[(offset as usize - 0x18) / 4] = value;
            }
            0x20 if self.channels > 0 => only("CCER (outputs)", value, 0)?,
            0x24 => self.restart(now, value & self.largest),
            0x28 => self.prescaler = value & 0xffff,
            0x2c => {
                self.reload = value & self.largest;
                if self.cr1 & AUTO_RELOAD_PRELOAD == 0 {
                    let count = self.count(now);
                    if self.runs() && count > self.reload {
                        return Err(Refusal::because("ARR below the running count is not modelled"));
                    }
                    self.reload_active = self.reload;
                    if self.runs() {
                        // Keep the phase inside the prescaler: whole ticks only move the start.
                        let at = self.cycle_of(self.total(now));
                        self.restart(at, count);
                    } else {
                        self.restart(now, count);
                    }
                }
            }
            0x34..=0x40 if offset as usize / 4 - 13 < self.channels => {
                self.compare[offset as usize / 4 - 13] = value & self.largest;
            }
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn started(prescaler: u32, reload: u32, at: u64) -> Timer {
        let mut timer = Timer::new(50, 4, 32);
        timer.write(0x28, prescaler, at).expect("PSC");
        timer.write(0x2c, reload, at).expect("ARR");
        timer.write(0x00, 4, at).expect("CR1 URS");
        timer.write(0x14, 1, at).expect("EGR");
        timer.write(0x00, 1, at).expect("CR1 CEN");
        timer
    }

    /// PSC 169, ARR 0xffff at 170 MHz: one count each 170 cycles, half-way flag at 0x8000, overflow at 0x10000.
    #[test]
    fn the_time_driver_s_timer_flags_half_way_and_overflow() {
        let mut timer = started(169, 0xffff, 1000);
        timer.write(0x34, 0x8000, 1000).expect("CCR1");
        timer.write(0x0c, 3, 1000).expect("DIER");
        assert_eq!(timer.read(0x24, 1000 + 170 * 5 + 169), Ok(5));
        assert_eq!(timer.next_event(), 1000 + 170 * 0x8000);
        assert_eq!(timer.read(0x10, 1000 + 170 * 0x8000 - 1), Ok(0));
        assert_eq!(timer.read(0x10, 1000 + 170 * 0x8000), Ok(2));
        timer.write(0x10, !2, 1000 + 170 * 0x8000).expect("SR");
        assert_eq!(timer.next_event(), 1000 + 170 * 0x1_0000);
        assert_eq!(timer.read(0x10, 1000 + 170 * 0x1_0000).map(|sr| sr & 3), Ok(1));
        assert_eq!(timer.read(0x24, 1000 + 170 * 0x1_0003), Ok(3));
    }

    #[test]
    fn a_compare_that_was_passed_waits_for_the_next_round() {
        let mut timer = started(0, 99, 0);
        timer.write(0x0c, 4, 40).expect("DIER");
        timer.write(0x38, 30, 40).expect("CCR2");
        timer.write(0x10, 0, 40).expect("SR");
        assert_eq!(timer.next_event(), 130);
        timer.write(0x38, 41, 40).expect("CCR2");
        assert_eq!(timer.next_event(), 41);
    }

    #[test]
    fn a_new_prescaler_waits_for_the_update() {
        let mut timer = started(0, 9, 0);
        timer.write(0x28, 3, 5).expect("PSC");
        // 10 cycles to the overflow, then 4 cycles a count.
        assert_eq!(timer.read(0x24, 10 + 4 * 3), Ok(3));
        assert_eq!(timer.read(0x28, 22), Ok(3));
    }

    #[test]
    fn what_is_not_modelled_is_refused() {
        let mut timer = Timer::new(54, 0, 16);
        assert!(timer.write(0x00, 8, 0).is_err(), "one pulse");
        assert!(timer.write(0x0c, 0x100, 0).is_err(), "DMA request");
        assert!(timer.write(0x34, 0, 0).is_err(), "a basic timer has no compare");
        assert!(timer.read(0x44, 0).is_err());
    }
}
