//! What a file says about its recording beside the rows: who made it, when, with which parameters.

use std::collections::BTreeMap;

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

    /// All groups, sorted by name.
    pub fn groups(&self) -> impl Iterator<Item = (&str, &BTreeMap<String, String>)> {
        self.0.iter().map(|(name, entries)| (name.as_str(), entries))
    }
}
