//! Which board: boards and boot loaders on USB, told apart by serial number and by the socket that they are plugged into.

use super::device::DfuDevice;
use super::serial_number;
use crate::error::FlashError;
use std::fmt;
use std::time::Duration;

/// A device on USB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plugged {
    /// Its serial number, if it has one that this user may read.
    pub serial: Option<String>,
    /// The socket: bus, and ports of the hubs on the way, as Linux writes them (`1-2.3`). A board keeps it when it changes from its
    /// firmware to its boot loader and back.
    pub socket: String,
}

impl fmt::Display for Plugged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let serial = self.serial.as_deref().unwrap_or("unknown");
        write!(f, "serial number {serial} at USB socket {}", self.socket)
    }
}

/// What is plugged into a machine.
pub trait Usb {
    /// An opened boot loader.
    type BootLoader: DfuDevice;

    /// Boards in the boot loader of their processor.
    fn boot_loaders(&self) -> Vec<Plugged>;

    /// Boards that run their firmware.
    fn boards(&self) -> Vec<Plugged>;

    /// Opens a boot loader.
    ///
    /// # Errors
    /// [`FlashError::NotAllowed`], [`FlashError::Unusable`].
    fn open(&self, boot_loader: &Plugged) -> Result<Self::BootLoader, FlashError>;

    /// Lets time pass.
    fn wait(&self, time: Duration);
}

/// The boot loader that is meant: the one that is plugged in, or the one with this serial number (its own, or the board's), or at this
/// socket.
///
/// # Errors
/// [`FlashError::NoBootLoader`], [`FlashError::OtherBootLoaders`], [`FlashError::SeveralBootLoaders`].
pub fn choose<'f>(found: &'f [Plugged], wanted: Option<&str>) -> Result<&'f Plugged, FlashError> {
    let chosen: Vec<&Plugged> =
        found.iter().filter(|plugged| wanted.is_none_or(|wanted| is_called(plugged, wanted))).collect();
    match (chosen.as_slice(), found, wanted) {
        ([one], ..) => Ok(one),
        (_, [], _) => Err(FlashError::NoBootLoader),
        ([], _, Some(wanted)) => {
            Err(FlashError::OtherBootLoaders { wanted: wanted.to_owned(), found: names(found) })
        }
        _ => Err(FlashError::SeveralBootLoaders { found: names(found) }),
    }
}

fn is_called(plugged: &Plugged, wanted: &str) -> bool {
    let Some(serial) = &plugged.serial else { return plugged.socket == wanted };
    let derived = serial_number::of_boot_loader(wanted);
    plugged.socket == wanted
        || serial.eq_ignore_ascii_case(wanted)
        || derived.is_some_and(|derived| serial.eq_ignore_ascii_case(&derived))
}

fn names(found: &[Plugged]) -> Vec<String> {
    found.iter().map(Plugged::to_string).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plugged(serial: Option<&str>, socket: &str) -> Plugged {
        Plugged { serial: serial.map(str::to_owned), socket: socket.to_owned() }
    }

    #[test]
    fn a_boot_loader_is_chosen_by_its_number_its_boards_number_or_its_socket() {
        let found = [
            plugged(Some("325E35633334"), "1-2"),
            plugged(Some("355A38693038"), "1-4.1"),
            plugged(None, "3-1"),
        ];
        for (wanted, expected) in [
            ("355A38693038", 1),
            ("325e35633334", 0),
            // The board of the first: UID words 0x002d0030, 0x3334510b, 0x32313533, bytes in the order of their addresses.
            ("30002D000B51343333353132", 0),
            ("1-4.1", 1),
            ("3-1", 2),
        ] {
            assert_eq!(choose(&found, Some(wanted)), Ok(&found[expected]), "{wanted}");
        }
        assert_eq!(choose(&found[1..2], None), Ok(&found[1]));
    }

    #[test]
    fn several_boot_loaders_are_listed_with_what_to_do() {
        let found = [plugged(Some("325E35633334"), "1-2"), plugged(None, "1-4.1")];
        let words = |wanted| choose(&found, wanted).unwrap_err().to_string();
        assert_eq!(
            words(None),
            "2 boot loaders on USB (serial number 325E35633334 at USB socket 1-2, serial number unknown at USB socket 1-4.1); choose \
             one with --boot-loader and its serial number or socket"
        );
        assert_eq!(
            words(Some("1-3")),
            "no boot loader is 1-3 (serial number 325E35633334 at USB socket 1-2, serial number unknown at USB socket 1-4.1); \
             correct --boot-loader"
        );
        assert_eq!(choose(&[], Some("1-3")), Err(FlashError::NoBootLoader));
        // The socket tells two with one number apart.
        let twins = [plugged(Some("A"), "1-1"), plugged(Some("A"), "1-2")];
        assert!(matches!(choose(&twins, Some("A")), Err(FlashError::SeveralBootLoaders { .. })));
        assert_eq!(choose(&twins, Some("1-2")), Ok(&twins[1]));
    }
}
