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

use serialport::{ErrorKind, SerialPort, SerialPortType};

use super::error::CommsError;
use super::transport::Transport;

/// USB vendor of the board: pid.codes, free for open hardware.
pub const USB_VENDOR: u16 = 0x1209;

/// USB product of the board.
pub const USB_PRODUCT: u16 = 0xb0d7;

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
    let (reason, next) = match error.kind() {
        ErrorKind::Io(io::ErrorKind::NotFound) => {
            ("there is no such port", "check the cable, or use --port auto")
        }
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => (
            "this user may not open the port",
            "add the user to the group that owns it (often dialout) and log in again",
        ),
        ErrorKind::NoDevice if Path::new(path).exists() => {
            ("another program has the port open", "close that one first")
        }
        _ if std::fs::metadata(path).is_ok_and(|there| there.is_file() || there.is_dir()) => {
            ("this is no serial port", "name one such as /dev/ttyACM0, or auto, or sim")
        }
        _ => {
            let reason = format!("cannot be opened as a serial port: {}", error.description.to_lowercase());
            let next = "name one such as /dev/ttyACM0, or auto, or sim";
            return CommsError::Open { port: path.to_owned(), reason, next };
        }
    };
    CommsError::Open { port: path.to_owned(), reason: reason.to_owned(), next }
}

/// Finds the one board on USB.
///
/// # Errors
/// [`CommsError::Open`] when there is none, or more than one.
pub fn find() -> Result<String, CommsError> {
    let refuse = |reason: String, next| CommsError::Open { port: "auto".to_owned(), reason, next };
    // Without this folder the library has nothing to look through.
    let ports = if cfg!(target_os = "linux") && !Path::new("/sys/class/tty").is_dir() {
        Vec::new()
    } else {
        serialport::available_ports()
            .map_err(|error| refuse(format!("ports cannot be listed: {error}"), "name the port"))?
    };
    let others: Vec<&str> = ports.iter().map(|port| port.port_name.as_str()).collect();
    let is_board = |kind: &SerialPortType| matches!(kind, SerialPortType::UsbPort(usb) if (usb.vid, usb.pid) == (USB_VENDOR, USB_PRODUCT));
    let boards: Vec<&str> =
        ports.iter().filter(|port| is_board(&port.port_type)).map(|port| port.port_name.as_str()).collect();
    match boards.as_slice() {
        [board] => Ok((*board).to_owned()),
        [] => {
            let others = if others.is_empty() { "no port at all".to_owned() } else { others.join(", ") };
            let sought = format!("no USB device {USB_VENDOR:04x}:{USB_PRODUCT:04x} found ({others})");
            Err(refuse(sought, "check the cable, or name the port"))
        }
        boards => Err(refuse(format!("{} boards found ({})", boards.len(), boards.join(", ")), "name one")),
    }
}
