//! Other tools on the same files: how well they predict the held-out recording, and at what cost.
//!
//! None of them names physics. Each sees the training recording, the rig file, the held-out inputs, and the first 0.1 s
//! of the held-out outputs, which nobody is judged by; its prediction is judged like a replay.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs::{self, File};
use std::hash::{DefaultHasher, Hasher};
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::{Deserialize, Serialize};
use virtual_bench::{Case, Recording};

use super::outcome::{Cost, Errors, Kept, Log, Outcome};
use super::plan::{Group, Plan};
use super::run::{key_of_case, write_case};
use super::score::ratio;
use super::summary::{median, quantile};
use super::tool::{LIMIT, Tool, errors, measured};

/// Samples of the held-out outputs that a rival may see: its initial state. A replay is compared from the 300th on.
const INITIAL_SAMPLES: usize = 100;

/// Variables that keep numerical libraries to one thread.
const ONE_THREAD: [&str; 3] = ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"];

/// Simulation with recalibrated parameters and nothing else: what every discrepancy model stands on.
const RECALIBRATED: &str = "recalibrated";

/// Packages with their versions.
const REQUIREMENTS: &str = include_str!("../../rivals/requirements.txt");

/// One tool, or a way to use it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Rival {
    /// Its script without the ending.
    id: &'static str,
    /// Name in the table.
    title: &'static str,
    /// Package whose version belongs to the name.
    package: Option<&'static str>,
    /// What it says of the physics.
    names: &'static str,
    /// Whether bowden's simulation is part of it.
    simulates: bool,
}

const RIVALS: [Rival; 5] = [
    Rival { id: RECALIBRATED, title: "`bowden fit` alone", package: None, names: "no", simulates: true },
    Rival {
        id: "discrepancy",
        title: "that with a Gaussian process, scikit-learn",
        package: Some("scikit-learn"),
        names: "no",
        simulates: true,
    },
    Rival {
        id: "bam",
        title: "that with BAM-style M1–M6 at the motor",
        package: None,
        names: "one of six motor frictions",
        simulates: true,
    },
    Rival {
        id: "narx",
        title: "SysIdentPy",
        package: Some("sysidentpy"),
        names: "no: polynomials",
        simulates: false,
    },
    Rival {
        id: "sindy",
        title: "PySINDy",
        package: Some("pysindy"),
        names: "no: polynomials",
        simulates: false,
    },
];

/// What a script writes beside its prediction.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Remarks {
    /// Settings that validated best.
    pub chosen: BTreeMap<String, String>,
    /// Channels of which the best settings left the training data by three of its ranges, and when, s.
    pub diverged_s: BTreeMap<String, f64>,
}

/// One rival on one case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RivalOutcome {
    /// Name of the case.
    pub case: String,
    /// Which rival.
    pub rival: String,
    /// Hash of the rival, of what it is given, and of the case as it was drawn.
    pub key: String,
    /// Held-out errors; empty where it failed.
    pub errors: Errors,
    /// What it chose, and where it diverged.
    pub remarks: Remarks,
    /// Why there is no prediction.
    pub failure: Option<String>,
    /// Time and memory.
    pub cost: Cost,
}

impl Kept for RivalOutcome {
    fn is(&self, name: &str, key: &str) -> bool {
        name.strip_prefix(self.case.as_str()).and_then(|rest| rest.strip_prefix(' ')) == Some(&self.rival)
            && self.key == key
    }
}

/// The rivals with the Python that runs them.
#[derive(Debug)]
pub struct Rivals {
    python: PathBuf,
    scripts: PathBuf,
}

impl Rivals {
    /// The rivals of `scripts` in the environment `venv`.
    ///
    /// # Errors
    /// When the environment is not there; the reason names the script that makes it.
    pub fn new(venv: &Path, scripts: &Path) -> Result<Self, String> {
        let python = venv.join("bin").join("python");
        // The last thing that the script leaves: an environment that was not finished does not count.
        if !venv.join("installed").exists() {
            return Err(format!(
                "--rivals: no Python environment in {}; {} makes it from PyPI",
                venv.display(),
                scripts.join("install").display()
            ));
        }
        Ok(Self { python, scripts: scripts.to_owned() })
    }

