//! One column of a recording.

use std::sync::Arc;

use bowden_model::channel::Channel;

use super::row::Cell;
use super::text_column::TextColumn;

/// One column beside the time.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// A role, in the unit of its channel.
    Known {
        /// The role.
        channel: Channel,
        /// One value a sample; what is prepared for a replay shares them.
        values: Arc<Vec<f64>>,
    },
    /// A column that is not interpreted.
    Unknown(TextColumn),
}

impl Column {
    /// Name as it stands in a header.
    pub fn name(&self) -> &str {
        match self {
            Self::Known { channel, .. } => channel.role(),
            Self::Unknown(text) => text.name(),
        }
    }

    pub(super) fn cell(&self, sample: usize) -> Cell<'_> {
        match self {
            Self::Known { values, .. } => Cell::Number(values[sample]),
            Self::Unknown(text) => Cell::Text(text.cell(sample).unwrap_or_default()),
        }
    }
}
