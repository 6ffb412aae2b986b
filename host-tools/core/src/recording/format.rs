//! Formats of recordings, and how file names ask for them.

use std::path::Path;

use crate::outcome::Failure;

/// Format of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated, one header line.
    Csv,
    /// The same, gzipped.
    GzippedCsv,
    /// MCAP with JSON messages.
    Mcap,
    /// Parquet; written at once, not row by row.
    Parquet,
}

impl Format {
    /// The format that a file name asks for, if any.
    pub fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        [
            (".csv", Self::Csv),
            (".csv.gz", Self::GzippedCsv),
            (".mcap", Self::Mcap),
            (".parquet", Self::Parquet),
        ]
        .into_iter()
        .find_map(|(ending, format)| name.ends_with(ending).then_some(format))
    }

    /// The format of a file that is to be written.
    ///
    /// # Errors
    /// Says which endings are known, if the name has none of them.
    pub fn for_output(path: &Path) -> Result<Self, Failure> {
        Self::of(path).ok_or_else(|| {
            let path = path.display();
            Failure::bad_input(format!(
                "{path}: unknown format; end the name in .csv, .csv.gz, .mcap or .parquet"
            ))
        })
    }

    /// The format of a file that is written row by row.
    ///
    /// # Errors
    /// As [`Format::for_output`], and for Parquet, which has its index at the end and would be lost with it.
    pub fn for_rows(path: &Path) -> Result<Self, Failure> {
        match Self::for_output(path)? {
            Self::Parquet => Err(Failure::bad_input(format!(
                "{}: a Parquet file that is cut holds nothing; write .csv, .csv.gz or .mcap, then `bowden convert` it",
                path.display()
            ))),
            format => Ok(format),
        }
    }
}
