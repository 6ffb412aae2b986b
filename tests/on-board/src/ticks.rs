//! Control ticks by the edges of their marker pin.

use std::collections::VecDeque;

use bowden_board::{Board, Edge, TICK_MARKER};

/// Cycles of the core clock in a microsecond.
pub const CYCLES_PER_US: f64 = 170.0;

/// Beginnings that are kept.
const KEPT: usize = 20_000;

/// Smallest, largest and sum of a duration in cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Range {
    /// Smallest.
    pub min: u64,
    /// Largest.
    pub max: u64,
    sum: u64,
    count: u64,
}

impl Range {
    const NOTHING: Self = Self { min: u64::MAX, max: 0, sum: 0, count: 0 };

    fn add(&mut self, value: u64) {
        (self.min, self.max) = (self.min.min(value), self.max.max(value));
        self.sum += value;
        self.count += 1;
    }

    /// Largest minus smallest, 0 if there is nothing.
    pub fn spread(&self) -> u64 {
        self.max.saturating_sub(self.min)
    }

    /// Mean, 0 if there is nothing.
    pub fn mean(&self) -> f64 {
        self.sum as f64 / self.count.max(1) as f64
    }
}

/// Ticks of one run of the firmware, counted from its boot as the firmware counts them.
#[derive(Debug)]
pub struct Ticks {
    boots: u64,
    /// Ticks that have begun.
    pub begun: u32,
    /// Beginnings of the last ticks \[s\], the newest last.
    beginnings_s: VecDeque<f64>,
    last_rise: Option<Edge>,
    /// Cycles of the longest tick since boot.
    pub longest: u64,
    /// Cycles from one beginning to the next, since [`Self::measure_anew`].
    pub period: Range,
    /// Cycles from a beginning to its end, since [`Self::measure_anew`].
    pub busy: Range,
}

impl Default for Ticks {
    fn default() -> Self {
        Self {
            boots: 0,
            begun: 0,
            beginnings_s: VecDeque::new(),
            last_rise: None,
            longest: 0,
            period: Range::NOTHING,
            busy: Range::NOTHING,
        }
    }
}

impl Ticks {
    /// Takes in what the marker did since the last call; nothing of it if there was a reset since then.
    pub fn follow(&mut self, board: &mut Board) {
        let boots = board.counters().boots;
        if boots != self.boots {
            *self = Self { boots, ..Self::default() };
            // Those of the run before; the first tick of this one comes milliseconds behind the reset.
            board.take_edges(TICK_MARKER);
        }
        for edge in board.take_edges(TICK_MARKER) {
            match (edge.high, self.last_rise) {
                (true, before) => {
                    if let Some(before) = before {
                        self.period.add(edge.cycle - before.cycle);
                    }
                    self.last_rise = Some(edge);
                    self.begun += 1;
                    self.beginnings_s.push_back(edge.at_s);
                    if self.beginnings_s.len() > KEPT {
                        self.beginnings_s.pop_front();
                    }
                }
                (false, Some(rise)) => {
                    let cycles = edge.cycle - rise.cycle;
                    self.busy.add(cycles);
                    self.longest = self.longest.max(cycles);
                }
                (false, None) => {}
            }
        }
    }

    /// Board time at which `tick` began \[s\]; `None` if it has not, or too long ago.
    pub fn beginning_s(&self, tick: u32) -> Option<f64> {
        let back = self.begun.checked_sub(tick)? as usize;
        self.beginnings_s.get(self.beginnings_s.len().checked_sub(back)?).copied()
    }

    /// Starts period and length anew.
    pub fn measure_anew(&mut self) {
        (self.period, self.busy) = (Range::NOTHING, Range::NOTHING);
    }
}
