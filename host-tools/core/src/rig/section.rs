//! Access to a TOML table that knows where every key and value stands.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::outcome::Failure;

/// A value and where it stands.
pub type Located<'t> = Spanned<DeValue<'t>>;

/// A string and where it stands.
pub type LocatedStr<'t> = (&'t str, Range<usize>);

/// Text of a rig file under its name.
#[derive(Clone, Copy)]
pub struct Source<'t> {
    /// Name of the file.
    pub name: &'t str,
    /// The whole text.
    pub text: &'t str,
}

impl Source<'_> {
    /// A failure at a byte range, as `file:line:column: reason`.
    pub fn at(&self, span: &Range<usize>, reason: impl std::fmt::Display) -> Failure {
        Failure::bad_input(format!("{}: {reason}", self.place(span)))
    }

    /// Where a byte range begins, as `file:line:column`; column counts characters from 1.
    pub fn place(&self, span: &Range<usize>) -> String {
        let before = self.text.get(..span.start).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        format!("{}:{line}:{column}", self.name)
    }
}

/// An accepted range.
#[derive(Clone, Copy, Debug)]
pub struct Bounds<'t> {
    /// Smallest accepted value.
    pub lower: f64,
    /// Largest accepted value.
    pub upper: f64,
    /// Unit of both; `1` for a bare number.
    pub unit: &'t str,
}

/// Any finite number.
pub const FINITE: Bounds<'static> = Bounds { lower: f64::MIN, upper: f64::MAX, unit: "1" };

/// One table of a rig file.
#[derive(Clone)]
pub struct Section<'t> {
    /// The file that the table is part of.
    pub source: Source<'t>,
    /// Name as in the file, dots included; empty for the file itself.
    pub name: &'t str,
    /// Where the table begins.
    pub span: Range<usize>,
    table: &'t DeTable<'t>,
}

impl<'t> Section<'t> {
    /// A table of a file that has been parsed.
    pub fn new(source: Source<'t>, name: &'t str, span: Range<usize>, table: &'t DeTable<'t>) -> Self {
        Self { source, name, span, table }
    }

    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&'t Located<'t>> {
        self.table.get(key)
    }

    /// Keys with their place and value.
    pub fn entries(&self) -> impl Iterator<Item = (&'t str, Range<usize>, &'t Located<'t>)> {
        self.table.iter().map(|(key, value)| (key.get_ref().as_ref(), key.span(), value))
    }

