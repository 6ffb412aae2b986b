//! `bowden log`: the log of the firmware, with time and level.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_flash::image::{Image, Kind};
use bowden_flash::probe::find::selector;
use bowden_flash::probe::{self, DebugProbeSelector, Lister, Target};
use bowden_host_link::firmware_log::{LogDecoder, LogImage, LogLine};

use super::{flash, print, print_json_line};
use crate::interrupt;

/// Bytes that are read at once.
const READ_BYTES: usize = 1 << 16;

/// Lowest level that is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
enum Level {
    Trace,
    Debug,
    Info,
    Warn,
    Error,
}

/// Arguments of `bowden log`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "A line is the time since the board's start in seconds, the level, and the words. LOG holds the bytes of the first RTT \
                  channel as they came from a debug probe or from `bowden-board run --log`. With --probe the log comes from a board that runs, \
                  from what its buffer holds on, until Ctrl-C: nothing is written to the flash, and the processor is not reset. Attaching halts it for a moment, which stops a joint that \
                  moves."
)]
pub struct LogArguments {
    /// ELF that the firmware was flashed from
    elf: PathBuf,
    /// File of logged bytes; `-` for standard input
    #[arg(required_unless_present = "probe", conflicts_with = "probe")]
    log: Option<PathBuf>,
    /// Read the log of the running board through its debug probe, in place of LOG; where several probes are connected, vendor, product and
    /// serial number of it
    #[arg(long, value_name = "VID:PID[:SERIAL]", num_args = 0..=1, value_parser = selector)]
    #[expect(clippy::option_option, reason = "asked for or not, and by name or not")]
    probe: Option<Option<DebugProbeSelector>>,
    #[command(flatten)]
    format: LogFormat,
}

/// Which lines of a log are printed, and how.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct LogFormat {
    /// Lowest level to print; lines without one are always printed
    #[arg(long, value_enum, default_value = "trace")]
    level: Level,
    /// Print JSON: one object a line
    #[arg(long)]
    pub(super) json: bool,
}

impl LogArguments {
    /// Decodes and prints as the bytes come.
    ///
    /// # Errors
    /// Exit status 2: a file that cannot be read, an ELF without log, or the ELF of another firmware.
    pub fn run(&self) -> Result<Outcome, Failure> {
        interrupt::catch()?;
        let Some(log) = &self.log else { return self.follow(self.probe.as_ref().and_then(Option::as_ref)) };
        let image = load_image(&self.elf)?;
        let mut decoder = LogDecoder::new(&image);
        let name = log.display();
        each_piece(log, |bytes| self.format.print(&decoder.take(bytes)?))?;
        let mut outcome = Outcome::done();
        outcome.extend(decoder.finish()?.map(|note| format!("{name}: {note}")));
        Ok(outcome)
    }

    /// The same from a board that runs.
    fn follow(&self, probe: Option<&DebugProbeSelector>) -> Result<Outcome, Failure> {
        let (name, elf) = read_elf(&self.elf)?;
        let words = LogImage::parse(&name, &elf)?;
        let image = Image::parse(&name, &elf, Kind::Any)?;
        let rtt = flash::rtt(&name, &image)?;
        let found = probe::find(&Lister::new(), probe).map_err(flash::failure)?;
        let target = Target::attach(found.probe).map_err(flash::failure)?.holding(&image)?;
        flash::follow(target, &words, rtt, &self.format)
    }
}

impl LogFormat {
    /// Prints lines as they come.
    ///
    /// # Errors
    /// Exit status 1, if standard output refuses.
    pub(super) fn print(&self, lines: &[LogLine]) -> Result<(), Failure> {
        lines.iter().filter(|line| self.shows(line)).try_for_each(|line| self.print_line(line))
    }

    fn shows(&self, line: &LogLine) -> bool {
        let level = match line.level {
            None => return true,
            Some("trace") => Level::Trace,
            Some("debug") => Level::Debug,
            Some("info") => Level::Info,
            Some("warn") => Level::Warn,
            Some(_) => Level::Error,
        };
        level >= self.level
    }

    fn print_line(&self, line: &LogLine) -> Result<(), Failure> {
        if !self.json {
            return print(&format!("{line}\n"));
        }
        print_json_line(line)
    }
}

/// The words of a firmware's log.
///
/// # Errors
/// Exit status 2: the file cannot be read, or see [`LogImage::parse`].
pub(super) fn load_image(elf: &Path) -> Result<LogImage, Failure> {
    let (name, bytes) = read_elf(elf)?;
    LogImage::parse(&name, &bytes)
}

/// Name and bytes of an ELF.
fn read_elf(elf: &Path) -> Result<(String, Vec<u8>), Failure> {
    let name = elf.display().to_string();
    let bytes = fs::read(elf).map_err(|error| {
        Failure::bad_input(format!("{name}: {}; name the firmware's ELF", output::describe(&error)))
    })?;
    Ok((name, bytes))
}

/// Hands the bytes of a log on, piece by piece, until its end or Ctrl-C.
///
/// # Errors
/// Exit status 2, if it cannot be read; what `take` says.
pub(super) fn each_piece(
    log: &Path,
    mut take: impl FnMut(&[u8]) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let refuse = |error: &io::Error| {
        Failure::bad_input(format!(
            "{}: {}; name a file of logged bytes",
            log.display(),
            output::describe(error)
        ))
    };
    let mut input: Box<dyn Read> = if log == Path::new("-") {
        Box::new(io::stdin().lock())
    } else {
        Box::new(File::open(log).map_err(|error| refuse(&error))?)
    };
    let mut buffer = vec![0; READ_BYTES];
    while !interrupt::requested() {
        match input.read(&mut buffer) {
            Ok(0) => break,
            Ok(length) => take(&buffer[..length])?,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(refuse(&error)),
        }
    }
    Ok(())
}
