//! Ring of the last control ticks, kept through a reset.
//!
//! Words are atomic so that a thread may read while the tick, which no thread can interrupt, writes. In RAM that is not
//! cleared at start the ring survives a reset of the processor; [`Snapshot::is_plausible`] tells a ring from the noise that
//! such RAM holds after power-on: magic word, counters in range, and consecutive ticks in all entries. Noise passes
//! with a probability below 2⁻³².

use core::sync::atomic::{AtomicU32, Ordering};

use bowden_link::{Limits, Sample, State};

/// Samples that the ring holds.
pub const LENGTH: usize = 64;

/// Words of an entry: tick and sample.
const WORDS: usize = 10;

const MAGIC: u32 = 0xb0bd_e401;

/// The ring. All bit patterns are valid memory, so it may be placed in RAM that nobody cleared.
#[derive(Debug)]
pub struct Snapshot {
    magic: AtomicU32,
    /// Entry that is written next.
    next: AtomicU32,
    length: AtomicU32,
    frozen: AtomicU32,
    entries: [[AtomicU32; WORDS]; LENGTH],
}

impl Default for Snapshot {
    fn default() -> Self {
        Self::new()
    }
}

impl Snapshot {
    /// An empty ring.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            magic: AtomicU32::new(MAGIC),
            next: AtomicU32::new(0),
            length: AtomicU32::new(0),
            frozen: AtomicU32::new(0),
            entries: [const { [const { AtomicU32::new(0) }; WORDS] }; LENGTH],
        }
    }

    /// Empties the ring; the first thing to do where it is not plausible.
    pub fn clear(&self) {
        for word in [&self.next, &self.length, &self.frozen] {
            word.store(0, Ordering::Relaxed);
        }
        self.magic.store(MAGIC, Ordering::Release);
    }

    /// Appends a tick; does nothing while frozen. For the tick only: there is one writer.
    pub fn push(&self, tick: u32, sample: &Sample) {
        if self.frozen.load(Ordering::Relaxed) != 0 {
            return;
        }
        let next = self.next.load(Ordering::Relaxed) as usize % LENGTH;
        for (place, word) in self.entries[next].iter().zip(packed(tick, sample)) {
            place.store(word, Ordering::Relaxed);
        }
        let length = self.length.load(Ordering::Relaxed);
        self.next.store(((next + 1) % LENGTH) as u32, Ordering::Release);
        self.length.store((length + 1).min(LENGTH as u32), Ordering::Release);
    }

    /// Keeps what is there.
    pub fn freeze(&self) {
        self.frozen.store(1, Ordering::Release);
    }

    /// Goes on recording.
    pub fn thaw(&self) {
        self.frozen.store(0, Ordering::Release);
    }

    /// Whether nothing is appended.
    #[must_use]
    pub fn is_frozen(&self) -> bool {
        self.frozen.load(Ordering::Acquire) != 0
    }

    /// Samples that it holds, 0 to 64.
    #[must_use]
    pub fn len(&self) -> usize {
        (self.length.load(Ordering::Acquire) as usize).min(LENGTH)
    }

    /// Whether it holds none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sample `index`, 0 the oldest, with its tick; `None` beyond the end, or if it was overwritten while being read.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<(u32, Sample)> {
        let length = self.len();
        if index >= length {
            return None;
        }
        let next = self.next.load(Ordering::Acquire);
        let at = (next as usize + 2 * LENGTH - length + index) % LENGTH;
        let mut words = [0; WORDS];
        for (word, place) in words.iter_mut().zip(&self.entries[at]) {
            *word = place.load(Ordering::Acquire);
        }
        (self.next.load(Ordering::Acquire) == next).then(|| unpacked(&words)).flatten()
    }

    /// Whether this memory holds a ring that an earlier run wrote.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        let in_range = |word: &AtomicU32, below: usize| (word.load(Ordering::Acquire) as usize) < below;
        if self.magic.load(Ordering::Acquire) != MAGIC
            || !in_range(&self.next, LENGTH)
            || !in_range(&self.length, LENGTH + 1)
            || !in_range(&self.frozen, 2)
        {
            return false;
        }
        let first = self.get(0).map(|(tick, _)| tick);
        (0..self.len()).all(|index| match (first, self.get(index)) {
            (Some(first), Some((tick, _))) => tick == first.wrapping_add(index as u32),
            _ => false,
        })
    }
}

/// Two half words, the first one low.
const fn pair(low: u16, high: u16) -> u32 {
    low as u32 | (high as u32) << 16
}

