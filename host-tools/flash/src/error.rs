//! Why an image was not written. A message is one line: what, where, what to do.

use bowden_core::outcome::Failure;

/// What a board needs that starts neither its firmware nor its boot loader by itself.
const REVIVE: &str = "hold BOOT0 (PB8) at 3.3 V while the board is switched on, and flash it again";

/// Why an image was not written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FlashError {
    /// No debug probe.
    #[error(
        "no debug probe on USB{}; connect the Nucleo board's USB socket CN1, see `bowden doctor` for who may open it, or flash \
         without a probe: --dfu",
        others(found)
    )]
    NoProbe {
        /// Probes that are there and not the one that was asked for.
        found: Vec<String>,
    },
    /// More than one debug probe.
    #[error("{} debug probes on USB ({}); choose one with --probe VID:PID:SERIAL", found.len(), found.join(", "))]
    SeveralProbes {
        /// The probes.
        found: Vec<String>,
    },
    /// No boot loader.
    #[error(
        "no boot loader on USB (0483:df11); name the port of a board that runs its firmware with --port, or hold BOOT0 (PB8) at \
         3.3 V while the board is switched on"
    )]
    NoBootLoader,
    /// The board was sent to its boot loader, which does not appear.
    #[error(
        "the board left its firmware, but no boot loader (0483:df11) is on USB after {seconds} s; check the board's USB cable, \
         or switch it off and on to go on with its firmware"
    )]
    BootLoaderLate {
        /// How long it was waited for, s.
        seconds: u64,
    },
    /// More than one boot loader.
    #[error(
        "{} boot loaders on USB ({}); choose one with --boot-loader and its serial number or socket", found.len(), found.join(", ")
    )]
    SeveralBootLoaders {
        /// Their serial numbers and sockets.
        found: Vec<String>,
    },
    /// No boot loader is the one that was asked for.
    #[error("no boot loader is {wanted} ({}); correct --boot-loader", found.join(", "))]
    OtherBootLoaders {
        /// What was asked for.
        wanted: String,
        /// Serial numbers and sockets of those that are there.
        found: Vec<String>,
    },
    /// The image is written, and the board does not come back.
    #[error(
        "the image is written, but {} on USB after {seconds} s; switch it off and on, with BOOT0 no longer at 3.3 V",
        absent(serial.as_deref())
    )]
    FirmwareLate {
        /// Serial number of the board, if it is known.
        serial: Option<String>,
        /// How long it was waited for, s.
        seconds: u64,
    },
    /// The operating system does not let this user.
    #[error("{device}: this user may not open it")]
    NotAllowed {
        /// What cannot be opened.
        device: String,
        /// Its USB vendor.
        vendor: u16,
    },
    /// The device cannot be used.
    #[error("{device}: {reason}; close other programs that use it, then plug it in again")]
    Unusable {
        /// What cannot be used.
        device: String,
        /// What the operating system says.
        reason: String,
    },
    /// Another processor.
    #[error(
        "another processor: {found}, expected an STM32G474RE; nothing was written, connect the driver board"
    )]
    OtherChip {
        /// What it is.
        found: String,
    },
    /// The flash may not be read.
    #[error(
        "the chip is read-out protected; nothing was written: take the protection off with STM32CubeProgrammer, which erases the \
         whole flash, stored parameters included"
    )]
    Protected,
    /// The flash is one bank.
    #[error(
        "the flash is set to one bank (option byte DBANK = 0), where its pages are others; nothing was written: set DBANK = 1 as \
         firmware/README.md says"
    )]
    OneBank,
    /// The device answers no more.
    #[error("the board is gone while {during}; {}", revived(*whole))]
    Gone {
        /// What was done.
        during: String,
        /// Whether the image before is whole.
        whole: bool,
    },
    /// A transfer failed that the device did not refuse.
    #[error("USB fails while {during}: {reason}; {}", revived(*whole))]
    Usb {
        /// What was done.
        during: String,
        /// What the operating system says.
        reason: String,
        /// Whether the image before is whole.
        whole: bool,
    },
    /// The device refused a step.
    #[error("{during}: the board answers {answer}; switch it off and on, and flash it again")]
    Refused {
        /// What was done.
        during: String,
        /// Its answer.
        answer: String,
    },
    /// What is in the flash is not what was written.
    #[error(
        "verification: byte {found:#04x} at address {address:#010x}, expected {expected:#04x}; flash it again, and replace the board if the \
         address stays the same"
    )]
    Differs {
        /// First address that differs.
        address: u32,
        /// What is there.
        found: u8,
        /// What was written.
        expected: u8,
    },
    /// The probe or the way to the chip failed.
    #[error("{during}: {reason}; {}", probe_advice(*whole))]
    Probe {
        /// What was done.
        during: String,
        /// What the probe says.
        reason: String,
        /// Whether the image before is whole.
        whole: bool,
    },
    /// The flash holds another image than the one whose log is to be read.
    #[error(
        "the board runs another image: byte {found:#04x} at address {address:#010x}, the ELF has {expected:#04x}; give the ELF that was flashed"
    )]
    OtherImage {
        /// First address that differs.
        address: u32,
        /// What is there.
        found: u8,
        /// What the ELF has.
        expected: u8,
    },
    /// The probe or the way to the chip failed while nothing but reading was done.
    #[error("{during}: {reason}; check the board's supply and the cable, then start again")]
    Unread {
        /// What was done.
        during: String,
        /// What the probe says.
        reason: String,
    },
    /// The firmware does not log.
    #[error(
        "the firmware started, but there is no log after {seconds} s; see `bowden faults`, and whether the ELF is the one that was flashed"
    )]
    NoLog {
        /// How long it was waited for, s.
        seconds: u64,
    },
}

fn others(found: &[String]) -> String {
    match found {
        [] => String::new(),
        found => format!(" is the one that was asked for ({})", found.join(", ")),
    }
}

fn absent(serial: Option<&str>) -> String {
    serial.map_or_else(
        || "no board is newly".to_owned(),
        |serial| format!("the board with serial number {serial} is not"),
    )
}

fn revived(whole: bool) -> String {
    if whole {
        "its flash is as it was: check the USB cable, switch it off and on, and flash it again".to_owned()
    } else {
        format!("its image is not whole: {REVIVE}")
    }
}

fn probe_advice(whole: bool) -> &'static str {
    if whole {
        "nothing was written: check the board's supply and the cable, then flash it again"
    } else {
        "the board's image is not whole: check supply and cable, then flash it again"
    }
}

impl From<FlashError> for Failure {
    fn from(error: FlashError) -> Self {
        match error {
            // What was named, or is connected, is not usable.
            FlashError::NoProbe { .. }
            | FlashError::SeveralProbes { .. }
            | FlashError::NoBootLoader
            | FlashError::SeveralBootLoaders { .. }
            | FlashError::OtherBootLoaders { .. }
            | FlashError::NotAllowed { .. }
            | FlashError::Unusable { .. }
            | FlashError::OtherChip { .. }
            | FlashError::OtherImage { .. } => Self::bad_input(error),
            _ => Self::failed(error),
        }
    }
}
