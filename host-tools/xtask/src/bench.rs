//! `cargo xtask bench`: figures for speed and accuracy, on the machine at hand.

use crate::process::{self, cargo};

/// Benchmarks: package, target, and what its figures say.
const BENCHES: [(&str, &str, &str); 3] = [
    (
        "bowden-model",
        "joint",
        "the model: steps of the whole joint a second, and cost over the number of elements",
    ),
    (
        "virtual-bench",
        "realtime",
        "the virtual bench: simulated milliseconds a second; 1 Kitem/s is real time",
    ),
    ("bowden", "reconstruction", "replay: what reconstructing the input angle gains over filtering it"),
];

/// Runs every benchmark.
///
/// # Errors
/// When one cannot be built or fails.
pub fn run() -> Result<(), String> {
    for (package, target, figures) in BENCHES {
        println!("\n== {figures}");
        process::run(&mut cargo(&["bench", "--quiet", "--package", package, "--bench", target]), &[0])?;
    }
    Ok(())
}
