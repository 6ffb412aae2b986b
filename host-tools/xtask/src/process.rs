//! Other programs: cargo, and what the workspace builds.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Folder of the workspace.
pub fn workspace() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here).to_owned()
}

/// Folder of recordings that are not part of the workspace; tests on real data read them where it is there.
pub fn shared() -> PathBuf {
    workspace().join("..").join("shared")
}

/// The cargo that started this program, in the workspace's folder.
pub fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(workspace()).args(arguments);
    command
}

/// The compiler that cargo uses, in the workspace's folder, so that its `rust-toolchain.toml` holds.
pub fn rustc(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()));
    command.current_dir(workspace()).args(arguments);
    command
}

/// Runs a program to its end.
///
/// # Errors
/// When it cannot be started or does not end with one of the accepted exit statuses.
pub fn run(command: &mut Command, accepted: &[i32]) -> Result<(), String> {
    let status = command.status().map_err(|error| unstarted(command, &error))?;
    match status.code() {
        Some(code) if accepted.contains(&code) => Ok(()),
        _ => Err(failed(command, status)),
    }
}

/// Where programs write what they say.
#[derive(Clone, Copy, Debug)]
pub enum Said<'a> {
    /// To the terminal of this program.
    Here,
    /// Into a file, because other programs write to the terminal at the same time.
    Into(&'a File),
}

impl Said<'_> {
    /// Runs a program to its end, as [`run`] does where only 0 is accepted.
    ///
    /// # Errors
    /// As [`run`]; when the file cannot be written.
    pub fn run(self, command: &mut Command) -> Result<(), String> {
        if let Self::Into(file) = self {
            let stream = || file.try_clone().map_err(|error| format!("a log of tests: {error}"));
            command.stdout(stream()?).stderr(stream()?);
        }
        run(command, &[0])
    }
}

/// What a program writes to standard output.
///
/// # Errors
/// When it cannot be started or fails; the last line of its standard error is the reason.
pub fn output(command: &mut Command) -> Result<String, String> {
    let done = command.stdin(Stdio::null()).output().map_err(|error| unstarted(command, &error))?;
    if done.status.success() {
        return Ok(String::from_utf8_lossy(&done.stdout).into_owned());
    }
    Err(format!("`{}` failed: {}", shown(command), last_line(&done.stderr)))
}

/// Runs a program that may wait for a network; it is ended after `limit`, and what it says goes to the file `log`.
///
/// # Errors
/// When it cannot be started, fails, or takes longer; the last line of what it says is the reason.
pub fn run_within(command: &mut Command, limit: Duration, log: &Path) -> Result<(), String> {
    let name = shown(command);
    // A file, because nobody reads a pipe while this waits.
    let file = File::create(log).map_err(|error| format!("{}: {error}", log.display()))?;
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(file).spawn();
    let mut child = child.map_err(|error| unstarted(command, &error))?;
    let status = wait(&mut child, limit).map_err(|error| format!("`{name}`: {error}"))?;
    match status {
        Some(status) if status.success() => Ok(()),
        Some(_) => {
            let said = fs::read(log).unwrap_or_default();
            Err(format!("`{name}` failed: {}", last_line(&said)))
        }
        None => {
            // Either it still runs and is ended here, or it has just ended by itself.
            let _ = child.kill();
            let _ = child.wait();
            Err(format!("`{name}` was not done after {} s", limit.as_secs()))
        }
    }
}

fn last_line(said: &[u8]) -> String {
    let said = String::from_utf8_lossy(said);
    said.lines().map(str::trim).rfind(|line| !line.is_empty()).unwrap_or("it says nothing").to_owned()
}

fn wait(child: &mut Child, limit: Duration) -> std::io::Result<Option<ExitStatus>> {
    let started = Instant::now();
    while started.elapsed() < limit {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        thread::sleep(Duration::from_millis(50));
    }
    Ok(None)
}

/// The reason for a program that ended badly, after it has written its own.
pub fn failed(command: &Command, status: ExitStatus) -> String {
    format!("`{}` failed ({status}); what it says above tells why", shown(command))
}

/// The reason for a program that did not run at all.
pub fn unstarted(command: &Command, error: &std::io::Error) -> String {
    format!("{} cannot be started: {error}", command.get_program().to_string_lossy())
}

fn shown(command: &Command) -> String {
    let mut words = vec![command.get_program().to_string_lossy()];
    words.extend(command.get_args().map(|argument| argument.to_string_lossy()));
    words.join(" ")
}

/// Cargo's target folder: the one that this program was built into.
///
/// # Errors
/// When the path of this program is not known.
pub fn target_folder() -> Result<PathBuf, String> {
    let here = std::env::current_exe().map_err(|error| format!("this program's own path: {error}"))?;
    Ok(here.ancestors().nth(2).unwrap_or(&here).to_owned())
}

/// A program that cargo made, in the folder of a profile: `release`, or `debug` for the one named `dev`.
///
/// # Errors
/// When it is not there.
pub fn built(profile_folder: &str, name: &str) -> Result<PathBuf, String> {
    let path = target_folder()?.join(profile_folder).join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    if path.exists() { Ok(path) } else { Err(format!("{} is not there after the build", path.display())) }
}

/// Finds a program as a shell would.
pub fn find_program(name: &str) -> Option<PathBuf> {
    let file = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    let paths = std::env::var_os("PATH")?;
    std::env::split_paths(&paths).map(|folder| folder.join(&file)).find(|path| path.is_file())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn shell(script: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    }

    #[test]
    fn output_is_what_was_written_and_a_failure_has_the_last_line_of_standard_error() {
        assert_eq!(output(&mut shell("echo here")).unwrap(), "here\n");
        let reason = output(&mut shell("echo first >&2; echo last >&2; exit 4")).unwrap_err();
        assert!(reason.ends_with("failed: last"), "{reason}");
        let reason = output(&mut Command::new("/nowhere/at-all")).unwrap_err();
        assert!(reason.starts_with("/nowhere/at-all cannot be started: "), "{reason}");
    }

    #[test]
    fn a_program_that_hangs_is_ended() {
        let log = std::env::temp_dir().join(format!("xtask-limit-{}", std::process::id()));
        let run = |script: &str, limit| run_within(&mut shell(script), limit, &log);
        let outcomes = [
            run("exit 0", Duration::MAX),
            run("echo here >&2; exit 1", Duration::MAX),
            run("exec sleep 600", Duration::from_millis(200)),
        ];
        fs::remove_file(&log).unwrap();
        assert_eq!(outcomes[0], Ok(()));
        assert!(outcomes[1].as_ref().unwrap_err().ends_with("failed: here"), "{outcomes:?}");
        assert!(outcomes[2].as_ref().unwrap_err().ends_with("was not done after 0 s"), "{outcomes:?}");
    }

    #[test]
    fn programs_are_found_on_the_path_only() {
        assert!(find_program("sh").is_some_and(|path| path.is_absolute()));
        assert_eq!(find_program("no-program-has-this-name"), None);
    }
}
