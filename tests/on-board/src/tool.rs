//! The host tool `bowden`, run against the pseudo terminal of an emulated board.

use std::env;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bowden_board::{Board, Terminal};

use crate::image::target_folder;
use crate::{Failure, Outcome, fail};

/// Board time between two looks at the tool \[s\].
const LOOK_S: f64 = 0.25e-3;
/// Board time that passes after a request of the tool unless the next one comes \[s\]: less than the 0.5 s of silence that the
/// board allows its host, more than it takes to store parameters.
const TIME_PER_REQUEST_S: f64 = 0.4;
/// Board time after which a tool has to be done \[s\].
const LIMIT_S: f64 = 120.0;
/// Value of `--timeout` \[s\]: the largest that the tool takes.
const ANSWER_LIMIT_S: &str = "600";
/// Real time without a request after which a tool counts as hung.
const HANG_LIMIT: Duration = Duration::from_mins(10);
/// Real time between two looks at a tool for which the board waits.
const WAIT: Duration = Duration::from_millis(1);

/// What a run of the tool gave.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ran {
    /// Exit status.
    pub status: Option<i32>,
    /// Standard output.
    pub output: String,
    /// Standard error.
    pub errors: String,
}

impl Ran {
    fn of(output: &Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Self { status: output.status.code(), output: text(&output.stdout), errors: text(&output.stderr) }
    }
}

/// The tool: the file that `BOWDEN_BIN` names, or the newest build.
pub fn tool() -> Outcome<PathBuf> {
    if let Some(path) = env::var_os("BOWDEN_BIN") {
        return Ok(PathBuf::from(path));
    }
    let folder = target_folder()?;
    let builds = ["release", "debug"].map(|profile| folder.join(profile).join("bowden"));
    let newest = builds
        .into_iter()
        .filter_map(|path| Some((path.metadata().ok()?.modified().ok()?, path)))
        .max()
        .map(|(_, path)| path);
    newest.ok_or_else(|| Failure(format!("{}: no tool; build it: cargo build -p bowden", folder.display())))
}

/// Runs `bowden <line>`, which needs no board, in `folder`.
pub fn run_alone(folder: &Path, line: &[&str]) -> Outcome<Ran> {
    let path = tool()?;
    let output = Command::new(&path).args(line).current_dir(folder).stdin(Stdio::null()).output();
    Ok(Ran::of(&output.map_err(|error| Failure(format!("{} {}: {error}", path.display(), line.join(" "))))?))
}

/// A board whose port is a pseudo terminal.
pub struct Plugged {
    /// The board.
    pub board: Board,
    /// None while the plug is pulled.
    terminal: Option<Terminal>,
    port: PathBuf,
    /// Name of the port that stays when it is plugged in again.
    link: Option<PathBuf>,
}

/// A tool that runs.
pub struct Running {
    what: String,
    process: u32,
    waiting: JoinHandle<io::Result<Output>>,
}

impl Running {
    /// Whether it has ended.
    pub fn has_ended(&self) -> bool {
        self.waiting.is_finished()
    }

    /// Ctrl-C.
    pub fn interrupt(&self) -> Outcome {
        self.signal("-INT")
    }

    /// Ends it with nothing of it running any more.
    pub fn kill(&self) -> Outcome {
        self.signal("-KILL")
    }

    fn signal(&self, signal: &str) -> Outcome {
        let process = self.process.to_string();
        match Command::new("kill").args([signal, &process]).status() {
            Ok(status) if status.success() => Ok(()),
            other => fail(format!("kill {signal} {process}: {other:?}")),
        }
    }
}

impl Plugged {
    /// Plugs `board` in and lets it be enumerated.
    pub fn new(board: Board) -> Outcome<Self> {
        Self::with_link(board, None)
    }

    /// The same under the name `link`, by which the port is found again after it was unplugged.
    pub fn linked(board: Board, link: PathBuf) -> Outcome<Self> {
        Self::with_link(board, Some(link))
    }

    fn with_link(mut board: Board, link: Option<PathBuf>) -> Outcome<Self> {
        let terminal = Terminal::open(link.as_deref())?;
        board.run_until("USB port", |board| board.usb_ready(), 1.0)?;
        let port = link.clone().unwrap_or_else(|| terminal.path().to_owned());
        Ok(Self { board, terminal: Some(terminal), port, link })
    }

    /// Name of the port.
    pub fn port(&self) -> String {
        self.port.to_string_lossy().into_owned()
    }

