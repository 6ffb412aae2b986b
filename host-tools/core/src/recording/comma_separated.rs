//! Comma-separated recordings: one header line, one line a sample. No cell spans lines.

use std::io::{self, BufRead, BufReader, Read, Write};

use super::build::Table;
use super::origin::Origin;
use super::place::Places;
use super::row::Cell;
use super::tail::Tail;
use super::{READ_BUFFER, ReadOptions, Recording, TIME_ROLE};
use crate::outcome::Failure;

/// Reads a table as it streams past; linear in time, and no more memory than the columns that are kept.
pub(super) fn read(data: impl Read, source: String, options: &ReadOptions) -> Result<Recording, Failure> {
    let mut text = BufReader::with_capacity(READ_BUFFER, Tail::new(data));
    let start = text.fill_buf().map_err(|error| damaged(&source, 0, &error.into()))?;
    let mark = mark_length(start, &source)?;
    text.consume(mark);
    let mut lines = Lines::new(text, mark as u64);

    let mut origin = Origin::new(source, Places::lines());
    let Some(header_line) = lines.next(&origin.source)? else {
        return Err(Failure::bad_input(format!(
            "{}:1: the file has no line, expected a header with t_s; record again",
            origin.source
        )));
    };
    let names: Vec<String> =
        lines.cells().map(|name| String::from_utf8_lossy(name.trim_ascii()).into()).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut table = Table::from_header(&names, options).map_err(|reason| {
        Failure::bad_input(format!(
            "{}: {reason}",
            origin.places.describe_number(&origin.source, header_line)
        ))
    })?;

    let mut repeated: Option<(u64, usize)> = None;
    while let Some(line) = lines.next(&origin.source)? {
        let row = table.len();
        if row > 0 && lines.repeats() {
            repeated.get_or_insert((line, 0)).1 += 1;
            continue;
        }
        // Whether this line was cut shows only once the end of the data is reached.
        let cut = lines.is_unterminated();
        let whole =
            if cut && lines.tail().cut_short { Err(String::new()) } else { lines.push_to(&mut table) };
        let Err(reason) = whole else {
            origin.places.push(row, line);
            continue;
        };
        let place = origin.places.describe_number(&origin.source, line);
        if !cut || lines.spans_lines() {
            return Err(Failure::bad_input(format!("{place}: {reason}")));
        }
        origin.notes.push(format!("{place}: the file ends within this line; the line was dropped"));
    }
    if let Some((line, count)) = repeated {
        let place = origin.places.describe_number(&origin.source, line);
        let rows =
            if count == 1 { "it was dropped".to_owned() } else { format!("{count} such rows were dropped") };
        origin.notes.push(format!("{place}: the row before it stands here again; {rows}"));
    }
    if lines.tail().cut_short {
        let whole = table.len();
        origin.notes.push(format!(
            "{}: the gzip data ends early; the {whole} whole samples before the end were used",
            origin.source
        ));
    }
    origin.finish(table)
}

/// Lines of a table with their numbers. Blank lines are passed over; a carriage return ends a line as part of its end.
struct Lines<R> {
    reader: csv::Reader<BufReader<Tail<R>>>,
    record: csv::ByteRecord,
    before: csv::ByteRecord,
    mark: u64,
}

impl<R: Read> Lines<R> {
    fn new(text: BufReader<Tail<R>>, mark: u64) -> Self {
        // With the line feed alone as end, the reader's line count is exact also where carriage returns precede it.
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .terminator(csv::Terminator::Any(b'\n'))
            .from_reader(text);
        Self { reader, record: csv::ByteRecord::new(), before: csv::ByteRecord::new(), mark }
    }

    /// Reads a line and returns its number; `None` at the end.
    fn next(&mut self, source: &str) -> Result<Option<u64>, Failure> {
        std::mem::swap(&mut self.record, &mut self.before);
        loop {
            let byte = self.reader.position().byte();
            let more = self
                .reader
                .read_byte_record(&mut self.record)
                .map_err(|error| damaged(source, byte, &error))?;
            if !more {
                return Ok(None);
            }
            if self.record.len() > 1 || !self.record[0].trim_ascii().is_empty() {
                let line_feeds = self.record.as_slice().split(|byte| *byte == b'\n').count() - 1;
                // A quote that runs to the end of the data has swallowed the last line feed.
                let swallowed = self.record[self.record.len() - 1].ends_with(b"\n");
                let ended = u64::from(!self.is_unterminated() && !swallowed);
                return Ok(Some(self.reader.position().line() - ended - line_feeds as u64));
            }
        }
    }

    /// Whether every cell is that of the line before.
    fn repeats(&self) -> bool {
        self.record == self.before
    }

    /// Whether the data ended before the line did.
    fn is_unterminated(&self) -> bool {
        let read = self.reader.position().byte() + self.mark;
        read == self.tail().bytes && self.tail().last_byte != Some(b'\n')
    }

    /// Whether a quote runs over the end of a line, which is a quote too many.
    fn spans_lines(&self) -> bool {
        self.record.as_slice().contains(&b'\n')
    }

    fn tail(&self) -> &Tail<R> {
        self.reader.get_ref().get_ref()
    }

