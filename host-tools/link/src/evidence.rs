//! What a recording of a board says of itself: when it was made, with what, and by whom.

use std::fs;

use bowden_core::recording::{END_GROUP, METADATA_SCHEMA, Metadata, RECORDING_GROUP};
use bowden_link::message::{Greeting, Mode};

use super::conversion;
use super::recorder::Tally;

/// What made a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// Program and its version.
    pub tool: String,
    /// Commit that the program was built from.
    pub tool_revision: String,
    /// What the operator has to say.
    pub note: Option<String>,
    /// The reference in words.
    pub reference: Option<String>,
    /// Text of the rig file.
    pub rig: Option<String>,
    /// Text of the plan, and the step of it.
    pub plan: Option<(String, String)>,
}

/// Entry that says which control law made the outputs: [`Greeting::control`].
pub const CONTROL: &str = "control";

/// Group of the ripple table that the board had; absent without one.
pub const TABLE_GROUP: &str = "bowden.ripple_table";

/// Bytes in hexadecimal digits.
#[must_use]
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes
        .iter()
        .flat_map(|byte| [byte >> 4, byte & 0xf])
        .filter_map(|digit| char::from_digit(digit.into(), 16))
        .collect()
}

/// Time now, UTC, as recordings have it.
#[must_use]
pub fn utc_now() -> String {
    jiff::Timestamp::now().to_string()
}

/// Both clocks of the host.
///
/// The monotonic one has no date and never jumps: within one `boot`, it tells the time between two recordings.
fn clocks(when: &str) -> Vec<(String, String)> {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    let mut entries = vec![
        (format!("{when}_utc"), utc_now()),
        (format!("{when}_monotonic_s"), format!("{}.{:09}", now.tv_sec, now.tv_nsec)),
    ];
    if when == "started"
        && let Ok(boot) = fs::read_to_string("/proc/sys/kernel/random/boot_id")
    {
        entries.push(("boot".into(), boot.trim().into()));
    }
    entries
}

/// What is known before the first row.
#[must_use]
pub fn of_board(greeting: &Greeting, port: &str, origin: &Origin, mode: Mode, every: u64) -> Metadata {
    let mut entries = vec![
        ("schema", METADATA_SCHEMA.to_owned()),
        ("tool", origin.tool.clone()),
        ("tool_revision", origin.tool_revision.clone()),
        ("firmware", greeting.firmware.as_str().to_owned()),
        ("firmware_revision", greeting.revision.as_str().to_owned()),
        (CONTROL, hexadecimal(&greeting.control)),
        ("board", greeting.board.as_str().to_owned()),
        ("board_serial", greeting.serial.as_str().to_owned()),
        ("port", port.to_owned()),
        ("mode", conversion::mode_name(mode).to_owned()),
        ("every", every.to_string()),
    ];
    let optional = [("note", &origin.note), ("reference", &origin.reference), ("rig", &origin.rig)];
    entries.extend(optional.into_iter().filter_map(|(name, value)| Some((name, value.clone()?))));
    if let Some((plan, step)) = &origin.plan {
        entries.extend([("plan", plan.clone()), ("plan_step", step.clone())]);
    }
    let mut metadata = Metadata::default();
    metadata.extend(RECORDING_GROUP, entries.into_iter().map(|(name, value)| (name.to_owned(), value)));
    metadata
}

/// Both clocks when the first row comes.
pub fn started() -> Vec<(String, String)> {
    clocks("started")
}

/// Adds when the first row came, and its tick.
pub fn begin(metadata: &mut Metadata, started: Vec<(String, String)>, tick: u64, period_ns: u32) {
    metadata.extend(RECORDING_GROUP, started);
    metadata.extend(
        RECORDING_GROUP,
        [("first_tick".into(), tick.to_string()), ("period_ns".into(), period_ns.to_string())],
    );
}

/// Adds the text of a rig file. A recording that is cut loses its end, and keeps this.
pub fn add_rig(metadata: &mut Metadata, rig: String) {
    metadata.extend(RECORDING_GROUP, [("rig".to_owned(), rig)]);
}

/// What is known at the end: how it came, and what is missing.
#[must_use]
pub fn end(tally: &Tally, how: &str) -> Metadata {
    let mut metadata = Metadata::default();
    metadata.extend(END_GROUP, clocks("ended"));
    let entries = [
        ("end", how.to_owned()),
        ("rows", tally.rows.to_string()),
        ("samples_lost", tally.missing.to_string()),
        ("gaps", tally.gaps.to_string()),
    ];
    metadata.extend(END_GROUP, entries.map(|(name, value)| (name.to_owned(), value)));
    metadata
}