    /// Pulls the plug; the board keeps its supply.
    pub fn unplug(&mut self) {
        self.terminal = None;
        self.board.set_usb_plugged(false);
    }

    /// Plugs the board in again, as another device under the same link.
    pub fn replug(&mut self) -> Outcome {
        self.board.set_usb_plugged(true);
        self.board.run_until("USB port", |board| board.usb_ready(), 1.0)?;
        let terminal = Terminal::open(self.link.as_deref())?;
        if self.link.is_none() {
            terminal.path().clone_into(&mut self.port);
        }
        self.terminal = Some(terminal);
        Ok(())
    }

    /// Arguments of `bowden` that begin a command with this board: `<command> --port <terminal> --timeout 600`.
    pub fn arguments(&self, command: &str) -> [String; 5] {
        let port = self.port();
        [command.to_owned(), "--port".to_owned(), port, "--timeout".to_owned(), ANSWER_LIMIT_S.to_owned()]
    }

    /// Runs `bowden <command> --port <terminal> --timeout 600 <arguments>` while the board runs.
    pub fn run(&mut self, command: &str, arguments: &[&str]) -> Outcome<Ran> {
        self.run_beside(command, arguments, |_| ())
    }

    /// The same, with what `act` does to the board each time before it goes on.
    pub fn run_beside(
        &mut self,
        command: &str,
        arguments: &[&str],
        act: impl FnMut(&mut Board),
    ) -> Outcome<Ran> {
        let before = self.arguments(command);
        let line: Vec<&str> = before.iter().map(String::as_str).chain(arguments.iter().copied()).collect();
        self.run_whole(None, &line, act)
    }

    /// Runs `bowden <line>`, which names the port itself, in `folder` while the board runs.
    pub fn run_in(&mut self, folder: &Path, line: &[&str]) -> Outcome<Ran> {
        self.run_in_beside(folder, line, |_| ())
    }

    /// The same, with what `act` does to the board each time before it goes on.
    pub fn run_in_beside(
        &mut self,
        folder: &Path,
        line: &[&str],
        act: impl FnMut(&mut Board),
    ) -> Outcome<Ran> {
        self.run_whole(Some(folder), line, act)
    }

    /// Runs `bowden <line> --port <terminal>` while the board runs, with what `act` does to the board each time before it goes on.
    pub fn run_line(&mut self, line: &[&str], act: impl FnMut(&mut Board)) -> Outcome<Ran> {
        let port = self.port();
        self.run_whole(None, &[line, &["--port", &port]].concat(), act)
    }

    fn run_whole(
        &mut self,
        folder: Option<&Path>,
        line: &[&str],
        act: impl FnMut(&mut Board),
    ) -> Outcome<Ran> {
        let running = self.start(folder.unwrap_or(Path::new(".")), line)?;
        self.finish_beside(running, act)
    }