    /// Cells of the line.
    fn cells(&self) -> impl Iterator<Item = &[u8]> {
        let last = self.record.len().saturating_sub(1);
        self.record.iter().enumerate().map(move |(index, cell)| {
            if index == last { cell.strip_suffix(b"\r").unwrap_or(cell) } else { cell }
        })
    }

    /// Adds the line to the table; the error is what a message says after the place.
    fn push_to(&self, table: &mut Table) -> Result<(), String> {
        if self.spans_lines() {
            return Err("a quote is opened and not closed before the end of the line; remove it".to_owned());
        }
        if self.record.len() != table.width() {
            let (got, expected) = (self.record.len(), table.width());
            return Err(format!(
                "{got} fields, expected {expected} as in the header; correct or drop the line"
            ));
        }
        table.push(self.cells())
    }
}

fn damaged(source: &str, byte: u64, error: &csv::Error) -> Failure {
    let reason = match error.kind() {
        csv::ErrorKind::Io(error) => crate::output::describe(error),
        _ => error.to_string(),
    };
    Failure::bad_input(format!(
        "{source}: after byte {byte} of the table: {reason}; copy the file again, or take out what is whole with `bowden recover`"
    ))
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

/// Writes a table row by row; every number in the shortest form that reads back to the same value.
pub(super) struct Writer<W: Write> {
    table: csv::Writer<W>,
    columns: Vec<String>,
    cell: Vec<u8>,
}

impl<W: Write> Writer<W> {
    /// Writes the header: the time and these columns.
    pub(super) fn new<'c>(columns: impl IntoIterator<Item = &'c str>, out: W) -> io::Result<Self> {
        let mut table = csv::WriterBuilder::new().buffer_capacity(READ_BUFFER).from_writer(out);
        let columns: Vec<String> = columns.into_iter().map(str::to_owned).collect();
        for name in &columns {
            if let Some(what) = unkept(name, true) {
                let name = name.escape_default();
                return Err(io::Error::other(format!(
                    "the column's name `{name}` holds a {what}, which a table cannot keep"
                )));
            }
        }
        table.write_field(TIME_ROLE)?;
        for column in &columns {
            table.write_field(column)?;
        }
        table.write_record(None::<&[u8]>)?;
        Ok(Self { table, columns, cell: Vec::with_capacity(32) })
    }

    /// Writes a row: the time and one cell a column.
    pub(super) fn row<'c>(&mut self, t_s: f64, cells: impl IntoIterator<Item = Cell<'c>>) -> io::Result<()> {
        self.write_number(format_args!("{t_s:?}"))?;
        for (index, cell) in cells.into_iter().enumerate() {
            match cell {
                Cell::Number(value) => self.write_number(format_args!("{value:?}"))?,
                Cell::Integer(value) => self.write_number(format_args!("{value}"))?,
                Cell::Text(cell) if let Some(what) = unkept(cell, index + 1 == self.columns.len()) => {
                    let name = self.columns.get(index).map_or("", String::as_str);
                    let reason = format!("column `{name}` holds a {what}, which a table cannot keep");
                    return Err(io::Error::other(reason));
                }
                Cell::Text(cell) => self.table.write_field(cell)?,
            }
        }
        self.table.write_record(None::<&[u8]>)?;
        Ok(())
    }

    /// Hands on all rows.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.table.flush()
    }

    /// Ends the table and gives back what it was written to.
    pub(super) fn finish(self) -> io::Result<W> {
        self.table.into_inner().map_err(csv::IntoInnerError::into_error)
    }

    fn write_number(&mut self, number: std::fmt::Arguments) -> io::Result<()> {
        self.cell.clear();
        self.cell.write_fmt(number)?;
        self.table.write_field(&self.cell)?;
        Ok(())
    }
}

/// What of a text would be read back as something else: lines end at a line feed, the last cell's carriage return belongs to the line's
/// end, and a zero byte tells that a file is no text.
fn unkept(text: &str, last: bool) -> Option<&'static str> {
    if text.contains('\n') || (last && text.ends_with('\r')) {
        Some("line break")
    } else if text.contains('\0') {
        Some("zero byte")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_that_would_read_back_as_another_is_refused() {
        let write = |columns: [&'static str; 2], cells: [&str; 2]| {
            let mut writer = Writer::new(columns, Vec::new())?;
            writer.row(0.5, cells.map(Cell::Text))?;
            writer.finish().map(|table| String::from_utf8(table).unwrap())
        };
        let refused = |columns, cells| write(columns, cells).unwrap_err().to_string();
        assert_eq!(write(["a", "b"], ["x\ry", "z"]).unwrap(), "t_s,a,b\n0.5,\"x\ry\",z\n");
        assert_eq!(write(["a", "b"], ["x\r", "z"]).unwrap(), "t_s,a,b\n0.5,\"x\r\",z\n");
        let a_break = "column `b` holds a line break, which a table cannot keep";
        assert_eq!(refused(["a", "b"], ["x", "z\r"]), a_break);
        assert_eq!(refused(["a", "b"], ["x", "y\nz"]), a_break);
        assert_eq!(
            refused(["a", "b"], ["\0", "z"]),
            "column `a` holds a zero byte, which a table cannot keep"
        );
        let name = "the column's name `b\\n` holds a line break, which a table cannot keep";
        assert_eq!(refused(["a", "b\n"], ["x", "z"]), name);
    }
}
