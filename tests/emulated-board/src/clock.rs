//! Board time: cycles of HCLK to seconds across changes of its frequency.

/// Conversion between cycles and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Clock {
    hz: u64,
    since_cycle: u64,
    since_s: f64,
    /// Frequency before the last change, for what began then.
    before_hz: u64,
}

impl Clock {
    /// HCLK of `hz` from cycle 0.
    pub(crate) fn new(hz: u64) -> Self {
        Self { hz, since_cycle: 0, since_s: 0.0, before_hz: hz }
    }

    /// Frequency \[Hz\].
    pub(crate) fn hz(&self) -> u64 {
        self.hz
    }

    /// Changes the frequency at `cycle`.
    pub(crate) fn set_hz(&mut self, cycle: u64, hz: u64) {
        if hz != self.hz {
            *self = Self { hz, since_cycle: cycle, since_s: self.seconds(cycle), before_hz: self.hz };
        }
    }

    /// Board time at `cycle` \[s\].
    pub(crate) fn seconds(&self, cycle: u64) -> f64 {
        let hz = if cycle < self.since_cycle { self.before_hz } else { self.hz };
        self.since_s + (cycle as f64 - self.since_cycle as f64) / hz as f64
    }

    /// First cycle at or behind board time `seconds`.
    pub(crate) fn cycle_at(&self, seconds: f64) -> u64 {
        let ahead = ((seconds - self.since_s) * self.hz as f64).ceil();
        self.since_cycle + if ahead > 0.0 { ahead as u64 } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As of a transfer that was under way when the crystal stopped.
    #[test]
    fn what_began_before_a_change_has_the_time_of_that_clock() {
        let mut clock = Clock::new(170_000_000);
        clock.set_hz(170_000_000, 16_000_000);
        assert!((clock.seconds(170_000_000 - 1700) - (1.0 - 10e-6)).abs() < 1e-12);
        assert!((clock.seconds(170_000_000 + 160) - (1.0 + 10e-6)).abs() < 1e-12);
    }

    #[test]
    fn seconds_go_on_across_a_change() {
        let mut clock = Clock::new(16_000_000);
        clock.set_hz(16_000_000, 170_000_000);
        assert!((clock.seconds(16_000_000 + 17_000) - 1.0001).abs() < 1e-12);
        assert!(clock.cycle_at(1.0001).abs_diff(16_000_000 + 17_000) <= 1);
        assert_eq!(clock.cycle_at(0.5), 16_000_000, "the past is now");
    }
}
