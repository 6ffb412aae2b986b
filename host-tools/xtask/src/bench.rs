//! `cargo xtask bench`: figures for speed and accuracy, on the machine at hand and on the emulated board.

use crate::parts::Parts;
use crate::process::{self, built, cargo};
use crate::{cross_target, firmware, system_packages};

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

/// Runs the benchmarks, then reads the figures of the release images.
///
/// # Errors
/// When one cannot be built or fails.
pub fn run(parts: Parts) -> Result<(), String> {
    if parts.host() {
        host()?;
    }
    if parts.board() { board() } else { Ok(()) }
}

fn host() -> Result<(), String> {
    for (package, target, figures) in BENCHES {
        println!("\n== {figures}");
        process::run(&mut cargo(&["bench", "--quiet", "--package", package, "--bench", target]), &[0])?;
    }
    Ok(())
}

fn board() -> Result<(), String> {
    println!("\n== the board: release images on the emulated processor; its cycles are a lower bound");
    system_packages::ensure()?;
    cross_target::ensure()?;
    let images = firmware::build()?;
    process::run(&mut cargo(&["build", "--quiet", "--release", "--package", "bowden"]), &[0])?;
    let figures = ["--package", "bowden-on-board-tests", "--bin", "on-board-figures"];
    let mut figures = cargo(&[&["run", "--quiet", "--release"], figures.as_slice()].concat());
    firmware::announce(&images, &mut figures);
    process::run(figures.env("BOWDEN_BIN", built("release", "bowden")?), &[0])
}
