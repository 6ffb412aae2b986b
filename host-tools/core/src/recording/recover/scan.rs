//! Whole samples of an MCAP file, found again behind damaged bytes.
//!
//! A file is a chain of records, each an opcode, a length and a body. Where the chain breaks, every byte behind is tried as
//! the start of a chunk: its two lengths have to agree, and its CRC decides.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Read, Seek, SeekFrom, Write};

use mcap::records::{Record, op};

use super::shorten;
use super::sink::{Sink, Stopped, twice};
use crate::recording::mcap_file::{RECORD_LIMIT, Records, Row, SCHEMA, TOPIC, parse_record, units_of};

/// Opcode and length of a record, bytes.
const HEAD: u64 = 9;

/// Fields of a chunk before its samples without the name of the compression, bytes.
const CHUNK_HEAD: usize = 40;

/// Longest name of a compression, bytes.
const COMPRESSION_NAME: usize = 16;

/// Bytes that are searched at once for the start of a record.
const WINDOW: usize = 1 << 20;

/// Writes the whole samples to `sink`; what is missing, one line each.
pub fn take<R: Read + Seek, W: Write + Seek>(
    file: &mut R,
    source: &str,
    sink: &mut Sink<W>,
) -> Result<Vec<String>, Stopped> {
    let input =
        |error: io::Error| Stopped::Input(format!("cannot be read: {}", crate::output::describe(&error)));
    let length = file.seek(SeekFrom::End(0)).map_err(input)?;
    let mut scan = Scan {
        file,
        length,
        sink,
        samples: BTreeMap::new(),
        others: BTreeSet::new(),
        damages: Vec::new(),
        sequence: None,
        unusable: 0,
        data_end: None,
    };
    let end = scan.run()?;
    let crc_differs = scan.crc_differs().map_err(input)?;
    let mut missing = shorten(scan.damages.iter().map(|damage| damage.line(source)).collect(), source);
    match end {
        End::Whole if crc_differs => missing.push(format!(
            "{source}: a byte outside the rows is damaged, maybe in the metadata; compare them with another recording"
        )),
        End::Whole => {}
        End::Early(byte) => {
            let after = scan.sink.last_s().map_or(String::new(), |last_s| format!(", after t_s = {last_s:?}"));
            missing.push(format!("{source}: the file ends early{after}: nothing whole follows byte {byte}"));
        }
        End::WithoutIndex(byte) => {
            missing.push(format!("{source}: the index at the end, around byte {byte}, is damaged; no row is missing for it"));
        }
    }
    if scan.unusable > 0 {
        missing.push(format!("{source}: {} messages are no whole rows and were left out", scan.unusable));
    }
    if !scan.others.is_empty() {
        let topics: Vec<&str> = scan.others.iter().map(String::as_str).collect();
        missing.push(format!("{source}: other topics were not copied: {}", topics.join(", ")));
    }
    Ok(missing)
}

/// How the file ends.
enum End {
    Whole,
    /// Within the samples; the byte from which on nothing is whole.
    Early(u64),
    /// Within what stands behind the samples.
    WithoutIndex(u64),
}

struct Scan<'s, R, W: Write + Seek> {
    file: &'s mut R,
    length: u64,
    sink: &'s mut Sink<W>,
    /// Whether a channel carries samples.
    samples: BTreeMap<u16, bool>,
    others: BTreeSet<String>,
    damages: Vec<Damage>,
    /// Number of the last sample.
    sequence: Option<u32>,
    unusable: u64,
    /// End of the data section and its CRC.
    data_end: Option<(u64, u32)>,
}

/// Damaged bytes, and the samples around them.
struct Damage {
    from: u64,
    to: u64,
    after_s: Option<f64>,
    /// The first whole sample behind.
    until_s: Option<f64>,
    rows: Option<u32>,
}

impl Damage {
    fn line(&self, source: &str) -> String {
        let Self { from, to, after_s, until_s, rows } = self;
        let place = format!("{source}: bytes {from} to {to} are damaged");
        let span = match (after_s, until_s) {
            (Some(after_s), Some(until_s)) => format!("between t_s = {after_s:?} and {until_s:?}"),
            (None, Some(until_s)) => format!("before t_s = {until_s:?}"),
            (Some(after_s), None) => format!("after t_s = {after_s:?}"),
            (None, None) => return place,
        };
        match rows {
            Some(0) => format!("{place}; no row is missing for them"),
            Some(rows) => format!("{place}: {rows} rows {span} are missing"),
            None => format!("{place}: rows {span} may be missing"),
        }
    }
}

