//! Fuzz targets: everything that reads bytes from outside, and the control under any sequence of requests.
//!
//! A target takes any bytes and panics where a property does not hold. Two engines drive the same targets:
//!
//! | engine | what | when |
//! |---|---|---|
//! | `proptest` | a fixed number of cases from a fixed seed: changed seeds, arbitrary bytes; shrinks a failure | `cargo test` |
//! | libFuzzer | guided by coverage, for as long as wanted | `cargo xtask fuzz` |
//!
//! What was found before lies in `corpus/TARGET/` and is run first by both. `tests/docs/fuzzing.md` lists it.
#![forbid(unsafe_code)]

mod change;
pub mod corpus;
mod files;
mod host;
mod joint;
mod judge;
mod recordings;
pub mod requests;
mod texts;
mod wire;

pub use change::{Change, changed};
pub use judge::alone;

/// Something that reads bytes from outside.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Name, also of its folder of the corpus.
    pub name: &'static str,
    /// Takes any bytes; panics where a property does not hold.
    pub run: fn(&[u8]),
    /// Valid inputs to start from.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Cases of a run in the tests.
    pub cases: u32,
}

/// All targets.
pub const TARGETS: [Target; 12] = [
    Target { name: "wire", run: wire::run, seeds: wire::seeds, cases: 20_000 },
    Target { name: "host", run: host::run, seeds: host::seeds, cases: 4000 },
    Target { name: "requests", run: requests::run, seeds: requests::seeds, cases: 100 },
    Target { name: "rig", run: texts::rig, seeds: texts::rigs, cases: 4000 },
    Target { name: "study", run: texts::study, seeds: texts::studies, cases: 2000 },
    Target { name: "plan", run: texts::plan, seeds: texts::plans, cases: 8000 },
    Target { name: "parameters", run: texts::parameters, seeds: texts::parameter_files, cases: 4000 },
    Target { name: "ripple_table", run: texts::ripple_table, seeds: texts::ripple_tables, cases: 5000 },
    Target { name: "csv", run: recordings::csv, seeds: recordings::tables, cases: 4000 },
    Target { name: "gzip", run: recordings::gzip, seeds: recordings::gzipped, cases: 2000 },
    Target { name: "mcap", run: recordings::mcap, seeds: recordings::mcaps, cases: 4000 },
    Target { name: "parquet", run: recordings::parquet, seeds: recordings::parquets, cases: 4000 },
];

/// The target of this name.
pub fn target(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}
