//! What this machine has for work with a board: USB devices, who may open them, the compiler.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use rustix::fs::{Access, access};

/// Vendor of ST.
pub const PROBE_VENDOR: u16 = 0x0483;

/// Its debug probes (ST-LINK V2, V2-1, V3); the Nucleo board has one on it.
const PROBES: [u16; 9] = [0x3744, 0x3748, 0x374b, 0x374d, 0x374e, 0x374f, 0x3752, 0x3753, 0x3754];

/// Where the operating system shows its devices.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Folder of USB devices, `/sys/bus/usb/devices`.
    pub usb: PathBuf,
    /// Folder of device files, `/dev`.
    pub dev: PathBuf,
}

impl Default for Machine {
    fn default() -> Self {
        Self { usb: "/sys/bus/usb/devices".into(), dev: "/dev".into() }
    }
}

/// A USB device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Device {
    /// What it calls itself.
    pub product: String,
    /// Serial number; empty if it has none.
    pub serial: String,
    /// Files that it is reached through.
    pub files: Vec<PathBuf>,
}

impl Device {
    /// The first of its files that this user may not read and write.
    pub fn forbidden(&self) -> Option<&Path> {
        let forbidden = |path: &&PathBuf| access(path.as_path(), Access::READ_OK | Access::WRITE_OK).is_err();
        self.files.iter().find(forbidden).map(PathBuf::as_path)
    }
}

impl Machine {
    /// Debug probes.
    pub fn probes(&self) -> Vec<Device> {
        self.devices(|vendor, product| vendor == PROBE_VENDOR && PROBES.contains(&product), false)
    }

    /// Boards with this identity, by their serial ports.
    pub fn boards(&self, vendor: u16, product: u16) -> Vec<Device> {
        self.devices(|v, p| (v, p) == (vendor, product), true)
    }

    fn devices(&self, wanted: impl Fn(u16, u16) -> bool, serial_ports: bool) -> Vec<Device> {
        let mut folders: Vec<PathBuf> =
            fs::read_dir(&self.usb).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
        folders.sort();
        let devices = folders.iter().filter_map(|folder| {
            let text =
                |name: &str| fs::read_to_string(folder.join(name)).ok().map(|text| text.trim().to_owned());
            let id = |name: &str| u16::from_str_radix(&text(name)?, 16).ok();
            if !wanted(id("idVendor")?, id("idProduct")?) {
                return None;
            }
            let number = |name: &str| text(name)?.parse::<u16>().ok();
            let files = if serial_ports {
                self.serial_ports(folder)
            } else {
                vec![self.dev.join(format!("bus/usb/{:03}/{:03}", number("busnum")?, number("devnum")?))]
            };
            let (product, serial) = (text("product").unwrap_or_default(), text("serial").unwrap_or_default());
            Some(Device { product, serial, files })
        });
        devices.collect()
    }

    /// Device files of the serial ports below a USB device: `1-2/1-2:1.0/tty/ttyACM0`.
    fn serial_ports(&self, device: &Path) -> Vec<PathBuf> {
        let interfaces = fs::read_dir(device).into_iter().flatten().flatten();
        let ports =
            interfaces.flat_map(|interface| fs::read_dir(interface.path().join("tty")).into_iter().flatten());
        ports.flatten().map(|port| self.dev.join(port.file_name())).collect()
    }
}

/// Version of a program, by what it prints as its version: `rustc 1.95.0 (...)` gives `1.95.0`.
pub fn version_of(program: &str) -> Option<String> {
    let output =
        Command::new(program).arg("--version").output().ok().filter(|output| output.status.success())?;
    let text = String::from_utf8(output.stdout).ok()?;
    text.split_whitespace().nth(1).map(str::to_owned)
}

/// Whether a version is at least another one, number by number.
pub fn at_least(version: &str, least: &str) -> bool {
    let numbers = |text: &str| -> Vec<u64> {
        let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
        text[..end].split('.').filter_map(|part| part.parse().ok()).collect()
    };
    numbers(version) >= numbers(least)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A machine with a Nucleo board's probe and a driver board, as Linux shows them.
    fn machine(folder: &Path) -> Machine {
        let machine = Machine { usb: folder.join("usb"), dev: folder.join("dev") };
        let device = |name: &str, files: &[(&str, &str)]| {
            fs::create_dir_all(machine.usb.join(name)).unwrap();
            for (file, text) in files {
                fs::write(machine.usb.join(name).join(file), text).unwrap();
            }
        };
        let probe = [("idVendor", "0483\n"), ("idProduct", "374e\n"), ("busnum", "1\n"), ("devnum", "12\n")];
        device("1-1", &[&probe[..], &[("product", "STLINK-V3\n"), ("serial", "0031\n")]].concat());
        device(
            "1-2",
            &[("idVendor", "1209\n"), ("idProduct", "b0d7\n"), ("product", "joint driver board\n")],
        );
        fs::create_dir_all(machine.usb.join("1-2/1-2:1.0/tty/ttyACM3")).unwrap();
        device("usb1", &[("idVendor", "1d6b\n"), ("idProduct", "0002\n")]);
        fs::create_dir_all(machine.dev.join("bus/usb/001")).unwrap();
        fs::write(machine.dev.join("bus/usb/001/012"), "").unwrap();
        machine
    }

    #[test]
    fn probes_and_boards_are_found_with_their_files() {
        let folder = tempfile::tempdir().unwrap();
        let machine = machine(folder.path());
        let probes = machine.probes();
        assert_eq!(probes.len(), 1);
        assert_eq!((probes[0].product.as_str(), probes[0].serial.as_str()), ("STLINK-V3", "0031"));
        assert_eq!(probes[0].files, [machine.dev.join("bus/usb/001/012")]);
        assert_eq!(probes[0].forbidden(), None);
        let boards = machine.boards(0x1209, 0xb0d7);
        assert_eq!(boards.len(), 1);
        // The port's file is not there: it cannot be opened.
        assert_eq!(boards[0].forbidden(), Some(machine.dev.join("ttyACM3").as_path()));
        assert_eq!(Machine { usb: folder.path().join("none"), ..machine }.probes(), []);
    }

    #[test]
    fn versions_are_compared_number_by_number() {
        for (version, least, expected) in [
            ("1.95.0", "1.95", true),
            ("1.100.0", "1.95", true),
            ("1.94.9", "1.95", false),
            ("1.95.0-nightly", "1.95.0", true),
            ("2.0", "1.95.0", true),
        ] {
            assert_eq!(at_least(version, least), expected, "{version} {least}");
        }
    }
}
