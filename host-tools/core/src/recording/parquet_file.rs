//! Recordings in Parquet, for data frames and databases: a table in columns, a quarter of a million rows a group.
//!
//! A role is a column of `DOUBLE`. A column that is not interpreted is `INT64` or `DOUBLE` where every cell reads back to the same
//! letters, else text. Metadata stand in the file's key-value metadata, as `group/entry`; units as `unit.COLUMN`.
//! The file's index stands at its end: it is written at once, never row by row.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as PhysicalType};
use parquet::column::reader::ColumnReader;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;

use super::build::Table;
use super::origin::Origin;
use super::place::Places;
use super::{Column, ReadOptions, Recording, TIME_ROLE, TextColumn};
use crate::guarded::guarded;
use crate::outcome::Failure;

/// First and last bytes of a file.
pub(super) const MAGIC: &[u8] = b"PAR1";

/// Rows of a row group.
const GROUP: usize = 1 << 18;

/// Rows that are read at once.
const BATCH: usize = 1 << 12;

/// Rows that a byte of a file may hold: times rise, so that every row takes some bits. A count beyond it is damage.
const ROWS_A_BYTE: u64 = 100;

/// Name of the schema's root.
const ROOT: &str = "bowden_recording";

/// What a column holds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Number,
    Integer,
    Text,
}

impl Kind {
    fn of(column: &Column) -> Self {
        let Column::Unknown(text) = column else { return Self::Number };
        let integer = |cell: &str| cell.parse::<i64>().is_ok_and(|value| value.to_string() == cell);
        let number = |cell: &str| cell.parse::<f64>().is_ok_and(|value| format!("{value:?}") == cell);
        if text.cells().all(integer) {
            Self::Integer
        } else if text.cells().all(number) {
            Self::Number
        } else {
            Self::Text
        }
    }

    fn schema(self, name: &str) -> Result<Type, ParquetError> {
        let (physical, logical) = match self {
            Self::Number => (PhysicalType::DOUBLE, None),
            Self::Integer => (PhysicalType::INT64, None),
            Self::Text => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
        };
        Type::primitive_type_builder(name, physical)
            .with_repetition(Repetition::REQUIRED)
            .with_logical_type(logical)
            .build()
    }
}

/// Writes a recording.
pub(super) fn write(recording: &Recording, out: impl Write + Send) -> io::Result<()> {
    try_write(recording, out).map_err(io_error)
}

fn try_write(recording: &Recording, out: impl Write + Send) -> Result<(), ParquetError> {
    let kinds: Vec<Kind> = recording.columns.iter().map(Kind::of).collect();
    let mut fields = vec![Arc::new(Kind::Number.schema(TIME_ROLE)?)];
    for (column, kind) in recording.columns.iter().zip(&kinds) {
        fields.push(Arc::new(kind.schema(column.name())?));
    }
    let schema = Type::group_type_builder(ROOT).with_fields(fields).build()?;
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(concat!("bowden ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_key_value_metadata(Some(key_values(recording)))
        .build();
    let mut file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
    for start in (0..recording.len()).step_by(GROUP) {
        let rows = start..recording.len().min(start + GROUP);
        let mut group = file.next_row_group()?;
        write_numbers(&mut group, &recording.t_s[rows.clone()])?;
        for (column, kind) in recording.columns.iter().zip(&kinds) {
            match (column, kind) {
                (Column::Known { values, .. }, _) => write_numbers(&mut group, &values[rows.clone()])?,
                (Column::Unknown(text), Kind::Number) => {
                    let numbers: Vec<f64> = cells(text, &rows).filter_map(|cell| cell.parse().ok()).collect();
                    write_numbers(&mut group, &numbers)?;
                }
                (Column::Unknown(text), Kind::Integer) => {
                    let numbers: Vec<i64> = cells(text, &rows).filter_map(|cell| cell.parse().ok()).collect();
                    let Some(mut column) = group.next_column()? else { return Err(no_column()) };
                    column.typed::<Int64Type>().write_batch(&numbers, None, None)?;
                    column.close()?;
                }
                (Column::Unknown(text), Kind::Text) => {
                    let texts: Vec<ByteArray> = cells(text, &rows).map(ByteArray::from).collect();
                    let Some(mut column) = group.next_column()? else { return Err(no_column()) };
                    column.typed::<ByteArrayType>().write_batch(&texts, None, None)?;
                    column.close()?;
                }
            }
        }
        group.close()?;
    }
    file.close()?;
    Ok(())
}

fn cells<'t>(text: &'t TextColumn, rows: &std::ops::Range<usize>) -> impl Iterator<Item = &'t str> {
    rows.clone().map(|row| text.cell(row).unwrap_or_default())
}

