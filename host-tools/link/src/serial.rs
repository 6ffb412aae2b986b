//! Serial ports: the board's USB port, or a pseudo terminal behind which a simulated board sits.
//!
//! A thread reads ahead, so that a disk that is slow for a moment costs no sample.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serialport::{ErrorKind, SerialPort, SerialPortInfo, SerialPortType, UsbPortInfo};

use super::error::CommsError;
use super::holders::{Holder, holders};
use super::transport::Transport;
use super::{AUTO, SERIAL};

/// USB vendor of the board: pid.codes, free for open hardware.
pub const USB_VENDOR: u16 = 0x1209;

/// USB product of the board.
pub const USB_PRODUCT: u16 = 0xb0d7;

/// Command that lets users open a USB device for good: a udev rule for the user at the machine and for the group that owns serial
/// ports. Without a product it holds for all devices of the vendor.
#[must_use]
pub fn udev_rule(subsystem: &str, vendor: u16, product: Option<u16>) -> String {
    let product =
        product.map_or_else(String::new, |product| format!(", ATTRS{{idProduct}}==\"{product:04x}\""));
    format!(
        "echo 'SUBSYSTEM==\"{subsystem}\", ATTRS{{idVendor}}==\"{vendor:04x}\"{product}, GROUP=\"dialout\", MODE=\"0660\", \
         TAG+=\"uaccess\"' | sudo tee -a /etc/udev/rules.d/70-bowden.rules && sudo udevadm control --reload, then plug it in again"
    )
}

/// Rate that the port is set to, baud. USB takes no notice of it.
const BAUD: u32 = 115_200;

/// How long the reading thread waits before it looks whether it is needed still.
const WAKE: Duration = Duration::from_millis(50);

/// How long writing may take.
const WRITE_TIMEOUT: Duration = Duration::from_secs(1);

/// Bytes of a chunk that the reading thread hands over.
const CHUNK: usize = 4096;

/// Chunks that are read ahead: 16 MiB, half a minute of telemetry at 20 kHz.
const CHUNKS: usize = 4096;

/// An open serial port.
pub struct SerialTransport {
    port: Box<dyn SerialPort>,
    chunks: Receiver<io::Result<Vec<u8>>>,
    rest: Vec<u8>,
    begun: Instant,
    stop: Arc<AtomicBool>,
    reader: Option<JoinHandle<()>>,
}

impl SerialTransport {
    /// Opens a port for this program alone.
    ///
    /// # Errors
    /// [`CommsError::Open`]: there is no such port, it belongs to somebody else, another program has it open, or it is
    /// no serial port.
    pub fn open(path: &str) -> Result<Self, CommsError> {
        let refuse = |error: serialport::Error| open_error(path, &error);
        let port = serialport::new(path, BAUD).timeout(WRITE_TIMEOUT).open().map_err(refuse)?;
        let mut reading = port.try_clone().map_err(refuse)?;
        reading.set_timeout(WAKE).map_err(refuse)?;
        let (send, chunks) = sync_channel(CHUNKS);
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let reader = std::thread::spawn(move || read_ahead(reading.as_mut(), &send, &stopped));
        Ok(Self { port, chunks, rest: Vec::new(), begun: Instant::now(), stop, reader: Some(reader) })
    }
}

/// Reads until told to stop, or the port breaks.
fn read_ahead(port: &mut dyn SerialPort, send: &SyncSender<io::Result<Vec<u8>>>, stop: &AtomicBool) {
    let mut buffer = [0; CHUNK];
    while !stop.load(Ordering::Relaxed) {
        let mut chunk = match port.read(&mut buffer) {
            Ok(0) => Err(io::Error::new(io::ErrorKind::BrokenPipe, "the port was closed at the other end")),
            Ok(read) => Ok(buffer[..read].to_vec()),
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => {
                continue;
            }
            Err(error) => Err(error),
        };
        let broken = chunk.is_err();
        // With a full queue the operating system holds the bytes back, then the board counts what it loses.
        while let Err(TrySendError::Full(back)) = send.try_send(chunk) {
            if stop.load(Ordering::Relaxed) {
                return;
            }
            chunk = back;
            std::thread::sleep(Duration::from_millis(1));
        }
        if broken {
            return;
        }
    }
}

