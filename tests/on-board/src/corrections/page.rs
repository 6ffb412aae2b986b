//! The table of the corrections, and the page `host-tools/docs/corrections.md`.

use std::collections::BTreeSet;

use super::Errors;

/// Share of the gain that a diagnosis is to reach \[1\].
pub const GOAL: f64 = 0.6;

/// Gains below this part of the error are not divided by: nothing is to be gained there \[1\].
const LEAST_GAIN: f64 = 0.1;

/// A line of the table.
#[derive(Debug, Clone)]
pub struct Row {
    /// Name of the case.
    pub name: String,
    /// Unit of the errors, a thousandth of it.
    pub shown: String,
    /// Date and commit of the run.
    pub provenance: String,
    /// Without the effect, control code alone.
    pub without: f64,
    /// With the effect, parameters as they were.
    pub before: Errors,
    /// After `from-rig` with the rig that states the true physics.
    pub with_truth: Errors,
    /// After `from-rig` with the diagnosed rig, and what the diagnosis said; or why there is none.
    pub diagnosed: Result<(Errors, String), String>,
}

impl Row {
    /// What the true physics gain of the error before \[1\].
    fn gain(&self) -> f64 {
        self.before.on_image - self.with_truth.on_image
    }

    /// Share of that gain which the diagnosis reaches; `None` if there is nothing to gain, or no diagnosis.
    pub fn share(&self) -> Option<f64> {
        let (after, _) = self.diagnosed.as_ref().ok()?;
        let worth = self.gain() > LEAST_GAIN * self.before.on_image;
        worth.then(|| (self.before.on_image - after.on_image) / self.gain())
    }

    /// Whether the diagnosis reaches the goal: its share, or where nothing is to be gained, no loss.
    pub fn reached(&self) -> bool {
        match (&self.diagnosed, self.share()) {
            (_, Some(share)) => share >= GOAL,
            (Ok((after, _)), None) => after.on_image <= (1.0 + LEAST_GAIN) * self.before.on_image,
            (Err(_), None) => false,
        }
    }

