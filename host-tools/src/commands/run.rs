//! `bowden run`: a bench run as a file.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::progress::Progress;
use bowden_host_link::Session;
use bowden_host_link::bench_run::ledger::{Done, Ledger};
use bowden_host_link::bench_run::plan_file::Plan;
use bowden_host_link::bench_run::{Action, Item, Setting, carry_out, items};
use bowden_host_link::evidence::Origin;
use bowden_host_link::rig_file::Weight;
use serde::Serialize;

use super::port::PortArguments;
use super::{print, print_json};
use crate::interrupt;

/// Arguments of `bowden run`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "All that the plan asks for is checked against its limits and the board's before anything moves. A run that was stopped goes \
                  on with the same command: steps that are done stand in OUT/run.json, what was recorded of the stopped one is kept as \
                  NAME.stopped-N. A motion begins with self test, pretension check and homing."
)]
pub struct RunArguments {
    /// Plan (schema bowden-plan/1)
    plan: PathBuf,
    #[command(flatten)]
    port: PortArguments,
    /// Folder of recordings and summary
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Format of the recordings
    #[arg(long, value_name = "ENDING", default_value = "mcap", value_parser = ["csv", "csv.gz", "mcap"])]
    format: String,
    /// What is to be remembered of this run; it stands in every recording
    #[arg(long, value_name = "TEXT")]
    note: Option<String>,
    /// Weight on the arm and its distance from the axis, for the rig in every recording: the board does not know it
    #[arg(long, value_name = "KG,M")]
    load: Option<Weight>,
    /// Show what would be done, and do nothing
    #[arg(long)]
    dry_run: bool,
    /// Print JSON: one object
    #[arg(long)]
    json: bool,
}

/// A plan that was not carried out.
#[derive(Serialize)]
struct Listed<'p> {
    plan: &'p str,
    steps: Vec<ListedStep<'p>>,
}

#[derive(Serialize)]
struct ListedStep<'p> {
    name: &'p str,
    what: String,
}

/// A plan that was carried out.
#[derive(Serialize)]
struct Facts<'p> {
    plan: &'p str,
    /// Steps that were done before this start.
    before: usize,
    steps: &'p [Done],
}

impl RunArguments {
    /// Checks and carries out the plan.
    ///
    /// # Errors
    /// Exit status 2: an unusable plan or folder, or a plan that this joint cannot do; 1: a fault, Ctrl-C, or a broken link or medium. What was
    /// done until then is kept.
    pub fn run(&self, progress: &dyn Progress) -> Result<Outcome, Failure> {
        let name = self.plan.display().to_string();
        let text = std::fs::read_to_string(&self.plan).map_err(|error| {
            Failure::bad_input(format!("{name}: {}; name a plan", output::describe(&error)))
        })?;
        let plan = Plan::parse(&text, &name, self.plan.parent().unwrap_or(Path::new("")))?;
        interrupt::catch()?;
        let mut session = Session::new(self.port.connect()?)?;
        progress.stage("checking the plan", 0);
        let items = items(&plan, &session.parameters().control())?;
        if self.dry_run {
            if self.json {
                let steps = items.iter().map(|item| ListedStep { name: &item.name, what: what(item) });
                print_json(&Listed { plan: &plan.name, steps: steps.collect() })?;
            } else {
                print(&format!("{}: {} steps\n{}", plan.name, items.len(), list(&items)))?;
            }
            return Ok(Outcome::done());
        }
        output::prepare_folder(&self.out, &[], &[&self.plan])?;
        let (greeting, _) = session.board();
        let board = format!("{} {}", greeting.board, greeting.serial).trim_end().to_owned();
        let mut ledger = Ledger::open(&self.out, &text, &board)?;
        let before = ledger.done().len();
        let origin = Origin { note: self.note.clone(), ..super::origin() };
        let setting = Setting {
            folder: &self.out,
            ending: &self.format,
            origin: &origin,
            load: self.load,
            text: &text,
            stop: &interrupt::requested,
            progress,
        };
        carry_out(&mut session, &items, &mut ledger, &setting)?;
        let summary = summary(&plan.name, ledger.done(), before);
        let path = self.out.join("summary.txt");
        output::write_text(&path, &summary).map_err(|error| {
            Failure::failed(format!(
                "{}: cannot be written: {}; make room",
                path.display(),
                output::describe(&error)
            ))
        })?;
        if self.json {
            print_json(&Facts { plan: &plan.name, before, steps: ledger.done() })?;
        } else {
            print(&summary)?;
        }
        let mut outcome = Outcome::done();
        let losses =
            ledger.done().iter().filter_map(|done| Some(format!("{}: {}", done.name, done.loss.as_ref()?)));
        outcome.extend(losses);
        Ok(outcome)
    }
}

/// What would be done.
fn list(items: &[Item]) -> String {
    let line = |item: &Item| format!("{:<24} {}\n", item.name, what(item));
    items.iter().map(line).collect()
}

/// What a step does, in words.
fn what(item: &Item) -> String {
    match &item.action {
        Action::PretensionCheck => "self test and pretension check".to_owned(),
        Action::Home => "homing".to_owned(),
        Action::Pause(pause) => format!("{} s, the bridge off", pause.as_secs_f64()),
        Action::Follow(motion) => motion.words(),
    }
}

/// What was done.
fn summary(name: &str, done: &[Done], before: usize) -> String {
    let again = if before == 0 { String::new() } else { format!(", {before} of them before this start") };
    let mut text = format!("{name}: {} steps done{again}\n", done.len());
    for Done { name, seconds, file, rows, loss } in done {
        let recorded = file.as_ref().map_or_else(String::new, |file| format!("  {rows} rows in {file}"));
        let loss = loss.as_ref().map_or_else(String::new, |loss| format!("  {loss}"));
        let _ = writeln!(text, "{name:<24} {seconds:>9.3} s{recorded}{loss}");
    }
    text
}