impl Transport for SerialTransport {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        if self.rest.is_empty() {
            self.rest = match self.chunks.recv_timeout(timeout) {
                Ok(chunk) => chunk?,
                Err(RecvTimeoutError::Timeout) => return Ok(0),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(io::Error::new(io::ErrorKind::BrokenPipe, "the port is gone"));
                }
            };
        }
        let length = buffer.len().min(self.rest.len());
        buffer[..length].copy_from_slice(&self.rest[..length]);
        self.rest.drain(..length);
        Ok(length)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        io::Write::write_all(&mut self.port, bytes)
    }

    fn now(&self) -> Duration {
        self.begun.elapsed()
    }
}

impl Drop for SerialTransport {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(reader) = self.reader.take() {
            // A reader that panicked has nothing left to clean up.
            let _ = reader.join();
        }
    }
}

fn open_error(path: &str, error: &serialport::Error) -> CommsError {
    const ANOTHER: &str = "name one such as /dev/ttyACM0, or auto, or sim";
    let (reason, next) = match error.kind() {
        ErrorKind::Io(io::ErrorKind::NotFound) => {
            ("there is no such port".to_owned(), "check the cable, or use --port auto".to_owned())
        }
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => {
            let rule = udev_rule("tty", USB_VENDOR, Some(USB_PRODUCT));
            ("this user may not open the port".to_owned(), format!("grant it with {rule}"))
        }
        ErrorKind::NoDevice if Path::new(path).exists() => {
            (held(&holders(Path::new(path))), "close that one first".to_owned())
        }
        _ if std::fs::metadata(path).is_ok_and(|there| there.is_file() || there.is_dir()) => {
            ("this is no serial port".to_owned(), ANOTHER.to_owned())
        }
        _ => (
            format!("cannot be opened as a serial port: {}", error.description.to_lowercase()),
            ANOTHER.to_owned(),
        ),
    };
    CommsError::Open { port: path.to_owned(), reason, next: next.into() }
}

/// Who has a port open, in words. Programs of other users cannot be named.
fn held(holders: &[Holder]) -> String {
    if holders.is_empty() {
        return "another program has the port open".to_owned();
    }
    let named: Vec<String> =
        holders.iter().map(|holder| format!("`{}` (process {})", holder.command, holder.pid)).collect();
    let verb = if named.len() == 1 { "has" } else { "have" };
    format!("{} {verb} the port open", named.join(", "))
}

/// Finds the one board on USB, or the one with a serial number.
///
/// # Errors
/// [`CommsError::Open`] when there is none, or more than one.
pub fn find(number: Option<&str>) -> Result<String, CommsError> {
    let ports = ports().map_err(|error| {
        refuse_to_find(number, format!("ports cannot be listed: {error}"), "name the port")
    })?;
    choose(&ports, number)
}

/// Serial number of the board at a port, if the system knows one.
pub fn number_of(path: &str) -> Option<String> {
    let path = Path::new(path).canonicalize().ok()?;
    let at_path =
        |port: &SerialPortInfo| Path::new(&port.port_name).canonicalize().is_ok_and(|port| port == path);
    let port = ports().ok()?.into_iter().find(at_path)?;
    board(&port)?.serial_number.clone()
}

fn ports() -> serialport::Result<Vec<SerialPortInfo>> {
    // Without this folder the library has nothing to look through.
    if cfg!(target_os = "linux") && !Path::new("/sys/class/tty").is_dir() {
        return Ok(Vec::new());
    }
    serialport::available_ports()
}

/// The board at a port, if there is one.
fn board(port: &SerialPortInfo) -> Option<&UsbPortInfo> {
    match &port.port_type {
        SerialPortType::UsbPort(usb) if (usb.vid, usb.pid) == (USB_VENDOR, USB_PRODUCT) => Some(usb),
        _ => None,
    }
}

fn refuse_to_find(number: Option<&str>, reason: String, next: &'static str) -> CommsError {
    let port = number.map_or_else(|| AUTO.to_owned(), |number| format!("{SERIAL}{number}"));
    CommsError::Open { port, reason, next: next.into() }
}

