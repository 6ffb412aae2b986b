//! Surveys: many recordings of several benches, ended and taken up again, with one that is no recording among them.

#[path = "../../build/sources.rs"]
mod sources;

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock};

use bowden_core::progress::{Progress, Quiet};
use bowden_core::rig::{Assignment, Rig};
use bowden_core::simulate::{Motion, Reference, RunOptions, run};
use bowden_core::survey::{Plan, Summary, survey};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::{Field, Row};

use crate::BENCH;

/// Dry friction of the joint, which the rig file does not state.
const STICKING: &str = "
[simulation]
effects = [\"joint_coulomb_friction\"]
[effects.joint_coulomb_friction]
torque_nm = 0.15
";

/// Records the bench with other parameters than its rig file states.
fn record(path: &Path, changed: &[&str], seed: u64) {
    record_with(path, "", changed, seed);
}

/// The same, with more in the rig than its file has.
fn record_with(path: &Path, more: &str, changed: &[&str], seed: u64) {
    let mut rig = Rig::parse(&[BENCH, more].concat(), "bench.toml").unwrap();
    for parameter in changed {
        parameter.parse::<Assignment>().unwrap().apply(&mut rig).unwrap();
    }
    let reference = Reference::of_motion(Motion::Multisine, 4.0, seed);
    let options = RunOptions { seconds: 4.0, rate_hz: 250.0, seed };
    run(&rig, &reference, options).unwrap().save(path).unwrap();
}

/// Two benches: the tendons of one lose tension from recording to recording, the other stays as it is. One file is no recording.
fn recordings() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path();
        for bench in ["loosening", "steady"] {
            fs::create_dir(place.join(bench)).unwrap();
        }
        fs::write(place.join("rig.toml"), BENCH).unwrap();
        for (number, pretension_n) in [(8_u64, 30.0), (9, 25.0), (10, 20.0)] {
            let changed = format!("tendon.pretension_n={pretension_n}");
            record(&place.join(format!("loosening/run-{number}.csv")), &[&changed], number);
        }
        record(&place.join("steady/run-9.mcap"), &[], 19);
        fs::write(place.join("steady/run-11.csv"), "t_s,duty\n0,0\n1,none\n").unwrap();
        folder
    });
    folder.path()
}

fn plan(out: &Path) -> Plan {
    Plan::new(recordings(), &[], out).unwrap()
}

fn rows(path: &Path) -> Vec<Row> {
    let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
    reader.get_row_iter(None).unwrap().map(|row| row.unwrap()).collect()
}

fn text(row: &Row, name: &str) -> String {
    let found = row.get_column_iter().find(|(column, _)| *column == name).map(|(_, field)| field.clone());
    match found {
        Some(Field::Str(text)) => text,
        Some(Field::Null) => String::new(),
        other => other.expect("no such column").to_string(),
    }
}

/// Every file of a survey by its path in the folder.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                all.insert(path.strip_prefix(folder).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    all
}

/// Wants the work to end after so many recordings.
struct EndsAfter(AtomicUsize);

impl Progress for EndsAfter {
    fn stage(&self, _name: &str, _steps: u64) {}

    fn advance(&self, _steps: u64) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }

    fn interrupted(&self) -> bool {
        self.0.load(Ordering::Relaxed) == 0
    }
}

