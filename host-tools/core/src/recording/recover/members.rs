//! Whole rows of a gzipped table, member by member: each has a CRC of its own.

use std::io::{BufRead, BufReader, ErrorKind, Read, Seek, SeekFrom, Write};

use flate2::bufread::GzDecoder;

use super::lines::Lines;
use super::sink::{Sink, Stopped};
use crate::output;

/// First bytes of a member: magic number and the one method of compression.
const START: [u8; 3] = [0x1f, 0x8b, 8];

/// Text of a member that is held until its CRC is known, bytes.
const HELD: u64 = 1 << 28;

/// Writes the whole rows to `sink`; what is missing, one line each.
pub fn take<R: Read + Seek, W: Write + Seek>(
    file: &mut BufReader<R>,
    source: &str,
    sink: &mut Sink<W>,
) -> Result<Vec<String>, Stopped> {
    let input =
        |error: std::io::Error| Stopped::Input(format!("cannot be read: {}", output::describe(&error)));
    let mut lines = Lines::new(source, sink);
    let mut at = 0;
    loop {
        file.seek(SeekFrom::Start(at)).map_err(input)?;
        if file.fill_buf().map_err(input)?.is_empty() {
            break;
        }
        let mut text = Vec::new();
        let mut decoder = GzDecoder::new(&mut *file);
        let read = decoder.by_ref().take(HELD).read_to_end(&mut text);
        match read {
            Ok(held) if held as u64 == HELD => {
                lines.feed(text.as_slice())?;
                lines.gap("a part of more than 256 MB: its check sum was not compared");
                lines.feed(decoder)?;
                at = file.stream_position().map_err(input)?;
            }
            Ok(_) => {
                lines.feed(text.as_slice())?;
                at = file.stream_position().map_err(input)?;
            }
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
                lines.feed(text.as_slice())?;
                lines.gap("the gzip data ends early: rows are missing");
                break;
            }
            Err(error) => {
                let next = find(file, at + 1).map_err(input)?;
                let reason = output::describe(&error);
                if next.is_none() && !lines.has_rows() {
                    // One member for all, as other programs write it: better than nothing.
                    lines.feed(text.as_slice())?;
                    lines.gap(&format!("{reason}: the last rows may be wrong, and others are missing"));
                    break;
                }
                let to = next.map_or("the end".to_owned(), |next| next.to_string());
                lines.gap(&format!("bytes {at} to {to} are damaged: rows are missing"));
                match next {
                    Some(next) => at = next,
                    None => break,
                }
            }
        }
    }
    lines.finish()
}

/// The next byte at which a whole member starts.
fn find<R: Read + Seek>(file: &mut BufReader<R>, from: u64) -> std::io::Result<Option<u64>> {
    let mut at = from;
    loop {
        file.seek(SeekFrom::Start(at))?;
        let mut window = Vec::new();
        let read = file.by_ref().take(1 << 20).read_to_end(&mut window)?;
        if read < START.len() {
            return Ok(None);
        }
        for offset in (0..=read - START.len()).filter(|offset| window[*offset..].starts_with(&START)) {
            let start = at + offset as u64;
            file.seek(SeekFrom::Start(start))?;
            let mut text = std::io::sink();
            if std::io::copy(&mut GzDecoder::new(&mut *file), &mut text).is_ok() {
                return Ok(Some(start));
            }
        }
        at += (read - START.len() + 1) as u64;
    }
}
