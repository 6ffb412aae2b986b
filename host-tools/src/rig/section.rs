//! Access to a TOML table that knows where every key and value stands.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::outcome::Failure;

/// A value and where it stands.
pub(crate) type Located<'t> = Spanned<DeValue<'t>>;

/// A string and where it stands.
pub(crate) type LocatedStr<'t> = (&'t str, Range<usize>);

/// Text of a rig file under its name.
#[derive(Clone, Copy)]
pub(crate) struct Source<'t> {
    pub(crate) name: &'t str,
    pub(crate) text: &'t str,
}

impl Source<'_> {
    /// A failure at a byte range, as `file:line:column: reason`.
    pub(crate) fn at(&self, span: &Range<usize>, reason: impl std::fmt::Display) -> Failure {
        Failure::bad_input(format!("{}: {reason}", self.place(span)))
    }

    /// Where a byte range begins, as `file:line:column`; column counts characters from 1.
    pub(crate) fn place(&self, span: &Range<usize>) -> String {
        let before = self.text.get(..span.start).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        format!("{}:{line}:{column}", self.name)
    }
}

/// An accepted range.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds<'t> {
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    pub(crate) unit: &'t str,
}

/// Any finite number.
pub(crate) const FINITE: Bounds<'static> = Bounds { lower: f64::MIN, upper: f64::MAX, unit: "1" };

/// One table of a rig file.
#[derive(Clone)]
pub(crate) struct Section<'t> {
    pub(crate) source: Source<'t>,
    /// Name as in the file, dots included; empty for the file itself.
    pub(crate) name: &'t str,
    /// Where the table begins.
    pub(crate) span: Range<usize>,
    table: &'t DeTable<'t>,
}

impl<'t> Section<'t> {
    pub(crate) fn new(source: Source<'t>, name: &'t str, span: Range<usize>, table: &'t DeTable<'t>) -> Self {
        Self { source, name, span, table }
    }

    /// The value of a key.
    pub(crate) fn get(&self, key: &str) -> Option<&'t Located<'t>> {
        self.table.get(key)
    }

    /// Keys with their place and value.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (&'t str, Range<usize>, &'t Located<'t>)> {
        self.table.iter().map(|(key, value)| (key.get_ref().as_ref(), key.span(), value))
    }

    /// Refuses the first key that is none of `known`.
    pub(crate) fn refuse_unknown<'k>(
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
    pub(crate) fn lacks(&self, key: &str, meaning: &str) -> Failure {
        self.source.at(&self.span, format!("[{}] lacks `{key}` ({meaning}); add it", self.name))
    }

    /// A failure on the type of a value.
    pub(crate) fn wrong_type(&self, key: &str, value: &Located, expected: &str) -> Failure {
        let got = kind_of(value.get_ref());
        let key = self.path(key);
        self.source.at(&value.span(), format!("{key}: got {got}, expected {expected}; correct it"))
    }

    /// Name of a key with its section.
    pub(crate) fn path(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }

    /// A sub-table.
    pub(crate) fn section(&self, key: &str, name: &'t str) -> Result<Option<Section<'t>>, Failure> {
        let Some(value) = self.get(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::Table(table) => Ok(Some(Section::new(self.source, name, value.span(), table))),
            _ => Err(self.wrong_type(key, value, "a table")),
        }
    }

    /// The entries of a list of tables, `[[key]]`; none where it is not there.
    pub(crate) fn sections(&self, key: &str, name: &'t str) -> Result<Vec<Section<'t>>, Failure> {
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
    pub(crate) fn check_schema(&self, expected: &str) -> Result<(), Failure> {
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
    pub(crate) fn flag(&self, key: &str) -> Result<Option<bool>, Failure> {
        let Some(value) = self.get(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::Boolean(flag) => Ok(Some(*flag)),
            _ => Err(self.wrong_type(key, value, "true or false")),
        }
    }

    /// A number within its range.
    pub(crate) fn number(&self, key: &str, bounds: Bounds) -> Result<Option<f64>, Failure> {
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
    pub(crate) fn integer(&self, key: &str, lower: u32, upper: u32) -> Result<Option<u32>, Failure> {
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
    pub(crate) fn string(&self, key: &str) -> Result<Option<LocatedStr<'t>>, Failure> {
        self.get(key).map(|value| self.as_string(key, value)).transpose()
    }

    /// A list of strings and where they stand.
    pub(crate) fn strings(&self, key: &str) -> Result<Option<Vec<LocatedStr<'t>>>, Failure> {
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
pub(crate) fn advice<'k>(name: &str, known: impl IntoIterator<Item = &'k str>) -> String {
    let mut known: Vec<&str> = known.into_iter().collect();
    if let Some(nearest) = nearest(name, known.iter().copied()) {
        return format!("did you mean `{nearest}`?");
    }
    known.sort_unstable();
    format!("expected one of {}", known.join(", "))
}

/// The known name that was probably meant.
pub(crate) fn nearest<'k>(name: &str, known: impl IntoIterator<Item = &'k str>) -> Option<&'k str> {
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
