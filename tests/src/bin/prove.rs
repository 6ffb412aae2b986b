//! `cargo xtask prove`: the concealed-effects benchmark on the command line.
#![forbid(unsafe_code)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use bowden_tests::prove::lengths::{self, LENGTHENED, Lengths, lengths};
use bowden_tests::prove::outcome::{Log, Outcome};
use bowden_tests::prove::page::{Provenance, render};
use bowden_tests::prove::plan::{Group, Plan, plans, quick_sample, thinned};
use bowden_tests::prove::rivals::{RivalOutcome, Rivals};
use bowden_tests::prove::run::{key, run};
use bowden_tests::prove::score::{concealed_shortly, said_shortly, score};
use bowden_tests::prove::summary::Summary;
use bowden_tests::prove::tool::Tool;
use clap::{Args, Parser};

/// Hide effects in rigs of the virtual bench and count how often `bowden diagnose` finds them
///
/// A run may be interrupted: results are kept, and a case that was done with the same binary is not done again.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask prove", args_override_self = true)]
#[command(after_help = "Exit status: 0 done, 1 failed or, with --strict, a goal is missed, 2 bad usage.")]
struct Options {
    /// A sample of 24 rigs of all groups; proof.md stays as it is
    #[arg(long)]
    quick: bool,
    /// Only a group (single, pair, triple, nothing, parameters, outside, mixed …), an effect, or cases whose name begins so.
    /// May be repeated; proof.md stays as it is
    #[arg(long, value_name = "GROUP|EFFECT")]
    only: Vec<String>,
    /// Only each N-th case of every group, for a page in a part of the time, which says so
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=20))]
    every: u8,
    /// Seed of the whole run
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Diagnoses at a time; they share the processors
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    jobs: u16,
    /// Keep the files of every case in this folder, and the results as well
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Do every case again, also those that were done with this binary
    #[arg(long)]
    fresh: bool,
    /// Exit status 1 if a goal is missed
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    show: Show,
    #[command(flatten)]
    others: Others,
    /// The binary to prove
    #[arg(long, value_name = "FILE", default_value = "target/release/bowden")]
    bowden: PathBuf,
    /// Folder of the results when --out is not given
    #[arg(long, value_name = "DIR", default_value = "target/prove")]
    results: PathBuf,
    /// Page that a complete run writes
    #[arg(long, value_name = "FILE")]
    proof: Option<PathBuf>,
}

/// What is shown instead of a run.
#[derive(Debug, Args)]
struct Show {
    /// List the cases with their seeds and do nothing
    #[arg(long)]
    list: bool,
    /// Run nothing: print what has been done so far with this binary
    #[arg(long)]
    so_far: bool,
    /// What longer recordings cost: time and memory of two cases, or those of --only, at 40 s, six minutes and an hour, which
    /// takes half an hour
    #[arg(long)]
    lengths: bool,
}

/// Other tools on the same files.
#[derive(Debug, Args)]
struct Others {
    /// Run other tools on the files of a sample of the cases as well, the one of --quick; tests/rivals/install gets them
    #[arg(long)]
    rivals: bool,
    /// Python environment of the rivals, by default the folder `rivals` in cargo's target folder
    #[arg(long, value_name = "DIR")]
    venv: Option<PathBuf>,
}

impl Others {
    /// `None` where nobody asks for them.
    fn open(&self) -> Result<Option<Rivals>, String> {
        if !self.rivals {
            return Ok(None);
        }
        let here = std::env::current_exe().map_err(|error| format!("this program's own path: {error}"))?;
        let target = here.ancestors().nth(2).unwrap_or(&here);
        let venv = self.venv.clone().unwrap_or_else(|| target.join("rivals"));
        Rivals::new(&venv, &Path::new(env!("CARGO_MANIFEST_DIR")).join("rivals")).map(Some)
    }
}

fn main() -> ExitCode {
    let options = Options::parse();
    match prove(&options) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(reason) => {
            eprintln!("prove: {reason}");
            ExitCode::FAILURE
        }
    }
}

