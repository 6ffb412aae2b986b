//! Whole rows of a comma-separated table.

use std::borrow::Cow;
use std::io::{BufRead, BufReader, Read, Seek, Write};

use super::shorten;
use super::sink::{Sink, Stopped};
use crate::output;

/// Longest line that is read, bytes; a longer one is damage.
const LINE_LIMIT: u64 = 1 << 20;

/// Writes the whole rows of a table to `sink`; what is missing, one line each.
pub fn take<W: Write + Seek>(
    data: impl Read,
    source: &str,
    sink: &mut Sink<W>,
) -> Result<Vec<String>, Stopped> {
    let mut lines = Lines::new(source, sink);
    lines.feed(data)?;
    lines.finish()
}

/// Lines of a table that comes in pieces.
pub struct Lines<'s, W: Write + Seek> {
    sink: &'s mut Sink<W>,
    missing: Missing<'s>,
    /// Start of a line whose end has not come yet.
    line: Vec<u8>,
    number: u64,
    /// A row waits for the next one: if only its time is wrong, the next one is earlier.
    waiting: Option<(u64, f64, Vec<String>)>,
}

impl<'s, W: Write + Seek> Lines<'s, W> {
    /// Nothing has come yet.
    pub fn new(source: &'s str, sink: &'s mut Sink<W>) -> Self {
        let missing = Missing { source, lines: Vec::new(), open: None };
        Self { sink, missing, line: Vec::new(), number: 0, waiting: None }
    }

    /// Takes the next piece, up to its end or to where it cannot be read.
    pub fn feed(&mut self, data: impl Read) -> Result<(), Stopped> {
        let mut data = BufReader::new(data);
        loop {
            let room = LINE_LIMIT.saturating_sub(self.line.len() as u64);
            match data.by_ref().take(room).read_until(b'\n', &mut self.line) {
                Ok(0) if room > 0 => return Ok(()),
                Ok(_) => {}
                Err(error) => {
                    let (source, number, reason) =
                        (self.missing.source, self.number, output::describe(&error));
                    self.missing.lines.push(format!(
                        "{source}: after line {number}: {reason}; nothing behind it can be read"
                    ));
                    return Ok(());
                }
            }
            if self.line.last() == Some(&b'\n') || self.line.len() as u64 >= LINE_LIMIT {
                let line = std::mem::take(&mut self.line);
                self.take(&line)?;
                self.line = line;
                self.line.clear();
            }
        }
    }

    /// The piece that would follow is missing.
    pub fn gap(&mut self, what: &str) {
        self.line.clear();
        let (source, after) = (self.missing.source, self.last_s());
        let after = after.map_or(String::new(), |last_s| format!(" after t_s = {last_s:?}"));
        self.missing.close(None);
        self.missing.lines.push(format!("{source}: {what}{after}"));
    }

    /// Whether a row has come.
    pub fn has_rows(&self) -> bool {
        self.last_s().is_some()
    }

    fn last_s(&self) -> Option<f64> {
        self.waiting.as_ref().map(|(_, t_s, _)| *t_s).or_else(|| self.sink.last_s())
    }

    /// A line with its end.
    fn take(&mut self, line: &[u8]) -> Result<(), Stopped> {
        self.number += 1;
        let number = self.number;
        let text = line.trim_ascii();
        if text.is_empty() {
            return Ok(());
        }
        let cells = cells_of(text);
        if self.sink.names().is_empty() {
            let Some(cells) = cells else {
                return Err(Stopped::Input(
                    "the header line is damaged; put one from another recording before the rows".into(),
                ));
            };
            let names = cells.iter().map(|cell| cell.trim_start_matches('\u{feff}').trim().to_owned());
            return self.sink.header(names.collect());
        }
        let Some((t_s, cells)) = cells.and_then(|cells| Some((self.sink.time_of(&cells)?, cells))) else {
            self.missing.line(number);
            return Ok(());
        };
        let cells = cells.into_iter().map(Cow::into_owned).collect();
        match self.waiting.replace((number, t_s, cells)) {
            Some(before) if before.1 < t_s => self.put(&before),
            Some((earlier, ..)) => {
                self.missing.line(earlier);
                Ok(())
            }
            None => Ok(()),
        }
    }

    fn put(&mut self, (line, t_s, cells): &(u64, f64, Vec<String>)) -> Result<(), Stopped> {
        self.missing.before(*line);
        let cells: Vec<Cow<str>> = cells.iter().map(|cell| Cow::Borrowed(cell.as_str())).collect();
        self.sink.row(*t_s, &cells)
    }

    /// Writes the last row and says what is missing, one line each.
    pub fn finish(mut self) -> Result<Vec<String>, Stopped> {
        if let Some(last) = self.waiting.take() {
            self.put(&last)?;
        }
        if !self.line.trim_ascii().is_empty() {
            // It may end within a number.
            self.missing.line(self.number + 1);
        }
        self.missing.close(None);
        Ok(shorten(self.missing.lines, self.missing.source))
    }
}

/// Cells of a line; none if it is no text or a quote stays open.
fn cells_of(line: &[u8]) -> Option<Vec<Cow<'_, str>>> {
    let text = std::str::from_utf8(line).ok()?;
    if text.contains(|c: char| c.is_control() && c != '\t') {
        return None;
    }
    if !text.contains('"') {
        return Some(text.split(',').map(Cow::Borrowed).collect());
    }
    if !text.matches('"').count().is_multiple_of(2) {
        return None;
    }
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line);
    let record = reader.records().next()?.ok()?;
    Some(record.iter().map(|cell| Cow::Owned(cell.to_owned())).collect())
}

/// Runs of lines that are no rows.
struct Missing<'s> {
    source: &'s str,
    lines: Vec<String>,
    /// First and last line of the run that is open.
    open: Option<(u64, u64)>,
}

impl Missing<'_> {
    fn line(&mut self, number: u64) {
        match &mut self.open {
            Some((first, last)) if number <= *last + 1 => *last = number.max(*last).max(*first),
            _ => {
                self.close(None);
                self.open = Some((number, number));
            }
        }
    }

    /// A whole row stands at a line: a run before it is over.
    fn before(&mut self, line: u64) {
        self.close(Some(line));
    }

    fn close(&mut self, line: Option<u64>) {
        if self.open.is_some_and(|(first, _)| line.is_none_or(|line| first < line))
            && let Some((first, last)) = self.open.take()
        {
            let source = self.source;
            self.lines.push(if first == last {
                format!("{source}:{first}: the line is no whole row and was left out")
            } else {
                format!("{source}:{first}: this line to line {last} are no whole rows and were left out")
            });
        }
    }
}
