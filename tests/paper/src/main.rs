//! `cargo xtask paper`: runs the experiments and prints their tables beside the paper's claims.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use bowden_paper::disturbed_tracking::SETUP;
use bowden_paper::error::ExperimentError;
use bowden_paper::tracking_methods::{LOADS, errors_over_seeds, methods};

/// Motions of the sheaths that the errors are reported on: none of those that constants were fixed on.
const SEEDS: [u64; 10] = [4, 5, 6, 7, 8, 9, 10, 11, 12, 13];

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("paper: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), ExperimentError> {
    println!(
        "Section 5.2: tracking while the sheaths are moved; median (least to largest) over {} runs",
        SEEDS.len()
    );
    for load in &LOADS {
        let claims = [Some(load.uncompensated_percent), Some(load.compensated_percent), None, None];
        for (method, claim) in methods(&SETUP, load).into_iter().zip(claims) {
            let errors = errors_over_seeds(&SETUP, load.mass_kg, method, &SEEDS)?;
            let torque = errors.torque_percent;
            println!(
                "{:>4} kg  {:<34} paper {:>8}  here {:6.2} % ({:.2} to {:.2})  angle {:5.1} mrad RMS, {:5.1} largest",
                load.mass_kg,
                errors.method.name,
                claim.map_or(String::new(), |claim| format!("{claim} %")),
                torque.median,
                torque.least,
                torque.largest,
                1e3 * errors.angle_rms_rad.median,
                1e3 * errors.angle_largest_rad.largest,
            );
        }
    }
    Ok(())
}
