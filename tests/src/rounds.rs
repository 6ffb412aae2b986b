//! Rounds of drawn cases, as the programs that print a table of them take them.

use std::path::PathBuf;
use std::process::ExitCode;

use bowden_core::outcome::Failure;
use clap::Args;

/// Where the files of the cases go in place of a diagnosis.
#[derive(Clone, Debug, Args)]
pub struct Kept {
    /// Keep the files of every case in this folder, and diagnose nothing
    #[arg(long, value_name = "DIR")]
    files: Option<PathBuf>,
}

impl Kept {
    /// Folder of the case of this number, if files are kept; says which.
    #[must_use]
    pub fn folder(&self, number: u64) -> Option<PathBuf> {
        let folder = self.files.as_ref()?.join(number.to_string());
        println!("{}", folder.display());
        Some(folder)
    }
}

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
    /// Examines every case of rounds of this length, by number and place, and prints the table of those that were diagnosed.
    pub fn run<T>(
        self,
        length: usize,
        mut examine: impl FnMut(u64, usize) -> Result<Option<T>, Failure>,
        table: impl FnOnce(&[(u64, T)]) -> String,
    ) -> ExitCode {
        let mut examined = Vec::new();
        for (number, place) in self.cases(length) {
            match examine(number, place) {
                Ok(one) => examined.extend(one.map(|one| (number, one))),
                Err(failure) => {
                    eprintln!("prove: case {number}: {failure}");
                    return ExitCode::FAILURE;
                }
            }
        }
        if !examined.is_empty() {
            print!("{}", table(&examined));
        }
        ExitCode::SUCCESS
    }

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
