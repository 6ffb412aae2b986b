//! A sample as a message: a JSON object with one property a column.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

use crate::recording::build::Table;

/// One message: properties in their order, values as they are written.
pub(in crate::recording) struct Row<'m>(Vec<(Cow<'m, str>, &'m RawValue)>);

impl<'m> Row<'m> {
    /// Reads a message; the error is what a message says after the place.
    pub(in crate::recording) fn parse(message: &'m [u8]) -> Result<Self, String> {
        serde_json::from_slice(message).map_err(|error| format!("not a JSON object: {error}; record again"))
    }

    pub(in crate::recording) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|(name, _)| name.as_ref())
    }

    /// Text of every value, strings without their quotes.
    pub(in crate::recording) fn cells(&self) -> Result<Vec<Cow<'m, str>>, String> {
        self.0
            .iter()
            .map(|(name, value)| {
                let value = value.get();
                if value.starts_with('"') {
                    serde_json::from_str(value)
                        .map(Cow::Owned)
                        .map_err(|error| format!("property `{name}`: {error}; record again"))
                } else {
                    Ok(Cow::Borrowed(value))
                }
            })
            .collect()
    }

    /// Adds the cells in the order of the first message.
    pub(super) fn push_to(&self, cells: &[Cow<str>], table: &mut Table) -> Result<(), String> {
        if self.names().eq(table.names()) {
            return table.push(cells.iter().map(|cell| cell.as_bytes()));
        }
        let given: BTreeMap<&str, &Cow<str>> = self.names().zip(cells).collect();
        let mut row = Vec::with_capacity(table.width());
        for name in table.names() {
            let cell = given.get(name.as_str()).ok_or_else(|| {
                format!("no property `{name}`, which the first message has; record it always or never")
            })?;
            row.push(cell.as_bytes());
        }
        if self.0.len() != table.width() {
            let (got, expected) = (self.0.len(), table.width());
            return Err(format!(
                "{got} properties, expected {expected} as in the first message; record again"
            ));
        }
        table.push(row.into_iter())
    }
}

#[derive(Deserialize)]
struct Name<'m>(#[serde(borrow)] Cow<'m, str>);

impl<'de> Deserialize<'de> for Row<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Rows;
        impl<'de> Visitor<'de> for Rows {
            type Value = Row<'de>;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                formatter.write_str("an object with one property a column")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Row<'de>, A::Error> {
                let mut properties = Vec::with_capacity(16);
                while let Some((Name(name), value)) = map.next_entry::<Name, &RawValue>()? {
                    properties.push((name, value));
                }
                Ok(Row(properties))
            }
        }
        deserializer.deserialize_map(Rows)
    }
}
