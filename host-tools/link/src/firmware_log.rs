//! The firmware's own log: defmt frames, as RTT carries them, to lines with time and level.
//!
//! The frames hold numbers only; the words stand in the ELF that the firmware was flashed from. [`LogImage`] is that table,
//! [`LogDecoder`] follows a stream of bytes, [`import`] makes a recording of it.

pub mod import;
mod values;

use std::fmt;

use bowden_core::outcome::Failure;
use defmt_decoder::{Encoding, Frame, Table};
use defmt_parser::Level;
use serde::Serialize;

/// Longest frame, bytes; the firmware's buffer is shorter.
const FRAME_LIMIT: usize = 1 << 16;

/// Zero bytes that the encoding adds behind a frame at most.
const PADDING: usize = 7;

/// Frames after which a log that mostly cannot be decoded counts as one of another firmware.
const FRAMES_TO_JUDGE: u64 = 8;

/// The words of a firmware's log, from its ELF.
pub struct LogImage {
    /// Name of the ELF in messages.
    name: String,
    table: Table,
}

/// A line of the log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LogLine {
    /// Byte of the stream at which its frame begins.
    pub byte: u64,
    /// Time that the firmware gave it, s; none without `defmt::timestamp!`.
    pub time_s: Option<f64>,
    /// `trace` to `error`; none for `println!`.
    pub level: Option<&'static str>,
    /// The words.
    pub text: String,
    /// Numbers with their names, in the order of the line.
    #[serde(skip)]
    pub values: Vec<(String, f64)>,
    /// Number of the log statement.
    #[serde(skip)]
    pub statement: u64,
}

impl fmt::Display for LogLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(time_s) = self.time_s {
            write!(f, "{time_s:.6} ")?;
        }
        write!(f, "{:5} {}", self.level.unwrap_or("print"), self.text)
    }
}

impl LogImage {
    /// Takes the words out of `elf`, whose name is `name` in messages.
    ///
    /// # Errors
    /// Exit status 2: it is no ELF, has no log, or one that this program cannot decode.
    pub fn parse(name: &str, elf: &[u8]) -> Result<Self, Failure> {
        let refuse = |what: &str| Failure::bad_input(format!("{name}: {what}"));
        if !elf.starts_with(b"\x7fELF") {
            return Err(refuse("no ELF file; give the file that the firmware was flashed from"));
        }
        let table = Table::parse(elf).map_err(|error| {
            refuse(&format!("its log cannot be decoded: {error}; build the firmware again"))
        })?;
        let table = table.ok_or_else(|| {
            refuse("it has no log (section .defmt); give the file that the firmware was flashed from")
        })?;
        if !matches!(table.encoding(), Encoding::Rzcobs) {
            return Err(refuse(
                "its log is not encoded as rzCOBS; build the firmware with defmt's encoding-rzcobs",
            ));
        }
        Ok(Self { name: name.to_owned(), table })
    }

    /// Whether its lines carry a time.
    pub fn has_time(&self) -> bool {
        self.table.has_timestamp()
    }

    /// The line of a frame; none if it is damaged or not of this firmware.
    fn line(&self, byte: u64, frame: &[u8]) -> Option<LogLine> {
        let bytes = rzcobs::decode(frame).ok()?;
        let (decoded, used) = self.table.decode(&bytes).ok()?;
        let rest = bytes.get(used..)?;
        // A frame of other words has bytes left over, or too few.
        if rest.len() > PADDING || rest.iter().any(|byte| *byte != 0) {
            return None;
        }
        let time_s = match decoded.display_timestamp() {
            Some(time) => Some(seconds(&time.to_string())?),
            None => None,
        };
        Some(LogLine {
            byte,
            time_s,
            level: decoded.level().map(Level::as_str),
            text: text(&decoded),
            values: values::named(&decoded),
            statement: decoded.index(),
        })
    }
}

/// One line, whatever the firmware printed.
fn text(frame: &Frame) -> String {
    frame.display_message().to_string().split(['\n', '\r']).collect::<Vec<_>>().join(" ")
}

