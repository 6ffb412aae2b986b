//! What has to hold at the end of a long run.

use std::fmt::Write as _;

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Check {
    /// What.
    pub what: String,
    /// What it came to.
    pub value: String,
    /// What is allowed.
    pub allowed: String,
    /// Whether it is.
    pub holds: bool,
}

impl Check {
    /// One that `holds` or not.
    pub fn new(
        what: impl Into<String>,
        value: impl Into<String>,
        allowed: impl Into<String>,
        holds: bool,
    ) -> Self {
        Self { what: what.into(), value: value.into(), allowed: allowed.into(), holds }
    }

    /// A number that has to be this one.
    pub fn equal<T: PartialEq + std::fmt::Display + Copy>(
        what: impl Into<String>,
        value: T,
        expected: T,
    ) -> Self {
        Self::new(what, value.to_string(), expected.to_string(), value == expected)
    }

    /// A number that must not be larger.
    pub fn at_most<T: PartialOrd + std::fmt::Display + Copy>(
        what: impl Into<String>,
        value: T,
        most: T,
    ) -> Self {
        Self::new(what, value.to_string(), format!("at most {most}"), value <= most)
    }
}

/// The checks as a table of a page.
pub fn table(checks: &[Check]) -> String {
    let mut text = String::from("| what | is | allowed | |\n|---|---|---|---|\n");
    for Check { what, value, allowed, holds } in checks {
        let _ =
            writeln!(text, "| {what} | {value} | {allowed} | {} |", if *holds { "yes" } else { "**NO**" });
    }
    text
}

/// Names of the checks that do not hold.
pub fn failed(checks: &[Check]) -> Vec<String> {
    let failed = checks.iter().filter(|check| !check.holds);
    failed.map(|check| format!("{}: {}, allowed {}", check.what, check.value, check.allowed)).collect()
}
