//! Records of an MCAP file as they stream past.

use std::io::{self, Read};

use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::RECORD_LIMIT;

/// Records of a file, those within chunks among them; a chunk is checked before its first record is given.
pub(in crate::recording) struct Records<R> {
    data: R,
    reader: LinearReader,
}

impl<R: Read> Records<R> {
    /// Of a whole file.
    pub(super) fn new(data: R) -> Self {
        Self::with(data, LinearReaderOptions::default().with_validate_data_section_crc(true))
    }

    /// Of one chunk, with its opcode and length before it.
    pub(in crate::recording) fn of_chunk(data: R) -> Self {
        Self::with(data, LinearReaderOptions::default().with_skip_start_magic(true).with_skip_end_magic(true))
    }

    fn with(data: R, options: LinearReaderOptions) -> Self {
        let options = options.with_record_length_limit(RECORD_LIMIT).with_prevalidate_chunk_crcs(true);
        Self { data, reader: LinearReader::new_with_options(options) }
    }

    /// The next record; none at the end.
    pub(in crate::recording) fn next(&mut self) -> Result<Option<Record<'static>>, McapError> {
        loop {
            match self.reader.next_event() {
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
                    return mcap::parse_record(opcode, data).map(|record| Some(record.into_owned()));
                }
            }
        }
    }
}
