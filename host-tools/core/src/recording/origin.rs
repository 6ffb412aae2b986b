//! What readers share: where a recording comes from, and what they noted on the way.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Metadata, Places, Recording, build};
use crate::outcome::{Failure, one_line};

/// What readers share: a recording under construction.
pub(super) struct Origin {
    pub source: String,
    pub places: Places,
    pub notes: Vec<String>,
    pub passed_over: Vec<String>,
    pub metadata: Metadata,
    pub units: BTreeMap<String, String>,
}

impl Origin {
    pub fn new(source: String, places: Places) -> Self {
        Self {
            source,
            places,
            notes: Vec::new(),
            passed_over: Vec::new(),
            metadata: Metadata::default(),
            units: BTreeMap::new(),
        }
    }

    pub fn finish(self, table: build::Table) -> Result<Recording, Failure> {
        let (t_s, columns) = table.finish();
        if t_s.is_empty() {
            let reason = self.notes.first().map_or(String::new(), |note| format!(" ({note})"));
            return Err(Failure::bad_input(format!(
                "{}: a header and no samples{reason}; record again",
                self.source
            )));
        }
        Ok(Recording {
            source: self.source,
            t_s: Arc::new(t_s),
            columns,
            places: self.places,
            // Names of columns and topics come from the file.
            notes: self.notes.iter().map(one_line).collect(),
            passed_over: self.passed_over,
            metadata: self.metadata,
            units: self.units,
        })
    }
}
