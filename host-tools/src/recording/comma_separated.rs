//! Comma-separated recordings: one header line, one line a sample.

use std::io::{self, BufRead, BufReader, Read, Write};

use super::build::Table;
use super::place::Places;
use super::{Column, Origin, READ_BUFFER, ReadOptions, Recording, TIME_ROLE, Tail};
use crate::outcome::Failure;

type Reader<R> = csv::Reader<BufReader<Tail<R>>>;

/// Reads a table as it streams past; linear in time, and no more memory than the columns that are kept.
pub(super) fn read(data: impl Read, source: String, options: &ReadOptions) -> Result<Recording, Failure> {
    let mut text = BufReader::with_capacity(READ_BUFFER, Tail::new(data));
    let start = text.fill_buf().map_err(|error| damaged(&source, 0, &error.into()))?;
    let mark = mark_length(start, &source)?;
    text.consume(mark);
    let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text);

    let mut record = csv::ByteRecord::new();
    let mut origin = Origin { source, places: Places::lines(), notes: Vec::new(), passed_over: Vec::new() };
    if !next(&mut reader, &mut record, &origin.source)? {
        return Err(Failure::bad_input(format!(
            "{}:1: the file has no line, expected a header with t_s; record again",
            origin.source
        )));
    }
    let header_line = line_of(&record);
    let names: Vec<String> =
        record.iter().map(|name| String::from_utf8_lossy(name.trim_ascii()).into()).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut table = Table::from_header(&names, options).map_err(|reason| {
        Failure::bad_input(format!(
            "{}: {reason}",
            origin.places.describe_number(&origin.source, header_line)
        ))
    })?;

    while next(&mut reader, &mut record, &origin.source)? {
        let line = line_of(&record);
        let row = table.len();
        let Err(reason) = push(&mut table, &record) else {
            origin.places.push(row, line);
            continue;
        };
        let bad = origin.places.describe_number(&origin.source, line);
        let quote_open = record.iter().any(|cell| cell.contains(&b'\n'));
        let another = next(&mut reader, &mut record, &origin.source)?;
        let tail = reader.get_ref().get_ref();
        if another || quote_open || !(tail.cut_short || tail.ended_within_a_line()) {
            let reason = if quote_open { "a quote is opened and never closed; remove it" } else { &reason };
            return Err(Failure::bad_input(format!("{bad}: {reason}")));
        }
        origin.notes.push(format!("{bad}: the file ends within this line; the line was dropped"));
    }
    let tail = reader.get_ref().get_ref();
    if tail.cut_short {
        let whole = table.len();
        origin.notes.push(format!(
            "{}: the gzip data ends early; the {whole} whole samples before the end were used",
            origin.source
        ));
    }
    origin.finish(table)
}

fn push(table: &mut Table, record: &csv::ByteRecord) -> Result<(), String> {
    if record.len() != table.width() {
        let (got, expected) = (record.len(), table.width());
        return Err(format!("{got} fields, expected {expected} as in the header; correct or drop the line"));
    }
    table.push(record.iter())
}

/// Reads one line; false at the end.
fn next<R: Read>(
    reader: &mut Reader<R>,
    record: &mut csv::ByteRecord,
    source: &str,
) -> Result<bool, Failure> {
    let byte = reader.position().byte();
    reader.read_byte_record(record).map_err(|error| damaged(source, byte, &error))
}

fn damaged(source: &str, byte: u64, error: &csv::Error) -> Failure {
    let reason = match error.kind() {
        csv::ErrorKind::Io(error) => crate::output::describe(error),
        _ => error.to_string(),
    };
    Failure::bad_input(format!(
        "{source}: after byte {byte} of the table: {reason}; copy or record the file again"
    ))
}

fn line_of(record: &csv::ByteRecord) -> u64 {
    record.position().map_or(1, csv::Position::line)
}

/// Length of the byte order mark with which the text may begin; refuses what is no text.
fn mark_length(start: &[u8], source: &str) -> Result<usize, Failure> {
    const UTF8_MARK: &[u8] = &[0xef, 0xbb, 0xbf];
    if start.starts_with(&[0xff, 0xfe]) || start.starts_with(&[0xfe, 0xff]) {
        return Err(Failure::bad_input(format!("{source}: byte 0: UTF-16 text; save the file as UTF-8")));
    }
    let broken = match std::str::from_utf8(start) {
        // A character that the end of the buffer cuts is no mistake.
        Err(error) if error.error_len().is_some() => Some(error.valid_up_to()),
        _ => start.iter().position(|byte| *byte == 0),
    };
    if let Some(byte) = broken {
        let value = start[byte];
        return Err(Failure::bad_input(format!(
            "{source}: byte {byte}: got 0x{value:02x}, expected UTF-8 text; this is no comma-separated table"
        )));
    }
    Ok(if start.starts_with(UTF8_MARK) { UTF8_MARK.len() } else { 0 })
}

/// Writes a table; every number in the shortest form that reads back to the same value.
pub(super) fn write(recording: &Recording, out: impl Write) -> io::Result<()> {
    let mut writer = csv::WriterBuilder::new().buffer_capacity(READ_BUFFER).from_writer(out);
    let mut cell = Vec::with_capacity(32);
    writer.write_field(TIME_ROLE)?;
    for column in recording.columns() {
        writer.write_field(column.name())?;
    }
    writer.write_record(None::<&[u8]>)?;
    for (sample, t_s) in recording.t_s().iter().enumerate() {
        write_number(&mut writer, &mut cell, *t_s)?;
        for column in recording.columns() {
            match column {
                Column::Known { values, .. } => write_number(&mut writer, &mut cell, values[sample])?,
                Column::Unknown(text) => writer.write_field(text.cell(sample).unwrap_or_default())?,
            }
        }
        writer.write_record(None::<&[u8]>)?;
    }
    writer.flush()
}

fn write_number(writer: &mut csv::Writer<impl Write>, cell: &mut Vec<u8>, value: f64) -> io::Result<()> {
    cell.clear();
    write!(cell, "{value:?}")?;
    writer.write_field(&cell)?;
    Ok(())
}
