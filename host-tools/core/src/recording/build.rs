//! A table under construction: which column of a file goes where, and rows cell by cell.

use std::collections::HashMap;
use std::fmt::Write;
use std::sync::Arc;

use bowden_model::channel::Channel;

use super::columns::{ColumnSource, TIME_ROLE};
use super::text_column::TextColumn;
use super::{Column, ReadOptions};

/// Where the cells of one file column go; nowhere when it is passed over.
#[derive(Debug, Default)]
struct Route {
    time: Option<ColumnSource>,
    known: Vec<(usize, ColumnSource)>,
    unknown: Option<usize>,
}

/// Columns that grow row by row.
#[derive(Debug)]
pub(super) struct Table {
    names: Vec<String>,
    routes: Vec<Route>,
    t_s: Vec<f64>,
    columns: Vec<Column>,
}

impl Table {
    /// Decides by the header what is read. The error is what a message says after the place.
    pub(super) fn from_header(names: &[&str], options: &ReadOptions) -> Result<Self, String> {
        refuse_other_headers(names)?;
        let mut position = HashMap::new();
        for (index, name) in names.iter().enumerate() {
            if let Some(before) = position.insert(*name, index) {
                let (first, second) = (before + 1, index + 1);
                return Err(format!(
                    "column `{name}` stands twice in the header (columns {first} and {second}); rename or remove one"
                ));
            }
        }
        let mut table = Self {
            names: names.iter().map(|name| (*name).to_owned()).collect(),
            routes: names.iter().map(|_| Route::default()).collect(),
            t_s: Vec::new(),
            columns: Vec::new(),
        };
        let time = options.columns.time();
        let index = *position.get(time.column.as_str()).ok_or_else(|| missing_time(&time.column, names))?;
        table.routes[index].time = Some(time);
        // Known columns stand where the file has them, so that a rewritten file keeps its order.
        let mut wanted = Vec::new();
        for channel in Channel::ALL {
            let (source, mapped) = options.columns.channel(channel);
            match position.get(source.column.as_str()) {
                _ if options.only.as_ref().is_some_and(|only| !only.contains(&channel)) => {}
                Some(index) => wanted.push((*index, channel, source)),
                None if mapped && options.only.is_none() => {
                    let (column, role) = (&source.column, channel.role());
                    return Err(format!(
                        "no column `{column}`, which the rig maps to {role}; the header has {}; correct \
                         [recording.columns]",
                        listed(names)
                    ));
                }
                None => {}
            }
        }
        wanted.sort_by_key(|(index, ..)| *index);
        let mut wanted = wanted.into_iter().peekable();
        for (index, name) in names.iter().enumerate() {
            while let Some((_, channel, source)) = wanted.next_if(|(at, ..)| *at == index) {
                table.routes[index].known.push((table.columns.len(), source));
                table.columns.push(Column::Known { channel, values: Arc::default() });
            }
            let route = &mut table.routes[index];
            let used = route.time.is_some() || !route.known.is_empty();
            // A role that the rig takes from another column would stand twice.
            let replaced = *name == TIME_ROLE || Channel::from_role(name).is_some();
            if !used && !replaced && options.only.is_none() {
                route.unknown = Some(table.columns.len());
                table.columns.push(Column::Unknown(TextColumn::new(*name)));
            }
        }
        Ok(table)
    }

    /// Number of cells a row has.
    pub(super) fn width(&self) -> usize {
        self.names.len()
    }

    /// Names in the header.
    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    /// Number of rows.
    pub(super) fn len(&self) -> usize {
        self.t_s.len()
    }

