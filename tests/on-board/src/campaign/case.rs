//! A case: one or two faults in a phase, all of it drawn from its name.

use super::catalogue::{KINDS, Kind, kind};
use super::draw::Draw;
use super::phase::Phase;
use super::trouble::Trouble;
use crate::{Outcome, fail};

/// Seeds of the bench's noise, and of the healthy runs.
pub const BENCH_SEEDS: [u64; 3] = [1, 2, 3];
/// Every how-manieth case has two faults.
const PAIR_EVERY: usize = 4;
/// Draw numbers that belong to one campaign seed.
const NUMBERS_PER_SEED: u64 = 1000;
/// Longest time between the two faults of a case \[s\].
const APART_S: f64 = 2e-3;

/// A case.
#[derive(Debug, Clone)]
pub struct Case {
    /// Kinds of its faults.
    pub kinds: Vec<&'static Kind>,
    /// Phase.
    pub phase: Phase,
    /// Draw number.
    pub number: u64,
    /// Seed of the bench's noise.
    pub bench_seed: u64,
    /// Time from the beginning of the phase to the first fault \[s\].
    pub instant_s: f64,
    /// Time from the first fault to the second \[s\].
    pub apart_s: f64,
    /// The faults.
    pub troubles: Vec<Trouble>,
}

impl Case {
    fn drawn(kinds: Vec<&'static Kind>, phase: Phase, number: u64) -> Self {
        let mut draw = Draw::of(&name(&kinds, phase, number));
        let bench_seed = BENCH_SEEDS[draw.index(BENCH_SEEDS.len())];
        let (instant_s, apart_s) = (phase.instant_s(&mut draw), draw.uniform(0.0, APART_S));
        let mut troubles: Vec<Trouble> = kinds.iter().map(|kind| (kind.draw)(&mut draw)).collect();
        // What ends the run at once would leave nothing to the other one.
        troubles.sort_by_key(Trouble::ends_at_once);
        Self { kinds, phase, number, bench_seed, instant_s, apart_s, troubles }
    }

    /// Name from which all of it follows: `kind/phase/number`, two kinds with a plus between.
    pub fn name(&self) -> String {
        name(&self.kinds, self.phase, self.number)
    }

    /// What breaks, with its numbers.
    pub fn words(&self) -> String {
        let words: Vec<&str> = self.troubles.iter().map(|trouble| trouble.words.as_str()).collect();
        format!("{} at {:.4} s", words.join(" and "), self.instant_s)
    }

    /// The case of this name.
    ///
    /// # Errors
    /// If it has another form, or an unknown kind or phase.
    pub fn named(text: &str) -> Outcome<Self> {
        let parts: Vec<&str> = text.split('/').collect();
        let [kinds, phase, number] = parts.as_slice() else {
            return fail(format!("{text}: expected kind/phase/number, as in tension-stuck/fast/1001"));
        };
        let Some(found) =
            kinds.split('+').map(kind).collect::<Option<Vec<_>>>().filter(|kinds| kinds.len() < 3)
        else {
            return fail(format!("{text}: no kind of fault is named {kinds}"));
        };
        let Some(phase) = Phase::named(phase) else {
            return fail(format!("{text}: no phase is named {phase}"));
        };
        if let Some(kind) = found.iter().find(|kind| !kind.phases.contains(&phase)) {
            return fail(format!("{text}: {} does not happen in this phase", kind.name));
        }
        match number.parse() {
            Ok(number) => Ok(Self::drawn(found, phase, number)),
            Err(_) => fail(format!("{text}: {number} is not a number")),
        }
    }
}

fn name(kinds: &[&Kind], phase: Phase, number: u64) -> String {
    let names: Vec<&str> = kinds.iter().map(|kind| kind.name).collect();
    format!("{}/{phase}/{number}", names.join("+"))
}

/// The first `count` cases of campaign `seed`: every kind in every phase in a drawn order, again and again; each fourth case is a
/// pair of kinds with different places.
pub fn drawn(seed: u64, count: usize) -> Vec<Case> {
    let mut draw = Draw::of(&format!("campaign {seed}"));
    let mut cases: Vec<Case> = Vec::with_capacity(count);
    let mut deck: Vec<(&'static Kind, Phase)> = Vec::new();
    let mut number = NUMBERS_PER_SEED * seed;
    while cases.len() < count {
        if cases.len() % PAIR_EVERY == PAIR_EVERY - 1 {
            let kinds = [(); 2].map(|()| &KINDS[draw.index(KINDS.len())]);
            let phase = Phase::ALL[draw.index(Phase::ALL.len())];
            let both = kinds.iter().all(|kind| kind.phases.contains(&phase));
            let number = NUMBERS_PER_SEED * seed + cases.len() as u64;
            let case = Case::drawn(kinds.to_vec(), phase, number);
            if both && case.troubles[0].place != case.troubles[1].place {
                cases.push(case);
            }
            continue;
        }
        if deck.is_empty() {
            number += 1;
            deck =
                KINDS.iter().flat_map(|kind| kind.phases.iter().map(move |phase| (kind, *phase))).collect();
        }
        let (kind, phase) = deck.swap_remove(draw.index(deck.len()));
        cases.push(Case::drawn(vec![kind], phase, number));
    }
    cases
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn a_case_follows_from_its_name() {
        for case in drawn(3, 400) {
            let again = Case::named(&case.name()).unwrap();
            assert_eq!((again.words(), again.bench_seed), (case.words(), case.bench_seed));
            assert_eq!(again.troubles, case.troubles);
        }
    }

    #[test]
    fn a_campaign_holds_every_kind_in_every_phase_and_pairs_and_no_case_twice() {
        let cases = drawn(1, 500);
        assert_eq!(cases.iter().map(Case::name).collect::<HashSet<_>>().len(), 500);
        assert_eq!(cases.iter().filter(|case| case.kinds.len() == 2).count(), 125);
        for kind in KINDS {
            for phase in kind.phases {
                let alone = |case: &&Case| case.kinds.len() == 1 && case.kinds[0].name == kind.name;
                assert!(cases.iter().filter(alone).any(|case| case.phase == *phase), "{} {phase}", kind.name);
            }
        }
    }

    #[test]
    fn what_is_no_name_of_a_case_is_refused_in_one_line() {
        for (text, reason) in [
            ("tension-stuck/fast", "expected kind/phase/number"),
            ("tension-stick/fast/1", "no kind of fault is named tension-stick"),
            ("tension-stuck/quick/1", "no phase is named quick"),
            ("store-torn/fast/1", "does not happen in this phase"),
            ("tension-stuck/fast/one", "one is not a number"),
        ] {
            let said = Case::named(text).unwrap_err().0;
            assert!(said.contains(reason) && !said.contains('\n'), "{said}");
        }
    }
}
