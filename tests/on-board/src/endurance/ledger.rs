//! Every tick accounted for: what one side handed on and the other side received, compared.

use bowden_link::Sample;

/// Samples in their order: how many, from which tick to which, whether any is missing between them, and a digest of their content.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Ledger {
    /// First tick.
    pub first_tick: Option<u32>,
    /// Tick behind the last one.
    pub next_tick: u32,
    /// Samples.
    pub count: u64,
    /// Samples whose tick was not the one behind the tick before, modulo 2³².
    pub out_of_order: u64,
    digest: u64,
}

impl Ledger {
    /// Takes the sample of `tick`.
    pub fn take(&mut self, tick: u32, sample: &Sample) {
        if self.first_tick.is_none() {
            self.first_tick = Some(tick);
        } else if tick != self.next_tick {
            self.out_of_order += 1;
        }
        self.next_tick = tick.wrapping_add(1);
        self.count += 1;
        let Sample { encoder_count_raw, tension_raw, reference_raw, command_raw, .. } = *sample;
        let pair = |a: i32, b: i32| u64::from(a.cast_unsigned()) << 32 | u64::from(b.cast_unsigned());
        let [f1, f2, f3, f4] = tension_raw.map(u64::from);
        let [current, bus, duty] =
            [sample.current_raw, sample.bus_raw, sample.duty_raw.cast_unsigned()].map(u64::from);
        let supply = current | bus << 16 | duty << 32;
        for word in [
            u64::from(tick),
            pair(encoder_count_raw[0], encoder_count_raw[1]),
            f1 | f2 << 16 | f3 << 32 | f4 << 48,
            pair(reference_raw, command_raw),
            supply | u64::from(sample.limits.0) << 48,
            sample.state as u64,
        ] {
            // FNV-1a by words: the order counts, and one bit that differs changes the rest.
            self.digest = (self.digest ^ word).wrapping_mul(0x0000_0100_0000_01b3).rotate_left(29);
        }
    }

    /// Whether the content of all samples is the same.
    pub fn is_same_content(&self, other: &Self) -> bool {
        self.digest == other.digest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_that_is_missing_or_changed_is_noticed() {
        let sample = |n: u32| Sample { duty_raw: n as i16, ..Sample::default() };
        let ledger = |ticks: &[u32]| {
            let mut ledger = Ledger::default();
            for tick in ticks {
                ledger.take(*tick, &sample(*tick));
            }
            ledger
        };
        // The count of ticks wraps.
        let whole = ledger(&[u32::MAX - 1, u32::MAX, 0, 1]);
        assert_eq!((whole.first_tick, whole.next_tick, whole.count), (Some(u32::MAX - 1), 2, 4));
        assert_eq!(whole.out_of_order, 0);
        let short = ledger(&[u32::MAX - 1, u32::MAX, 1]);
        assert_eq!((short.count, short.out_of_order), (3, 1));
        assert!(!short.is_same_content(&whole));
        let mut changed = ledger(&[u32::MAX - 1, u32::MAX, 0]);
        changed.take(1, &sample(2));
        assert!(!changed.is_same_content(&whole));
        assert!(ledger(&[u32::MAX - 1, u32::MAX, 0, 1]).is_same_content(&whole));
    }
}
