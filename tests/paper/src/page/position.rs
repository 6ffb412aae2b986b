//! Sections of `tracking.md` on position mode and on steps of the wrap angle.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::error::ExperimentError;
use crate::position;
use crate::position::{
    FREQUENCIES_HZ, MASSES_KG, PRETENSION_AMPLITUDE_RAD, PRETENSION_FACTORS, SEEDS, START_FACTORS, SineCase,
    SineRow, WAYS, frequency_cases, least_pretension_n, load_cases, pretension_cases, run_all, start_cases,
};
use crate::sheath_steps::{BETWEEN_S, SWING_S};
use crate::tracking_methods::Spread;
use crate::wrap_step::{Knowledge, STEP_BAND_NM, STEP_LIMIT_S, StepFigures, run_steps, step_cases};

/// First line of the sections; what follows it on the page is theirs.
pub const HEADING: &str = "## Position mode while the sheaths are moved";

/// What the steps of K show.
const READING: &str = "
Far from a turn the torque is back at once; 0.97 s there is the next turn of the reference, 0.94 s after the step. Near a turn the
goal is missed, and with this control no observer changes that: with `mu K` set right in the tick of the step most of the same cases miss
it. The reasons:

- *What can be known.* A cable that sticks has `abs(ln(F_in/F_out)) < mu K`: every larger K fits the same four tensions. After a turn the
  pulley crosses `2 F0 L tanh(mu K/2)/(EA r1)`, 10 mrad of the default joint, before the cables slip, so that a rise of K shows only there. A
  fall shows at once only in a cable whose tensions then exceed the new limit.
- *What can be done with it.* The friction that is fed forward has the sign of the reference's rate. A step ahead of a turn leaves an error
  whose removal takes the pulley through the dead zone against that sign, and the torque loop alone carries it there. Friction
  by the sign of the torque error instead would be a function of the joint's state, which the stability argument of
  [the observer](../../firmware/control/docs/sheath-observer.md) excludes.
- *What an observer could still gain* is the difference of the two columns: falls far from a turn, where the cables of the new, smaller dead
  zone slip before the pulley has dragged the old one along.
";

/// Runs everything and returns the sections.
///
/// # Errors
/// That of the first run that fails otherwise than by a stop of the supervisor.
pub fn sections(provenance: &str) -> Result<String, ExperimentError> {
    let mut text = format!(
        "{HEADING}\n\n\
         `cargo xtask paper --beyond position` wrote the sections from here on: {provenance}.\n\n\
         Default bench, default parameters that describe it, nothing tuned; seeds {} to {}, at least 20 s each after settling. K of both\n\
         sheaths wanders between pi/2 and 3 pi/2 as above. The error is that of the true joint angle against the board's\n\
         reference; RMS is the median of the seeds, largest that of all. *Turns* are the eighth of a period after each turn, where the\n\
         dead zone is crossed. The amplitude is 0.5 rad, or what the board accepts. A slack event is a time in which a true tension is\n\
         below `tension.slack`, 1 N; the goal is none.\n\n",
        SEEDS[0],
        SEEDS[SEEDS.len() - 1]
    );
    let cases = frequency_cases();
    let names = WAYS.iter().flat_map(|way| FREQUENCIES_HZ.map(|hz| format!("{} | {hz} Hz", way.name)));
    table(&mut text, "compensation | frequency", names, &cases)?;
    let _ = write!(
        text,
        "\n### K steps by pi\n\n\
         The same, but K of both sheaths goes from pi/2 to 3 pi/2 or back within {SWING_S} s, at random every {} to {} s.\n\n",
        BETWEEN_S[0], BETWEEN_S[1]
    );
    let names = WAYS.iter().flat_map(|way| FREQUENCIES_HZ.map(|hz| format!("{} | {hz} Hz", way.name)));
    table(&mut text, "compensation | frequency", names, &position::step_cases())?;
    text += "\n### `mu K` wrong at the start\n\n0.3 rad, default compensation.\n\n";
    let names =
        START_FACTORS.iter().flat_map(|factor| [0.1, 0.5].map(|hz| format!("{factor} of it | {hz} Hz")));
    table(&mut text, "`mu K` at the start | frequency", names, &start_cases())?;
    text +=
        "\n### Loads\n\nAt most 0.3 rad at 0.5 Hz, default compensation; the arm itself has 2e-4 kg m².\n\n";
    let names = MASSES_KG.iter().map(|mass_kg| format!("{mass_kg} kg"));
    table(&mut text, "load", names, &load_cases())?;
    let _ = write!(
        text,
        "\n### Pretension down to the least one\n\n\
         At 0.2 Hz. The least pretension of the paper's section 4.2.1, for the weight at {PRETENSION_AMPLITUDE_RAD} rad with K at 3 pi/2, is {:.2} N\n\
         ([equation](../../model/docs/derivation.md)): there a tendon is just taut. The board leaves 1 N and a tenth of the pretension, so\n\
         it refuses {PRETENSION_AMPLITUDE_RAD} rad at low pretensions; the amplitude is what it accepts.\n\n",
        least_pretension_n()
    );
    let names = PRETENSION_FACTORS
        .iter()
        .map(|factor| format!("{factor} of the least: {:.1} N", factor * least_pretension_n()));
    table(&mut text, "pretension", names, &pretension_cases())?;
    steps(&mut text)?;
    Ok(text)
}

