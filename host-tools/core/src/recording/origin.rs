//! What readers share: where a recording comes from, and what they noted on the way.

use std::sync::Arc;

use super::{Places, Recording, build};
use crate::outcome::Failure;

/// What readers share: a recording under construction.
pub(super) struct Origin {
    pub source: String,
    pub places: Places,
    pub notes: Vec<String>,
    pub passed_over: Vec<String>,
}

impl Origin {
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
            notes: self.notes,
            passed_over: self.passed_over,
        })
    }
}
