//! The basic and general-purpose timers together.

use super::NEVER;
use super::timer::Timer;
use crate::error::Refusal;

/// Timers with what the core asks for far more often than it changes.
#[derive(Debug, Clone)]
pub(crate) struct Timers {
    each: Vec<Timer>,
    next_event: u64,
    lines: u128,
}

impl Timers {
    /// All of them behind a reset.
    pub(crate) fn new(each: Vec<Timer>) -> Self {
        let mut timers = Self { each, next_event: NEVER, lines: 0 };
        timers.follow();
        timers
    }

    fn follow(&mut self) {
        self.next_event = self.each.iter().map(Timer::next_event).min().unwrap_or(NEVER);
        self.lines =
            self.each.iter().fold(0, |lines, timer| lines | u128::from(timer.line()) << timer.interrupt);
    }

    /// Resets all of them.
    pub(crate) fn reset_all(&mut self) {
        self.each.iter_mut().for_each(Timer::reset);
        self.follow();
    }

    /// Resets timer `index`.
    pub(crate) fn reset(&mut self, index: usize) {
        self.each[index].reset();
        self.follow();
    }

    /// Cycle of the next flag that raises an interrupt.
    pub(crate) fn next_event(&self) -> u64 {
        self.next_event
    }

    /// Interrupt lines that are high, bit n for interrupt n.
    pub(crate) fn lines(&self) -> u128 {
        self.lines
    }

    /// Brings those that are due up to `at`.
    pub(crate) fn advance(&mut self, at: u64) {
        if self.next_event > at {
            return;
        }
        for timer in self.each.iter_mut().filter(|timer| timer.next_event() <= at) {
            timer.advance(at);
        }
        self.follow();
    }

    /// Value of the register at `offset` of timer `index`.
    pub(crate) fn read(&mut self, index: usize, offset: u32, now: u64) -> Result<u32, Refusal> {
        let read = self.each[index].read(offset, now);
        self.follow();
        read
    }

    /// Writes the register at `offset` of timer `index`.
    pub(crate) fn write(&mut self, index: usize, offset: u32, value: u32, now: u64) -> Result<(), Refusal> {
        let written = self.each[index].write(offset, value, now);
        self.follow();
        written
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two timers of one count a cycle whose update raises interrupts 54 and 55, each asked alone beside.
    #[test]
    fn lines_and_next_event_are_those_of_the_timers_one_by_one() {
        let alone = || vec![Timer::new(54, 0, 16), Timer::new(55, 0, 16)];
        let (mut timers, mut each) = (Timers::new(alone()), alone());
        assert_eq!((timers.next_event(), timers.lines()), (NEVER, 0));
        for (index, reload) in [(0, 99), (1, 49)] {
            for (offset, value) in [(0x2c, reload), (0x00, 4), (0x14, 1), (0x0c, 1), (0x00, 5)] {
                timers.write(index, offset, value, 0).expect("a register");
                each[index].write(offset, value, 0).expect("a register");
            }
        }
        for (at, lines) in [(49, 0), (50, 1_u128 << 55), (99, 1 << 55), (100, 1 << 54 | 1 << 55)] {
            timers.advance(at);
            for timer in &mut each {
                timer.advance(at);
            }
            assert_eq!(timers.lines(), lines, "{at}");
            let expected = each.iter().map(Timer::next_event).min();
            assert_eq!(Some(timers.next_event()), expected, "{at}");
        }
        timers.write(1, 0x10, 0, 120).expect("SR");
        assert_eq!((timers.lines(), timers.next_event()), (1 << 54, 150));
        timers.reset(0);
        assert_eq!((timers.lines(), timers.next_event()), (0, 150));
        timers.reset_all();
        assert_eq!((timers.lines(), timers.next_event()), (0, NEVER));
    }
}
