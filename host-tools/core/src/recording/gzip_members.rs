//! Gzip data in members, one from flush to flush: each has a CRC of its own, and readers take them as one text.

use std::io::{self, Write};

use flate2::write::GzEncoder;

/// Compresses into members.
pub(super) struct Members<W: Write>(State<W>);

enum State<W: Write> {
    Between(W),
    Within(GzEncoder<W>),
    /// The medium refused.
    Broken,
}

impl<W: Write> Members<W> {
    pub fn new(out: W) -> Self {
        Self(State::Between(out))
    }

    /// Ends the last member and gives back what was written to.
    pub fn finish(mut self) -> io::Result<W> {
        self.end()?;
        match self.0 {
            State::Between(out) => Ok(out),
            State::Within(_) | State::Broken => Err(refused()),
        }
    }

    fn end(&mut self) -> io::Result<()> {
        self.0 = match std::mem::replace(&mut self.0, State::Broken) {
            State::Within(encoder) => State::Between(encoder.finish()?),
            other => other,
        };
        Ok(())
    }
}

impl<W: Write> Write for Members<W> {
    fn write(&mut self, data: &[u8]) -> io::Result<usize> {
        if let State::Between(_) = self.0
            && let State::Between(out) = std::mem::replace(&mut self.0, State::Broken)
        {
            self.0 = State::Within(GzEncoder::new(out, flate2::Compression::default()));
        }
        match &mut self.0 {
            State::Within(encoder) => encoder.write(data),
            State::Between(_) | State::Broken => Err(refused()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.end()?;
        match &mut self.0 {
            State::Between(out) => out.flush(),
            State::Within(_) | State::Broken => Err(refused()),
        }
    }
}

fn refused() -> io::Error {
    io::Error::other("an earlier write failed")
}
