//! A board from its firmware to its boot loader and back.

use std::time::Duration;

use bowden_core::progress::Progress;

use super::plugged::{Plugged, Usb, choose};
use crate::error::FlashError;

/// Time that a board gets from its firmware to its boot loader, and from there back.
pub const PATIENCE: Duration = Duration::from_secs(10);

/// Time between two looks at what is plugged in.
const LOOK: Duration = Duration::from_millis(100);

/// A board in its boot loader.
pub struct InBootLoader<D> {
    /// The boot loader.
    pub device: D,
    /// Serial number of the board's firmware, if it is known.
    serial: Option<String>,
    /// Boards that were there while this one was not.
    others: Vec<Plugged>,
}

/// Opens the boot loader that is plugged in, or the one that is meant by `wanted`: see [`choose`].
///
/// # Errors
/// As [`choose`] and [`Usb::open`].
pub fn open<U: Usb>(usb: &U, wanted: Option<&str>) -> Result<InBootLoader<U::BootLoader>, FlashError> {
    let device = usb.open(choose(&usb.boot_loaders(), wanted)?)?;
    Ok(InBootLoader { device, serial: None, others: usb.boards() })
}

/// Sends a board to its boot loader by `leave` and opens that: the one that appears in the board's socket, or where serial number or
/// socket of the board are not known, the one that was not there before.
///
/// # Errors
/// What `leave` returns; [`FlashError::BootLoaderLate`], [`FlashError::SeveralBootLoaders`]; as [`Usb::open`].
pub fn send<U: Usb, E: From<FlashError>>(
    usb: &U,
    serial: Option<String>,
    leave: impl FnOnce() -> Result<(), E>,
    progress: &dyn Progress,
) -> Result<InBootLoader<U::BootLoader>, E> {
    let before = usb.boot_loaders();
    let board = usb.boards().into_iter().find(|board| serial.is_some() && board.serial == serial);
    leave()?;
    progress.stage("waiting for the boot loader", 0);
    let mut answer = Err(late());
    for _ in 0..PATIENCE.as_millis() / LOOK.as_millis() {
        let mut found = usb.boot_loaders();
        found.retain(|found| match &board {
            Some(board) => found.socket == board.socket,
            None => !before.contains(found),
        });
        answer = match choose(&found, None) {
            Err(FlashError::NoBootLoader) => Err(late()),
            Err(error) => return Err(error.into()),
            Ok(one) => usb.open(one),
        };
        // Its file is there before the rule that gives it to this user has acted.
        if !matches!(answer, Err(FlashError::BootLoaderLate { .. } | FlashError::NotAllowed { .. })) {
            break;
        }
        usb.wait(LOOK);
    }
    Ok(InBootLoader { device: answer?, serial, others: usb.boards() })
}

fn late() -> FlashError {
    FlashError::BootLoaderLate { seconds: PATIENCE.as_secs() }
}

impl<D> InBootLoader<D> {
    /// Waits until the board runs its firmware: a board with its serial number, or where that is not known, one in a socket that had
    /// no board before.
    ///
    /// # Errors
    /// [`FlashError::FirmwareLate`].
    pub fn await_firmware<U: Usb>(self, usb: &U, progress: &dyn Progress) -> Result<(), FlashError> {
        let Self { device, serial, others } = self;
        drop(device);
        progress.stage("waiting for the firmware", 0);
        for _ in 0..PATIENCE.as_millis() / LOOK.as_millis() {
            let is_back = |board: &Plugged| match &serial {
                Some(_) => board.serial == serial,
                None => !others.iter().any(|other| other.socket == board.socket),
            };
            if usb.boards().iter().any(is_back) {
                return Ok(());
            }
            if progress.interrupted() {
                break;
            }
            usb.wait(LOOK);
        }
        Err(FlashError::FirmwareLate { serial, seconds: PATIENCE.as_secs() })
    }
}