/// What a chunk is.
enum Chunk {
    Whole(Vec<Record<'static>>),
    /// Its lengths agree and its content does not.
    Damaged,
    /// Its lengths do not agree: it may be none.
    Inconsistent,
}

impl<R: Read + Seek, W: Write + Seek> Scan<'_, R, W> {
    fn run(&mut self) -> Result<End, Stopped> {
        let magic = mcap::MAGIC.len() as u64;
        let mut at = magic;
        if self.bytes(0, magic)?.as_deref() != Some(mcap::MAGIC) {
            let Some(next) = self.find(0)? else {
                return Err(Stopped::Input("neither its start nor a chunk of MCAP is in the file; give the file that was recorded, or one with the ending of its format".into()));
            };
            self.damaged(0, next);
            at = next;
        }
        loop {
            let record = self.record(at)?;
            let next = record.as_ref().map_or(at, |(_, body)| at + HEAD + body.len() as u64);
            let in_place = match record {
                None => false,
                Some((op::FOOTER, body)) => {
                    let whole = self.summary_is_whole(at, &body)?;
                    return Ok(if whole { End::Whole } else { End::WithoutIndex(at) });
                }
                Some((op::CHUNK, body)) => match chunk(&body) {
                    Chunk::Whole(records) => {
                        for record in records {
                            self.take(record)?;
                        }
                        true
                    }
                    Chunk::Damaged => {
                        self.damaged(at, next);
                        true
                    }
                    Chunk::Inconsistent => false,
                },
                Some((opcode, body)) => match parse_record(opcode, &body) {
                    Ok(Record::DataEnd(end)) => {
                        self.data_end = Some((at, end.data_section_crc));
                        true
                    }
                    Ok(record) => {
                        self.take(record.into_owned())?;
                        true
                    }
                    Err(_) => false,
                },
            };
            if in_place {
                at = next;
                continue;
            }
            let found = if self.data_end.is_some() { None } else { self.find(at + 1)? };
            match found {
                Some(next) => {
                    self.damaged(at, next);
                    at = next;
                }
                None if self.data_end.is_some() => return Ok(End::WithoutIndex(at)),
                None => return Ok(End::Early(at)),
            }
        }
    }

    fn take(&mut self, record: Record) -> Result<(), Stopped> {
        match record {
            Record::Schema { header, data } if header.name == SCHEMA => self.sink.units = units_of(&data),
            Record::Channel(channel) => {
                let samples = channel.topic == TOPIC && channel.message_encoding == "json";
                self.samples.insert(channel.id, samples);
                if !samples {
                    self.others.insert(channel.topic);
                }
            }
            Record::Metadata(metadata) => self.sink.metadata.extend(&metadata.name, metadata.metadata),
            Record::Message { header, data } => match self.samples.get(&header.channel_id) {
                Some(false) => {}
                // The chunk that told the channel may be the damaged one.
                _ => self.sample(header.sequence, &data)?,
            },
            _ => {}
        }
        Ok(())
    }

    fn sample(&mut self, sequence: u32, data: &[u8]) -> Result<(), Stopped> {
        let Ok(row) = Row::parse(data) else {
            self.unusable += 1;
            return Ok(());
        };
        if self.sink.names().is_empty() {
            let names: Vec<String> = row.names().map(str::to_owned).collect();
            if twice(&names).is_some() {
                self.unusable += 1;
                return Ok(());
            }
            self.sink.header(names)?;
        }
        let same = row.names().eq(self.sink.names().iter().map(String::as_str));
        let cells = row.cells().unwrap_or_default();
        let Some(t_s) = self.sink.time_of(&cells).filter(|_| same) else {
            self.unusable += 1;
            return Ok(());
        };
        for damage in self.damages.iter_mut().filter(|damage| damage.until_s.is_none()) {
            damage.until_s = Some(t_s);
            damage.rows =
                Some(self.sequence.map_or(sequence, |last| sequence.wrapping_sub(last).wrapping_sub(1)));
        }
        self.sequence = Some(sequence);
        self.sink.row(t_s, &cells)
    }

    /// Notes damaged bytes; those that no sample separates are one place.
    fn damaged(&mut self, from: u64, to: u64) {
        match self.damages.last_mut() {
            Some(last) if last.until_s.is_none() => last.to = to,
            _ => {
                let after_s = self.sink.last_s();
                self.damages.push(Damage { from, to, after_s, until_s: None, rows: None });
            }
        }
    }

    /// Opcode and body of the record at a byte, if it can be one.
    fn record(&mut self, at: u64) -> Result<Option<(u8, Vec<u8>)>, Stopped> {
        let Some(head) = self.bytes(at, HEAD)? else { return Ok(None) };
        let opcode = head[0];
        let length = little_endian(&head[1..]);
        if !(op::HEADER..=op::DATA_END).contains(&opcode) && opcode < 0x80 || length > RECORD_LIMIT as u64 {
            return Ok(None);
        }
        Ok(self.bytes(at + HEAD, length)?.map(|body| (opcode, body)))
    }

    /// The first byte from `from` on at which a whole chunk or the end of the data stands.
    fn find(&mut self, from: u64) -> Result<Option<u64>, Stopped> {
        let mut start = from;
        while start + HEAD < self.length {
            let length = (self.length - start).min(WINDOW as u64);
            let Some(window) = self.bytes(start, length)? else { return Ok(None) };
            let last_window = start + length == self.length;
            let searched = if last_window {
                window.len()
            } else {
                window.len() - (CHUNK_HEAD + COMPRESSION_NAME) - HEAD as usize
            };
            for (offset, opcode) in window[..searched].iter().enumerate() {
                let at = start + offset as u64;
                let found = match *opcode {
                    op::CHUNK => could_be_chunk(&window[offset..]) && self.is_chunk(at)?,
                    op::DATA_END => self.is_data_end(at)?,
                    _ => false,
                };
                if found {
                    return Ok(Some(at));
                }
            }
            start += searched as u64;
        }
        Ok(None)
    }

