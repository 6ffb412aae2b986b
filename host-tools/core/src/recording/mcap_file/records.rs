//! Records of an MCAP file as they stream past.

use std::io::{self, Read};

use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::RECORD_LIMIT;
use super::lengths::parse_record;
use crate::guarded::guarded;

/// Records of a file, those within chunks among them; a chunk is checked before its first record is given.
pub(in crate::recording) struct Records<R> {
    data: R,
    reader: LinearReader,
}

impl<R: Read> Records<R> {
    /// Of a whole file of `length` bytes.
    pub(super) fn new(data: R, length: u64) -> Self {
        Self::with(data, length, LinearReaderOptions::default().with_validate_data_section_crc(true))
    }

    /// Of one chunk of `length` bytes, with its opcode and length before it.
    pub(in crate::recording) fn of_chunk(data: R, length: u64) -> Self {
        Self::with(
            data,
            length,
            LinearReaderOptions::default().with_skip_start_magic(true).with_skip_end_magic(true),
        )
    }

    fn with(data: R, length: u64, options: LinearReaderOptions) -> Self {
        let options = options.with_record_length_limit(limit(length)).with_prevalidate_chunk_crcs(true);
        Self { data, reader: LinearReader::new_with_options(options) }
    }

    /// The next record; none at the end.
    pub(in crate::recording) fn next(&mut self) -> Result<Option<Record<'static>>, McapError> {
        loop {
            let reader = &mut self.reader;
            // A record that is longer than its uncompressed chunk makes the library subtract with overflow.
            match guarded(move || reader.next_event()).unwrap_or(Some(Err(McapError::UnexpectedEoc))) {
                None => return Ok(None),
                Some(Err(error)) => return Err(error),
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                    let into = self.reader.insert(wanted);
                    let read = loop {
                        match self.data.read(into) {
                            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                            read => break read?,
                        }
                    };
                    self.reader.notify_read(read);
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    return parse_record(opcode, data).map(|record| Some(record.into_owned()));
                }
            }
        }
    }
}

/// Largest record, packed or unpacked, that is read from a file of `length` bytes: the reader makes room for it before it comes.
fn limit(length: u64) -> usize {
    /// What any chunk may be, bytes; writers make them of some megabytes.
    const LEAST: u64 = 1 << 22;
    /// How often a table may be longer than its compressed form.
    const DENSEST: u64 = 1000;
    length.saturating_mul(DENSEST).clamp(LEAST, RECORD_LIMIT as u64) as usize
}
