//! Gathers samples of consecutive ticks into batches.

use bowden_link::{Batch, RawBatch, RawTick, Sample};

/// Gathers samples; a gap between two ticks closes the batch before it, so that every batch is gapless.
#[derive(Debug, Default)]
pub struct Batcher {
    batch: Batch,
}

impl Batcher {
    /// Adds the sample of `tick`; gives the batch that is complete, if this completes one.
    ///
    /// `period_ns` and `lost` describe the board at this moment.
    pub fn push(&mut self, tick: u32, sample: Sample, period_ns: u32, lost: u32) -> Option<Batch> {
        let follows = self.batch.first_tick.wrapping_add(self.batch.samples.len() as u32) == tick;
        let fits = follows && self.batch.period_ns == period_ns && !self.batch.samples.is_full();
        let closed = if self.batch.samples.is_empty() || fits { None } else { self.take() };
        if self.batch.samples.is_empty() {
            self.batch.first_tick = tick;
            self.batch.period_ns = period_ns;
        }
        self.batch.lost = lost;
        // There is room: a full batch was closed above.
        let _ = self.batch.samples.push(sample);
        closed.or_else(|| if self.batch.samples.is_full() { self.take() } else { None })
    }

    /// What is gathered so far, if anything.
    pub fn take(&mut self) -> Option<Batch> {
        if self.batch.samples.is_empty() { None } else { Some(core::mem::take(&mut self.batch)) }
    }
}

/// The same for complete ticks.
#[derive(Debug, Default)]
pub struct RawBatcher {
    batch: RawBatch,
}

impl RawBatcher {
    /// As [`Batcher::push`].
    pub fn push(&mut self, tick: u32, complete: RawTick, period_ns: u32, lost: u32) -> Option<RawBatch> {
        let follows = self.batch.first_tick.wrapping_add(self.batch.ticks.len() as u32) == tick;
        let fits = follows && self.batch.period_ns == period_ns && !self.batch.ticks.is_full();
        let closed = if self.batch.ticks.is_empty() || fits { None } else { self.take() };
        if self.batch.ticks.is_empty() {
            self.batch.first_tick = tick;
            self.batch.period_ns = period_ns;
        }
        self.batch.lost = lost;
        // There is room: a full batch was closed above.
        let _ = self.batch.ticks.push(complete);
        closed.or_else(|| if self.batch.ticks.is_full() { self.take() } else { None })
    }

    /// What is gathered so far, if anything.
    pub fn take(&mut self) -> Option<RawBatch> {
        if self.batch.ticks.is_empty() { None } else { Some(core::mem::take(&mut self.batch)) }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::vec::Vec;

    use bowden_link::sample::BATCH_LENGTH;

    use super::*;

    fn ticks(batches: &[Batch]) -> Vec<(u32, usize)> {
        batches.iter().map(|batch| (batch.first_tick, batch.samples.len())).collect()
    }

    #[test]
    fn batches_are_full_and_gapless() {
        let mut batcher = Batcher::default();
        let mut batches = Vec::new();
        for tick in (0..30).chain(33..40) {
            batches.extend(batcher.push(tick, Sample::default(), 100_000, 0));
        }
        batches.extend(batcher.take());
        assert_eq!(BATCH_LENGTH, 24);
        assert_eq!(ticks(&batches), [(0, 24), (24, 6), (33, 7)]);
    }

    #[test]
    fn a_new_period_starts_a_new_batch() {
        let mut batcher = Batcher::default();
        assert_eq!(batcher.push(7, Sample::default(), 100_000, 0), None);
        let closed = batcher.push(8, Sample::default(), 50_000, 2).unwrap();
        assert_eq!(
            (closed.first_tick, closed.samples.len(), closed.period_ns, closed.lost),
            (7, 1, 100_000, 0)
        );
        let rest = batcher.take().unwrap();
        assert_eq!((rest.first_tick, rest.period_ns, rest.lost), (8, 50_000, 2));
    }

    #[test]
    fn the_count_of_ticks_may_wrap() {
        let mut batcher = Batcher::default();
        for tick in [u32::MAX, 0, 1] {
            assert_eq!(batcher.push(tick, Sample::default(), 100_000, 0), None);
        }
        assert_eq!(ticks(&[batcher.take().unwrap()]), [(u32::MAX, 3)]);
    }
}