    fn is_chunk(&mut self, at: u64) -> Result<bool, Stopped> {
        let record = self.record(at)?;
        Ok(record.is_some_and(|(_, body)| matches!(chunk(&body), Chunk::Whole(_))))
    }

    /// Four bytes of CRC, and the record behind them is one of those that may follow.
    fn is_data_end(&mut self, at: u64) -> Result<bool, Stopped> {
        let Some(head) = self.bytes(at, HEAD)? else { return Ok(false) };
        if little_endian(&head[1..]) != 4 {
            return Ok(false);
        }
        let next = self.record(at + HEAD + 4)?;
        Ok(next.is_some_and(|(opcode, body)| opcode != op::DATA_END && parse_record(opcode, &body).is_ok()))
    }

    /// Bytes of the file; none if it ends before.
    fn bytes(&mut self, from: u64, length: u64) -> Result<Option<Vec<u8>>, Stopped> {
        if from.saturating_add(length) > self.length {
            return Ok(None);
        }
        let mut bytes = vec![0; length as usize];
        let read = self.file.seek(SeekFrom::Start(from)).and_then(|_| self.file.read_exact(&mut bytes));
        read.map_err(|error| Stopped::Input(format!("cannot be read: {}", crate::output::describe(&error))))?;
        Ok(Some(bytes))
    }

    /// Whether the summary before a footer is the one that was written, and the file ends behind it.
    fn summary_is_whole(&mut self, at: u64, footer: &[u8]) -> Result<bool, Stopped> {
        let Ok(Record::Footer(footer)) = parse_record(op::FOOTER, footer) else { return Ok(false) };
        // All of the footer but the CRC itself.
        let end = at + HEAD + 16;
        if self.bytes(end + 4, mcap::MAGIC.len() as u64)?.as_deref() != Some(mcap::MAGIC) {
            return Ok(false);
        }
        if footer.summary_crc == 0 || footer.summary_start == 0 {
            return Ok(true);
        }
        let summary = end.checked_sub(footer.summary_start).filter(|length| *length <= RECORD_LIMIT as u64);
        let Some(summary) = summary.map(|length| self.bytes(footer.summary_start, length)).transpose()?
        else {
            return Ok(false);
        };
        let mut crc = flate2::Crc::new();
        crc.update(&summary.unwrap_or_default());
        Ok(crc.sum() == footer.summary_crc)
    }

    /// Whether a file in which every chunk is whole differs from what its writer summed up.
    fn crc_differs(&mut self) -> io::Result<bool> {
        let Some((end, expected)) = self.data_end.filter(|(_, crc)| *crc != 0) else { return Ok(false) };
        if !self.damages.is_empty() {
            return Ok(false);
        }
        self.file.seek(SeekFrom::Start(0))?;
        let mut crc = flate2::CrcWriter::new(io::sink());
        io::copy(&mut self.file.by_ref().take(end), &mut crc)?;
        Ok(crc.crc().sum() != expected)
    }
}

fn little_endian(bytes: &[u8]) -> u64 {
    bytes.iter().take(8).rev().fold(0, |value, byte| value << 8 | u64::from(*byte))
}

/// Whether the lengths at the start of a record are those of a chunk.
fn could_be_chunk(record: &[u8]) -> bool {
    let Some(body) = record.get(HEAD as usize..) else { return false };
    lengths_agree(body, little_endian(&record[1..]))
}

/// Whether the lengths in a chunk's head and that of its record agree.
fn lengths_agree(body: &[u8], length: u64) -> bool {
    let Some(name) = body.get(28..32).map(|bytes| little_endian(bytes) as usize) else { return false };
    if name > COMPRESSION_NAME {
        return false;
    }
    let Some(samples) = body.get(32 + name..CHUNK_HEAD + name).map(little_endian) else { return false };
    samples.checked_add((CHUNK_HEAD + name) as u64) == Some(length) && length <= RECORD_LIMIT as u64
}

fn chunk(body: &[u8]) -> Chunk {
    if !lengths_agree(body, body.len() as u64) {
        return Chunk::Inconsistent;
    }
    let mut head = [0; HEAD as usize];
    head[0] = op::CHUNK;
    head[1..].copy_from_slice(&(body.len() as u64).to_le_bytes());
    let mut records = Records::of_chunk(head.chain(body), body.len() as u64);
    let mut whole = Vec::new();
    loop {
        match records.next() {
            Ok(Some(record)) => whole.push(record),
            Ok(None) => return Chunk::Whole(whole),
            Err(_) => return Chunk::Damaged,
        }
    }
}