fn choose(ports: &[SerialPortInfo], wanted: Option<&str>) -> Result<String, CommsError> {
    let boards: Vec<(&str, Option<&str>)> = ports
        .iter()
        .filter_map(|port| Some((port.port_name.as_str(), board(port)?.serial_number.as_deref())))
        .collect();
    let named = |boards: &[(&str, Option<&str>)]| {
        let name = |(port, number): &(&str, Option<&str>)| {
            format!("{port} with serial number {}", number.unwrap_or("unknown"))
        };
        boards.iter().map(name).collect::<Vec<_>>().join(", ")
    };
    let chosen: Vec<&(&str, Option<&str>)> =
        boards.iter().filter(|(_, number)| wanted.is_none() || *number == wanted).collect();
    match (chosen.as_slice(), boards.as_slice()) {
        ([(port, _)], _) => Ok((*port).to_owned()),
        ([], []) => {
            let others: Vec<&str> = ports.iter().map(|port| port.port_name.as_str()).collect();
            let others = if others.is_empty() { "no port at all".to_owned() } else { others.join(", ") };
            let sought = format!("no USB device {USB_VENDOR:04x}:{USB_PRODUCT:04x} found ({others})");
            Err(refuse_to_find(wanted, sought, "check the cable, or name the port"))
        }
        ([], boards) => {
            let reason = format!("no board has this serial number ({})", named(boards));
            Err(refuse_to_find(wanted, reason, "correct it"))
        }
        (_, boards) => {
            let reason = format!("{} boards found ({})", boards.len(), named(boards));
            Err(refuse_to_find(wanted, reason, "choose one with --port serial:NUMBER"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn port(name: &str, kind: Option<(u16, Option<&str>)>) -> SerialPortInfo {
        let port_type = kind.map_or(SerialPortType::PciPort, |(pid, number)| {
            SerialPortType::UsbPort(UsbPortInfo {
                vid: USB_VENDOR,
                pid,
                serial_number: number.map(str::to_owned),
                manufacturer: None,
                product: None,
                interface: None,
            })
        });
        SerialPortInfo { port_name: name.to_owned(), port_type }
    }

    #[test]
    fn a_board_is_chosen_by_its_serial_number() {
        let other = port("/dev/ttyACM0", Some((0x5740, Some("A1"))));
        let [first, second] =
            ["A1", "B2"].map(|number| port(&format!("/dev/{number}"), Some((USB_PRODUCT, Some(number)))));
        let pci = port("/dev/ttyS0", None);
        let choice = |ports: &[&SerialPortInfo], wanted: Option<&str>| {
            let ports: Vec<SerialPortInfo> = ports.iter().map(|port| (*port).clone()).collect();
            choose(&ports, wanted).map_err(|error| error.to_string())
        };
        assert_eq!(choice(&[&pci, &other, &first], None), Ok("/dev/A1".to_owned()));
        assert_eq!(choice(&[&other, &first, &second], Some("B2")), Ok("/dev/B2".to_owned()));
        let refusals = [
            (
                choice(&[&first, &second], None),
                "auto: 2 boards found (/dev/A1 with serial number A1, /dev/B2 with serial number B2); choose one with \
                 --port serial:NUMBER",
            ),
            (
                choice(&[&other, &second], Some("A1")),
                "serial:A1: no board has this serial number (/dev/B2 with serial number B2); correct it",
            ),
            (
                choice(&[&pci, &other], Some("A1")),
                "serial:A1: no USB device 1209:b0d7 found (/dev/ttyS0, /dev/ttyACM0); check the cable, or name the port",
            ),
            (
                choice(&[], None),
                "auto: no USB device 1209:b0d7 found (no port at all); check the cable, or name the port",
            ),
        ];
        for (got, expected) in refusals {
            assert_eq!(got, Err(expected.to_owned()));
        }
    }

    #[test]
    fn a_missing_permission_offers_the_udev_rule() {
        let kind = ErrorKind::Io(io::ErrorKind::PermissionDenied);
        let error = open_error("/dev/ttyACM0", &serialport::Error::new(kind, "denied")).to_string();
        assert!(error.starts_with("/dev/ttyACM0: this user may not open the port; "), "{error}");
        let ids =
            format!("ATTRS{{idVendor}}==\"{USB_VENDOR:04x}\", ATTRS{{idProduct}}==\"{USB_PRODUCT:04x}\"");
        assert!(error.contains(&ids) && error.contains("/etc/udev/rules.d/70-bowden.rules"), "{error}");
    }
}