/// Time as defmt shows it, s: `12.345678`, or `1:02:03.456` with hours (and days before) in front.
fn seconds(shown: &str) -> Option<f64> {
    let mut parts = shown.rsplit(':');
    let mut time_s: f64 = parts.next()?.parse().ok()?;
    let mut unit_s = 60.0;
    for (part, next) in parts.zip([60.0, 24.0, 1.0]) {
        time_s += part.parse::<f64>().ok()? * unit_s;
        unit_s *= next;
    }
    time_s.is_finite().then_some(time_s)
}

/// Cuts a stream of bytes into frames and decodes them.
pub struct LogDecoder<'i> {
    image: &'i LogImage,
    pending: Vec<u8>,
    /// Bytes of the stream before `pending`.
    taken: u64,
    lines: u64,
    damaged: u64,
    first_damaged: Option<u64>,
}

impl<'i> LogDecoder<'i> {
    /// At the beginning of a stream.
    pub fn new(image: &'i LogImage) -> Self {
        Self { image, pending: Vec::new(), taken: 0, lines: 0, damaged: 0, first_damaged: None }
    }

    /// Takes the next bytes and gives the lines that they complete.
    ///
    /// # Errors
    /// Exit status 2: most of what came cannot be decoded, so that it is the log of another firmware.
    pub fn take(&mut self, bytes: &[u8]) -> Result<Vec<LogLine>, Failure> {
        let mut lines = Vec::new();
        for byte in bytes {
            if *byte != 0 {
                self.pending.push(*byte);
                if self.pending.len() > FRAME_LIMIT {
                    self.damage();
                }
                continue;
            }
            if !self.pending.is_empty() {
                match self.image.line(self.taken, &self.pending) {
                    Some(line) => {
                        self.lines += 1;
                        self.taken += self.pending.len() as u64;
                        self.pending.clear();
                        lines.push(line);
                    }
                    None => self.damage(),
                }
            }
            self.taken += 1;
            if self.lines + self.damaged >= FRAMES_TO_JUDGE {
                self.judge()?;
            }
        }
        Ok(lines)
    }

    fn damage(&mut self) {
        self.damaged += 1;
        self.first_damaged.get_or_insert(self.taken);
        self.taken += self.pending.len() as u64;
        self.pending.clear();
    }

    fn judge(&self) -> Result<(), Failure> {
        if self.damaged <= self.lines {
            return Ok(());
        }
        Err(Failure::bad_input(format!(
            "{}: {} of {} log frames cannot be decoded with it, the first at byte {}; give the ELF that this firmware was flashed \
             from, and RTT bytes as they came",
            self.image.name,
            self.damaged,
            self.damaged + self.lines,
            self.first_damaged.unwrap_or_default()
        )))
    }

