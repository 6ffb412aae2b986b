//! Names and units of a file's columns, where they are not those of the roles.

use bowden_model::channel::Channel;

/// Role of the time column.
pub const TIME_ROLE: &str = "t_s";

/// Where the values of a role come from: `role = scale · file + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnSource {
    /// Name in the file.
    pub column: String,
    /// Factor, unit of the role per unit of the file.
    pub scale: f64,
    /// Added after scaling, unit of the role.
    pub offset: f64,
}

impl ColumnSource {
    /// A column that already has the unit of its role.
    pub fn named(column: impl Into<String>) -> Self {
        Self { column: column.into(), scale: 1.0, offset: 0.0 }
    }

    /// Value of the role. Without scale and offset the value keeps every bit, the sign of zero included.
    pub fn apply(&self, value: f64) -> f64 {
        let scaled = if self.scale == 1.0 { value } else { self.scale * value };
        if self.offset == 0.0 { scaled } else { scaled + self.offset }
    }
}

/// Roles that a file keeps under another name or in another unit. Several roles may share a column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColumnMap {
    /// Source of the time, if it is not `t_s` in seconds.
    pub time: Option<ColumnSource>,
    /// Sources of channels.
    pub channels: Vec<(Channel, ColumnSource)>,
}

impl ColumnMap {
    /// Source of the time.
    pub fn time(&self) -> ColumnSource {
        self.time.clone().unwrap_or_else(|| ColumnSource::named(TIME_ROLE))
    }

    /// Source of a channel, and whether the map names it.
    pub fn channel(&self, channel: Channel) -> (ColumnSource, bool) {
        match self.channels.iter().find(|(c, _)| *c == channel) {
            Some((_, source)) => (source.clone(), true),
            None => (ColumnSource::named(channel.role()), false),
        }
    }
}