    /// Cells of the row.
    fn cells(&self) -> [String; 8] {
        let milli = |errors: &Errors| format!("{:.2} ({:.2})", 1e3 * errors.on_image, 1e3 * errors.natively);
        let diagnosed = self.diagnosed.as_ref();
        let share = self.share().map_or("-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
        [
            self.name.clone(),
            self.shown.clone(),
            format!("({:.2})", 1e3 * self.without),
            milli(&self.before),
            diagnosed.map_or("-".to_owned(), |(errors, _)| milli(errors)),
            milli(&self.with_truth),
            share,
            if self.reached() { "yes" } else { "no" }.to_owned(),
        ]
    }

    /// The row in Markdown.
    pub fn line(&self) -> String {
        format!("| {} |", self.cells().join(" | "))
    }
}

/// First lines of the table.
pub const HEAD: &str = "| effect | error | without effect | before | after diagnosis | with true physics | share of the gain | goal |\n\
                        |---|---|---|---|---|---|---|---|";

/// The page.
pub fn page(rows: &[Row], provenance: &str) -> String {
    let table: Vec<String> = rows.iter().map(Row::line).collect();
    let said: Vec<String> = rows
        .iter()
        .map(|row| match &row.diagnosed {
            Ok((_, summary)) => format!("| {} | {summary} |", row.name),
            Err(reason) => format!("| {} | failed: {reason} |", row.name),
        })
        .collect();
    let reached = rows.iter().filter(|row| row.reached()).count();
    format!(
        "# Corrections on the emulated board\n\n\
         `cargo xtask bench --corrections` wrote this page: {provenance}.{}{}\n\n\
         The virtual bench behind the emulated board conceals one effect. The release image runs the joint with the default\n\
         parameters (*before*), then with what `bowden params from-rig` sets: from the rig file that `bowden diagnose` wrote\n\
         (*after diagnosis*), and from a rig file that states the effect (*with true physics*). Reference and noise are the same\n\
         in every run of a row. The diagnosis has 16 s of a multisine of 0.5 rad recorded on the same emulated board with another seed, every\n\
         tenth tick, and a rig file that lacks the effect.\n\n\
         Errors are the root of the mean square over whole periods, of the bench's true angle or of the torque that carries\n\
         the load, in brackets those of the control code without a board. Sheath friction and wrap are measured with\n\
         `sheath.adapts` 0: while it is 1 the joint follows them without a correction.\n\n\
         *Share of the gain* is what the diagnosis takes off over what the true physics take off. The goal is {:.0} % of it, and\n\
         never to be worse than before: {reached} of {} reach it.\n\n\
         An encoder of the joint that is off its centre at phase 0 shows 0.03 sin θ more. Over ±0.5 rad that is a slope of 0.03 to\n\
         within 0.1 mrad, as of a pulley that is 3 % smaller (`a_short_travel_hardly_bends_a_sine`). The diagnosis names the pulley, which\n\
         is the commoner of the two, and says that it cannot tell them apart (`[[undecided]]`): the board keeps its radius, and gains\n\
         nothing.\n\n{HEAD}\n{}\n\n\
         ## What the diagnosis said\n\n| effect | diagnosis |\n|---|---|\n{}\n",
        lacking(rows),
        kept(rows, provenance),
        100.0 * GOAL,
        rows.len(),
        table.join("\n"),
        said.join("\n"),
    )
}

/// Says which cases have no row; empty if all have one.
fn lacking(rows: &[Row]) -> String {
    let all = super::cases::all();
    let names: Vec<&str> =
        all.iter().map(|case| case.name).filter(|name| rows.iter().all(|row| row.name != *name)).collect();
    match names.as_slice() {
        [] => String::new(),
        names => format!(" Not measured yet, `--resume` does it: {}.", names.join(", ")),
    }
}

/// Says which rows were measured at another commit or on another day; empty if none was.
fn kept(rows: &[Row], provenance: &str) -> String {
    let others: BTreeSet<&str> =
        rows.iter().map(|row| row.provenance.as_str()).filter(|other| *other != provenance).collect();
    let list = |other: &str| {
        let names: Vec<&str> =
            rows.iter().filter(|row| row.provenance == other).map(|row| row.name.as_str()).collect();
        format!("\n- {other}: {}", names.join(", "))
    };
    let lists: String = others.into_iter().map(list).collect();
    if lists.is_empty() { lists } else { format!(" Rows kept from runs before (`--resume`):\n{lists}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, provenance: &str, after: f64) -> Row {
        let errors = |on_image| Errors { on_image, natively: on_image };
        Row {
            name: name.into(),
            shown: "mrad".into(),
            provenance: provenance.into(),
            without: 1e-3,
            before: errors(11e-3),
            with_truth: errors(1e-3),
            diagnosed: Ok((errors(after), "adding it".into())),
        }
    }

    #[test]
    fn the_goal_is_a_share_of_what_the_true_physics_gain() {
        // 10 mrad to gain: 60 % of it is 5 mrad left.
        assert!(row("a", "", 4.9e-3).reached() && !row("a", "", 5.1e-3).reached());
        assert!((row("a", "", 4e-3).share().unwrap() - 0.7).abs() < 1e-12);
        assert_eq!(
            row("a", "", 4e-3).line(),
            "| a | mrad | (1.00) | 11.00 (11.00) | 4.00 (4.00) | 1.00 (1.00) | 70 % | yes |"
        );
    }

    #[test]
    fn where_nothing_is_to_be_gained_a_loss_misses_the_goal() {
        let idle =
            |after| Row { with_truth: Errors { on_image: 10.5e-3, natively: 0.0 }, ..row("a", "", after) };
        assert_eq!(idle(11.5e-3).share(), None);
        assert!(idle(11.5e-3).reached() && !idle(13e-3).reached());
    }

    #[test]
    fn rows_of_other_commits_are_named() {
        let rows = [row("one", "now", 0.0), row("two", "then", 0.0), row("three", "then", 0.0)];
        assert!(page(&rows, "now").contains("(`--resume`):\n\n- then: two, three"));
        assert!(!kept(&rows[..1], "now").contains("--resume"));
    }

    #[test]
    fn cases_without_a_row_are_named() {
        let mut rows: Vec<Row> =
            super::super::cases::all().iter().map(|case| row(case.name, "", 0.0)).collect();
        assert_eq!(lacking(&rows), "");
        let last = rows.pop().unwrap();
        assert!(lacking(&rows).ends_with(&format!(": {}.", last.name)));
    }
}
