//! Memory of this process.

use std::fs;

use crate::{Failure, Outcome};

/// Where Linux says what this process takes.
const STATUS: &str = "/proc/self/status";

/// Memory of this process that is in RAM \[KiB\].
pub fn resident_kib() -> Outcome<u64> {
    let text = fs::read_to_string(STATUS).map_err(|error| Failure(format!("{STATUS}: {error}")))?;
    text.lines()
        .find_map(|line| line.strip_prefix("VmRSS:")?.trim().strip_suffix("kB")?.trim().parse().ok())
        .ok_or_else(|| Failure(format!("{STATUS}: no VmRSS")))
}
