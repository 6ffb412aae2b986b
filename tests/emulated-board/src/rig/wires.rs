//! What a test does to the wires of the tension channels and of the current channel.

use std::collections::VecDeque;

use crate::faults::Rail;

/// What a test does to one tension channel.
#[derive(Debug, Clone)]
pub(super) struct TensionFault {
    pub(super) wire: Option<Rail>,
    pub(super) offset_n: f64,
    pub(super) gain: f64,
    pub(super) stuck_v: Option<f64>,
    /// Channel whose sensor is plugged in here instead.
    pub(super) plugged_in: Option<usize>,
    pub(super) noise_n: f64,
    pub(super) late: Option<Late>,
}

/// A reading that comes late.
#[derive(Debug, Clone, Default)]
pub(super) struct Late {
    pub(super) delay_s: f64,
    /// Times \[s\] and readings \[N\], the oldest first; the first one is the present reading.
    pub(super) readings: VecDeque<(f64, f64)>,
}

impl Late {
    /// Takes a new reading in and gives the late one.
    pub(super) fn pass(&mut self, at_s: f64, reading: f64) -> f64 {
        self.readings.push_back((at_s, reading));
        while self.readings.get(1).is_some_and(|(then_s, _)| *then_s <= at_s - self.delay_s) {
            self.readings.pop_front();
        }
        self.readings.front().map_or(reading, |(_, then)| *then)
    }
}

/// What a test does to the current channel.
#[derive(Debug, Clone)]
pub(super) struct CurrentFault {
    pub(super) offset_a: f64,
    pub(super) gain: f64,
    pub(super) noise_a: f64,
    pub(super) wire: Option<Rail>,
    pub(super) stuck_v: Option<f64>,
}

impl Default for CurrentFault {
    fn default() -> Self {
        Self { offset_a: 0.0, gain: 1.0, noise_a: 0.0, wire: None, stuck_v: None }
    }
}

impl Default for TensionFault {
    fn default() -> Self {
        Self {
            wire: None,
            offset_n: 0.0,
            gain: 1.0,
            stuck_v: None,
            plugged_in: None,
            noise_n: 0.0,
            late: None,
        }
    }
}