    /// What of a case is done already.
    #[must_use]
    pub fn known(&self, log: &Log<RivalOutcome>, tool: &Tool, plan: &Plan, case: &Case) -> Vec<RivalOutcome> {
        let found = RIVALS.iter().filter_map(|rival| {
            let name = format!("{} {}", plan.name, rival.id);
            log.find(&name, &self.key(*rival, tool, plan, case)).cloned()
        });
        found.collect()
    }

    /// Runs on one case, in a folder below `folder`, the rivals that are not among `done`, and keeps each at once.
    ///
    /// # Errors
    /// When the bench refuses the case or a file cannot be written; what goes wrong in a rival is part of its outcome.
    pub fn run(
        &self,
        log: &Log<RivalOutcome>,
        tool: &Tool,
        (plan, case): (&Plan, &Case),
        folder: &Path,
        mut done: Vec<RivalOutcome>,
    ) -> Result<Vec<RivalOutcome>, String> {
        let missing = |rival: &&Rival| done.iter().all(|outcome| outcome.rival != rival.id);
        let missing: Vec<Rival> = RIVALS.iter().filter(missing).copied().collect();
        if missing.is_empty() {
            return Ok(done);
        }
        let heldout = write_case(plan, case, folder)?;
        let seen = folder.join("rivals");
        show(folder, &seen, &heldout)?;
        let recalibrated = recalibrate(tool, &seen);
        for rival in missing {
            let mut outcome = RivalOutcome {
                case: plan.name.clone(),
                rival: rival.id.to_owned(),
                key: self.key(rival, tool, plan, case),
                errors: Errors::new(),
                remarks: Remarks::default(),
                failure: None,
                cost: Cost::default(),
            };
            let found = match &recalibrated {
                Err(reason) if rival.simulates => Err(reason.clone()),
                Ok(cost) if rival.id == RECALIBRATED => {
                    errors(&seen.join("recalibrated-heldout.csv"), &heldout)
                        .map(|errors| (errors, Remarks::default(), *cost))
                }
                _ => self.predict(rival, &seen, &heldout),
            };
            match found {
                Ok((errors, remarks, cost)) => {
                    outcome = RivalOutcome { errors, remarks, cost, ..outcome };
                }
                Err(reason) => outcome.failure = Some(reason),
            }
            log.append(&outcome)?;
            done.push(outcome);
        }
        Ok(done)
    }

    fn predict(
        &self,
        rival: Rival,
        seen: &Path,
        heldout: &Recording,
    ) -> Result<(Errors, Remarks, Cost), String> {
        let prediction = seen.join(rival.id).with_extension("csv");
        if prediction.exists() {
            // One of an earlier run must not stand in for one that fails now.
            fs::remove_file(&prediction).map_err(|error| format!("{}: {error}", prediction.display()))?;
        }
        let mut command = Command::new(&self.python);
        command.arg(self.scripts.join(rival.id).with_extension("py")).arg(".");
        command.envs(ONE_THREAD.map(|name| (name, "1"))).env("PYTHONDONTWRITEBYTECODE", "1");
        let cost = measured(&mut command, seen, rival.id, &[0], LIMIT)?;
        let remarks = prediction.with_extension("json");
        let text = fs::read_to_string(&remarks).map_err(|error| format!("{}: {error}", remarks.display()))?;
        let remarks =
            serde_json::from_str(&text).map_err(|error| format!("{}: {error}", remarks.display()))?;
        Ok((errors(&prediction, heldout)?, remarks, cost))
    }

    fn key(&self, rival: Rival, tool: &Tool, plan: &Plan, case: &Case) -> String {
        let mut hasher = DefaultHasher::new();
        for script in [rival.id, "case_files"] {
            // A script that is missing shows when it is run.
            hasher.write(&fs::read(self.scripts.join(script).with_extension("py")).unwrap_or_default());
        }
        hasher.write(REQUIREMENTS.as_bytes());
        if rival.simulates {
            hasher.write_u64(tool.hash());
        }
        format!("{:016x}-{}", hasher.finish(), key_of_case(plan, case))
    }
}