/// Runs the cases and appends their table; `names` has the first cells of each row.
fn table(
    text: &mut String,
    columns: &str,
    names: impl Iterator<Item = String>,
    cases: &[SineCase],
) -> Result<(), ExperimentError> {
    let rows = run_all(cases, &SEEDS)?;
    let dashes = "---|".repeat(columns.split(" | ").count());
    // Writing to a string does not fail.
    let _ = write!(
        text,
        "| {columns} | amplitude, rad | RMS, mrad | largest, mrad | RMS at turns, mrad | largest at turns, mrad | least tension, N | \
         slack events | stopped |\n|{dashes}---|---|---|---|---|---|---|---|\n"
    );
    for ((name, case), row) in names.zip(cases).zip(&rows) {
        let _ = writeln!(text, "| {name} | {:.3} | {} |", case.amplitude_rad, cells(row));
    }
    Ok(())
}

fn cells(row: &SineRow) -> String {
    let stopped = row
        .stopped
        .first()
        .map_or(String::from("0"), |(seed, reason)| format!("{} (seed {seed}: {reason})", row.stopped.len()));
    format!(
        "{:.2} | {:.1} | {:.2} | {:.1} | {:.1} | {} | {stopped}",
        1e3 * row.median(|figures| figures.rms_rad),
        1e3 * row.largest(|figures| figures.largest_rad),
        1e3 * row.median(|figures| figures.turn_rms_rad),
        1e3 * row.largest(|figures| figures.turn_largest_rad),
        -row.largest(|figures| -figures.least_tension_n),
        row.slack_events(),
    )
}

/// Runs the steps of K and appends their section.
fn steps(text: &mut String) -> Result<(), ExperimentError> {
    let cases = step_cases();
    let runs = run_steps(&cases, Knowledge::Observed, &SEEDS)?;
    let known = run_steps(&cases, Knowledge::AtOnce, &SEEDS)?;
    let _ = write!(
        text,
        "\n## Torque error after a step of K by pi\n\n\
         Torque mode, all four tensions, default bench and parameters, 0.3 N·m at 0.2 Hz; K of both sheaths jumps at eight phases of the\n\
         reference, seeds as above. The error is back when its mean over 5 ms stays within {:.0} mN·m, 5 % of the amplitude; the goal is\n\
         {STEP_LIMIT_S} s. *Without a step* is the same figure for the second before; *near* is within 0.4 s of a turn of the reference, *far* all\n\
         else. *K known at once* are the same runs with `sheath.adapts` 0 and `sheath.wrap_angle` set right in the tick of the step: the bound\n\
         for every observer.\n\n\
         | K | reference | runs | largest error, mN·m | back after, median | 90 % of the runs | last | within {STEP_LIMIT_S} s | K known at once: median | within {STEP_LIMIT_S} s | without a step, last |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
        1e3 * STEP_BAND_NM
    );
    let rows = [("pi/2 to 3 pi/2", true), ("3 pi/2 to pi/2", false)];
    for ((name, rises), (place, near)) in rows
        .into_iter()
        .flat_map(|row| [("far from a turn", false), ("near a turn", true)].map(|place| (row, place)))
    {
        let of_place = |runs: &[Vec<StepFigures>]| -> Vec<StepFigures> {
            let chosen = cases
                .iter()
                .zip(runs)
                .filter(|(case, _)| case.rises() == rises && case.is_near_turn() == near);
            chosen.flat_map(|(_, figures)| figures.clone()).collect()
        };
        let within = |figures: &[StepFigures]| {
            let count = figures.iter().filter(|figure| figure.back_s <= STEP_LIMIT_S).count();
            format!("{count} of {}", figures.len())
        };
        let (figures, known) = (of_place(&runs), of_place(&known));
        let back_known = Spread::of(known.iter().map(|figure| figure.back_s))?;
        let back = Spread::of(figures.iter().map(|figure| figure.back_s))?;
        let mut sorted: Vec<f64> = figures.iter().map(|figure| figure.back_s).collect();
        sorted.sort_by(f64::total_cmp);
        let most = |of: fn(&StepFigures) -> f64| figures.iter().map(of).fold(0.0, f64::max);
        let _ = writeln!(
            text,
            "| {name} | {place} | {} | {:.0} | {:.3} s | {:.3} s | {:.3} s | {} | {:.3} s | {} | {:.3} s |",
            figures.len(),
            1e3 * most(|figure| figure.largest_nm),
            back.median,
            sorted[(sorted.len() * 9).div_ceil(10) - 1],
            back.largest,
            within(&figures),
            back_known.median,
            within(&known),
            most(|figure| figure.before_s),
        );
    }
    *text += READING;
    Ok(())
}

/// Replaces the sections of the page.
///
/// # Errors
/// When the page cannot be read or written, and why.
pub fn replace(sections: &str, page: &Path) -> Result<(), String> {
    let told = |error: std::io::Error| format!("{}: {error}", page.display());
    let text = fs::read_to_string(page).map_err(told)?;
    let before = text.find(HEADING).map_or(text.as_str(), |at| &text[..at]);
    fs::write(page, format!("{}\n\n{sections}", before.trim_end())).map_err(told)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sections_are_replaced_and_the_rest_stays() {
        let page = std::env::temp_dir().join(format!("bowden-paper-{}.md", std::process::id()));
        fs::write(&page, "# Torque\n\n| a |\n").expect("writes");
        for sections in [
            "## Position mode while the sheaths are moved\n\nold\n",
            "## Position mode while the sheaths are moved\n\nnew\n",
        ] {
            replace(sections, &page).expect("replaces");
            assert_eq!(fs::read_to_string(&page).expect("reads"), format!("# Torque\n\n| a |\n\n{sections}"));
        }
        fs::remove_file(&page).expect("removes");
    }
}
