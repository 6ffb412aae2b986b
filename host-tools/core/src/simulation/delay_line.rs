//! A signal as it was a fixed time ago.

use std::collections::VecDeque;

/// Angle as it was a fixed time ago.
#[derive(Clone, Debug)]
pub(crate) struct DelayLine {
    delay_s: f64,
    history: VecDeque<(f64, f64)>,
    last: f64,
}

impl DelayLine {
    pub(crate) fn new(delay_s: f64, start: f64) -> Self {
        Self { delay_s, history: VecDeque::new(), last: start }
    }

    pub(crate) fn at(&mut self, t_s: f64, value: f64) -> f64 {
        if self.delay_s <= 0.0 {
            return value;
        }
        self.history.push_back((t_s, value));
        while let Some(&(then_s, old)) = self.history.front() {
            if then_s > t_s - self.delay_s {
                break;
            }
            self.last = old;
            self.history.pop_front();
        }
        self.last
    }
}
