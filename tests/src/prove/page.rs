//! The result as a page of Markdown.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::outcome::Outcome;
use super::plan::{Group, noise_levels_n};
use super::rivals::{RivalOutcome, table};
use super::score::{Score, concealed_shortly, reason, said_shortly};
use super::summary::{Rate, Summary, median, quantile};

/// What was run, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Provenance {
    /// Day, UTC.
    pub date: String,
    /// Commit of the workspace.
    pub commit: String,
    /// Processor and memory.
    pub machine: String,
    /// Version of the binary.
    pub tool: String,
    /// Threads of a diagnosis, and diagnoses at a time.
    pub threads: usize,
    /// Diagnoses at a time.
    pub jobs: usize,
    /// Seed of the run.
    pub seed: u64,
    /// One of so many cases of every group was run; 1 for all.
    pub every: usize,
}

/// Writes the whole page; a table of rivals where there are any.
#[must_use]
pub fn render(summary: &Summary, rivals: &[RivalOutcome], provenance: &Provenance) -> String {
    let mut page = String::new();
    // Writing to a string cannot fail.
    let _ = write(&mut page, summary, rivals, provenance);
    page
}

fn write(
    page: &mut String,
    summary: &Summary,
    rivals: &[RivalOutcome],
    provenance: &Provenance,
) -> std::fmt::Result {
    let Provenance { date, commit, machine, tool, threads, jobs, seed, every } = provenance;
    let [quiet_n, noisy_n] = noise_levels_n();
    writeln!(page, "# Concealed effects, found or not\n")?;
    writeln!(
        page,
        "`cargo xtask prove` draws rigs by seed on the virtual bench, which shares no code with the simulator of the\n\
         diagnosis, and gives `bowden diagnose` their files: what the user believes, and 40 s of recording at 1 kHz. 20 s\n\
         more, of other motion, judge the diagnosed rig. Every bench is a few per cent off its rig file. An effect is hidden\n\
         at two strengths, a clear fault and about half of it, and at two noise levels, {quiet_n} N and {noisy_n:.1} N on the tensions.\n"
    )?;
    writeln!(page, "| | |\n|---|---|")?;
    writeln!(
        page,
        "| date | {date} |\n| commit | {commit} |\n| machine | {machine} |\n| program | {tool} |"
    )?;
    let part = if *every > 1 { format!(", one of {every} of every group") } else { String::new() };
    writeln!(
        page,
        "| run | seed {seed}, {jobs} at a time with {threads} threads each, {} cases{part} |\n",
        summary.cases.len()
    )?;

    writeln!(page, "## Goals\n\n| score | found | wanted | |\n|---|---|---|---|")?;
    for goal in summary.goals() {
        let met = goal.met.map_or("", |met| if met { "met" } else { "**missed**" });
        writeln!(page, "| {} | {} | {} | {met} |", goal.what, goal.found, goal.wanted)?;
    }
    groups(page, summary)?;
    let outcomes: Vec<&Outcome> = summary.cases.iter().map(|(outcome, _)| outcome).collect();
    page.push_str(&table(&outcomes, rivals));
    errors(page, summary)?;
    calibration(page, summary)?;
    by_effect(page, summary)?;
    confusion(page, summary)?;
    failures(page, summary, *seed)
}

fn groups(page: &mut String, summary: &Summary) -> std::fmt::Result {
    writeln!(
        page,
        "\n## By group\n\nRight: exactly what is concealed was said. Ratio: held-out error of the diagnosed rig over that of the\n\
         true physics with the true parameters, replayed alike (root mean square over the channels); rows of physics\n\
         outside the catalogue compare with the law that a rig file can state, and where there is none with the true parameters alone.\n"
    )?;
    writeln!(
        page,
        "| group | cases | right | first name | all named | exact | false alarms | unexplained | component | ratio, median | ratio, 90 % |"
    )?;
    writeln!(page, "|---|---|---|---|---|---|---|---|---|---|---|")?;
    for group in Group::ALL {
        let scores: Vec<&Score> = summary.group(group).collect();
        if scores.is_empty() {
            continue;
        }
        let share =
            |rate: Rate| rate.share().map_or(String::new(), |share| format!("{:.0} %", 100.0 * share));
        let of = |answer: fn(&Score) -> Option<bool>| {
            share(Rate::count(scores.iter().filter_map(|score| answer(score))))
        };
        let alarms: usize = scores.iter().map(|score| score.false_alarms.len()).sum();
        let ratios = || scores.iter().filter_map(|score| score.heldout_ratio);
        writeln!(
            page,
            "| {} | {} | {} | {} | {} | {} | {alarms} | {} | {} | {} | {} |",
            group.name(),
            scores.len(),
            of(|score| Some(score.right)),
            of(|score| score.top1),
            of(|score| score.all_named),
            of(|score| Some(score.exact)),
            of(|score| Some(score.unexplained)),
            of(|score| score.component),
            number(median(ratios()), 2),
            number(quantile(ratios(), 0.9), 2),
        )?;
    }
    Ok(())
}

