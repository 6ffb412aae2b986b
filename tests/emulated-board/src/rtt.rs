//! Log of the firmware: defmt frames from the first RTT up channel, decoded to lines.

use defmt_decoder::{DecodeError, Table};

use crate::error::BoardError;

/// Severity of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// `trace!`
    Trace,
    /// `debug!`
    Debug,
    /// `info!`
    Info,
    /// `warn!`
    Warn,
    /// `error!`
    Error,
    /// `println!`, which has no level.
    Print,
}

impl Level {
    /// Name as in the macros.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Trace => "trace",
            Self::Debug => "debug",
            Self::Info => "info",
            Self::Warn => "warn",
            Self::Error => "error",
            Self::Print => "print",
        }
    }
}

/// A line of the firmware's log.
#[derive(Debug, Clone, PartialEq)]
pub struct LogLine {
    /// Board time at which the host fetched it, at most 1 ms behind its making \[s\].
    pub at_s: f64,
    /// Timestamp that the firmware gave it, empty if it has none.
    pub timestamp: String,
    /// Severity.
    pub level: Level,
    /// Text.
    pub text: String,
}

impl std::fmt::Display for LogLine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.6} {:5} {}", self.at_s, self.level.as_str(), self.text)
    }
}

/// Offsets in the control block: id (16), channel counts, then the first up channel.
const BUFFER: u32 = 28;

/// The debug probe's side of RTT.
pub(crate) struct Rtt {
    control_block: u32,
    table: Option<Table>,
    /// Bytes behind the last complete frame.
    partial: Vec<u8>,
    lines: Vec<LogLine>,
    /// Everything fetched that nobody took yet.
    bytes: Vec<u8>,
}

impl Rtt {
    /// The log of `elf`, whose control block is at `control_block`; `None` without RTT.
    pub(crate) fn new(elf: &[u8], control_block: Option<u32>) -> Result<Option<Self>, BoardError> {
        let Some(control_block) = control_block else { return Ok(None) };
        let table = Table::parse(elf)
            .map_err(|error| BoardError::Image(format!("its defmt table cannot be read: {error}")))?;
        Ok(Some(Self { control_block, table, partial: Vec::new(), lines: Vec::new(), bytes: Vec::new() }))
    }

    /// Lines so far.
    pub(crate) fn lines(&self) -> &[LogLine] {
        &self.lines
    }

    /// Takes out the lines so far.
    pub(crate) fn take_lines(&mut self) -> Vec<LogLine> {
        std::mem::take(&mut self.lines)
    }

    /// Takes out the bytes so far, as a debug probe gets them.
    pub(crate) fn take_bytes(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes)
    }

    /// A frame that was cut by a reset is lost.
    pub(crate) fn restart(&mut self) {
        self.partial.clear();
    }

    /// Fetches what the firmware has written; `read` and `write` reach its memory.
    pub(crate) fn drain<M>(
        &mut self,
        memory: &mut M,
        read: impl Fn(&M, u32, &mut [u8]) -> bool,
        write: impl Fn(&mut M, u32, &[u8]),
        at_s: f64,
    ) {
        let mut descriptor = [0; 16];
        if !read(memory, self.control_block + BUFFER, &mut descriptor) {
            return;
        }
        let word = |k: usize| {
            u32::from_le_bytes([descriptor[k], descriptor[k + 1], descriptor[k + 2], descriptor[k + 3]])
        };
        let (buffer, size, written, mut fetched) = (word(0), word(4), word(8), word(12));
        // Before the firmware's start-up has run, the block holds anything.
        if size == 0 || size > 0x1_0000 || written >= size || fetched >= size || written == fetched {
            return;
        }
        let mut content = vec![0; size as usize];
        if !read(memory, buffer, &mut content) {
            return;
        }
        while fetched != written {
            self.partial.push(content[fetched as usize]);
            self.bytes.push(content[fetched as usize]);
            fetched = (fetched + 1) % size;
        }
        write(memory, self.control_block + BUFFER + 12, &written.to_le_bytes());
        self.decode(at_s);
    }

    fn decode(&mut self, at_s: f64) {
        // Frames end with a zero byte (rzCOBS); what stands behind the last one waits.
        let Some(end) = self.partial.iter().rposition(|byte| *byte == 0) else { return };
        let complete: Vec<u8> = self.partial.drain(..=end).collect();
        let Some(table) = &self.table else { return };
        let mut decoder = table.new_stream_decoder();
        decoder.received(&complete);
        loop {
            let (level, text, timestamp) = match decoder.decode() {
                Ok(frame) => {
                    let level = frame.level().map_or(Level::Print, |level| match level.as_str() {
                        "trace" => Level::Trace,
                        "debug" => Level::Debug,
                        "info" => Level::Info,
                        "warn" => Level::Warn,
                        _ => Level::Error,
                    });
                    let timestamp =
                        frame.display_timestamp().map_or_else(String::new, |time| time.to_string());
                    (level, frame.display_message().to_string(), timestamp)
                }
                Err(DecodeError::UnexpectedEof) => return,
                Err(DecodeError::Malformed) => {
                    (Level::Error, "a frame that cannot be decoded".to_owned(), String::new())
                }
            };
            self.lines.push(LogLine { at_s, timestamp, level, text });
        }
    }
}