/// Puts what a rival may see, and nothing else, into the folder `seen`.
fn show(folder: &Path, seen: &Path, heldout: &Recording) -> Result<(), String> {
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", seen.display());
    fs::create_dir_all(seen).map_err(|error| failed(&error))?;
    for name in ["rig.toml", "train.csv", "inputs.csv"] {
        fs::copy(folder.join(name), seen.join(name)).map_err(|error| failed(&error))?;
    }
    let file = File::create(seen.join("initial.csv")).map_err(|error| failed(&error))?;
    let mut whole = Vec::new();
    heldout.write_csv(&mut whole).map_err(|error| failed(&error))?;
    let lines = whole.split_inclusive(|byte| *byte == b'\n').take(1 + INITIAL_SAMPLES);
    let mut file = BufWriter::new(file);
    for line in lines {
        std::io::Write::write_all(&mut file, line).map_err(|error| failed(&error))?;
    }
    std::io::Write::flush(&mut file).map_err(|error| failed(&error))
}

/// Recalibrates, and replays both recordings.
fn recalibrate(tool: &Tool, seen: &Path) -> Result<Cost, String> {
    let rig = "recalibrated.toml";
    let fit = tool.fit(seen, rig)?;
    let train = tool.replay_to(seen, "train.csv", rig, "recalibrated-train.csv")?;
    let heldout = tool.replay_to(seen, "inputs.csv", rig, "recalibrated-heldout.csv")?;
    let sum = |of: fn(&Cost) -> f64| of(&fit) + of(&train) + of(&heldout);
    Ok(Cost {
        seconds: sum(|cost| cost.seconds),
        cpu_seconds: sum(|cost| cost.cpu_seconds),
        peak_mb: fit.peak_mb.max(train.peak_mb).max(heldout.peak_mb),
    })
}

/// Version that `requirements.txt` pins.
fn version(package: &str) -> Option<&'static str> {
    let mut pins = REQUIREMENTS.lines().filter_map(|line| line.split_once("=="));
    let (_, rest) = pins.find(|(name, _)| *name == package)?;
    rest.split_whitespace().next()
}

/// One tool over many cases.
#[derive(Debug, Default)]
struct Row {
    /// Group and ratio to the truth's error, of each case.
    ratios: Vec<(Group, f64)>,
    nearer_than_bowden: usize,
    diverged: usize,
    failed: usize,
    seconds: Vec<f64>,
    cpu_seconds: Vec<f64>,
}

impl Row {
    fn add(&mut self, outcome: &Outcome, errors: &Errors, cost: &Cost) {
        let of_bowden = ratio(&outcome.replays.diagnosed, &outcome.replays.truth);
        match ratio(errors, &outcome.replays.truth) {
            Some(ratio) => {
                self.ratios.push((outcome.group, ratio));
                self.nearer_than_bowden += usize::from(of_bowden.is_some_and(|of_bowden| ratio < of_bowden));
                self.seconds.push(cost.seconds);
                self.cpu_seconds.push(cost.cpu_seconds);
            }
            None => self.failed += 1,
        }
    }
}

/// The table of the rivals beside bowden and the truth; empty without results.
#[must_use]
pub fn table(outcomes: &[&Outcome], results: &[RivalOutcome]) -> String {
    let mut page = String::new();
    // Writing to a string cannot fail.
    let _ = write(&mut page, outcomes, results);
    page
}

