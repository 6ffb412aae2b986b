//! How the data of a file end.

use std::io::Read;

/// A reader that remembers how the data ended.
pub(super) struct Tail<R> {
    inner: R,
    pub bytes: u64,
    pub last_byte: Option<u8>,
    pub cut_short: bool,
}

impl<R: Read> Tail<R> {
    pub fn new(inner: R) -> Self {
        Self { inner, bytes: 0, last_byte: None, cut_short: false }
    }
}

impl<R: Read> Read for Tail<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        match self.inner.read(buffer) {
            Ok(read) => {
                self.bytes += read as u64;
                if let Some(last) = buffer[..read].last() {
                    self.last_byte = Some(*last);
                }
                Ok(read)
            }
            // Compressed data that stops early: what came before is whole.
            Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
                self.cut_short = true;
                Ok(0)
            }
            Err(error) => Err(error),
        }
    }
}