    /// Starts `bowden <line>`, which names the port itself, in `folder`.
    pub fn start(&self, folder: &Path, line: &[&str]) -> Outcome<Running> {
        let path = tool()?;
        let what = format!("{} {}", path.display(), line.join(" "));
        let child = Command::new(&path)
            .args(line)
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| Failure(format!("{what}: {error}")))?;
        let process = child.id();
        // Another thread reads what it prints, so that it never waits for us.
        Ok(Running { what, process, waiting: std::thread::spawn(move || child.wait_with_output()) })
    }

    /// Lets the board run until `running` has ended.
    pub fn finish(&mut self, running: Running) -> Outcome<Ran> {
        self.finish_beside(running, |_| ())
    }

    fn finish_beside(&mut self, running: Running, act: impl FnMut(&mut Board)) -> Outcome<Ran> {
        self.attend_beside(&running.what, || running.has_ended(), act)?;
        let what = &running.what;
        let output =
            running.waiting.join().map_err(|_| Failure(format!("{what}: the waiting thread failed")))?;
        let output = output.map_err(|error| Failure(format!("{what}: {error}")))?;
        Ok(Ran::of(&output))
    }

    /// Runs `bowden <command> --port <terminal> --timeout 600 <arguments>` and answers its questions: `answer` gets each question, and the
    /// board, to whose bench it may do what the question asks for. Without an answer the tool's standard input ends.
    pub fn converse(
        &mut self,
        command: &str,
        arguments: &[&str],
        mut answer: impl FnMut(&str, &mut Board) -> Option<String>,
    ) -> Outcome<Ran> {
        let before = self.arguments(command);
        let line: Vec<&str> = before.iter().map(String::as_str).chain(arguments.iter().copied()).collect();
        let path = tool()?;
        let what = format!("{} {}", path.display(), line.join(" "));
        let failed = |error: std::io::Error| Failure(format!("{what}: {error}"));
        let mut child = Command::new(&path)
            .args(&line)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(failed)?;
        let mut input = child.stdin.take();
        let Some(mut printed) = child.stdout.take() else { return fail("no standard output") };
        // Another thread reads what it prints, so that neither side waits for the other one.
        let (sender, bytes) = mpsc::channel();
        let reading = std::thread::spawn(move || {
            let mut byte = [0];
            while let Ok(1) = printed.read(&mut byte) {
                if sender.send(byte[0]).is_err() {
                    break;
                }
            }
        });
        let waiting = std::thread::spawn(move || child.wait_with_output());
        let mut output = Vec::new();
        let mut written = Ok(());
        // The board may not run while a question stands: what is done at its bench is done at once.
        while !waiting.is_finished() {
            let end = || waiting.is_finished();
            let mut asked = false;
            self.attend_beside(
                &what,
                || {
                    output.extend(bytes.try_iter());
                    asked = question(&output).is_some();
                    asked || end()
                },
                |_| (),
            )?;
            let Some(text) = question(&output).filter(|_| asked) else { continue };
            output.push(b'\n');
            match (answer(&text, &mut self.board), &mut input) {
                (Some(line), Some(stdin)) => written = writeln!(stdin, "{line}"),
                _ => input = None,
            }
        }
        drop(input);
        let ended = waiting.join().map_err(|_| Failure(format!("{what}: the waiting thread failed")))?;
        let ended = ended.map_err(failed)?;
        reading.join().map_err(|_| Failure(format!("{what}: the reading thread failed")))?;
        output.extend(bytes.try_iter());
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let ran = Ran { status: ended.status.code(), output: text(&output), errors: text(&ended.stderr) };
        if written.is_err() && ran.status == Some(0) {
            return fail(format!("{what}: took no answer"));
        }
        Ok(ran)
    }

    /// Lets the board run with its port on the terminal until `is_done`.
    ///
    /// Neither side depends on how fast this machine is: the board stands still while the terminal has no room for its bytes, and
    /// [`TIME_PER_REQUEST_S`] after the last request of the tool. A slow tool is therefore never silent and loses no sample.
    pub fn attend(&mut self, what: &str, is_done: impl FnMut() -> bool) -> Outcome {
        self.attend_beside(what, is_done, |_| ())
    }

    fn attend_beside(
        &mut self,
        what: &str,
        mut is_done: impl FnMut() -> bool,
        mut act: impl FnMut(&mut Board),
    ) -> Outcome {
        let end_s = self.board.time_s() + LIMIT_S;
        let mut allowed_until_s = self.board.time_s();
        let mut heard = Instant::now();
        while !is_done() {
            let received = match &mut self.terminal {
                Some(terminal) => terminal.exchange(&mut self.board)?,
                None => 0,
            };
            if received > 0 {
                heard = Instant::now();
                allowed_until_s = self.board.time_s() + TIME_PER_REQUEST_S;
            }
            // Without a port the board cannot be asked, and is on the way to one.
            let allowed = self.board.time_s() < allowed_until_s || !self.board.usb_ready();
            if allowed && !self.terminal.as_ref().is_some_and(Terminal::is_full) {
                act(&mut self.board);
                self.board.run_for(LOOK_S)?;
            } else {
                std::thread::sleep(WAIT);
            }
            if self.board.time_s() > end_s {
                return fail(format!("{what}: not done within {LIMIT_S} s of board time"));
            }
            if heard.elapsed() > HANG_LIMIT {
                return fail(format!("{what}: not done {} s after its last request", HANG_LIMIT.as_secs()));
            }
        }
        Ok(())
    }
}

/// The question at the end of what a tool has printed: a last line that is not ended, and ends as questions do.
fn question(output: &[u8]) -> Option<String> {
    let last = output.rsplit(|byte| *byte == b'\n').next().unwrap_or_default();
    let text = String::from_utf8(last.to_vec()).ok()?;
    ["] ", "? ", "): "].iter().any(|end| text.ends_with(end)).then_some(text)
}
