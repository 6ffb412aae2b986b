//! `bowden-board`: runs a firmware ELF on the emulated driver board.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bowden_board::virtual_bench::{BenchConfig, ConcealedEffect};
use bowden_board::{Board, BoardError, TICK_MARKER, Terminal};
use clap::error::ErrorKind;
use clap::{Args, Parser, Subcommand, ValueEnum};

/// Emulated joint driver board with the virtual bench behind its pins.
#[derive(Debug, Parser)]
#[command(name = "bowden-board", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a firmware ELF; its USB port is a pseudo terminal, its log goes to standard error
    #[command(after_help = "Example:\n  bowden-board run bowden-firmware --pty /tmp/joint\n\n\
        Exit status: 0 the time is over, 1 the firmware or the board failed, 2 bad usage.")]
    Run(RunArgs),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Speed {
    /// Board time does not run ahead of real time.
    Realtime,
    /// As fast as it goes.
    Max,
}

#[derive(Debug, Args)]
struct RunArgs {
    /// ELF of the firmware, as cargo leaves it
    elf: PathBuf,
    /// Symbolic link to make for the pseudo terminal
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,
    /// Board time to run, in seconds; without it, until the process is ended
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Seed of sensor noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How fast board time goes
    #[arg(long, value_enum, default_value_t = Speed::Realtime)]
    speed: Speed,
    /// Effect to conceal in the bench; strength 1 (default) is a clear fault. May be repeated
    #[arg(long = "effect", value_name = "ID[:STRENGTH]")]
    effects: Vec<String>,
    /// File to append the bytes of the firmware's log to, for `bowden log`
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// File that keeps the last 16 KiB of flash between runs
    #[arg(long, value_name = "FILE")]
    flash: Option<PathBuf>,
}

/// What goes wrong, with its exit status.
struct Failure {
    text: String,
    status: u8,
}

impl Failure {
    fn usage(text: impl Into<String>) -> Self {
        Self { text: text.into(), status: 2 }
    }
}

impl From<BoardError> for Failure {
    fn from(error: BoardError) -> Self {
        let status = if matches!(error, BoardError::Image(_) | BoardError::Bench(_)) { 2 } else { 1 };
        Self { text: error.to_string(), status }
    }
}

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            eprintln!("error: a command is missing, expected run; see bowden-board --help");
            return ExitCode::from(2);
        }
        Err(error) if error.use_stderr() => {
            let text = error.to_string();
            eprintln!("{}", text.lines().next().unwrap_or("error: bad usage"));
            return ExitCode::from(2);
        }
        Err(help) => {
            println!("{}", help.to_string().trim_end());
            return ExitCode::SUCCESS;
        }
    };
    let Command::Run(args) = cli.command;
    match run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {}", failure.text);
            ExitCode::from(failure.status)
        }
    }
}

fn run(args: &RunArgs) -> Result<(), Failure> {
    if let Some(seconds) = args.seconds
        && !(seconds.is_finite() && seconds > 0.0)
    {
        return Err(Failure::usage(format!("--seconds {seconds}: expected a number above 0")));
    }
    let elf = std::fs::read(&args.elf)
        .map_err(|error| Failure::usage(format!("{}: {error}", args.elf.display())))?;
    let effects = args.effects.iter().map(|text| effect(text, args.seed)).collect::<Result<Vec<_>, _>>()?;
    let mut builder = Board::builder(&elf).seed(args.seed).bench(&BenchConfig::default(), &effects);
    if let Some(path) = args.flash.as_deref().filter(|path| path.exists()) {
        let content =
            std::fs::read(path).map_err(|error| Failure::usage(format!("{}: {error}", path.display())))?;
        builder = builder.flash_image(&content);
    }
    let mut board = builder.build()?;
    let mut terminal = Terminal::open(args.pty.as_deref())?;
    println!("pty {}", terminal.path().display());
    let seconds = args.seconds.unwrap_or(f64::INFINITY);
    let mut log = args.log.as_deref().map(LogFile::open).transpose()?;
    let mut attend = |board: &mut Board| {
        if let Some(log) = &mut log {
            log.append(board);
        }
        print_log(board);
    };
    let result = terminal.serve(&mut board, seconds, args.speed == Speed::Realtime, &mut attend);
    attend(&mut board);
    log.map_or(Ok(()), LogFile::finish)?;
    if let Some(path) = &args.flash {
        keep_flash(path, &board)?;
    }
    Ok(result?)
}

fn print_log(board: &mut Board) {
    for line in board.take_log() {
        eprintln!("{line}");
    }
    // Nobody looks at the tick's edges here, and a long run makes many.
    board.take_edges(TICK_MARKER);
}

/// Where the bytes of the log go.
struct LogFile {
    path: PathBuf,
    file: std::fs::File,
    written: std::io::Result<()>,
}

impl LogFile {
    fn open(path: &Path) -> Result<Self, Failure> {
        let file = std::fs::File::options().create(true).append(true).open(path);
        let file = file.map_err(|error| Failure::usage(format!("{}: {error}", path.display())))?;
        Ok(Self { path: path.to_owned(), file, written: Ok(()) })
    }

    /// The board runs on where the file takes no more.
    fn append(&mut self, board: &mut Board) {
        let bytes = board.take_log_bytes();
        if self.written.is_ok() {
            self.written = self.file.write_all(&bytes);
        }
    }

    fn finish(self) -> Result<(), Failure> {
        let path = self.path.display();
        self.written.map_err(|error| Failure { text: format!("cannot write {path}: {error}"), status: 1 })
    }
}

fn keep_flash(path: &Path, board: &Board) -> Result<(), Failure> {
    std::fs::write(path, board.flash_image())
        .map_err(|error| Failure { text: format!("cannot write {}: {error}", path.display()), status: 1 })
}

fn effect(text: &str, seed: u64) -> Result<ConcealedEffect, Failure> {
    let (id, strength) = text.split_once(':').unwrap_or((text, "1"));
    let strength: f64 = strength.parse().map_err(|_| {
        Failure::usage(format!("--effect {text}: '{strength}' is no number, expected ID[:STRENGTH]"))
    })?;
    ConcealedEffect::drawn(id, strength, seed)
        .map_err(|error| Failure::usage(format!("--effect {text}: {error}")))
}
