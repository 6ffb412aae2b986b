//! Columns that are kept and not interpreted.

/// A column of text, one run of bytes for all cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextColumn {
    name: String,
    text: String,
    ends: Vec<usize>,
}

impl TextColumn {
    /// A column without cells.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), text: String::new(), ends: Vec::new() }
    }

    /// Name in the header.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Adds a cell.
    pub fn push(&mut self, cell: &str) {
        self.text.push_str(cell);
        self.ends.push(self.text.len());
    }

    /// Text of a cell, as it stood in the file; `None` beyond the last.
    pub fn cell(&self, sample: usize) -> Option<&str> {
        let end = *self.ends.get(sample)?;
        let start = sample.checked_sub(1).map_or(0, |before| self.ends[before]);
        Some(&self.text[start..end])
    }

    /// Cells in order.
    pub fn cells(&self) -> impl Iterator<Item = &str> {
        (0..self.ends.len()).filter_map(|sample| self.cell(sample))
    }

    /// Keeps the first cells only.
    pub(super) fn truncate(&mut self, samples: usize) {
        self.ends.truncate(samples);
        self.text.truncate(self.ends.last().copied().unwrap_or(0));
    }

    /// The cells of these samples.
    pub(super) fn of(&self, samples: impl Iterator<Item = usize>) -> Self {
        let mut part = Self::new(self.name.clone());
        samples.filter_map(|sample| self.cell(sample)).for_each(|cell| part.push(cell));
        part
    }
}
