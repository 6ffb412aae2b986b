//! `bowden flash`: an image into a driver board.

use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::progress::Progress;
use bowden_flash::dfu::{self, DfuDevice, InBootLoader, NativeUsb, usb::UsbDevice};
use bowden_flash::image::{Image, Kind};
use bowden_flash::probe::{self, DebugProbeSelector, Lister, Target};
use bowden_flash::{FlashError, probe::find::selector};
use bowden_host_link::firmware_log::{LogDecoder, LogImage};
use bowden_host_link::serial::{USB_PRODUCT, USB_VENDOR, udev_rule};
use bowden_host_link::{LinkError, SIM};
use serde::Serialize;

use super::log::LogFormat;
use super::{print, print_json_line};
use crate::interrupt;
use crate::progress::UntilInterrupted;

/// Time that a board gets for an answer.
const TIMEOUT: Duration = Duration::from_millis(1500);

/// USB of this machine.
const USB: NativeUsb = NativeUsb { board: (USB_VENDOR, USB_PRODUCT) };

/// Arguments of `bowden flash`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "The board is reset, which switches the bridge off: a joint that moves is stopped. Pages that the image does not take \
                  keep their content, so that stored parameters and ripple table stay; the firmware that is written may refuse those \
                  of another version. What was written is read back and compared. Ctrl-C takes effect once the image is whole.\n\n\
                  Without a probe: `bowden flash ELF --dfu --port auto` sends a board that runs its firmware to the boot loader of its \
                  processor, if its bridge is off. A board whose firmware does not run enters it when BOOT0 (PB8) is at 3.3 V while it is \
                  switched on; leave --port out then."
)]
pub struct FlashArguments {
    /// ELF of the image, as `cargo xtask firmware` names it
    elf: PathBuf,
    /// Debug probe, where several are connected: vendor, product and serial number as `bowden flash` lists them
    #[arg(long, value_name = "VID:PID[:SERIAL]", value_parser = selector)]
    probe: Option<DebugProbeSelector>,
    /// Then print the firmware's log as `bowden log` does, until Ctrl-C
    #[arg(long, conflicts_with = "dfu")]
    log: bool,
    /// Write through the processor's own boot loader, over the board's USB lines, in place of a probe
    #[arg(long, conflicts_with = "probe")]
    dfu: bool,
    /// With --dfu, board that runs its firmware and is sent to its boot loader: a serial port, `auto`, or `serial:NUMBER`
    #[arg(long, value_name = "PATH|auto|serial:NUMBER", requires = "dfu")]
    port: Option<String>,
    /// With --dfu, where several boards are in their boot loader: serial number of the boot loader or of the board, or USB socket
    /// (BUS-PORT), as `bowden flash` lists them
    #[arg(long, value_name = "NUMBER|SOCKET", requires = "dfu", conflicts_with = "port")]
    boot_loader: Option<String>,
    /// Take an image that is not the board's firmware, such as `bowden-measure`
    #[arg(long)]
    other: bool,
    #[command(flatten)]
    format: LogFormat,
}

/// What was written.
#[derive(Clone, Debug, Serialize)]
struct Written {
    image: String,
    through: String,
    bytes: usize,
    seconds: f64,
    verified: bool,
}

impl FlashArguments {
    /// Checks the image, writes it, reads it back, starts it, and follows its log.
    ///
    /// # Errors
    /// Exit status 2: an ELF that is not for this board, no probe or boot loader, or several. 1: it could not be written or
    /// verified.
    pub fn run(&self, progress: &dyn Progress) -> Result<Outcome, Failure> {
        interrupt::catch()?;
        let name = self.elf.display().to_string();
        let elf = fs::read(&self.elf).map_err(|error| {
            Failure::bad_input(format!("{name}: {}; name the image's ELF", output::describe(&error)))
        })?;
        let image = Image::parse(&name, &elf, if self.other { Kind::Any } else { Kind::Firmware })?;
        let log = if self.log { Some((LogImage::parse(&name, &elf)?, rtt(&name, &image)?)) } else { None };
        if self.dfu {
            return self.through_boot_loader(&image, progress);
        }
        let found = probe::find(&Lister::new(), self.probe.as_ref()).map_err(failure)?;
        let started = Instant::now();
        let mut target = Target::attach(found.probe).map_err(failure)?;
        target.write(&image, self.log, progress).map_err(failure)?;
        progress.stage("running", 0);
        self.say(&image, found.name, started)?;
        match log {
            Some((words, rtt)) => follow(target, &words, rtt, &self.format),
            None => Ok(Outcome::done()),
        }
    }

