//! When tables and page are written anew while a survey goes on.

/// A share of `1 / SHARE` of what the tables hold has to be new before they are written again.
const SHARE: usize = 10;

/// Decides when tables and page are due, from the number of recordings that they hold.
///
/// A writing reads back all results, so it costs as much as there are. Each holds a tenth more than the one before, so that together they cost at
/// most `1 / (1 - 1 / 1.1) = 11` times as much as the last one, whatever the number of recordings.
#[derive(Clone, Debug, Default)]
pub struct Interim {
    in_tables: usize,
}

impl Interim {
    /// Whether tables and page are due: of `ended` recordings, which were diagnosed, kept from an earlier run or failed, `failed` have no result.
    /// Without any result there is nothing to write; the first is written at once.
    #[must_use]
    pub const fn is_due(&self, ended: usize, failed: usize) -> bool {
        let new = ended.saturating_sub(self.in_tables);
        ended > failed && new * SHARE >= self.in_tables
    }

    /// Takes note that tables and page hold `ended` recordings.
    pub const fn written(&mut self, ended: usize) {
        self.in_tables = ended;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Recordings that the tables hold after each writing of a survey, of which `kept` were done before and the first `failed` fail.
    fn writings(kept: usize, failed: usize, all: usize) -> Vec<usize> {
        let mut interim = Interim::default();
        let mut sizes = Vec::new();
        for ended in kept + 1..=all {
            if interim.is_due(ended, failed.min(ended)) {
                interim.written(ended);
                sizes.push(ended);
            }
        }
        sizes
    }

    #[test]
    fn the_first_ten_are_written_one_by_one_then_every_tenth_more() {
        let expected: Vec<usize> = (1..=11).chain([13, 15, 17, 19, 21, 24, 27, 30]).collect();
        assert_eq!(writings(0, 0, 32), expected);
    }

    #[test]
    fn all_writings_cost_at_most_eleven_times_the_last() {
        for all in [9, 100, 12_345, 100_000] {
            let sizes = writings(0, 0, all);
            let (sum, last) = (sizes.iter().sum::<usize>(), sizes[sizes.len() - 1]);
            assert!(sum <= 11 * last, "{all} recordings: {sum} read back, {last} by the last writing");
            assert!(10 * last + 10 >= 9 * all, "{all} recordings: the last writing has {last}");
        }
        assert!(writings(0, 0, 100_000).len() <= 107, "{} writings", writings(0, 0, 100_000).len());
    }

    #[test]
    fn results_of_an_earlier_run_are_written_with_the_first_new_one() {
        assert_eq!(writings(1000, 0, 1102), [1001, 1102]);
    }

    #[test]
    fn without_a_result_nothing_is_due() {
        assert_eq!(writings(0, 3, 5), [4, 5]);
        assert_eq!(writings(0, 5, 5), [0_usize; 0]);
    }

    #[test]
    fn a_recording_that_is_in_the_tables_is_not_new() {
        let mut interim = Interim::default();
        interim.written(1);
        assert!(!interim.is_due(1, 0) && !interim.is_due(0, 0));
    }
}