fn write(page: &mut String, outcomes: &[&Outcome], results: &[RivalOutcome]) -> std::fmt::Result {
    let ran: BTreeSet<&str> = results.iter().map(|result| result.case.as_str()).collect();
    let cases: Vec<&&Outcome> = outcomes
        .iter()
        .filter(|outcome| ran.contains(outcome.name.as_str()) && !outcome.replays.truth.is_empty())
        .collect();
    if cases.is_empty() {
        return Ok(());
    }
    let groups: Vec<Group> =
        Group::ALL.into_iter().filter(|group| cases.iter().any(|outcome| outcome.group == *group)).collect();
    writeln!(
        page,
        "\n## Rivals\n\n\
         Other tools on the same files; cases: {}. They see the training recording, the rig file, the held-out inputs and the\n\
         first 0.1 s of the held-out outputs, choose their settings on a third of the training recording, and run freely; their\n\
         predictions are judged like a replay. Ratio: held-out error of the prediction over that of the true physics with the\n\
         true parameters (root mean square over the channels); median by group, and median and 90 % of all. Diverged: cases in\n\
         which the best settings of a channel left the training data by three of its ranges; the next best took their place, and\n\
         where all diverged the channel stayed at its last good value. The rivals' times are those of one thread, without the\n\
         recalibration that some stand on. Settings and their sources: tests/rivals/README.md.\n",
        cases.len()
    )?;
    write!(page, "| tool | names physics | abstains |")?;
    for group in &groups {
        let count = cases.iter().filter(|outcome| outcome.group == *group).count();
        write!(page, " {} ({count}) |", group.name())?;
    }
    writeln!(page, " all | 90 % | nearer than bowden | diverged | failed | s | processor s |")?;
    writeln!(page, "|{}", "---|".repeat(groups.len() + 10))?;

    let mut truth = Row::default();
    let mut bowden = Row::default();
    for outcome in &cases {
        truth.add(outcome, &outcome.replays.truth, &Cost::default());
        bowden.add(outcome, &outcome.replays.diagnosed, &outcome.cost);
    }
    (truth.seconds, truth.cpu_seconds) = (Vec::new(), Vec::new());
    let known = "physics and parameters are given";
    line(page, &groups, "the truth, replayed", (known, ""), &truth)?;
    line(page, &groups, "`bowden diagnose`", ("yes, with a probability", "yes"), &bowden)?;
    for rival in RIVALS {
        let mut row = Row::default();
        for outcome in &cases {
            let mut of_it = results.iter().filter(|result| result.case == outcome.name);
            let Some(result) = of_it.find(|result| result.rival == rival.id) else { continue };
            row.add(outcome, &result.errors, &result.cost);
            row.diverged += usize::from(!result.remarks.diverged_s.is_empty());
        }
        let version = rival.package.and_then(version).map_or(String::new(), |version| format!(" {version}"));
        line(page, &groups, &format!("{}{version}", rival.title), (rival.names, "no"), &row)?;
    }
    failures(page, results)
}

fn line(
    page: &mut String,
    groups: &[Group],
    title: &str,
    (names, abstains): (&str, &str),
    row: &Row,
) -> std::fmt::Result {
    let number =
        |value: Option<f64>, digits: usize| value.map_or(String::new(), |value| format!("{value:.digits$}"));
    let all = || row.ratios.iter().map(|(_, ratio)| *ratio);
    write!(page, "| {title} | {names} | {abstains} |")?;
    for group in groups {
        let of_group = row.ratios.iter().filter(|(of, _)| of == group).map(|(_, ratio)| *ratio);
        write!(page, " {} |", number(median(of_group), 2))?;
    }
    writeln!(
        page,
        " {} | {} | {} | {} | {} | {} | {} |",
        number(median(all()), 2),
        number(quantile(all(), 0.9), 2),
        row.nearer_than_bowden,
        row.diverged,
        row.failed,
        number(median(row.seconds.iter().copied()), 1),
        number(median(row.cpu_seconds.iter().copied()), 1),
    )
}

