//! The table of the corrections, and the page `host-tools/docs/corrections.md`.

use super::{Case, Errors};

/// Share of the gain that a diagnosis is to reach \[1\].
pub const GOAL: f64 = 0.6;

/// Gains below this part of the error are not divided by: nothing is to be gained there \[1\].
const LEAST_GAIN: f64 = 0.1;

/// A line of the table.
#[derive(Debug, Clone)]
pub struct Row {
    /// What was run.
    pub case: Case,
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
            self.case.name.to_owned(),
            self.case.shown.to_owned(),
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
            Ok((_, summary)) => format!("| {} | {summary} |", row.case.name),
            Err(reason) => format!("| {} | failed: {reason} |", row.case.name),
        })
        .collect();
    let reached = rows.iter().filter(|row| row.reached()).count();
    format!(
        "# Corrections on the emulated board\n\n\
         `cargo xtask bench --corrections` wrote this page: {provenance}.\n\n\
         The virtual bench behind the emulated board conceals one effect. The release image runs the joint with the default\n\
         parameters (*before*), then with what `bowden params from-rig` sets: from the rig file that `bowden diagnose` wrote\n\
         (*after diagnosis*), and from a rig file that states the effect (*with true physics*). Reference and noise are the same\n\
         in every run of a row. The diagnosis has 16 s of a multisine recorded on the same emulated board with another seed, every\n\
         tenth tick, and a rig file that lacks the effect.\n\n\
         Errors are the root of the mean square over whole periods, of the bench's true angle or of the torque that carries\n\
         the load, in brackets those of the control code without a board. Sheath friction and wrap are measured with\n\
         `sheath.adapts` 0: while it is 1 the joint follows them without a correction.\n\n\
         *Share of the gain* is what the diagnosis takes off over what the true physics take off. The goal is {:.0} % of it, and\n\
         never to be worse than before: {reached} of {} reach it.\n\n{HEAD}\n{}\n\n\
         ## What the diagnosis said\n\n| effect | diagnosis |\n|---|---|\n{}\n",
        100.0 * GOAL,
        rows.len(),
        table.join("\n"),
        said.join("\n"),
    )
}
