//! `cargo xtask bench`: figures for speed and accuracy, on the machine at hand and on the emulated board.

use std::ffi::OsString;

use clap::Args;

use crate::parts::Parts;
use crate::process::{self, built, cargo, target_folder, workspace};
use crate::prove::provenance;
use crate::{cross_target, firmware, peers, system_packages};

/// Which benchmarks are run.
#[derive(Debug, Args)]
// Switches of a command line.
#[allow(clippy::struct_excessive_bools)]
pub struct Options {
    #[command(flatten)]
    parts: Parts,
    /// Instead, measure what each correction of the board gains, and write host-tools/docs/corrections.md
    #[arg(long, conflicts_with_all = ["host", "board"])]
    corrections: bool,
    /// Instead, measure speed and error beside MuJoCo, scipy, diffrax, the mcap crate, an f32 cascade and other tools of
    /// identification, and write host-tools/docs/peers.md
    #[arg(long, conflicts_with_all = ["host", "board", "corrections"])]
    peers: bool,
    /// With --corrections: only effects whose names contain one of these; no page is written then
    #[arg(value_name = "EFFECT", requires = "corrections")]
    effects: Vec<OsString>,
    /// With --corrections: without diagnoses, in minutes; no page is written then
    #[arg(long, requires = "corrections")]
    undiagnosed: bool,
    /// With --corrections: measure only what runs before, of any commit, have not finished; the page names their commits
    #[arg(long, requires = "corrections", conflicts_with = "undiagnosed")]
    resume: bool,
}

/// Page of the corrections, below the workspace.
const CORRECTIONS: &str = "host-tools/docs/corrections.md";

/// Benchmarks: package, target, and what its figures say.
const BENCHES: [(&str, &str, &str); 6] = [
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
    ("bowden-core", "reconstruction", "replay: what reconstructing the input angle gains over filtering it"),
    (
        "bowden",
        "link",
        "the link: full rate over a pseudo terminal, decoding, MCAP, the monitor's share of a core",
    ),
    (
        "bowden",
        "excitation",
        "excitations: what chosen motions tell of a rig's parameters, beside plain motions of the same length",
    ),
    ("bowden-tests", "diagnosis", "diagnosis: time by stage, from 40 s at 1 kHz"),
];

/// Runs the benchmarks, then reads the figures of the release images.
///
/// # Errors
/// When one cannot be built or fails.
pub fn run(options: &Options) -> Result<(), String> {
    if options.corrections {
        return corrections(options);
    }
    if options.peers {
        return peers::run();
    }
    let parts = options.parts;
    if parts.host() {
        host()?;
    }
    if parts.board() { board() } else { Ok(()) }
}

/// One that fails, as that of the link does where a goal is missed, does not stop the others.
fn host() -> Result<(), String> {
    let mut failed = Vec::new();
    for (package, target, figures) in BENCHES {
        println!("\n== {figures}");
        let mut bench = cargo(&["bench", "--quiet", "--package", package, "--bench", target]);
        failed.extend(process::run(&mut bench, &[0]).err());
    }
    if failed.is_empty() { Ok(()) } else { Err(failed.join("; ")) }
}

fn board() -> Result<(), String> {
    println!("\n== the board: release images on the emulated processor; lower and upper bounds of cycles");
    on_board("on-board-figures", &[])
}

fn corrections(options: &Options) -> Result<(), String> {
    println!(
        "\n== corrections: the release image on the emulated board, RMS error; control code alone in brackets"
    );
    let mut arguments = vec![target_folder()?.join("corrections").into_os_string()];
    arguments.extend(["--provenance".into(), provenance().into()]);
    for (given, argument) in [(options.undiagnosed, "--undiagnosed"), (options.resume, "--resume")] {
        arguments.extend(given.then(|| argument.into()));
    }
    if !options.undiagnosed && options.effects.is_empty() {
        arguments.extend(["--page".into(), workspace().join(CORRECTIONS).into_os_string()]);
    }
    arguments.extend(options.effects.iter().cloned());
    on_board("on-board-corrections", &arguments)
}

/// Builds the images, the tool and the program `name` that runs them on the emulated board, and runs it.
///
/// # Errors
/// When something cannot be built, or the program fails.
pub fn on_board(name: &str, arguments: &[OsString]) -> Result<(), String> {
    system_packages::ensure()?;
    cross_target::ensure()?;
    let images = firmware::build()?;
    process::run(&mut cargo(&["build", "--quiet", "--release", "--package", "bowden"]), &[0])?;
    let program = ["--package", "bowden-on-board-tests", "--bin", name, "--"];
    let mut program = cargo(&[&["run", "--quiet", "--release"], program.as_slice()].concat());
    firmware::announce(&images, &mut program);
    process::run(program.args(arguments).env("BOWDEN_BIN", built("release", "bowden")?), &[0])
}