#[test]
fn a_survey_says_which_bench_drifts_goes_on_where_it_stopped_and_gives_the_same_bytes() {
    let place = tempfile::tempdir().unwrap();
    let [whole, parts] = ["whole", "parts"].map(|name| place.path().join(name));
    let summary = survey(&plan(&whole), &whole, 2, &Quiet).unwrap();
    assert_eq!((summary.diagnosed, summary.kept, summary.left), (4, 0, 0));
    assert_eq!(summary.failed.len(), 1);
    let (recording, message) = &summary.failed[0];
    assert_eq!(recording, "steady/run-11.csv");
    assert!(message.contains("run-11.csv:3: column `duty`: got `none`"), "{message}");

    let listed = rows(&whole.join("recordings.parquet"));
    let order: Vec<String> = listed.iter().map(|row| text(row, "recording")).collect();
    assert_eq!(order[..3], ["8", "9", "10"].map(|run| format!("loosening/run-{run}.csv")));
    assert_eq!(order[3..], ["steady/run-9.mcap", "steady/run-11.csv"]);
    let status: Vec<String> = listed.iter().map(|row| text(row, "status")).collect();
    assert_eq!(status, ["done", "done", "done", "done", "failed"]);
    // That its pretension is not what the rig file states is said of the last recordings of the loosening bench.
    assert_eq!(text(&listed[2], "verdict"), "recalibrate", "{}", text(&listed[2], "summary"));
    assert_eq!(text(&listed[3], "verdict"), "consistent", "{}", text(&listed[3], "summary"));

    let drifting: Vec<(String, String)> = rows(&whole.join("drifts.parquet"))
        .iter()
        .filter(|row| text(row, "drifts") == "true")
        .map(|row| (text(row, "bench"), text(row, "parameter")))
        .collect();
    assert_eq!(drifting, [("loosening".to_owned(), "tendon.pretension_n".to_owned())]);
    let page = fs::read_to_string(whole.join("survey.html")).unwrap();
    assert!(page.contains("<code>tendon.pretension_n</code>") && page.contains("steady/run-11.csv"));
    assert!(!page.contains("http://") && !page.contains("https://") && !page.contains("<script"));

    // Ended after the first two, then taken up: the same bytes in every file.
    let summary = survey(&plan(&parts), &parts, 1, &EndsAfter(AtomicUsize::new(2))).unwrap();
    assert_eq!((summary.diagnosed, summary.left), (2, 3));
    assert_eq!(rows(&parts.join("recordings.parquet")).len(), 5);
    let summary = survey(&plan(&parts), &parts, 1, &Quiet).unwrap();
    assert_eq!((summary.diagnosed, summary.kept, summary.left), (2, 2, 0));
    assert_eq!(contents(&parts), contents(&whole));

    // What is done is kept; what has changed is done anew.
    let summary = survey(&plan(&parts), &parts, 2, &Quiet).unwrap();
    assert_eq!((summary.diagnosed, summary.kept), (0, 4));
    fs::write(parts.join("diagnoses/steady/run-9.mcap.json"), "{}").unwrap();
    let summary = survey(&plan(&parts), &parts, 2, &Quiet).unwrap();
    assert_eq!((summary.diagnosed, summary.kept), (1, 3));
    assert_eq!(contents(&parts), contents(&whole));
}

/// Reads, each time a recording is done, what the table then says of all recordings.
struct ReadsTheTable<'a> {
    out: &'a Path,
    read: Mutex<Vec<Vec<String>>>,
}

impl Progress for ReadsTheTable<'_> {
    fn stage(&self, _name: &str, _steps: u64) {}

    fn advance(&self, _steps: u64) {
        let table = self.out.join("recordings.parquet");
        let status = if table.exists() {
            rows(&table).iter().map(|row| text(row, "status")).collect()
        } else {
            Vec::new()
        };
        assert_eq!(self.out.join("survey.html").exists(), !status.is_empty());
        self.read.lock().unwrap().push(status);
    }
}

#[test]
fn tables_and_page_follow_while_a_survey_goes_on() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("recordings");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("rig.toml"), BENCH).unwrap();
    // No recording first: without a result there is nothing to write.
    fs::write(folder.join("run-0.csv"), "").unwrap();
    for seed in [1, 2] {
        record(&folder.join(format!("run-{seed}.csv")), &[], seed);
    }
    let out = place.path().join("out");
    let watcher = ReadsTheTable { out: &out, read: Mutex::default() };
    let summary = survey(&Plan::new(&folder, &[], &out).unwrap(), &out, 1, &watcher).unwrap();
    assert_eq!((summary.diagnosed, summary.failed.len()), (2, 1));
    let read = watcher.read.into_inner().unwrap();
    assert_eq!(read, [&[][..], &["failed", "done", "left"], &["failed", "done", "done"]]);

    // Written anew by a run that finds everything done, tables and page are the same.
    let after = contents(&out);
    for name in ["recordings", "effects", "parameters", "drifts"] {
        fs::remove_file(out.join(format!("{name}.parquet"))).unwrap();
    }
    fs::remove_file(out.join("survey.html")).unwrap();
    survey(&Plan::new(&folder, &[], &out).unwrap(), &out, 1, &Quiet).unwrap();
    assert_eq!(contents(&out), after);
}

