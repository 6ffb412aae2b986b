//! Columns and their units in an MCAP file: schema of the messages and metadata of the channel.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::SCHEMA;
use crate::recording::TIME_ROLE;
use crate::recording::row::RowColumn;

/// Units of the columns, by the descriptions of a schema that this program wrote.
pub(in crate::recording) fn units_of(schema: &[u8]) -> BTreeMap<String, String> {
    #[derive(Deserialize)]
    struct Schema {
        properties: BTreeMap<String, Property>,
    }
    #[derive(Deserialize)]
    struct Property {
        description: Option<String>,
    }
    let Ok(Schema { properties }) = serde_json::from_slice(schema) else { return BTreeMap::new() };
    let units = properties.into_iter().filter_map(|(name, property)| Some((name, property.description?)));
    units.filter(|(name, _)| name != TIME_ROLE).collect()
}

/// Units by column, for the channel; a schema has a place for descriptions only.
pub(super) fn units(columns: &[RowColumn]) -> BTreeMap<String, String> {
    let unit = |column: &RowColumn| match column {
        RowColumn::Known(channel) => Some(channel.unit().to_owned()),
        RowColumn::Described { unit, .. } => Some(unit.clone()),
        RowColumn::Unknown(_) => None,
    };
    let columns = columns.iter().filter_map(|column| Some((column.name(), unit(column)?)));
    std::iter::once((TIME_ROLE, "s".to_owned()))
        .chain(columns)
        .map(|(name, unit)| (format!("unit.{name}"), unit))
        .collect()
}

/// JSON schema of a message: one property a column, with its unit as the description.
pub(super) fn schema_of(columns: &[RowColumn]) -> Vec<u8> {
    let mut properties = serde_json::Map::new();
    properties
        .insert(TIME_ROLE.to_owned(), serde_json::json!({ "type": "number", "description": "time, s" }));
    for column in columns {
        let schema = match column {
            RowColumn::Known(channel) => {
                serde_json::json!({ "type": "number", "description": channel.unit() })
            }
            RowColumn::Described { unit, .. } => {
                serde_json::json!({ "type": "number", "description": unit })
            }
            RowColumn::Unknown(_) => serde_json::json!({}),
        };
        properties.insert(column.name().to_owned(), schema);
    }
    let schema = serde_json::json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": SCHEMA,
        "type": "object",
        "properties": properties,
    });
    schema.to_string().into_bytes()
}