fn packed(tick: u32, sample: &Sample) -> [u32; WORDS] {
    let [f1, f2, f3, f4] = sample.tension_raw;
    [
        tick,
        sample.encoder_count_raw[0].cast_unsigned(),
        sample.encoder_count_raw[1].cast_unsigned(),
        pair(f1, f2),
        pair(f3, f4),
        pair(sample.current_raw, sample.bus_raw),
        pair(sample.duty_raw.cast_unsigned(), sample.limits.0),
        sample.reference_raw.cast_unsigned(),
        sample.command_raw.cast_unsigned(),
        sample.state as u32,
    ]
}

/// `None` if the state has no such number.
fn unpacked(words: &[u32; WORDS]) -> Option<(u32, Sample)> {
    let [tick, input, joint, f12, f34, supply, duty_limits, reference, command, state] = *words;
    let halves = |word: u32| [word as u16, (word >> 16) as u16];
    let ([f1, f2], [f3, f4]) = (halves(f12), halves(f34));
    let ([current_raw, bus_raw], [duty, limits]) = (halves(supply), halves(duty_limits));
    let sample = Sample {
        encoder_count_raw: [input.cast_signed(), joint.cast_signed()],
        tension_raw: [f1, f2, f3, f4],
        current_raw,
        bus_raw,
        duty_raw: duty.cast_signed(),
        reference_raw: reference.cast_signed(),
        command_raw: command.cast_signed(),
        state: State::from_number(u8::try_from(state).ok()?)?,
        limits: Limits(limits),
    };
    Some((tick, sample))
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::boxed::Box;

    use super::*;

    /// A sample in which every field depends on the tick.
    fn sample(tick: u32) -> Sample {
        let signed = tick.cast_signed();
        Sample {
            encoder_count_raw: [signed.wrapping_mul(77), !signed],
            tension_raw: [tick as u16, !tick as u16, 3, 4095],
            current_raw: 2047 ^ tick as u16,
            bus_raw: 65_535,
            duty_raw: (tick as u16).cast_signed().wrapping_neg(),
            reference_raw: i32::MIN ^ signed,
            command_raw: signed.wrapping_neg(),
            state: State::from_number((tick % 7) as u8).unwrap_or_default(),
            limits: Limits(tick as u16 & 0x1ff),
        }
    }

    #[test]
    fn the_last_ticks_come_back_whole() {
        let ring = Snapshot::new();
        assert!(ring.is_empty() && ring.get(0).is_none() && ring.is_plausible());
        for tick in 1000..1010 {
            ring.push(tick, &sample(tick));
        }
        assert_eq!(ring.len(), 10);
        assert_eq!(ring.get(9), Some((1009, sample(1009))));
        for tick in 1010..1200 {
            ring.push(tick, &sample(tick));
        }
        assert_eq!(ring.len(), 64);
        for index in 0..64 {
            let tick = 1136 + index as u32;
            assert_eq!(ring.get(index), Some((tick, sample(tick))));
        }
        assert_eq!(ring.get(64), None);
    }

    #[test]
    fn frozen_means_unchanged() {
        let ring = Snapshot::new();
        ring.push(1, &sample(1));
        ring.freeze();
        ring.push(2, &sample(2));
        assert_eq!((ring.len(), ring.is_frozen()), (1, true));
        ring.thaw();
        ring.push(2, &sample(2));
        assert_eq!(ring.get(1), Some((2, sample(2))));
    }

    #[test]
    fn noise_is_not_taken_for_a_ring() {
        let filled = || {
            let ring = Box::new(Snapshot::new());
            for tick in 0xffff_fff0..=u32::MAX {
                ring.push(tick, &sample(tick));
            }
            // The count of ticks may wrap.
            ring.push(0, &sample(0));
            ring
        };
        assert!(filled().is_plausible());
        let spoilt: [fn(&Snapshot); 6] = [
            |ring| ring.magic.store(0, Ordering::Relaxed),
            |ring| ring.next.store(64, Ordering::Relaxed),
            |ring| ring.length.store(65, Ordering::Relaxed),
            |ring| ring.frozen.store(2, Ordering::Relaxed),
            |ring| ring.entries[3][0].store(5, Ordering::Relaxed),
            |ring| ring.entries[4][WORDS - 1].store(9, Ordering::Relaxed),
        ];
        for (n, spoil) in spoilt.into_iter().enumerate() {
            let ring = filled();
            spoil(&ring);
            assert!(!ring.is_plausible(), "spoilt {n}");
            ring.clear();
            assert!(ring.is_plausible() && ring.is_empty(), "cleared {n}");
        }
    }
}
