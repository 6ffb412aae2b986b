//! Recordings that outlive the program: rows are on the medium soon after they were written.
//!
//! | what happens | what is lost |
//! |---|---|
//! | the program is killed, the power fails | rows of the last [`SAVE_INTERVAL`], in MCAP and gzipped CSV down to the last whole block |
//! | the medium is full | rows since the last block that found room; the part of a block that did is taken off again |

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::{Cell, Format, Metadata, RowColumn, RowWriter};
use crate::output;

/// Longest time that rows wait for the medium, of the recording's own time and of the clock: whichever is over first.
pub const SAVE_INTERVAL: Duration = Duration::from_millis(250);

/// A file for a recording, open under its own name.
///
/// What a file of this name holds stays until the recording has a row.
#[derive(Debug)]
pub struct DurableFile {
    path: PathBuf,
    file: File,
    is_new: bool,
    is_regular: bool,
}

impl DurableFile {
    /// Opens or makes the file.
    ///
    /// # Errors
    /// The reason why the medium refuses.
    pub fn open(path: &Path) -> io::Result<Self> {
        let is_new = !path.exists();
        let file = File::options().write(true).create(true).truncate(false).open(path)?;
        let is_regular = file.metadata()?.is_file();
        Ok(Self { path: path.to_owned(), file, is_new, is_regular })
    }

    /// Gives the file up without a row: it is as it was before.
    pub fn abandon(self) {
        if self.is_new {
            // An empty file that cannot be removed does no harm.
            let _ = fs::remove_file(&self.path);
        }
    }

    /// Empties the file and writes what stands before the rows.
    ///
    /// # Errors
    /// The reason why the medium refuses.
    pub fn begin(
        self,
        format: Format,
        columns: &[RowColumn],
        metadata: &Metadata,
    ) -> io::Result<DurableWriter> {
        if self.is_regular {
            self.file.set_len(0)?;
            sync_folder(&self.path);
        }
        let out = Medium { file: self.file.try_clone()?, position: 0 };
        let rows = RowWriter::new(format, columns, metadata, out)?;
        Ok(DurableWriter {
            rows: Some(rows),
            file: self.file,
            is_regular: self.is_regular,
            written: 0,
            unsaved: None,
            saved: Saved::default(),
            saved_bytes: 0,
        })
    }
}

/// What a [`RowWriter`] writes to. It only appends, so that a pipe serves as well; positions are counted.
#[derive(Debug)]
struct Medium {
    file: File,
    position: u64,
}

impl Write for Medium {
    fn write(&mut self, data: &[u8]) -> io::Result<usize> {
        let written = self.file.write(data)?;
        self.position += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl io::Seek for Medium {
    fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
        match to {
            io::SeekFrom::Current(0) => Ok(self.position),
            _ => Err(io::ErrorKind::Unsupported.into()),
        }
    }
}

/// The name of a new file is kept by its folder; a file system that cannot say so keeps it all the same.
fn sync_folder(path: &Path) {
    let folder = output::folder_of(path);
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

/// What is on the medium for sure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Saved {
    /// Rows.
    pub rows: u64,
    /// Time of the last one, s.
    pub last_s: Option<f64>,
}

/// Writes rows; see the [module](self).
pub struct DurableWriter {
    /// Gone after the medium has refused.
    rows: Option<RowWriter<Medium>>,
    file: File,
    is_regular: bool,
    written: u64,
    unsaved: Option<Unsaved>,
    saved: Saved,
    saved_bytes: u64,
}

/// Rows that wait.
#[derive(Clone, Copy, Debug)]
struct Unsaved {
    first_s: f64,
    last_s: f64,
    since: Instant,
}

impl DurableWriter {
    /// Writes a row: the time, s, and one cell a column.
    ///
    /// # Errors
    /// The reason why the medium refuses; [`DurableWriter::saved`] is what it holds then, and nothing else.
    pub fn row<'c>(&mut self, t_s: f64, cells: impl IntoIterator<Item = Cell<'c>>) -> io::Result<()> {
        let result = self.rows.as_mut().ok_or_else(refused).and_then(|rows| rows.row(t_s, cells));
        self.or_take_back(result)?;
        self.written += 1;
        let since = self.unsaved.map_or_else(Instant::now, |unsaved| unsaved.since);
        let first_s = self.unsaved.map_or(t_s, |unsaved| unsaved.first_s);
        self.unsaved = Some(Unsaved { first_s, last_s: t_s, since });
        if t_s - first_s >= SAVE_INTERVAL.as_secs_f64() { self.save() } else { Ok(()) }
    }

    /// How long the oldest row that is not saved may wait still; `None` if there is none.
    pub fn time_left(&self) -> Option<Duration> {
        self.unsaved.map(|unsaved| SAVE_INTERVAL.saturating_sub(unsaved.since.elapsed()))
    }

    /// Puts all rows on the medium.
    ///
    /// # Errors
    /// As [`DurableWriter::row`].
    pub fn save(&mut self) -> io::Result<()> {
        let result = self.rows.as_mut().ok_or_else(refused).and_then(RowWriter::flush);
        let result = result.and_then(|()| if self.is_regular { self.file.sync_data() } else { Ok(()) });
        self.or_take_back(result)?;
        self.count()
    }

    /// Ends the recording. `metadata` is what is known at its end; formats without a place for it drop it.
    ///
    /// # Errors
    /// As [`DurableWriter::row`].
    pub fn finish(&mut self, metadata: &Metadata) -> io::Result<()> {
        self.save()?;
        let result = self.rows.take().ok_or_else(refused).and_then(|rows| rows.finish(metadata));
        let result = result.and_then(|()| if self.is_regular { self.file.sync_all() } else { Ok(()) });
        self.or_take_back(result)
    }

    /// What is on the medium for sure.
    pub fn saved(&self) -> Saved {
        self.saved
    }

    fn count(&mut self) -> io::Result<()> {
        if let Some(unsaved) = self.unsaved.take() {
            self.saved = Saved { rows: self.written, last_s: Some(unsaved.last_s) };
        }
        if self.is_regular {
            self.saved_bytes = self.file.metadata()?.len();
        }
        Ok(())
    }

    /// After a refusal: takes off again what was written since the last save, so that the file ends with a whole block.
    fn or_take_back(&mut self, result: io::Result<()>) -> io::Result<()> {
        if result.is_err() {
            // What it still holds would be written to the end once more.
            drop(self.rows.take());
            if self.is_regular {
                // The first error is the one that counts.
                let _ = self.file.set_len(self.saved_bytes);
            }
        }
        result
    }
}

fn refused() -> io::Error {
    io::Error::other("an earlier write failed")
}