/// Whether the goals are met, or need not be.
fn prove(options: &Options) -> Result<bool, String> {
    let plans = chosen(options)?;
    if options.show.list {
        for plan in &plans {
            println!("{:<50} {:>7}  {}", plan.name, plan.seed, plan.hidden().join(", "));
        }
        return Ok(true);
    }
    let rivals = options.others.open()?;
    let folder = options.out.as_deref().unwrap_or(&options.results);
    fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let folder = folder.canonicalize().map_err(|error| format!("{}: {error}", folder.display()))?;
    let bowden = options.bowden.canonicalize().unwrap_or_else(|_| options.bowden.clone());
    let processors = thread::available_parallelism().map_or(1, usize::from);
    let jobs = usize::from(options.jobs);
    let threads = (processors / jobs).max(1);
    let tool = Tool::new(&bowden, threads)?;
    if options.show.lengths {
        return cost_of_length(&tool, &plans, options);
    }
    let log = Log::open(&folder.join("results.jsonl"))?;
    let rivals = match rivals {
        Some(rivals) => Some((rivals, Log::open(&folder.join("rivals.jsonl"))?)),
        None => None,
    };
    // A run takes hours, in which the workspace may go on.
    let commit = commit();
    let work = Work { tool: &tool, log: &log, rivals: rivals.as_ref(), options, folder: &folder };
    let (outcomes, rival_outcomes) = work.all(&plans, jobs)?;

    let complete = outcomes.len() == plans.len();
    let summary = Summary::of(outcomes);
    let provenance = Provenance {
        date: time::OffsetDateTime::now_utc().date().to_string(),
        commit,
        machine: machine(processors),
        tool: tool.version(),
        threads,
        jobs,
        seed: options.seed,
        every: usize::from(options.every),
    };
    let page = render(&summary, &rival_outcomes, &provenance);
    println!("\n{page}");
    if let Some(proof) = &options.proof
        && complete
        && !options.quick
        && options.only.is_empty()
    {
        fs::write(proof, &page).map_err(|error| format!("{}: {error}", proof.display()))?;
        println!("written to {}", proof.display());
    }
    Ok(!options.strict || summary.goals().iter().all(|goal| goal.met != Some(false)))
}

/// Prints what longer recordings cost; whether an hour takes no more memory than it may, or need not.
fn cost_of_length(tool: &Tool, plans: &[Plan], options: &Options) -> Result<bool, String> {
    let is_asked = |plan: &&Plan| !options.only.is_empty() || LENGTHENED.contains(&plan.name.as_str());
    let folder = tempfile::tempdir().map_err(|error| format!("temporary folder: {error}"))?;
    let all: Result<Vec<Lengths>, String> = plans
        .iter()
        .filter(is_asked)
        .map(|plan| {
            // An hour of recording takes a quarter of an hour; whoever waits sees what is done.
            lengths(tool, plan, folder.path(), |recorded_s, cost| {
                eprintln!(
                    "{}: {recorded_s:.0} s took {:.0} s and {:.0} MB",
                    plan.name, cost.seconds, cost.peak_mb
                );
            })
        })
        .collect();
    let (page, met) = lengths::page(&all?);
    print!("{page}");
    Ok(met || !options.strict)
}

/// The cases that the options ask for.
fn chosen(options: &Options) -> Result<Vec<Plan>, String> {
    let mut plans = thinned(plans(options.seed), usize::from(options.every));
    for word in &options.only {
        if !plans.iter().any(|plan| plan.matches(word)) {
            let groups = Group::ALL.map(Group::name).join(", ");
            return Err(format!(
                "--only {word}: no case; expected one of {groups}, an effect that the bench can hide, or the beginning of a \
                 name that --list shows"
            ));
        }
    }
    if !options.only.is_empty() {
        plans.retain(|plan| options.only.iter().any(|word| plan.matches(word)));
    }
    Ok(if options.quick { quick_sample(plans) } else { plans })
}

/// What all cases of a run share.
struct Work<'a> {
    tool: &'a Tool,
    log: &'a Log,
    rivals: Option<&'a (Rivals, Log<RivalOutcome>)>,
    options: &'a Options,
    folder: &'a Path,
}