    /// Adds a row of `width` cells; on an error, which is what a message says after the place, nothing is added.
    pub(super) fn push<'c>(&mut self, cells: impl Iterator<Item = &'c [u8]>) -> Result<(), String> {
        let rows = self.len();
        let result = self.try_push(cells);
        if result.is_err() {
            self.truncate(rows);
        }
        result
    }

    fn try_push<'c>(&mut self, cells: impl Iterator<Item = &'c [u8]>) -> Result<(), String> {
        for ((cell, route), name) in cells.zip(&self.routes).zip(&self.names) {
            if route.time.is_some() || !route.known.is_empty() {
                let value = finite_number(cell).map_err(|reason| format!("column `{name}`: {reason}"))?;
                if let Some(source) = &route.time {
                    let t_s = source.apply(value);
                    if let Some(before) = self.t_s.last()
                        && t_s <= *before
                    {
                        return Err(not_increasing(name, t_s, *before));
                    }
                    self.t_s.push(t_s);
                }
                for (column, source) in &route.known {
                    if let Column::Known { values, .. } = &mut self.columns[*column] {
                        Arc::make_mut(values).push(source.apply(value));
                    }
                }
            }
            if let Some(column) = route.unknown
                && let Column::Unknown(text) = &mut self.columns[column]
            {
                let cell = std::str::from_utf8(cell)
                    .map_err(|_| format!("column `{name}`: not UTF-8 text; save the file as UTF-8"))?;
                text.push(cell);
            }
        }
        Ok(())
    }

    fn truncate(&mut self, rows: usize) {
        self.t_s.truncate(rows);
        for column in &mut self.columns {
            match column {
                Column::Known { values, .. } => Arc::make_mut(values).truncate(rows),
                Column::Unknown(text) => text.truncate(rows),
            }
        }
    }

    /// Adds whole columns of numbers, one for every name of the header, in place of rows. `None` is a column without numbers, which
    /// only one that is not read may be. The error is the row, where there is one, and what a message says after the place.
    pub(super) fn fill(&mut self, columns: &[Option<&[f64]>]) -> Result<(), (Option<usize>, String)> {
        let rows = columns.iter().flatten().map(|values| values.len()).next().unwrap_or(0);
        for ((values, route), name) in columns.iter().zip(&self.routes).zip(&self.names) {
            if route.time.is_none() && route.known.is_empty() {
                continue;
            }
            let values = values.ok_or_else(|| {
                (None, format!("column `{name}`: no numbers, expected float64; convert it"))
            })?;
            if values.len() != rows {
                let got = values.len();
                let reason =
                    format!("column `{name}`: got {got} values beside columns of {rows}; make them equal");
                return Err((None, reason));
            }
            if let Some(row) = values.iter().position(|value| !value.is_finite()) {
                let got = values[row];
                let reason =
                    format!("column `{name}`: got {got}, expected a finite number; fill it or drop the row");
                return Err((Some(row), reason));
            }
            if let Some(source) = &route.time {
                self.t_s = values.iter().map(|value| source.apply(*value)).collect();
                if let Some(before) = self.t_s.windows(2).position(|pair| pair[1] <= pair[0]) {
                    return Err((
                        Some(before + 1),
                        not_increasing(name, self.t_s[before + 1], self.t_s[before]),
                    ));
                }
            }
            for (column, source) in &route.known {
                if let Column::Known { values: filled, .. } = &mut self.columns[*column] {
                    *filled = Arc::new(values.iter().map(|value| source.apply(*value)).collect());
                }
            }
        }
        self.columns.retain(|column| matches!(column, Column::Known { .. }));
        Ok(())
    }

    /// Time and columns.
    pub(super) fn finish(mut self) -> (Vec<f64>, Vec<Column>) {
        self.t_s.shrink_to_fit();
        for column in &mut self.columns {
            if let Column::Known { values, .. } = column {
                Arc::make_mut(values).shrink_to_fit();
            }
        }
        (self.t_s, self.columns)
    }
}

/// What is said of time that stands still or runs backwards.
fn not_increasing(name: &str, t_s: f64, before_s: f64) -> String {
    format!(
        "column `{name}`: got {t_s:?} s after {before_s:?} s, expected strictly increasing time; sort the rows and drop repeated ones"
    )
}

/// A cell as a number.
fn finite_number(cell: &[u8]) -> Result<f64, String> {
    let cell = cell.trim_ascii();
    if cell.is_empty() {
        return Err("empty cell, expected a finite number; fill it or drop the row".to_owned());
    }
    match std::str::from_utf8(cell).ok().and_then(|text| text.parse::<f64>().ok()) {
        Some(value) if value.is_finite() => Ok(value),
        _ => {
            let shown = shorten(&String::from_utf8_lossy(cell));
            Err(format!("got `{shown}`, expected a finite number; correct the cell or drop the row"))
        }
    }
}

/// Recognises first lines that are no header of a comma-separated table.
fn refuse_other_headers(names: &[&str]) -> Result<(), String> {
    if names.iter().all(|name| name.trim().parse::<f64>().is_ok()) {
        return Err("the first line holds numbers, expected a header with t_s; add a header line".to_owned());
    }
    if names.iter().any(|name| name.contains('\r')) {
        return Err("lines end in a carriage return alone; save the file with line feeds".to_owned());
    }
    if let [name] = names
        && let Some(separator) = [';', '\t'].into_iter().find(|separator| name.contains(*separator))
    {
        let shown = separator.escape_default();
        return Err(format!(
            "columns are separated by `{shown}`, expected commas; export as comma-separated"
        ));
    }
    Ok(())
}

fn missing_time(column: &str, names: &[&str]) -> String {
    let has = listed(names);
    if column == TIME_ROLE {
        format!(
            "no column `t_s`; the header has {has}; rename the time column, or map it under [recording.columns] of \
             the rig: t_s = {{ column = \"...\" }}"
        )
    } else {
        format!(
            "no column `{column}`, which the rig maps to t_s; the header has {has}; correct [recording.columns]"
        )
    }
}

/// The first names of a header.
fn listed(names: &[&str]) -> String {
    const SHOWN: usize = 8;
    let mut text = names.iter().take(SHOWN).map(|name| shorten(name)).collect::<Vec<_>>().join(", ");
    if names.len() > SHOWN {
        let _ = write!(text, ", and {} more", names.len() - SHOWN);
    }
    text
}

fn shorten(text: &str) -> String {
    const SHOWN: usize = 40;
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}
