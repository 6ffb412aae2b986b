//! One row of a recording that is being written: its columns and its values.

use bowden_model::channel::Channel;

/// A column of a recording that is being written, beside the time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RowColumn {
    /// A role.
    Known(Channel),
    /// A number that is no role.
    Described {
        /// Name in the header.
        name: String,
        /// Unit, where the format has a place for it.
        unit: String,
    },
    /// Anything.
    Unknown(String),
}

impl RowColumn {
    /// A number that is no role.
    pub fn described(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self::Described { name: name.into(), unit: unit.into() }
    }

    /// Name as it stands in a header.
    pub fn name(&self) -> &str {
        match self {
            Self::Known(channel) => channel.role(),
            Self::Described { name, .. } | Self::Unknown(name) => name,
        }
    }
}

/// One value of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell<'c> {
    /// A number, written in the shortest form that reads back to the same value.
    Number(f64),
    /// A whole number.
    Integer(i64),
    /// Text that is not interpreted.
    Text(&'c str),
}
