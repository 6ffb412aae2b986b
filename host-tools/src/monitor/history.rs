//! The last seconds of all signals: smallest and largest value in each of a fixed number of time slots.

use std::collections::VecDeque;

use super::signals::{Reading, Signal};

/// Slots of the whole history: two for each dot of a panel 100 characters wide.
const SLOTS: u64 = 400;

/// History of all signals; its memory does not grow.
#[derive(Clone, Debug)]
pub struct History {
    length_s: f64,
    period_ns: u32,
    slot_ticks: u64,
    slots: VecDeque<Slot>,
}

#[derive(Clone, Copy, Debug)]
struct Slot {
    number: u64,
    low: Reading,
    high: Reading,
}

/// Points of a signal, s before now and value, one list for each stretch without a gap.
pub type Stretches = Vec<Vec<(f64, f64)>>;

impl History {
    /// A history of so many seconds.
    pub fn new(length_s: f64) -> Self {
        Self { length_s, period_ns: 0, slot_ticks: 1, slots: VecDeque::new() }
    }

    /// Its length, s.
    pub fn length_s(&self) -> f64 {
        self.length_s
    }

    /// Takes the values at a tick. Another control period or an earlier tick begins anew.
    pub fn push(&mut self, tick: u64, period_ns: u32, reading: &Reading) {
        if period_ns != self.period_ns {
            self.period_ns = period_ns;
            let slot_ns = self.length_s * 1e9 / SLOTS as f64;
            self.slot_ticks = ((slot_ns / f64::from(period_ns.max(1))) as u64).max(1);
            self.slots.clear();
        }
        let number = tick / self.slot_ticks;
        match self.slots.back_mut() {
            Some(slot) if slot.number == number => {
                for ((low, high), value) in slot.low.iter_mut().zip(&mut slot.high).zip(reading) {
                    *low = low.min(*value);
                    *high = high.max(*value);
                }
                return;
            }
            Some(slot) if slot.number > number => self.slots.clear(),
            _ => {}
        }
        self.slots.push_back(Slot { number, low: *reading, high: *reading });
        while self.slots.front().is_some_and(|slot| slot.number + SLOTS < number) {
            self.slots.pop_front();
        }
    }

    /// A signal over time, s, up to now at 0.
    pub fn stretches(&self, signal: Signal) -> Stretches {
        let Some(last) = self.slots.back() else { return Vec::new() };
        let slot_s = self.slot_ticks as f64 * f64::from(self.period_ns) * 1e-9;
        let mut stretches: Stretches = Vec::new();
        let mut before = None;
        for slot in &self.slots {
            let (low, high) = (slot.low[signal as usize], slot.high[signal as usize]);
            if low.is_nan() {
                continue;
            }
            if before != Some(slot.number.wrapping_sub(1)) {
                stretches.push(Vec::new());
            }
            before = Some(slot.number);
            let at_s = -((last.number - slot.number) as f64 * slot_s);
            if let Some(stretch) = stretches.last_mut() {
                stretch.push((at_s, low.into()));
                if high > low {
                    stretch.push((at_s, high.into()));
                }
            }
        }
        stretches
    }
}

#[cfg(test)]
mod tests {
    use super::super::signals::SIGNALS;
    use super::*;

    fn reading(value: f32) -> Reading {
        [value; SIGNALS]
    }

    #[test]
    fn a_peak_of_one_tick_is_kept_and_a_gap_is_no_line() {
        // 4 s in 400 slots of 100 ticks each.
        let mut history = History::new(4.0);
        for tick in (0..10_000).filter(|tick| !(3000..5000).contains(tick)) {
            history.push(tick, 100_000, &reading(if tick == 7777 { 9.0 } else { 1.0 }));
        }
        let stretches = history.stretches(Signal::F2);
        assert_eq!(stretches.len(), 2);
        assert_eq!(stretches[0].len(), 30);
        // 50 slots, and one point more where smallest and largest differ.
        assert_eq!(stretches[1].len(), 51);
        let peak = stretches[1].iter().find(|(_, value)| *value == 9.0).unwrap();
        // Slot 77 of 99, 10 ms each.
        assert!((peak.0 + 0.22).abs() < 1e-9, "{peak:?}");
    }

    #[test]
    fn what_is_older_than_the_history_goes() {
        let mut history = History::new(1.0);
        for tick in 0..50_000 {
            history.push(tick, 100_000, &reading(tick as f32));
        }
        let stretch = &history.stretches(Signal::Duty)[0];
        assert!((stretch[0].0 + 1.0).abs() < 0.01, "{:?}", stretch[0]);
        assert!(history.slots.len() <= 401);
        // A board that started again begins a history of its own.
        history.push(3, 100_000, &reading(0.0));
        assert_eq!(history.stretches(Signal::Duty), [[(0.0, 0.0)]]);
    }

    #[test]
    fn a_signal_that_is_no_number_has_no_points() {
        let mut history = History::new(1.0);
        let mut values = reading(2.0);
        values[Signal::TorqueRef as usize] = f32::NAN;
        history.push(0, 100_000, &values);
        assert!(history.stretches(Signal::TorqueRef).is_empty());
        assert_eq!(history.stretches(Signal::ThetaIn).len(), 1);
    }
}