impl Work<'_> {
    /// Every case that is done or can be done, in the order of the plans, and the rivals on a sample of them.
    fn all(&self, plans: &[Plan], jobs: usize) -> Result<(Vec<Outcome>, Vec<RivalOutcome>), String> {
        let next = AtomicUsize::new(0);
        let done = Mutex::new(Vec::new());
        let sample = quick_sample(plans.to_vec());
        let work = || -> Result<(), String> {
            loop {
                let place = next.fetch_add(1, Ordering::Relaxed);
                let Some(plan) = plans.get(place) else { return Ok(()) };
                let Some(outcome) = self.one(plan)? else { continue };
                println!("[{:>3}/{}] {}", place + 1, plans.len(), line(&outcome));
                let others = if sample.contains(plan) { self.others(plan)? } else { Vec::new() };
                done.lock().unwrap_or_else(PoisonError::into_inner).push((place, outcome, others));
            }
        };
        thread::scope(|scope| {
            let workers: Vec<_> = (0..jobs).map(|_| scope.spawn(work)).collect();
            let ends = workers
                .into_iter()
                .map(|worker| worker.join().unwrap_or_else(|_| Err("a case panicked".to_owned())));
            ends.collect::<Result<Vec<()>, String>>()
        })?;
        let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
        done.sort_by_key(|(place, ..)| *place);
        let (outcomes, others): (Vec<_>, Vec<_>) =
            done.into_iter().map(|(_, outcome, others)| (outcome, others)).unzip();
        Ok((outcomes, others.concat()))
    }

    /// The rivals on a case; without any, or where nothing shall be run, those that are done.
    fn others(&self, plan: &Plan) -> Result<Vec<RivalOutcome>, String> {
        let Some((rivals, log)) = self.rivals else { return Ok(Vec::new()) };
        let case = plan.case().map_err(|error| format!("{}: {error}", plan.name))?;
        let known = rivals.known(log, self.tool, plan, &case);
        if self.options.show.so_far {
            return Ok(known);
        }
        let done = if self.options.fresh { Vec::new() } else { known };
        self.in_folder(plan, |folder| rivals.run(log, self.tool, (plan, &case), folder, done))
    }

    /// Does something in the folder of a case: one that is kept, or one that is gone afterwards.
    fn in_folder<T>(&self, plan: &Plan, work: impl FnOnce(&Path) -> Result<T, String>) -> Result<T, String> {
        if self.options.out.is_some() {
            return work(&self.folder.join(plan.name.replace('/', "-")));
        }
        let folder = tempfile::tempdir().map_err(|error| format!("temporary folder: {error}"))?;
        work(folder.path())
    }

    /// `None` for a case that is not done yet where nothing shall be run.
    fn one(&self, plan: &Plan) -> Result<Option<Outcome>, String> {
        let case = plan.case().map_err(|error| format!("{}: {error}", plan.name))?;
        let known = self.log.find(&plan.name, &key(self.tool, plan, &case));
        if self.options.show.so_far {
            return Ok(known.cloned());
        }
        if let Some(known) = known.filter(|_| !self.options.fresh) {
            return Ok(Some(known.clone()));
        }
        let outcome = self.in_folder(plan, |folder| run(self.tool, plan, &case, folder))?;
        self.log.append(&outcome)?;
        Ok(Some(outcome))
    }
}

/// One case in one line.
fn line(outcome: &Outcome) -> String {
    let score = score(outcome);
    let ratio = score.heldout_ratio.map_or(String::new(), |ratio| format!(", held out {ratio:.2}"));
    let failure = outcome.failure.as_ref().map_or(String::new(), |reason| format!(", {reason}"));
    format!(
        "{:<5} {}: {} -> {} ({:.1} s{ratio}{failure})",
        if score.right { "right" } else { "WRONG" },
        outcome.name,
        concealed_shortly(outcome),
        said_shortly(outcome),
        outcome.cost.seconds,
    )
}

/// Commit of the workspace that the run is started in, with a word where files differ from it.
fn commit() -> String {
    let git = |arguments: &[&str]| {
        let out = Command::new("git").args(arguments).output().ok()?;
        out.status.success().then(|| String::from_utf8_lossy(&out.stdout).trim().to_owned())
    };
    let Some(commit) = git(&["rev-parse", "--short=12", "HEAD"]) else { return "not known".to_owned() };
    match git(&["status", "--porcelain", "--untracked-files=no"]) {
        Some(changes) if changes.is_empty() => commit,
        _ => format!("{commit} with changes"),
    }
}

/// Processor, its cores, and memory, where the system says.
fn machine(processors: usize) -> String {
    let field = |path: &str, name: &str| -> Option<String> {
        let text = fs::read_to_string(path).ok()?;
        let line = text.lines().find(|line| line.starts_with(name))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    };
    let model = field("/proc/cpuinfo", "model name").unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    let memory = field("/proc/meminfo", "MemTotal")
        .and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok())
        .map_or(String::new(), |kilobytes| format!(", {:.0} GB", kilobytes / 1e6));
    format!("{model}, {processors} threads{memory}")
}