    /// Refuses the first key that is none of `known`.
    ///
    /// # Errors
    /// Place and name of the key, and the nearest that is known.
    pub fn refuse_unknown<'k>(
        &self,
        kind: &str,
        known: impl IntoIterator<Item = &'k str>,
    ) -> Result<(), Failure> {
        let known: Vec<&str> = known.into_iter().collect();
        let Some((key, span, _)) = self.entries().find(|(key, ..)| !known.contains(key)) else {
            return Ok(());
        };
        let within = if self.name.is_empty() { String::new() } else { format!(" in [{}]", self.name) };
        Err(self.source.at(&span, format!("unknown {kind} `{key}`{within}; {}", advice(key, known))))
    }

    /// A failure that lacks a key.
    pub fn lacks(&self, key: &str, meaning: &str) -> Failure {
        self.source.at(&self.span, format!("[{}] lacks `{key}` ({meaning}); add it", self.name))
    }

    /// A failure on the type of a value.
    pub fn wrong_type(&self, key: &str, value: &Located, expected: &str) -> Failure {
        let got = kind_of(value.get_ref());
        let key = self.path(key);
        self.source.at(&value.span(), format!("{key}: got {got}, expected {expected}; correct it"))
    }

    /// Name of a key with its section.
    pub fn path(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }

    /// A sub-table.
    ///
    /// # Errors
    /// Place of a value that is no table.
    pub fn section(&self, key: &str, name: &'t str) -> Result<Option<Section<'t>>, Failure> {
        let Some(value) = self.get(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::Table(table) => Ok(Some(Section::new(self.source, name, value.span(), table))),
            _ => Err(self.wrong_type(key, value, "a table")),
        }
    }

    /// The entries of a list of tables, `[[key]]`; none where it is not there.
    ///
    /// # Errors
    /// Place of a value that is no array of tables.
    pub fn sections(&self, key: &str, name: &'t str) -> Result<Vec<Section<'t>>, Failure> {
        let Some(value) = self.get(key) else { return Ok(Vec::new()) };
        let DeValue::Array(array) = value.get_ref() else {
            return Err(self.wrong_type(key, value, &format!("tables [[{key}]]")));
        };
        array
            .iter()
            .map(|entry| match entry.get_ref() {
                DeValue::Table(table) => Ok(Section::new(self.source, name, entry.span(), table)),
                _ => Err(self.wrong_type(key, entry, &format!("tables [[{key}]]"))),
            })
            .collect()
    }

    /// Refuses a file whose `schema` is not `expected`.
    ///
    /// # Errors
    /// Place of a schema that is missing or another.
    pub fn check_schema(&self, expected: &str) -> Result<(), Failure> {
        match self.string("schema")? {
            Some((schema, _)) if schema == expected => Ok(()),
            Some((schema, span)) => Err(self.source.at(
                &span,
                format!("schema: got `{schema}`, expected `{expected}`; this version reads no other"),
            )),
            None => Err(self.source.at(
                &(0..0),
                format!("no `schema`, expected schema = \"{expected}\" as the first line; add it"),
            )),
        }
    }

    /// `true` or `false`.
    ///
    /// # Errors
    /// Place of a value that is no boolean.
    pub fn flag(&self, key: &str) -> Result<Option<bool>, Failure> {
        let Some(value) = self.get(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::Boolean(flag) => Ok(Some(*flag)),
            _ => Err(self.wrong_type(key, value, "true or false")),
        }
    }

    /// A number within its range.
    ///
    /// # Errors
    /// Place of a value that is no number, not finite or out of bounds.
    pub fn number(&self, key: &str, bounds: Bounds) -> Result<Option<f64>, Failure> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let number = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse::<f64>().ok(),
            DeValue::Integer(integer) => {
                i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64)
            }
            _ => None,
        };
        let number = number.ok_or_else(|| self.wrong_type(key, value, "a number"))?;
        // Written so that NaN is refused too.
        if !(number >= bounds.lower && number <= bounds.upper) {
            let Bounds { lower, upper, unit } = bounds;
            let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
            let key = self.path(key);
            return Err(self.source.at(
                &value.span(),
                format!("{key}: got {number}, allowed {lower} to {upper}{unit}; check value and unit"),
            ));
        }
        Ok(Some(number))
    }

    /// A whole number within its range.
    ///
    /// # Errors
    /// Place of a value that is no integer or out of bounds.
    pub fn integer(&self, key: &str, lower: u32, upper: u32) -> Result<Option<u32>, Failure> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let DeValue::Integer(integer) = value.get_ref() else {
            return Err(self.wrong_type(key, value, "a whole number"));
        };
        match u32::from_str_radix(integer.as_str(), integer.radix()) {
            Ok(number) if (lower..=upper).contains(&number) => Ok(Some(number)),
            _ => Err(self.source.at(
                &value.span(),
                format!("{}: got {integer}, allowed {lower} to {upper}; correct it", self.path(key)),
            )),
        }
    }

    /// A string and where it stands.
    ///
    /// # Errors
    /// Place of a value that is no string.
    pub fn string(&self, key: &str) -> Result<Option<LocatedStr<'t>>, Failure> {
        self.get(key).map(|value| self.as_string(key, value)).transpose()
    }

    /// A string that has to be there, and where it stands; `meaning` says what it is.
    ///
    /// # Errors
    /// Place of a value that is no string, or of the section that lacks it.
    pub fn text(&self, key: &str, meaning: &str) -> Result<LocatedStr<'t>, Failure> {
        self.string(key)?.ok_or_else(|| self.lacks(key, meaning))
    }

    /// A list of strings and where they stand.
    ///
    /// # Errors
    /// Place of a value that is no array of strings.
    pub fn strings(&self, key: &str) -> Result<Option<Vec<LocatedStr<'t>>>, Failure> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let DeValue::Array(array) = value.get_ref() else {
            return Err(self.wrong_type(key, value, "a list of strings"));
        };
        array.iter().map(|value| self.as_string(key, value)).collect::<Result<_, _>>().map(Some)
    }

    fn as_string(&self, key: &str, value: &'t Located<'t>) -> Result<LocatedStr<'t>, Failure> {
        match value.get_ref() {
            DeValue::String(text) => Ok((text.as_ref(), value.span())),
            _ => Err(self.wrong_type(key, value, "a string")),
        }
    }
}

/// What to do about an unknown name: the nearest known one, or all of them.
pub fn advice<'k>(name: &str, known: impl IntoIterator<Item = &'k str>) -> String {
    let mut known: Vec<&str> = known.into_iter().collect();
    if let Some(nearest) = nearest(name, known.iter().copied()) {
        return format!("did you mean `{nearest}`?");
    }
    known.sort_unstable();
    format!("expected one of {}", known.join(", "))
}

/// The known name that was probably meant.
pub fn nearest<'k>(name: &str, known: impl IntoIterator<Item = &'k str>) -> Option<&'k str> {
    const NEAR: f64 = 0.8;
    let nearness = |candidate: &str| strsim::jaro_winkler(&name.to_lowercase(), candidate);
    let nearest = known.into_iter().max_by(|a, b| nearness(a).total_cmp(&nearness(b)))?;
    (nearness(nearest) >= NEAR).then_some(nearest)
}

fn kind_of(value: &DeValue) -> String {
    match value {
        DeValue::String(text) => format!("the string \"{text}\""),
        DeValue::Integer(integer) => format!("the whole number {integer}"),
        DeValue::Float(float) => format!("the number {float}"),
        DeValue::Boolean(flag) => format!("{flag}"),
        DeValue::Datetime(_) => "a date".to_owned(),
        DeValue::Array(_) => "a list".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    }
}
