//! Recordings from and to files.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;

use super::{
    Column, Format, Metadata, READ_BUFFER, ReadOptions, Recording, RowColumn, RowWriter, comma_separated,
    mcap_file, parquet_file,
};
use crate::outcome::Failure;
use crate::output;

/// First bytes of gzip data.
pub(super) const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

impl Recording {
    /// Reads a file. The content decides between CSV, gzipped CSV, MCAP and Parquet; a table is not called `.mcap` or `.parquet`.
    ///
    /// A file that ends early (a last line without its end that makes no whole row, gzip data or an MCAP file
    /// without its end) gives the samples that are whole and a note.
    ///
    /// # Errors
    /// One line that names the file, the line or byte, the column, what was there, and what to do: no or double
    /// `t_s` column, rows of another length than the header, cells of a channel that are no finite number, time that
    /// does not increase, text that is not UTF-8, damaged compression, no samples.
    pub fn load(path: &Path, options: &ReadOptions) -> Result<Self, Failure> {
        let source = path.display().to_string();
        let unreadable = |error: &std::io::Error| {
            let reason = output::describe(error);
            Failure::bad_input(format!("{source}: cannot be read: {reason}; check the path"))
        };
        if path.is_dir() {
            return Err(Failure::bad_input(format!(
                "{source}: is a folder, expected a recording; name a file"
            )));
        }
        let file = File::open(path).map_err(|error| unreadable(&error))?;
        let length = file.metadata().map_err(|error| unreadable(&error))?.len();
        let mut file = BufReader::with_capacity(READ_BUFFER, file);
        let start = file.fill_buf().map_err(|error| unreadable(&error))?;
        let no_table = match Format::of(path) {
            Some(Format::Mcap) => Some("an MCAP file"),
            Some(Format::Parquet) => Some("a Parquet file"),
            _ => None,
        };
        if start.is_empty() {
            return Err(Failure::bad_input(format!(
                "{source}:1: the file is empty, expected a header line with t_s; record again"
            )));
        }
        if start.starts_with(mcap::MAGIC) {
            return mcap_file::read(file, length, source, options);
        }
        if start.starts_with(parquet_file::MAGIC) {
            return parquet_file::read(path, source, options);
        }
        let recording = if let Some(expected) = no_table {
            Err(Failure::bad_input(format!(
                "{source}: byte 0: not the start of {expected}; if it is a table, call it .csv"
            )))
        } else if start.starts_with(&GZIP_MAGIC) {
            comma_separated::read(flate2::bufread::MultiGzDecoder::new(file), source, options)
        } else {
            comma_separated::read(file, source, options)
        };
        let mut recording = recording?;
        match Metadata::beside(path) {
            Ok(metadata) => recording.metadata = metadata,
            Err(note) => recording.notes.push(note),
        }
        Ok(recording)
    }

    /// Writes the recording in the format that the file name asks for: `.csv`, `.csv.gz`, `.mcap` or `.parquet`.
    ///
    /// # Errors
    /// A name that asks for no known format (see [`Format::for_output`]), or the reason why the medium refuses.
    pub fn save(&self, path: &Path) -> Result<(), Failure> {
        let format = Format::for_output(path)?;
        if format == Format::Parquet {
            return output::write_file(path, |file| parquet_file::write(self, file));
        }
        let columns: Vec<RowColumn> = self.columns.iter().map(|column| self.written(column)).collect();
        output::write_file(path, |file| {
            let mut writer = RowWriter::new(format, &columns, &self.metadata, file)?;
            for (sample, t_s) in self.t_s.iter().enumerate() {
                writer.row(*t_s, self.columns.iter().map(|column| column.cell(sample)))?;
            }
            writer.finish(&Metadata::default())
        })?;
        match Metadata::file_beside(path).filter(|_| !self.metadata.is_empty()) {
            Some(beside) => {
                output::write_file(&beside, |file| file.write_all(self.metadata.to_toml().as_bytes()))
            }
            None => Ok(()),
        }
    }

    /// A column as it is written, with its unit where that is known.
    fn written(&self, column: &Column) -> RowColumn {
        match column {
            Column::Known { channel, .. } => RowColumn::Known(*channel),
            Column::Unknown(text) => match self.units.get(text.name()) {
                Some(unit) => RowColumn::described(text.name(), unit),
                None => RowColumn::Unknown(text.name().to_owned()),
            },
        }
    }
}
