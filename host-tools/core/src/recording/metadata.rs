//! What a file says about its recording beside the rows: who made it, when, with which parameters.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::Format;
use crate::output;

/// Value of `schema` in a file of metadata, and the group in which it stands.
pub const METADATA_SCHEMA: &str = "bowden-recording/1";

/// Group of a recording: when, with what, by whom.
pub const RECORDING_GROUP: &str = "bowden.recording";

/// Group of what is known at the end of a recording.
pub const END_GROUP: &str = "bowden.end";

/// Named groups of entries, as MCAP keeps them: a group is one metadata record.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Metadata(BTreeMap<String, BTreeMap<String, String>>);

impl Metadata {
    /// Whether nothing is said.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds entries to a group; an entry that is there already gets the new value.
    pub fn extend(&mut self, group: &str, entries: impl IntoIterator<Item = (String, String)>) {
        self.0.entry(group.to_owned()).or_default().extend(entries);
    }

    /// Entries of a group.
    pub fn group(&self, group: &str) -> Option<&BTreeMap<String, String>> {
        self.0.get(group)
    }

    /// One entry.
    pub fn entry(&self, group: &str, name: &str) -> Option<&str> {
        self.0.get(group)?.get(name).map(String::as_str)
    }

    /// File of metadata beside a recording: an MCAP file needs none.
    pub fn file_beside(recording: &Path) -> Option<PathBuf> {
        let name = recording.file_name()?.to_string_lossy().into_owned();
        let lower = name.to_ascii_lowercase();
        let stem = match Format::of(recording) {
            Some(Format::Mcap | Format::Parquet) => return None,
            Some(Format::Csv | Format::GzippedCsv) => {
                let ending = [".csv.gz", ".csv"].into_iter().find(|ending| lower.ends_with(ending))?;
                &name[..name.len() - ending.len()]
            }
            None => &name,
        };
        Some(recording.with_file_name(format!("{stem}.recording.toml")))
    }

    /// Reads what stands beside a recording; nothing if there is no such file. The error is one line for the user.
    ///
    /// # Errors
    /// A file that cannot be read, or is no such file.
    pub fn beside(recording: &Path) -> Result<Self, String> {
        let Some(path) = Self::file_beside(recording).filter(|path| path.is_file()) else {
            return Ok(Self::default());
        };
        let refuse = |reason: &str| format!("{}: {reason}; it was passed over", path.display());
        let text = fs::read_to_string(&path).map_err(|error| refuse(&output::describe(&error)))?;
        let groups: BTreeMap<String, BTreeMap<String, String>> =
            toml::from_str(&text).map_err(|error| refuse(error.message()))?;
        let metadata = Self(groups);
        match metadata.entry(RECORDING_GROUP, "schema") {
            None | Some(METADATA_SCHEMA) => Ok(metadata),
            Some(other) => Err(refuse(&format!("got schema `{other}`, expected `{METADATA_SCHEMA}`"))),
        }
    }

    /// Text of a file beside a recording.
    pub fn to_toml(&self) -> String {
        let mut text = "# What belongs to the recording of the same name.\n".to_owned();
        for (group, entries) in &self.0 {
            // Keys and values are quoted as TOML wants them.
            let table: toml::Table =
                entries.iter().map(|(name, value)| (name.clone(), value.clone().into())).collect();
            let group: toml::Table = [(group.clone(), toml::Value::Table(table))].into_iter().collect();
            text.push('\n');
            text.push_str(&group.to_string());
        }
        text
    }

    /// All groups, sorted by name.
    pub fn groups(&self) -> impl Iterator<Item = (&str, &BTreeMap<String, String>)> {
        self.0.iter().map(|(name, entries)| (name.as_str(), entries))
    }
}