#[test]
fn a_table_that_cannot_be_written_ends_a_survey_at_the_first_recording() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    fs::create_dir_all(out.join("effects.parquet")).unwrap();
    let failure = survey(&plan(&out), &out, 1, &Quiet).unwrap_err();
    assert!(failure.message().contains("effects.parquet: cannot be written: "), "{failure}");
    let kept: Vec<PathBuf> = contents(&out.join("diagnoses")).into_keys().collect();
    assert_eq!(kept, [Path::new("loosening/run-8.csv.json")]);
}

#[test]
fn a_survey_says_since_which_recording_a_bench_has_an_effect() {
    let place = tempfile::tempdir().unwrap();
    let [folder, out] = ["recordings", "out"].map(|name| place.path().join(name));
    fs::create_dir_all(folder.join("a")).unwrap();
    fs::write(folder.join("rig.toml"), BENCH).unwrap();
    for (seed, more) in [(1, ""), (2, STICKING), (3, STICKING)] {
        record_with(&folder.join(format!("a/run-{seed}.csv")), more, &[], seed);
    }
    let plan = Plan::new(&folder, &[], &out).unwrap();
    assert_eq!(survey(&plan, &out, 2, &Quiet).unwrap().diagnosed, 3);

    let found = rows(&out.join("effects.parquet"));
    let cells: Vec<[String; 3]> =
        found.iter().map(|row| ["recording", "id", "since"].map(|name| text(row, name))).collect();
    let friction = |recording: &str| [recording, "joint_coulomb_friction", "a/run-2.csv"].map(str::to_owned);
    assert_eq!(cells, [friction("a/run-2.csv"), friction("a/run-3.csv")]);
    let page = fs::read_to_string(out.join("survey.html")).unwrap();
    assert_eq!(
        page.matches("<code>joint_coulomb_friction</code> since run-2.csv").count(),
        2,
        "card and overview"
    );
    assert!(!page.contains("in every recording"));
}

#[test]
fn a_folder_of_which_nothing_can_be_diagnosed_says_the_first_reason() {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join("a.csv"), "").unwrap();
    let out = place.path().join("out");
    let refuse = |plan: &Plan| survey(plan, &out, 2, &Quiet).map(|_: Summary| ()).unwrap_err();
    let failure = refuse(&Plan::new(place.path(), &[], &out).unwrap());
    assert!(failure.message().contains("no rig: name one with --rig"), "{failure}");
    fs::write(place.path().join("rig.toml"), BENCH).unwrap();
    let failure = refuse(&Plan::new(place.path(), &[], &out).unwrap());
    assert!(failure.message().contains("a.csv:1: the file is empty"), "{failure}");
    let failure = Plan::new(&place.path().join("nowhere"), &[], &out).unwrap_err();
    assert!(failure.message().ends_with("is no folder; name the folder of the recordings"), "{failure}");
    fs::remove_file(place.path().join("a.csv")).unwrap();
    let failure = Plan::new(place.path(), &[], &out).unwrap_err();
    assert!(failure.message().contains("no recording"), "{failure}");
}

#[test]
fn the_digest_of_sources_is_of_names_and_contents_and_not_of_the_place() {
    let place = tempfile::tempdir().unwrap();
    let lay = |name: &str, files: &[(&str, &str)]| {
        let root = place.path().join(name);
        for (file, text) in files {
            let path = root.join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        sources::digest(&root, &["Cargo.lock", "src"]).unwrap()
    };
    let of = [("Cargo.lock", "1"), ("src/a.rs", "one"), ("src/b/c.rs", "two")];
    let first = lay("first", &of);
    assert_eq!(first.len(), 64);
    assert_eq!(lay("elsewhere", &[of[2], of[1], of[0], ("README.md", "not a source")]), first);
    let changed = [
        lay("contents", &[of[0], of[1], ("src/b/c.rs", "twO")]),
        lay("name", &[of[0], of[1], ("src/b/d.rs", "two")]),
        lay("moved", &[of[0], ("src/a.rs", "onetwo"), ("src/b/c.rs", "")]),
        lay("more", &[of[0], of[1], of[2], ("src/d.rs", "")]),
        lay("dependencies", &[("Cargo.lock", "2"), of[1], of[2]]),
        lay("without", &of[1..]),
    ];
    for (number, digest) in changed.iter().enumerate() {
        assert!(*digest != first && !changed[..number].contains(digest), "{number}");
    }
}