    fn through_boot_loader(&self, image: &Image, progress: &dyn Progress) -> Result<Outcome, Failure> {
        let mut board = match &self.port {
            None => dfu::open(&USB, self.boot_loader.as_deref()).map_err(failure)?,
            Some(port) => send(port, progress)?,
        };
        let started = Instant::now();
        dfu::write(&mut board.device, image, progress).map_err(failure)?;
        self.say(image, board.device.name().to_owned(), started)?;
        let mut outcome = Outcome::done();
        if !self.other
            && let Err(late) = board.await_firmware(&USB, &UntilInterrupted(progress))
        {
            outcome.extend([late.to_string()]);
        }
        Ok(outcome)
    }

    fn say(&self, image: &Image, through: String, started: Instant) -> Result<(), Failure> {
        let written = Written {
            image: self.elf.display().to_string(),
            through,
            bytes: image.bytes(),
            seconds: started.elapsed().as_secs_f64(),
            verified: true,
        };
        if self.format.json {
            return print_json_line(&written);
        }
        let Written { image, through, bytes, seconds, .. } = written;
        print(&format!(
            "{image}: {bytes} bytes written and verified in {seconds:.1} s through {through}; the board was reset and runs it\n"
        ))
    }
}

/// Prints the log of a board that runs until Ctrl-C.
pub(super) fn follow(
    target: Target,
    words: &LogImage,
    rtt: u32,
    format: &LogFormat,
) -> Result<Outcome, Failure> {
    let mut decoder = LogDecoder::new(words);
    target.follow_log(rtt, &interrupt::requested, &mut |bytes| format.print(&decoder.take(bytes)?))?;
    let mut outcome = Outcome::done();
    // The last frame is cut where Ctrl-C came; that is no loss.
    if !interrupt::requested() {
        outcome.extend(decoder.finish()?);
    }
    Ok(outcome)
}

/// Address of the log of an image.
pub(super) fn rtt(name: &str, image: &Image) -> Result<u32, Failure> {
    image.rtt().ok_or_else(|| {
        Failure::bad_input(format!(
            "{name}: it has no place for its log (symbol _SEGGER_RTT); give an ELF with symbols, or leave out the log"
        ))
    })
}

/// Sends a board to its boot loader and waits for that.
fn send(port: &str, progress: &dyn Progress) -> Result<InBootLoader<UsbDevice>, Failure> {
    if port == SIM || port.starts_with("sim:") {
        return Err(Failure::bad_input(format!(
            "{port}: a simulated board has no flash; name the port of a board"
        )));
    }
    let mut client = bowden_host_link::connect(port, TIMEOUT)?;
    let serial = Some(client.greeting().serial.as_str().to_owned()).filter(|serial| !serial.is_empty());
    // Moved, so that the port is closed once the board has left it.
    let leave = move || Ok(client.enter_boot_loader()?);
    dfu::send(&USB, serial, leave, progress).map_err(|error| match error {
        Sent::Flash(error) => failure(error),
        Sent::Link(error) => error.into(),
    })
}

/// Why a board is not in its boot loader.
enum Sent {
    Flash(FlashError),
    Link(LinkError),
}

impl From<FlashError> for Sent {
    fn from(error: FlashError) -> Self {
        Self::Flash(error)
    }
}

impl From<LinkError> for Sent {
    fn from(error: LinkError) -> Self {
        Self::Link(error)
    }
}

/// One line, with the rule that lets this user open a device where that is what is missing.
pub(super) fn failure(error: FlashError) -> Failure {
    match error {
        FlashError::NotAllowed { vendor, .. } => {
            let rule = udev_rule("usb", vendor, None);
            Failure::from(error).with_note(&format!("grant it with {rule}"))
        }
        error => error.into(),
    }
}
