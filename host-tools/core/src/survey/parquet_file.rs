//! Tables as Parquet files, written without Arrow: text, numbers, whole numbers and flags are all that is needed.

use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::outcome::Failure;
use crate::output;

/// Values of a column, one a row.
pub(super) enum Values {
    Text(Vec<Option<String>>),
    Number(Vec<Option<f64>>),
    Whole(Vec<Option<i64>>),
    Flag(Vec<Option<bool>>),
}

/// A column of a table.
pub(super) type NamedColumn = (&'static str, Values);

/// Writes a table; equal tables give equal bytes.
pub(super) fn write(path: &Path, columns: &[NamedColumn]) -> Result<(), Failure> {
    let refuse =
        |error: ParquetError| Failure::failed(format!("{}: cannot be written: {error}", path.display()));
    let bytes = encode(columns).map_err(refuse)?;
    output::write_file(path, |file| std::io::Write::write_all(file, &bytes))
}

fn encode(columns: &[NamedColumn]) -> Result<Vec<u8>, ParquetError> {
    let fields: Result<Vec<_>, ParquetError> =
        columns.iter().map(|column| Ok(Arc::new(field(column)?))).collect();
    let schema = Arc::new(Type::group_type_builder("table").with_fields(fields?).build()?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(concat!("bowden ", env!("CARGO_PKG_VERSION")).to_owned())
        .build();
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    for (_, values) in columns {
        let Some(mut column) = group.next_column()? else { break };
        match values {
            Values::Text(values) => {
                let (present, levels) =
                    present(values.iter().map(|value| value.as_deref().map(ByteArray::from)));
                column.typed::<ByteArrayType>().write_batch(&present, Some(&levels), None)?;
            }
            Values::Number(values) => {
                let (present, levels) = present(values.iter().copied());
                column.typed::<DoubleType>().write_batch(&present, Some(&levels), None)?;
            }
            Values::Whole(values) => {
                let (present, levels) = present(values.iter().copied());
                column.typed::<Int64Type>().write_batch(&present, Some(&levels), None)?;
            }
            Values::Flag(values) => {
                let (present, levels) = present(values.iter().copied());
                column.typed::<BoolType>().write_batch(&present, Some(&levels), None)?;
            }
        }
        column.close()?;
    }
    group.close()?;
    file.close()?;
    Ok(bytes)
}

fn field((name, values): &NamedColumn) -> Result<Type, ParquetError> {
    let (physical, logical) = match values {
        Values::Text(_) => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
        Values::Number(_) => (PhysicalType::DOUBLE, None),
        Values::Whole(_) => (PhysicalType::INT64, None),
        Values::Flag(_) => (PhysicalType::BOOLEAN, None),
    };
    let builder = Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL);
    builder.with_logical_type(logical).build()
}

/// The values that are there, and for every row whether it has one.
fn present<T>(values: impl Iterator<Item = Option<T>>) -> (Vec<T>, Vec<i16>) {
    let mut levels = Vec::new();
    let there = values.inspect(|value| levels.push(i16::from(value.is_some()))).flatten().collect();
    (there, levels)
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::{FileReader, SerializedFileReader};

    use super::*;

    #[test]
    fn a_table_reads_back_with_what_is_missing() {
        let columns = [
            ("name", Values::Text(vec![Some("a".to_owned()), None, Some("ü".to_owned())])),
            ("value", Values::Number(vec![None, Some(0.1), Some(-2.5)])),
            ("count", Values::Whole(vec![Some(3), Some(-1), None])),
            ("flag", Values::Flag(vec![Some(true), Some(false), None])),
        ];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.parquet");
        write(&path, &columns).unwrap();
        let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
        let rows: Vec<String> =
            reader.get_row_iter(None).unwrap().map(|row| row.unwrap().to_string()).collect();
        assert_eq!(
            rows,
            [
                "{name: \"a\", value: null, count: 3, flag: true}",
                "{name: null, value: 0.1, count: -1, flag: false}",
                "{name: \"ü\", value: -2.5E0, count: null, flag: null}"
            ]
        );
        let first = std::fs::read(&path).unwrap();
        write(&path, &columns).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), first);
    }

    #[test]
    fn a_table_without_rows_is_a_file() {
        let bytes = encode(&[("name", Values::Text(Vec::new()))]).unwrap();
        assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"));
    }
}
