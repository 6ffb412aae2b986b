//! A survey in which a diagnosis panics. One test in a process of its own, because the hook for panics is the process's.

use std::fs::{self, File};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use bowden_core::progress::{Progress, Quiet};
use bowden_core::rig::Rig;
use bowden_core::simulate::{Motion, Reference, RunOptions, run};
use bowden_core::survey::{Plan, survey};
use parquet::file::reader::{FileReader, SerializedFileReader};

const RIG: &str = include_str!("rigs/bench.toml");

/// Panics the first time that a diagnosis, which runs in a pool of threads, asks whether it is to end.
struct PanicsOnce(AtomicBool);

impl Progress for PanicsOnce {
    fn stage(&self, _name: &str, _steps: u64) {}

    fn advance(&self, _steps: u64) {}

    fn interrupted(&self) -> bool {
        let is_first = rayon::current_thread_index().is_some() && !self.0.swap(true, Ordering::Relaxed);
        assert!(!is_first, "injected\nin two lines");
        false
    }
}

/// `recording` and `status` of every row.
fn statuses(folder: &Path) -> Vec<(String, String)> {
    let file = File::open(folder.join("recordings.parquet")).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    let cell = |row: &parquet::record::Row, name: &str| {
        let found = row.get_column_iter().find(|(column, _)| *column == name).map(|(_, field)| field);
        found.unwrap().to_string().trim_matches('"').to_owned()
    };
    let rows = reader.get_row_iter(None).unwrap().map(|row| row.unwrap());
    rows.map(|row| (cell(&row, "recording"), cell(&row, "status"))).collect()
}

#[test]
fn a_panic_in_one_diagnosis_fails_its_recording_alone() {
    let place = tempfile::tempdir().unwrap();
    let [recordings, out] = ["recordings", "out"].map(|name| place.path().join(name));
    fs::create_dir(&recordings).unwrap();
    fs::write(recordings.join("rig.toml"), RIG).unwrap();
    let rig = Rig::parse(RIG, "bench.toml").unwrap();
    for seed in 1..=3 {
        let reference = Reference::of_motion(Motion::Multisine, 4.0, seed);
        let recorded = run(&rig, &reference, RunOptions { seconds: 4.0, rate_hz: 250.0, seed }).unwrap();
        recorded.save(&recordings.join(format!("run-{seed}.csv"))).unwrap();
    }
    let plan = Plan::new(&recordings, &[], &out).unwrap();

    // The command's own hook ends the process: what reaches it has stopped the survey.
    let printed = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&printed);
    std::panic::set_hook(Box::new(move |_| {
        counted.fetch_add(1, Ordering::Relaxed);
    }));
    let summary = survey(&plan, &out, 1, &PanicsOnce(AtomicBool::new(false)));
    let reached_hook = printed.load(Ordering::Relaxed);
    drop(std::panic::take_hook());
    let summary = summary.unwrap();

    assert_eq!(reached_hook, 0);
    assert_eq!((summary.diagnosed, summary.kept, summary.left), (2, 0, 0));
    let [(recording, message)] = summary.failed.as_slice() else { panic!("{:?}", summary.failed) };
    assert_eq!(recording, "run-1.csv");
    let file = recordings.join("run-1.csv");
    assert!(message.starts_with(&format!("{}: the diagnosis panicked at ", file.display())), "{message}");
    assert!(message.contains("survey_panic.rs:"), "{message}");
    assert!(
        message.contains(" (injected in two lines), a fault of bowden and not of the recording; report it"),
        "{message}"
    );
    let status = |name: &str, status: &str| (name.to_owned(), status.to_owned());
    let of_first =
        |first: &str| [status("run-1.csv", first), status("run-2.csv", "done"), status("run-3.csv", "done")];
    assert_eq!(statuses(&out), of_first("failed"));
    assert!(fs::read_to_string(out.join("survey.html")).unwrap().contains("a fault of bowden"));

    // The next run keeps the others and tries it again.
    let summary = survey(&plan, &out, 1, &Quiet).unwrap();
    assert_eq!((summary.diagnosed, summary.kept, summary.failed.len()), (1, 2, 0));
    assert_eq!(statuses(&out), of_first("done"));
}