    /// Ends the stream: one line about what is missing, if anything is. A frame that is cut by the end counts as damaged.
    ///
    /// # Errors
    /// As [`LogDecoder::take`].
    pub fn finish(mut self) -> Result<Option<String>, Failure> {
        if !self.pending.is_empty() {
            self.damage();
        }
        self.judge()?;
        Ok(self.first_damaged.map(|byte| {
            format!(
                "{} of {} log frames are damaged or cut, the first at byte {byte}; the others are whole",
                self.damaged,
                self.damaged + self.lines
            )
        }))
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn times_are_read_as_defmt_shows_them() {
        // 1 h 2 min 3.456 s and 2 d 1 h, by hand.
        for (shown, expected_s) in [
            ("0.000012", 12e-6),
            ("12.345678", 12.345_678),
            ("1:02:03.456", 3723.456),
            ("2:01:00:00", 176_400.0),
        ] {
            assert_eq!(seconds(shown), Some(expected_s), "{shown}");
        }
        assert_eq!(seconds("soon"), None);
    }

    /// An image with a time in microseconds and these statements, by number.
    fn image(statements: &[(u16, &str, &str)]) -> LogImage {
        let entry =
            |tag: &str, text: &str| json!({ "string": { "tag": tag, "string": text }, "raw_symbol": "" });
        let entries: serde_json::Map<String, serde_json::Value> =
            statements.iter().map(|(number, tag, text)| (number.to_string(), entry(tag, text))).collect();
        let table = json!({
            "timestamp": entry("Timestamp", "{=u64:us}"),
            "entries": entries,
            "bitflags": {},
            "encoding": "Rzcobs",
        });
        LogImage { name: "a.elf".to_owned(), table: serde_json::from_value(table).unwrap() }
    }

    /// A frame by hand: number, time, arguments, all little-endian.
    fn frame(number: u16, time_us: u64, arguments: &[u8]) -> Vec<u8> {
        let body = [&number.to_le_bytes()[..], &time_us.to_le_bytes(), arguments].concat();
        [rzcobs::encode(&body), vec![0]].concat()
    }

    fn run() -> Vec<u8> {
        let angle = |value: f32| value.to_le_bytes();
        let rows = (0..20_u64).flat_map(|n| frame(3, 1000 * n, &angle(0.5 * n as f32)));
        frame(1, 0, &[]).into_iter().chain(rows).chain(frame(2, 40_000, &[5])).collect()
    }

    const STATEMENTS: [(u16, &str, &str); 3] =
        [(1, "Info", "start"), (2, "Warn", "state {=u8}"), (3, "Info", "theta_in_rad={=f32}")];

    #[test]
    fn frames_are_decoded_wherever_the_stream_is_cut() {
        let image = image(&STATEMENTS);
        for piece in [1, 7, 1000] {
            let mut decoder = LogDecoder::new(&image);
            let bytes = run();
            let lines: Vec<LogLine> =
                bytes.chunks(piece).flat_map(|piece| decoder.take(piece).unwrap()).collect();
            assert_eq!(decoder.finish().unwrap(), None);
            assert_eq!(lines.len(), 22);
            assert_eq!(lines[2].to_string(), "0.001000 info  theta_in_rad=0.5");
            assert_eq!(lines[2].values, [("theta_in_rad".to_owned(), 0.5)]);
            assert_eq!((lines[21].level, lines[21].text.as_str()), (Some("warn"), "state 5"));
        }
    }

    #[test]
    fn a_damaged_frame_is_passed_over_and_said() {
        let image = image(&STATEMENTS);
        let mut bytes = run();
        let place = frame(1, 0, &[]).len() + 2;
        bytes[place] ^= 0x40;
        let mut decoder = LogDecoder::new(&image);
        let lines = decoder.take(&bytes).unwrap().len();
        let note = decoder.finish().unwrap();
        // A changed byte of the time or the argument may give another number, but never another count of frames.
        assert!(
            lines == 22 && note.is_none()
                || lines == 21 && note.is_some_and(|text| text.starts_with("1 of 22 "))
        );
        let whole = run();
        let cut = (40..50).find(|cut| whole[cut - 1] != 0).unwrap();
        let mut decoder = LogDecoder::new(&image);
        let frames = whole[..cut].split(|byte| *byte == 0).count() - 1;
        assert_eq!(decoder.take(&whole[..cut]).unwrap().len(), frames);
        assert!(
            decoder.finish().unwrap().is_some_and(|text| text.contains("damaged or cut, the first at byte "))
        );
    }

    #[test]
    fn another_firmware_is_refused_in_one_line() {
        // The same words under other numbers, as one more statement in front would give. Zeros may end a frame, so that the first two
        // pass for lines with a number.
        let other = image(&[
            (1, "Info", "new {=u32}"),
            (2, "Info", "start"),
            (3, "Warn", "state {=u8}"),
            (4, "Info", "theta_in_rad={=f32}"),
        ]);
        let error = LogDecoder::new(&other).take(&run()).unwrap_err();
        assert_eq!(
            error.message(),
            "a.elf: 6 of 8 log frames cannot be decoded with it, the first at byte 8; give the ELF that this firmware was flashed \
             from, and RTT bytes as they came"
        );
    }

    #[test]
    fn what_is_no_image_is_refused_in_one_line() {
        let error = LogImage::parse("a.bin", b"MZ").err().map(|failure| failure.message().to_owned());
        assert_eq!(
            error.as_deref(),
            Some("a.bin: no ELF file; give the file that the firmware was flashed from")
        );
        let error = LogImage::parse("a.elf", b"\x7fELF and no more")
            .err()
            .map(|failure| failure.message().to_owned());
        assert!(error.is_some_and(|text| text.starts_with("a.elf: its log cannot be decoded: ")));
    }
}