fn errors(page: &mut String, summary: &Summary) -> std::fmt::Result {
    let scores = || summary.cases.iter().map(|(_, score)| score);
    let onsets = || scores().flat_map(|score| &score.onset_errors_s).map(|error| error.abs());
    let parameters = || scores().flat_map(|score| &score.parameter_errors).map(|(_, error)| *error);
    let cost = |of: fn(&Outcome) -> f64| {
        let done = summary.cases.iter().filter(|(outcome, _)| outcome.said.is_some());
        done.map(|(outcome, _)| of(outcome)).collect::<Vec<f64>>()
    };
    writeln!(page, "\n## Numbers\n\n| | median | 90 % | of |\n|---|---|---|---|")?;
    let mut row = |name: &str, values: Vec<f64>, digits: usize| {
        let (half, most) = (median(values.iter().copied()), quantile(values.iter().copied(), 0.9));
        writeln!(page, "| {name} | {} | {} | {} |", number(half, digits), number(most, digits), values.len())
    };
    row("onset error, s", onsets().collect(), 2)?;
    row("effect parameter, relative error, %", parameters().map(|error| 100.0 * error).collect(), 1)?;
    let mut nominal: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for (name, error) in scores().flat_map(|score| &score.nominal_errors) {
        nominal.entry(name).or_default().push(100.0 * error);
    }
    for (name, errors) in nominal {
        row(&format!("{name}, relative error, %"), errors, 1)?;
    }
    row("diagnosis, s", cost(|outcome| outcome.cost.seconds), 1)?;
    row("diagnosis, processor seconds", cost(|outcome| outcome.cost.cpu_seconds), 1)?;
    row("diagnosis, peak memory, MB", cost(|outcome| outcome.cost.peak_mb), 0)
}

fn calibration(page: &mut String, summary: &Summary) -> std::fmt::Result {
    writeln!(page, "\n## Calibration\n\nRight of the statements at 90 % or more: {}.\n", summary.certain())?;
    writeln!(page, "| stated | mean stated | right |\n|---|---|---|")?;
    for bin in summary.calibration() {
        let stated = bin.stated.map_or(String::new(), |stated| format!("{:.1} %", 100.0 * stated));
        writeln!(page, "| {:.0} to {:.0} % | {stated} | {} |", 100.0 * bin.from, 100.0 * bin.to, bin.right)?;
    }
    Ok(())
}

/// Single effects and physics outside the catalogue, one row each.
fn by_effect(page: &mut String, summary: &Summary) -> std::fmt::Result {
    let mut rows: BTreeMap<(Group, String), Vec<&Score>> = BTreeMap::new();
    for (outcome, score) in &summary.cases {
        let truth = &outcome.truth;
        let id = match (outcome.group, truth.effects.first(), truth.outside.first()) {
            (Group::Single, Some(effect), _) => effect.id.clone(),
            (Group::Outside, _, Some((id, _))) => id.clone(),
            _ => continue,
        };
        rows.entry((outcome.group, id)).or_default().push(score);
    }
    writeln!(
        page,
        "\n## By effect\n\nWorth: held-out error of the true rig without the effect over that with it, smallest and largest; below 1 the\n\
         replay with the effect is worse than without, and nobody could find it by its predictions.\n\n\
         | concealed alone | cases | right | worth | parameter error, median | ratio, median |\n|---|---|---|---|---|---|"
    )?;
    for ((group, id), scores) in rows {
        let worth = || scores.iter().filter_map(|score| score.effects_worth);
        // Outside the catalogue the true rig has no effect that it could be without.
        let worth = if group == Group::Outside {
            String::new()
        } else {
            format!("{} to {}", number(quantile(worth(), 0.0), 2), number(quantile(worth(), 1.0), 2))
        };
        let errors = scores.iter().flat_map(|score| &score.parameter_errors).map(|(_, error)| 100.0 * error);
        let error = median(errors).map_or(String::new(), |error| format!("{error:.1} %"));
        let right = scores.iter().filter(|score| score.right).count();
        let ratio = number(median(scores.iter().filter_map(|score| score.heldout_ratio)), 2);
        writeln!(page, "| {id} | {} | {right} | {worth} | {error} | {ratio} |", scores.len())?;
    }
    Ok(())
}

