//! How the link does: rates over the last second, and what was lost since the beginning.

use std::time::{Duration, Instant};

use bowden_host_link::Losses;
use bowden_host_link::hub::Live;

/// Time over which rates are counted.
const INTERVAL: Duration = Duration::from_secs(1);

/// Figures of the link.
#[derive(Clone, Debug)]
pub struct Health {
    /// Samples a second.
    pub samples_per_s: f64,
    /// Bytes a second.
    pub bytes_per_s: f64,
    /// What was lost since the greeting.
    pub losses: Losses,
    begun: Instant,
    samples: u64,
    bytes: Option<u64>,
    heard_bytes: u64,
}

impl Health {
    /// Begins to count.
    pub fn new() -> Self {
        Self {
            samples_per_s: 0.0,
            bytes_per_s: 0.0,
            losses: Losses::default(),
            begun: Instant::now(),
            samples: 0,
            bytes: None,
            heard_bytes: 0,
        }
    }

    /// Counts a batch.
    pub fn take(&mut self, live: &Live) {
        self.samples += live.telemetry.batch.samples.len() as u64;
        self.losses = live.losses;
        self.heard_bytes = live.heard_bytes;
        self.bytes.get_or_insert(live.heard_bytes);
    }

    /// Makes rates of the counts, once a second.
    pub fn look(&mut self) {
        let elapsed = self.begun.elapsed();
        if elapsed < INTERVAL {
            return;
        }
        let bytes = self.bytes.map_or(0, |bytes| self.heard_bytes - bytes);
        self.samples_per_s = self.samples as f64 / elapsed.as_secs_f64();
        self.bytes_per_s = bytes as f64 / elapsed.as_secs_f64();
        self.begun = Instant::now();
        self.samples = 0;
        self.bytes = Some(self.heard_bytes);
    }
}

impl Default for Health {
    fn default() -> Self {
        Self::new()
    }
}
