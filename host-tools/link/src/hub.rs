//! Live samples for several readers: whoever owns the port publishes, each reader takes at its own pace.
//!
//! Every reader has a queue of its own. Where one falls behind by more than it asked room for, its oldest samples are dropped
//! and counted, for it alone: neither the owner of the port nor another reader waits.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use super::client::Telemetry;
use super::losses::Losses;

/// A batch of samples and how the link stands after it.
#[derive(Clone, Debug, PartialEq)]
pub struct Live {
    /// The samples.
    pub telemetry: Telemetry,
    /// What was lost since the greeting.
    pub losses: Losses,
    /// Bytes that came since the port was opened.
    pub heard_bytes: u64,
}

/// Where samples are published; clones are the same hub.
#[derive(Clone, Debug, Default)]
pub struct Hub(Arc<Mutex<Readers>>);

#[derive(Debug, Default)]
struct Readers {
    queues: Vec<Weak<Queue>>,
    closed: bool,
}

/// One reader of a hub.
#[derive(Debug)]
pub struct Reader(Arc<Queue>);

#[derive(Debug)]
struct Queue {
    waiting: Mutex<Waiting>,
    came: Condvar,
}

#[derive(Debug)]
struct Waiting {
    batches: VecDeque<Arc<Live>>,
    samples: usize,
    room: usize,
    lost: u64,
    closed: bool,
}

/// What a reader gets.
#[derive(Clone, Debug, PartialEq)]
pub enum Next {
    /// The oldest batch that it has not taken.
    Batch(Arc<Live>),
    /// Nothing came in time.
    Nothing,
    /// The owner of the port has ended, and everything before is taken.
    Ended,
}

impl Hub {
    /// Another reader, from the next batch on, with room for so many samples.
    #[must_use]
    pub fn subscribe(&self, room: usize) -> Reader {
        let mut readers = self.lock();
        let (batches, closed) = (VecDeque::new(), readers.closed);
        let waiting = Mutex::new(Waiting { batches, samples: 0, room, lost: 0, closed });
        let queue = Arc::new(Queue { waiting, came: Condvar::new() });
        readers.queues.push(Arc::downgrade(&queue));
        Reader(queue)
    }

    /// Hands a batch to every reader.
    pub fn publish(&self, live: Live) {
        let live = Arc::new(live);
        self.lock().queues.retain(|queue| {
            let Some(queue) = queue.upgrade() else { return false };
            queue.lock().push(&live);
            queue.came.notify_one();
            true
        });
    }

    /// Tells the readers that nothing comes any more.
    pub fn close(&self) {
        let mut readers = self.lock();
        readers.closed = true;
        for queue in readers.queues.iter().filter_map(Weak::upgrade) {
            queue.lock().closed = true;
            queue.came.notify_one();
        }
    }

    fn lock(&self) -> MutexGuard<'_, Readers> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Queue {
    // A reader that panicked while it held the lock has left counts that still fit: each change is one step.
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Waiting {
    fn push(&mut self, live: &Arc<Live>) {
        self.samples += live.telemetry.batch.samples.len();
        self.batches.push_back(Arc::clone(live));
        while self.samples > self.room {
            let Some(oldest) = self.batches.pop_front() else { break };
            let dropped = oldest.telemetry.batch.samples.len();
            self.samples -= dropped;
            self.lost += dropped as u64;
        }
    }
}

impl Reader {
    /// The next batch, waiting for it up to `timeout`.
    pub fn next(&self, timeout: Duration) -> Next {
        let begun = Instant::now();
        let mut waiting = self.0.lock();
        loop {
            if let Some(live) = waiting.batches.pop_front() {
                waiting.samples -= live.telemetry.batch.samples.len();
                return Next::Batch(live);
            }
            if waiting.closed {
                return Next::Ended;
            }
            let left = timeout.saturating_sub(begun.elapsed());
            if left.is_zero() {
                return Next::Nothing;
            }
            waiting = self.0.came.wait_timeout(waiting, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Samples that this reader has lost because it was too slow.
    pub fn lost(&self) -> u64 {
        self.0.lock().lost
    }
}

#[cfg(test)]
mod tests {
    use bowden_link::{Batch, Sample};

    use super::*;

    fn live(first_tick: u32) -> Live {
        let samples = std::iter::repeat_n(Sample::default(), 24).collect();
        let batch = Batch { first_tick, period_ns: 100_000, lost: 0, samples };
        let telemetry = Telemetry { first_tick: first_tick.into(), batch, given: Vec::new() };
        Live { telemetry, losses: Losses::default(), heard_bytes: 0 }
    }

    /// First ticks of what a reader gets without waiting.
    fn take_all(reader: &Reader) -> Vec<u64> {
        let next = || match reader.next(Duration::ZERO) {
            Next::Batch(live) => Some(live.telemetry.first_tick),
            Next::Nothing | Next::Ended => None,
        };
        std::iter::from_fn(next).collect()
    }

    #[test]
    fn a_slow_reader_loses_its_oldest_samples_and_nobody_elses() {
        let hub = Hub::default();
        let (slow, quick) = (hub.subscribe(50), hub.subscribe(50));
        let mut came = Vec::new();
        for first_tick in (0..240).step_by(24) {
            hub.publish(live(first_tick));
            came.extend(take_all(&quick));
        }
        assert_eq!(came, (0..240).step_by(24).collect::<Vec<u64>>());
        // Room for 50 samples is room for two batches.
        assert_eq!(take_all(&slow), [192, 216]);
        assert_eq!((slow.lost(), quick.lost()), (8 * 24, 0));
    }

    #[test]
    fn a_reader_begins_where_it_subscribes_and_takes_all_before_the_end() {
        let hub = Hub::default();
        hub.publish(live(0));
        let reader = hub.subscribe(1000);
        hub.publish(live(24));
        hub.close();
        assert_eq!(take_all(&reader), [24]);
        assert_eq!(reader.next(Duration::from_mins(10)), Next::Ended);
        assert_eq!(hub.subscribe(1000).next(Duration::from_mins(10)), Next::Ended);
        // A reader that has gone is no burden.
        drop(reader);
        hub.publish(live(48));
        assert_eq!(hub.lock().queues.len(), 0);
    }

    #[test]
    fn a_waiting_reader_is_woken() {
        let hub = Hub::default();
        let reader = hub.subscribe(1000);
        let waiting = std::thread::spawn(move || reader.next(Duration::from_mins(10)));
        hub.publish(live(7));
        assert!(matches!(waiting.join(), Ok(Next::Batch(live)) if live.telemetry.first_tick == 7));
    }
}
