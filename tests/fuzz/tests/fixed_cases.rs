//! Every target on a fixed number of cases from a fixed seed, after what was found before.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use bowden_fuzz::requests::carry_out;
use bowden_fuzz::{Change, Target, alone, changed, corpus, target};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestError, TestRunner};

/// Seed of all cases.
const SEED: u64 = 7;

fn change() -> impl Strategy<Value = Change> {
    let at = any::<u32>();
    prop_oneof![
        1 => (at, 0..8_u8).prop_map(|(at, bit)| Change::Flip(at, bit)),
        1 => (at, any::<u8>()).prop_map(|(at, value)| Change::Byte(at, value)),
        1 => at.prop_map(Change::Cut),
        1 => (at, any::<u16>()).prop_map(|(at, count)| Change::Drop(at, count)),
        1 => (at, any::<u16>()).prop_map(|(at, count)| Change::Repeat(at, count)),
        3 => (at, any::<u8>()).prop_map(|(at, piece)| Change::Insert(at, piece)),
        1 => at.prop_map(Change::DropLine),
        1 => at.prop_map(Change::RepeatLine),
        1 => (at, any::<u32>()).prop_map(|(at, to)| Change::MoveLine(at, to)),
        4 => (at, any::<u8>()).prop_map(|(at, piece)| Change::Word(at, piece)),
        2 => (at, any::<u8>()).prop_map(|(at, kind)| Change::Length(at, kind)),
    ]
}

/// A seed with up to six changes, or any bytes at all.
fn input(seeds: Vec<Vec<u8>>) -> impl Strategy<Value = Vec<u8>> {
    let from_seed = (prop::sample::select(seeds), prop::collection::vec(change(), 0..6));
    prop_oneof![
        7 => from_seed.prop_map(|(seed, changes)| changed(seed, &changes)),
        1 => prop::collection::vec(any::<u8>(), 0..600),
    ]
}

fn run(name: &str) {
    let _alone = alone();
    let Target { run, seeds, cases, .. } = *target(name).expect("a target of this name");
    for (file, bytes) in corpus::inputs(name) {
        let ended = catch_unwind(AssertUnwindSafe(|| run(&bytes)));
        assert!(ended.is_ok(), "{file}: the failure above came back");
    }
    let cases = std::env::var("BOWDEN_FUZZ_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(cases);
    let seed = std::env::var("BOWDEN_FUZZ_SEED").ok().and_then(|n| n.parse().ok()).unwrap_or(SEED);
    let config =
        Config { cases, rng_seed: RngSeed::Fixed(seed), failure_persistence: None, ..Config::default() };
    let outcome = TestRunner::new(config).run(&input(seeds()), |bytes| {
        run(&bytes);
        Ok(())
    });
    match outcome {
        Ok(()) => {}
        Err(TestError::Fail(reason, bytes)) => {
            let found = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("found-{name}"));
            fs::write(&found, &bytes).expect("the target folder can be written");
            panic!(
                "{reason}; the smallest input is {}, keep it in {}: {}",
                found.display(),
                corpus::folder(name).display(),
                bytes.escape_ascii()
            );
        }
        Err(TestError::Abort(reason)) => panic!("{reason}"),
    }
}

macro_rules! targets {
    ($($name:ident)+) => {$(
        #[test]
        fn $name() {
            run(stringify!($name));
        }
    )+

        /// Every target has its test.
        #[test]
        fn no_target_is_left_out() {
            assert_eq!(bowden_fuzz::TARGETS.map(|target| target.name), [$(stringify!($name)),+]);
        }
    };
}

targets! { wire host requests rig study plan parameters ripple_table csv gzip mcap parquet }

/// The sequences that others are made of drive the joint, two of them far; otherwise what is judged would be a joint at rest.
#[test]
fn the_seeds_of_the_requests_move_the_joint() {
    let _alone = alone();
    for (number, seed) in (0..).zip((target("requests").expect("a target of this name").seeds)()) {
        let tally = carry_out(&seed);
        assert!(tally.driven > 3000, "{number}: {tally:?}");
        assert!(number > 1 || tally.farthest_rad > 0.25, "{number}: {tally:?}");
        assert!(number != 4 || tally.at_duty_limit > 100, "{number}: {tally:?}");
    }
}
