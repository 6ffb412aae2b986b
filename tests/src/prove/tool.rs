//! The program under test, as its users meet it: a process that sees files only.

use std::fs::{self, File};
use std::hash::{DefaultHasher, Hasher};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use wait4::Wait4;

use super::outcome::{Cost, Errors};

/// A program that takes longer over one recording is ended.
pub const LIMIT: Duration = Duration::from_mins(10);

/// How often a running program is asked whether it is done.
const POLL: Duration = Duration::from_millis(10);

/// Bytes of the binary that are hashed at a time.
const PIECE: usize = 1 << 16;

/// Samples at the beginning of a replay that are not compared: the simulation starts from rest.
const SETTLING_SAMPLES: usize = 300;

/// Columns that a replay may see.
const REPLAY_COLUMNS: [&str; 5] = ["t_s", "theta_ref_rad", "theta_in_rad", "duty", "bus_v"];

/// The binary `bowden`.
#[derive(Clone, Debug)]
pub struct Tool {
    path: PathBuf,
    threads: usize,
    hash: u64,
    limit: Duration,
}

impl Tool {
    /// The binary at `path`, run with so many threads.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn new(path: &Path, threads: usize) -> Result<Self, String> {
        let failed = |error: std::io::Error| {
            format!("{}: {error}; expected the binary of bowden, built with --release", path.display())
        };
        // Piece by piece: a child's peak memory counts from what this process has in memory.
        let mut file = File::open(path).map_err(failed)?;
        let mut hasher = DefaultHasher::new();
        let mut piece = vec![0; PIECE];
        loop {
            let length = file.read(&mut piece).map_err(failed)?;
            if length == 0 {
                break;
            }
            hasher.write(&piece[..length]);
        }
        Ok(Self { path: path.to_owned(), threads, hash: hasher.finish(), limit: LIMIT })
    }

    /// The same, given so many times as long.
    #[must_use]
    pub fn patient(&self, times: u32) -> Self {
        Self { limit: LIMIT * times, ..self.clone() }
    }

    /// Hash of the binary's bytes.
    #[must_use]
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// What `--version` prints.
    #[must_use]
    pub fn version(&self) -> String {
        let printed = Command::new(&self.path).arg("--version").output();
        printed.map_or_else(
            |error| error.to_string(),
            |out| String::from_utf8_lossy(&out.stdout).trim().to_owned(),
        )
    }

    /// Diagnoses `train.csv` with `rig.toml` in `folder` into `folder/out`.
    ///
    /// # Errors
    /// When it cannot be started, fails or takes too long; the reason is its last line.
    pub fn diagnose(&self, folder: &Path) -> Result<Cost, String> {
        self.run(folder, &["diagnose", "train.csv", "--rig", "rig.toml", "--out", "out"])
    }

    /// Replays the inputs of the held-out recording with a rig of `folder` and compares with what was recorded.
    ///
    /// # Errors
    /// As [`Self::diagnose`]; or when the prediction cannot be read.
    pub fn replay(
        &self,
        folder: &Path,
        rig: &str,
        recorded: &virtual_bench::Recording,
    ) -> Result<Errors, String> {
        let predicted = "predicted.csv";
        self.replay_to(folder, "inputs.csv", rig, predicted)?;
        errors(&folder.join(predicted), recorded)
    }

    /// Recalibrates the nominal parameters to `train.csv` into a rig file of `folder`.
    ///
    /// # Errors
    /// As [`Self::diagnose`].
    pub fn fit(&self, folder: &Path, fitted: &str) -> Result<Cost, String> {
        self.run(folder, &["fit", "train.csv", "--rig", "rig.toml", "--out", fitted])
    }

    /// Replays any recording of `folder` into a file there.
    ///
    /// # Errors
    /// As [`Self::diagnose`].
    pub fn replay_to(&self, folder: &Path, recording: &str, rig: &str, out: &str) -> Result<Cost, String> {
        self.run(folder, &["replay", recording, "--rig", rig, "--out", out])
    }

    fn run(&self, folder: &Path, arguments: &[&str]) -> Result<Cost, String> {
        let mut command = Command::new(&self.path);
        command.args(arguments).arg("--quiet").arg("--jobs").arg(self.threads.to_string());
        // 3: done, but something was lost or repaired.
        measured(&mut command, folder, &format!("bowden {}", arguments[0]), &[0, 3], self.limit)
    }
}

/// Runs a program in `folder` to its end and measures what it used; what it says goes to `stderr.txt`.
///
/// # Errors
/// When it cannot be started, takes longer than `limit`, or does not end with one of the accepted exit statuses; the reason is its
/// last line.
pub fn measured(
    command: &mut Command,
    folder: &Path,
    what: &str,
    accepted: &[i32],
    limit: Duration,
) -> Result<Cost, String> {
    let said = folder.join("stderr.txt");
    let stderr = File::create(&said).map_err(|error| format!("{}: {error}", said.display()))?;
    command.current_dir(folder);
    let started = Instant::now();
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(stderr).spawn();
    let mut child = child.map_err(|error| {
        format!("{} cannot be started: {error}", Path::new(command.get_program()).display())
    })?;
    let used = loop {
        if let Some(used) = child.try_wait4().map_err(|error| format!("{what}: {error}"))? {
            break used;
        }
        if started.elapsed() > limit {
            // Either it still runs and is ended here, or it has just ended by itself.
            let _ = child.kill();
            let _ = child.wait();
            return Err(format!("{what} was not done after {} s", limit.as_secs()));
        }
        thread::sleep(POLL);
    };
    if !used.status.code().is_some_and(|code| accepted.contains(&code)) {
        let text = fs::read_to_string(&said).unwrap_or_default();
        let last = text.lines().map(str::trim).rfind(|line| !line.is_empty()).unwrap_or("it says nothing");
        return Err(format!("{what} ended with {}: {last}", used.status));
    }
    Ok(Cost {
        seconds: started.elapsed().as_secs_f64(),
        cpu_seconds: (used.rusage.utime + used.rusage.stime).as_secs_f64(),
        peak_mb: used.rusage.maxrss as f64 / 1e6,
    })
}