fn confusion(page: &mut String, summary: &Summary) -> std::fmt::Result {
    writeln!(
        page,
        "\n## Confusion\n\nAll groups; what was named right first, then every mix-up.\n\n| concealed | named | cases |\n|---|---|---|"
    )?;
    let cells = summary.confusion();
    let (right, wrong): (Vec<_>, Vec<_>) = cells.iter().partition(|((truth, named), _)| truth == named);
    for ((truth, named), cases) in right.into_iter().chain(wrong) {
        writeln!(page, "| {truth} | {named} | {cases} |")?;
    }
    Ok(())
}

fn failures(page: &mut String, summary: &Summary, run_seed: u64) -> std::fmt::Result {
    let count = summary.failed().count();
    writeln!(page, "\n## Cases that are not right: {count}\n")?;
    if count == 0 {
        return Ok(());
    }
    writeln!(
        page,
        "`cargo xtask prove --seed {run_seed} --only CASE --out DIR` runs one again and keeps its files.\n"
    )?;
    writeln!(page, "| case | seed | concealed | said | what the files tell |\n|---|---|---|---|---|")?;
    for (outcome, score) in summary.failed() {
        let (name, seed) = (&outcome.name, outcome.seed);
        let (concealed, said) = (concealed_shortly(outcome), said_shortly(outcome));
        writeln!(
            page,
            "| {name} | {seed} | {concealed} | {said} | {} |",
            reason(outcome, score).replace('|', "/")
        )?;
    }
    Ok(())
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or(String::new(), |value| format!("{value:.digits$}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prove::outcome::tests::{diagnosis, outcome};

    fn provenance() -> Provenance {
        Provenance {
            date: "2026-01-02".to_owned(),
            commit: "abc".to_owned(),
            machine: "a machine".to_owned(),
            tool: "bowden 0.1.0".to_owned(),
            threads: 2,
            jobs: 1,
            seed: 7,
            every: 2,
        }
    }

    #[test]
    fn the_page_has_goals_confusion_and_every_failed_case() {
        let spring = ("joint_spring", "joint");
        let wrong = diagnosis("missing_physics", &[("joint_backlash", "joint", 0.92)]);
        let summary = Summary::of(vec![
            outcome(Group::Single, &[spring], wrong),
            outcome(Group::Nothing, &[], diagnosis("consistent", &[])),
        ]);
        let page = render(&summary, &[], &provenance());
        for line in [
            "| date | 2026-01-02 |",
            "| run | seed 7, 1 at a time with 2 threads each, 2 cases, one of 2 of every group |",
            "| single effects: first name right | 0 of 1 (0.0 %) | ≥ 95 % | **missed** |",
            "| nothing or parameters only: false physics | 0 of 1 (0.0 %) | none | met |",
            "| joint_spring | joint_backlash | 1 |",
            "`cargo xtask prove --seed 7 --only CASE --out DIR` runs one again and keeps its files.",
            "| nothing | nothing | 1 |",
            "| 90 to 97 % | 92.0 % | 0 of 1 (0.0 %) |",
            "## Cases that are not right: 1",
        ] {
            assert!(page.contains(line), "{line}\n{page}");
        }
        let failed: Vec<&str> =
            page.lines().filter(|line| line.starts_with("| single/by-hand | 7 |")).collect();
        assert!(
            matches!(failed[..], [line] if line.contains("| joint_spring | joint_backlash 92 % |")),
            "{failed:?}"
        );
    }

    #[test]
    fn every_row_has_as_many_cells_as_its_header() {
        let summary = Summary::of(vec![outcome(
            Group::Single,
            &[("joint_spring", "joint")],
            diagnosis("consistent", &[]),
        )]);
        let mut cells = None;
        for line in render(&summary, &[], &provenance()).lines() {
            if line.starts_with('|') {
                let here = line.matches('|').count();
                assert_eq!(*cells.get_or_insert(here), here, "{line}");
            } else {
                cells = None;
            }
        }
    }
}
