//! What the motions that `bowden run` chooses tell of a rig's parameters: `cargo bench -p bowden --bench excitation`.
//!
//! The logarithm of the determinant of the information, beside that of plain motions of the same length. Exit status 1 if a plain sine
//! tells as much as the chosen ones.

use std::error::Error;
use std::process::ExitCode;

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/common/excitation.rs"]
mod excitation;

/// Lengths and largest angles, s and rad.
const EXCITATIONS: [(f64, f64); 3] = [(9.0, 0.3), (9.0, 0.1), (24.0, 0.3)];

/// Forms of plain motions.
const FORMS: [&str; 4] = ["sine", "triangle", "multisine", "staircase"];

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let mut exit = ExitCode::SUCCESS;
    for (seconds, angle_rad) in EXCITATIONS {
        let folder = tempfile::tempdir()?;
        std::fs::write(folder.path().join("rig.toml"), virtual_bench::nominal_rig_toml("bench"))?;
        let all = excitation::compared(folder.path(), seconds, angle_rad, &FORMS);
        println!("{seconds} s up to {angle_rad} rad: logarithm of the determinant of the information");
        for (words, worth) in &all {
            println!("  {worth:7.2}  {words}");
        }
        if all[1..].iter().any(|(words, worth)| words.starts_with("sine ") && *worth >= all[0].1) {
            println!("  a plain sine tells as much as the chosen ones");
            exit = ExitCode::FAILURE;
        }
    }
    Ok(exit)
}