fn write_numbers<W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &[f64],
) -> Result<(), ParquetError> {
    let Some(mut column) = group.next_column()? else { return Err(no_column()) };
    column.typed::<DoubleType>().write_batch(values, None, None)?;
    column.close()
}

fn no_column() -> ParquetError {
    ParquetError::General("a column more than the schema has".into())
}

/// Metadata and units as the file keeps them.
fn key_values(recording: &Recording) -> Vec<KeyValue> {
    let metadata = recording.metadata.groups().flat_map(|(group, entries)| {
        entries.iter().map(move |(name, value)| KeyValue::new(format!("{group}/{name}"), value.clone()))
    });
    let roles = recording.channels().map(|channel| (channel.role(), channel.unit()));
    let others = recording.units.iter().map(|(name, unit)| (name.as_str(), unit.as_str()));
    let units = std::iter::once((TIME_ROLE, "s")).chain(roles).chain(others);
    metadata.chain(units.map(|(name, unit)| KeyValue::new(format!("unit.{name}"), unit.to_owned()))).collect()
}

/// Reads a file.
pub(super) fn read(path: &Path, source: String, options: &ReadOptions) -> Result<Recording, Failure> {
    let mut origin = Origin::new(source, Places::samples());
    // The library panics where parts of a damaged file contradict each other.
    let table = guarded(|| try_read(path, &mut origin, options))
        .unwrap_or_else(|panic| Err(Unreadable::Damaged(panic.text)));
    let table = table.map_err(|error| {
        let (source, reason) = (&origin.source, error.reason());
        Failure::bad_input(format!("{source}: {reason}; copy or convert the file again"))
    })?;
    origin.finish(table)
}

/// Why a file cannot be read.
enum Unreadable {
    Parquet(ParquetError),
    Damaged(String),
    Row(String),
}

impl Unreadable {
    fn reason(&self) -> String {
        match self {
            Self::Parquet(error) => format!("not readable as Parquet: {error}"),
            Self::Damaged(reason) => {
                format!("not readable as Parquet: its parts contradict each other ({reason})")
            }
            Self::Row(reason) => reason.clone(),
        }
    }
}

impl From<ParquetError> for Unreadable {
    fn from(error: ParquetError) -> Self {
        Self::Parquet(error)
    }
}

impl From<io::Error> for Unreadable {
    fn from(error: io::Error) -> Self {
        Self::Row(crate::output::describe(&error))
    }
}