fn failures(page: &mut String, results: &[RivalOutcome]) -> std::fmt::Result {
    for result in results {
        if let Some(reason) = &result.failure {
            writeln!(page, "\n{} failed on {}: {reason}", result.rival, result.case)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prove::outcome::tests::{diagnosis, outcome};

    fn errors_of(list: &[(&str, f64)]) -> Errors {
        list.iter().map(|(name, error)| ((*name).to_owned(), *error)).collect()
    }

    /// A case whose truth errs by 0.1 N and whose diagnosed rig by 0.2 N.
    fn case(group: Group) -> Outcome {
        let mut case = outcome(group, &[], diagnosis("consistent", &[]));
        case.replays.truth = errors_of(&[("f1_n", 0.1)]);
        case.replays.diagnosed = errors_of(&[("f1_n", 0.2)]);
        case
    }

    fn result(case: &Outcome, rival: &str, error_n: f64) -> RivalOutcome {
        RivalOutcome {
            case: case.name.clone(),
            rival: rival.to_owned(),
            key: "key".to_owned(),
            errors: errors_of(&[("f1_n", error_n)]),
            remarks: Remarks::default(),
            failure: None,
            cost: Cost { seconds: 7.0, cpu_seconds: 5.0, peak_mb: 1.0 },
        }
    }

    fn row<'a>(page: &'a str, title: &str) -> Vec<&'a str> {
        let line = page.lines().find(|line| line.starts_with(&format!("| {title}"))).unwrap();
        line.split('|').map(str::trim).collect()
    }

    #[test]
    fn the_table_has_ratios_by_group_and_counts_what_diverged_and_failed() {
        let (single, pair) = (case(Group::Single), case(Group::Pair));
        let mut far = result(&pair, "sindy", 0.5);
        far.remarks.diverged_s.insert("f1_n".to_owned(), 3.0);
        let mut broken = result(&pair, "narx", 0.0);
        (broken.errors, broken.failure) = (Errors::new(), Some("no numbers".to_owned()));
        let results = [result(&single, "sindy", 0.15), far, result(&single, "narx", 0.3), broken];
        let page = table(&[&single, &pair], &results);

        let sindy = row(&page, "PySINDy 2");
        // 0.15/0.1 and 0.5/0.1: medians 1.5 and 5 of the groups, 3.25 of both; 0.15 N is nearer than bowden's 0.2 N.
        assert_eq!(sindy[4..6], ["1.50", "5.00"]);
        assert_eq!(sindy[6..], ["3.25", "4.65", "1", "1", "0", "7.0", "5.0", ""]);
        assert_eq!(row(&page, "SysIdentPy")[4..11], ["3.00", "", "3.00", "3.00", "0", "0", "1"]);
        assert_eq!(row(&page, "`bowden diagnose`")[4..7], ["2.00", "2.00", "2.00"]);
        assert_eq!(row(&page, "the truth")[4..7], ["1.00", "1.00", "1.00"]);
        assert!(page.contains("narx failed on pair/by-hand: no numbers"), "{page}");
        let cells: BTreeSet<usize> =
            page.lines().filter(|line| line.starts_with('|')).map(|line| line.matches('|').count()).collect();
        assert_eq!(cells.len(), 1, "{page}");
        // The table stands on two pages, and only one of them has another table above it.
        assert!(
            page.contains("Ratio: held-out error of the prediction over that of the true physics"),
            "{page}"
        );
        assert!(!page.contains("above"), "{page}");
    }

    #[test]
    fn cases_that_no_rival_ran_on_are_left_out_of_every_row() {
        let (single, pair) = (case(Group::Single), case(Group::Pair));
        let page = table(&[&single, &pair], &[result(&single, "bam", 0.1)]);
        assert!(page.contains("single (1)") && !page.contains("pair ("), "{page}");
        assert_eq!(table(&[&single], &[]), "");
    }

    #[test]
    fn a_log_finds_a_rival_of_a_case_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rivals.jsonl");
        let kept = result(&case(Group::Pair), "bam", 0.25);
        Log::open(&path).unwrap().append(&kept).unwrap();
        let log = Log::<RivalOutcome>::open(&path).unwrap();
        assert_eq!(log.find("pair/by-hand bam", "key"), Some(&kept));
        for (name, key) in [("pair/by-hand bam", "other"), ("pair/by-hand sindy", "key"), ("pair bam", "key")]
        {
            assert_eq!(log.find(name, key), None, "{name}");
        }
    }

    #[test]
    fn a_missing_environment_is_one_line_that_names_the_script() {
        let folder = tempfile::tempdir().unwrap();
        let reason = Rivals::new(folder.path(), Path::new("tests/rivals")).unwrap_err();
        assert!(reason.ends_with("tests/rivals/install makes it from PyPI"), "{reason}");
        assert_eq!(reason.lines().count(), 1);
    }

    #[test]
    fn versions_are_those_that_are_installed() {
        for rival in RIVALS {
            assert_eq!(rival.package.is_some(), rival.package.and_then(version).is_some(), "{}", rival.id);
        }
        assert_eq!(version("pysindy"), Some("2.1.0"));
        assert_eq!(version("sindy"), None);
    }

    #[test]
    fn a_rival_sees_no_held_out_output_beyond_a_tenth_of_a_second() {
        let plan =
            super::super::plan::plans(1).into_iter().find(|plan| plan.group == Group::Nothing).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let heldout = write_case(&plan, &plan.case().unwrap(), folder.path()).unwrap();
        let seen = folder.path().join("rivals");
        show(folder.path(), &seen, &heldout).unwrap();
        let names: BTreeSet<_> = fs::read_dir(&seen)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        let expected = ["initial.csv", "inputs.csv", "rig.toml", "train.csv"].map(str::to_owned);
        assert_eq!(names, BTreeSet::from(expected));
        let initial = fs::read_to_string(seen.join("initial.csv")).unwrap();
        assert_eq!(initial.lines().count(), 101);
        assert!(initial.lines().last().unwrap().starts_with("0.099"), "{initial}");
    }
}