/// Writes the columns of `recorded` that a replay may see.
///
/// # Errors
/// When the file cannot be written.
pub fn write_inputs(path: &Path, recorded: &virtual_bench::Recording) -> Result<(), String> {
    let failed = |error: csv::Error| format!("{}: {error}", path.display());
    let columns = REPLAY_COLUMNS.map(|name| recorded.column(name).unwrap_or_default());
    let mut writer = csv::Writer::from_path(path).map_err(failed)?;
    writer.write_record(REPLAY_COLUMNS).map_err(failed)?;
    for row in 0..recorded.len() {
        writer.write_record(columns.map(|values| format!("{:.6}", values[row]))).map_err(failed)?;
    }
    writer.flush().map_err(|error| format!("{}: {error}", path.display()))
}

/// Root mean square difference of every channel that `path` predicts.
///
/// # Errors
/// When the file cannot be read, or has not one row of numbers a recorded sample.
pub fn errors(path: &Path, recorded: &virtual_bench::Recording) -> Result<Errors, String> {
    let shown = path.display();
    let mut reader = csv::Reader::from_path(path).map_err(|error| format!("{shown}: {error}"))?;
    let names = reader.headers().map_err(|error| format!("{shown}: {error}"))?.clone();
    let mut columns = vec![Vec::with_capacity(recorded.len()); names.len()];
    for row in reader.records() {
        let row = row.map_err(|error| format!("{shown}: {error}"))?;
        for (column, field) in columns.iter_mut().zip(&row) {
            column.push(field.parse::<f64>().map_err(|_| format!("{shown}: `{field}` is no number"))?);
        }
    }
    let mut errors = Errors::new();
    for (name, predicted) in names.iter().zip(&columns).filter(|(name, _)| *name != "t_s") {
        let Some(measured) = recorded.column(name) else { continue };
        if predicted.len() != measured.len() {
            let (got, expected) = (predicted.len(), measured.len());
            return Err(format!("{shown}: {got} rows of {name}, expected {expected}, one a recorded sample"));
        }
        let pairs = predicted.iter().zip(measured).skip(SETTLING_SAMPLES);
        let squares: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
        errors.insert(name.to_owned(), (squares / (measured.len() - SETTLING_SAMPLES) as f64).sqrt());
    }
    Ok(errors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;
    use virtual_bench::{BenchConfig, Motion, MotionKind, record};

    #[cfg(unix)]
    #[test]
    fn a_program_is_ended_at_its_limit_which_longer_recordings_move() {
        let folder = tempfile::tempdir().unwrap();
        let mut sleep = Command::new("sleep");
        let ended = measured(sleep.arg("600"), folder.path(), "sleep", &[0], Duration::from_millis(50));
        assert_eq!(ended.unwrap_err(), "sleep was not done after 0 s");
        let tool = Tool { path: "bowden".into(), threads: 1, hash: 0, limit: LIMIT };
        assert_eq!(tool.patient(90).limit, Duration::from_hours(15), "ninety times ten minutes");
    }

    #[test]
    fn a_prediction_half_a_newton_off_has_that_error_after_settling() {
        let folder = tempfile::tempdir().unwrap();
        let motion = Motion::new(MotionKind::Rest, 0.5, 1);
        let recorded = record(&BenchConfig::default(), &[], &motion, 1).unwrap();
        let path = folder.path().join("predicted.csv");
        let mut text = "t_s,f1_n,theta_out_rad\n".to_owned();
        for row in 0..recorded.len() {
            let off = if row < SETTLING_SAMPLES { 9.0 } else { 0.5 };
            let (t_s, f1_n, theta_rad) =
                (recorded.t_s[row], recorded.f1_n[row] + off, recorded.theta_out_rad[row]);
            writeln!(text, "{t_s},{f1_n},{theta_rad}").unwrap();
        }
        fs::write(&path, &text).unwrap();
        let found = errors(&path, &recorded).unwrap();
        assert!((found["f1_n"] - 0.5).abs() < 1e-9 && found["theta_out_rad"] == 0.0, "{found:?}");
        fs::write(&path, "t_s,f1_n\n0,1\n").unwrap();
        assert!(errors(&path, &recorded).unwrap_err().contains("1 rows of f1_n, expected 500"));
    }

    #[test]
    fn a_replay_sees_time_and_inputs_only() {
        let folder = tempfile::tempdir().unwrap();
        let motion = Motion::new(MotionKind::Rest, 0.02, 1);
        let recorded = record(&BenchConfig::default(), &[], &motion, 1).unwrap();
        let path = folder.path().join("inputs.csv");
        write_inputs(&path, &recorded).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(text.lines().next(), Some("t_s,theta_ref_rad,theta_in_rad,duty,bus_v"));
        assert_eq!(text.lines().count(), 21);
    }
}
