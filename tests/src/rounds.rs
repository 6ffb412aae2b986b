//! Rounds of drawn cases, as the programs that print a table of them take them.

use clap::Args;

/// Which cases are drawn.
#[derive(Clone, Copy, Debug, Args)]
pub struct Rounds {
    /// Seed of the first round
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Rounds of twelve, one seed each
    #[arg(long = "rounds", value_name = "ROUNDS", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100))]
    count: u64,
    /// Only the one of this number, 100 times the seed and its place in the round
    #[arg(long, value_name = "NUMBER")]
    only: Option<u64>,
}

impl Rounds {
    /// Number and place in its round of every case, where a round has `length` of them.
    pub fn cases(self, length: usize) -> impl Iterator<Item = (u64, usize)> {
        let rounds = self.seed..self.seed.saturating_add(self.count);
        let all =
            rounds.flat_map(move |round| (0..length).map(move |place| (100 * round + place as u64, place)));
        all.filter(move |(number, _)| self.only.is_none_or(|only| only == *number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_are_numbered_by_seed_and_place() {
        let of = |only| Rounds { seed: 7, count: 2, only }.cases(3).collect::<Vec<_>>();
        assert_eq!(of(None), [(700, 0), (701, 1), (702, 2), (800, 0), (801, 1), (802, 2)]);
        assert_eq!(of(Some(801)), [(801, 1)]);
    }
}
