//! Samples as they arrive, and what is missing among them.

use bowden_link::{Batch, Sample};

/// Samples of one run of the firmware.
#[derive(Debug, Default)]
pub struct Telemetry {
    samples: Vec<(u32, Sample)>,
    next_tick: Option<u32>,
    /// Samples that are missing between others.
    pub missing: u64,
    /// Batches that begin before the end of the one before.
    pub disordered: u64,
    /// Samples that the board says it lost, as of the last batch.
    pub lost: u32,
    /// Samples received.
    pub received: u64,
}

impl Telemetry {
    /// Takes a batch in.
    pub fn push(&mut self, batch: &Batch) {
        let ahead = self.next_tick.map_or(0, |next| batch.first_tick.wrapping_sub(next));
        if ahead > u32::MAX / 2 {
            self.disordered += 1;
        } else {
            self.missing += u64::from(ahead);
        }
        for (k, sample) in batch.samples.iter().enumerate() {
            self.samples.push((batch.first_tick.wrapping_add(k as u32), *sample));
        }
        self.next_tick = Some(batch.first_tick.wrapping_add(batch.samples.len() as u32));
        self.lost = batch.lost;
        self.received += batch.samples.len() as u64;
    }

    /// Tick behind the last sample, `None` before the first.
    pub fn next_tick(&self) -> Option<u32> {
        self.next_tick
    }

    /// Takes out the samples so far, each with its tick.
    pub fn take(&mut self) -> Vec<(u32, Sample)> {
        std::mem::take(&mut self.samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn batch(first_tick: u32, samples: usize) -> Batch {
        let mut batch = Batch { first_tick, period_ns: 100_000, lost: 3, ..Batch::default() };
        for _ in 0..samples {
            batch.samples.push(Sample::default()).expect("24 at most");
        }
        batch
    }

    #[test]
    fn gaps_are_counted() {
        let mut telemetry = Telemetry::default();
        for (first, length) in [(1000, 24), (1024, 7), (1040, 2)] {
            telemetry.push(&batch(first, length));
        }
        assert_eq!(
            (telemetry.missing, telemetry.disordered, telemetry.received, telemetry.lost),
            (9, 0, 33, 3)
        );
        let ticks: Vec<u32> = telemetry.take().iter().map(|(tick, _)| *tick).collect();
        assert_eq!((ticks[0], ticks[31], ticks[32]), (1000, 1040, 1041));
        telemetry.push(&batch(1000, 1));
        assert_eq!(telemetry.disordered, 1);
    }

    #[test]
    fn the_count_of_ticks_may_wrap() {
        let mut telemetry = Telemetry::default();
        telemetry.push(&batch(u32::MAX - 1, 2));
        telemetry.push(&batch(0, 1));
        assert_eq!((telemetry.missing, telemetry.disordered), (0, 0));
    }
}