fn try_read(path: &Path, origin: &mut Origin, options: &ReadOptions) -> Result<Table, Unreadable> {
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    let file = SerializedFileReader::new(file)?;
    let metadata = file.metadata().file_metadata();
    for KeyValue { key, value } in metadata.key_value_metadata().into_iter().flatten() {
        let value = value.clone().unwrap_or_default();
        if let Some(column) = key.strip_prefix("unit.") {
            origin.units.insert(column.to_owned(), value);
        } else if let Some((group, name)) = key.split_once('/') {
            origin.metadata.extend(group, [(name.to_owned(), value)]);
        }
    }
    origin.units.remove(TIME_ROLE);
    let fields = metadata.schema_descr().columns();
    let names: Vec<&str> = fields.iter().map(|field| field.name()).collect();
    if let Some(nested) =
        fields.iter().find(|field| field.max_rep_level() > 0 || field.path().parts().len() > 1)
    {
        return Err(Unreadable::Row(format!("column `{}` is nested, expected a plain table", nested.path())));
    }
    let mut table = Table::from_header(&names, options).map_err(Unreadable::Row)?;
    let rows = metadata.num_rows();
    if u64::try_from(rows).map_or(true, |rows| rows > length.saturating_mul(ROWS_A_BYTE)) {
        return Err(Unreadable::Row(format!(
            "the index counts {rows} rows in {length} bytes, which cannot be"
        )));
    }
    for index in 0..file.num_row_groups() {
        let group = file.get_row_group(index)?;
        let counted = group.metadata().num_rows();
        let rows = usize::try_from(counted).ok().filter(|_| counted <= rows).ok_or_else(|| {
            Unreadable::Row(format!("a part of the table counts {counted} rows, the whole {rows}"))
        })?;
        let mut columns = Vec::with_capacity(names.len());
        for (column, name) in names.iter().enumerate() {
            columns.push(read_column(group.get_column_reader(column)?, rows, name)?);
        }
        for row in 0..rows {
            let cells = columns.iter().map(|column| column.get(row).map_or(&[][..], |cell| cell.as_slice()));
            let place = table.len() + 1;
            table.push(cells).map_err(|reason| Unreadable::Row(format!("row {place}: {reason}")))?;
        }
    }
    Ok(table)
}

/// Cells of a column as text, numbers in the shortest form that reads back to them.
fn read_column(reader: ColumnReader, rows: usize, name: &str) -> Result<Vec<Vec<u8>>, Unreadable> {
    macro_rules! cells {
        ($reader:ident, $text:expr) => {{
            let mut reader = $reader;
            let mut cells = Vec::with_capacity(rows.min(GROUP));
            let mut levels = Vec::new();
            loop {
                let mut values = Vec::new();
                levels.clear();
                let (records, _, _) = reader.read_records(BATCH, Some(&mut levels), None, &mut values)?;
                if cells.len() + records > rows || (records == 0 && cells.len() < rows) {
                    let got = cells.len() + records;
                    return Err(Unreadable::Row(format!(
                        "column `{name}` has {got} values, expected {rows} as the index counts"
                    )));
                }
                if records == 0 {
                    break cells;
                }
                if values.len() != records {
                    return Err(Unreadable::Row(format!(
                        "column `{name}` has empty cells, expected a value a row"
                    )));
                }
                cells.extend(values.iter().map($text));
            }
        }};
    }
    Ok(match reader {
        ColumnReader::DoubleColumnReader(reader) => cells!(reader, |value| format!("{value:?}").into_bytes()),
        ColumnReader::FloatColumnReader(reader) => cells!(reader, |value| format!("{value:?}").into_bytes()),
        ColumnReader::Int64ColumnReader(reader) => cells!(reader, |value| value.to_string().into_bytes()),
        ColumnReader::Int32ColumnReader(reader) => cells!(reader, |value| value.to_string().into_bytes()),
        ColumnReader::BoolColumnReader(reader) => {
            cells!(reader, |value| u8::from(*value).to_string().into_bytes())
        }
        ColumnReader::ByteArrayColumnReader(reader) => {
            cells!(reader, |value: &ByteArray| value.data().to_vec())
        }
        ColumnReader::Int96ColumnReader(_) | ColumnReader::FixedLenByteArrayColumnReader(_) => {
            return Err(Unreadable::Row(format!(
                "column `{name}` is of a type that is no number and no text"
            )));
        }
    })
}

fn io_error(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(error) => match error.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(error) => io::Error::other(error),
        },
        error => io::Error::other(error),
    }
}
