//! What a diagnosis costs as recordings grow: the same forty seconds again and again in one file.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;

use virtual_bench::MotionKind;

use super::outcome::Cost;
use super::plan::Plan;
use super::tool::Tool;
use super::truth::{TRAINING_S, believed_rig};

/// Cases that are taken where nobody names others: one that hides nothing, and one that hides something.
pub const LENGTHENED: [&str; 2] = ["nothing/01", "single/motor_cogging/clear/quiet"];

/// Times that the recording stands in the file, the last time an hour.
pub const REPEATS: [u32; 3] = [1, 9, 90];

/// Most that an hour at 1 kHz may take, MB.
const MOST_MB: f64 = 1024.0;

/// What each length cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Lengths {
    /// Name of the case.
    pub name: String,
    /// Recorded time, s, and what its diagnosis took, shortest first.
    pub costs: Vec<(f64, Cost)>,
}

/// Diagnoses one case at every length in `folder`, which is made; `done` hears of each.
///
/// # Errors
/// When the bench refuses the case, a file cannot be written, or the program fails.
pub fn lengths(
    tool: &Tool,
    plan: &Plan,
    folder: &Path,
    done: impl Fn(f64, &Cost),
) -> Result<Lengths, String> {
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", folder.display());
    let case = plan.case().map_err(|error| format!("{}: {error}", plan.name))?;
    let recording =
        case.train(MotionKind::Lab, TRAINING_S).map_err(|error| format!("{}: {error}", plan.name))?;
    fs::create_dir_all(folder).map_err(|error| failed(&error))?;
    fs::write(folder.join("rig.toml"), believed_rig(plan, &case)).map_err(|error| failed(&error))?;
    let mut once = Vec::new();
    recording.write_csv(&mut once).map_err(|error| failed(&error))?;
    let once = String::from_utf8_lossy(&once);
    let step_s = TRAINING_S / recording.len() as f64;
    let mut costs = Vec::new();
    for repeats in REPEATS {
        let train = File::create(folder.join("train.csv")).map_err(|error| failed(&error))?;
        write_repeated(&once, step_s, repeats, BufWriter::new(train)).map_err(|error| failed(&error))?;
        let cost = tool.patient(repeats).diagnose(folder)?;
        let recorded_s = f64::from(repeats) * TRAINING_S;
        done(recorded_s, &cost);
        costs.push((recorded_s, cost));
    }
    Ok(Lengths { name: plan.name.clone(), costs })
}

/// A table of samples `step_s` apart `repeats` times, each where the one before has ended.
fn write_repeated(
    once: &str,
    step_s: f64,
    repeats: u32,
    mut out: impl std::io::Write,
) -> std::io::Result<()> {
    let (header, rows) = once.split_once('\n').unwrap_or((once, ""));
    writeln!(out, "{header}")?;
    let samples = (0..repeats).flat_map(|_| rows.lines()).filter_map(|row| row.split_once(','));
    for (sample, (_, values)) in samples.enumerate() {
        writeln!(out, "{:.6},{values}", step_s * sample as f64)?;
    }
    out.flush()
}

/// Tables of all cases, and whether an hour stays below the memory that it may take.
#[must_use]
pub fn page(all: &[Lengths]) -> (String, bool) {
    let mut page = String::new();
    let mut met = true;
    for Lengths { name, costs } in all {
        // Writing to a string cannot fail.
        let _ = writeln!(page, "{name}\n  recorded s     s  processor s  of it per 40 s  peak memory MB");
        for (recorded_s, cost) in costs {
            let each = cost.cpu_seconds * TRAINING_S / recorded_s;
            let _ = writeln!(
                page,
                "{recorded_s:>12.0}{:>6.0}{:>13.1}{each:>16.1}{:>16.0}",
                cost.seconds, cost.cpu_seconds, cost.peak_mb
            );
        }
        if let Some((_, hour)) = costs.last() {
            let holds = hour.peak_mb <= MOST_MB;
            met &= holds;
            let verdict = if holds { "met" } else { "missed" };
            let _ = writeln!(page, "  an hour: {:.0} MB, at most {MOST_MB:.0}: {verdict}", hour.peak_mb);
        }
    }
    (page, met)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_hour_has_its_limit_and_every_length_its_time_per_forty_seconds() {
        let of = |hour_mb| {
            let cost = |cpu_seconds, peak_mb| Cost { seconds: 9.0, cpu_seconds, peak_mb };
            let costs = vec![(40.0, cost(18.0, 27.0)), (3600.0, cost(900.0, hour_mb))];
            Lengths { name: "nothing/01".to_owned(), costs }
        };
        let (page, met) = page(&[of(1024.0)]);
        assert!(met && page.contains("an hour: 1024 MB, at most 1024: met"), "{page}");
        // 900 s over ninety times 40 s.
        assert!(page.contains("3600     9        900.0            10.0            1024"), "{page}");
        let (page, met) = super::page(&[of(1030.0), of(900.0)]);
        assert!(!met && page.contains("1030 MB, at most 1024: missed"), "{page}");
    }

    #[test]
    fn time_runs_on_from_one_repeat_to_the_next() {
        let mut out = Vec::new();
        write_repeated("t_s,f1_n,duty\n0.0,30,0.1\n0.5,31,0.2\n", 0.5, 2, &mut out).unwrap();
        let rows = "0.000000,30,0.1\n0.500000,31,0.2\n1.000000,30,0.1\n1.500000,31,0.2\n";
        assert_eq!(String::from_utf8(out).unwrap(), format!("t_s,f1_n,duty\n{rows}"));
    }
}
