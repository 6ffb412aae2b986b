//! What a fake board can be told to do wrong.

use std::time::Duration;

/// Failures of the board and of the wire.
#[derive(Clone, Debug, Default)]
pub struct Mishaps {
    /// Answers nothing, ever.
    pub silent: bool,
    /// Another version of the protocol.
    pub protocol_version: Option<u16>,
    /// Another schema.
    pub schema: Option<[u8; 8]>,
    /// Every n-th answer is lost on the way.
    pub lose_answers: Option<u64>,
    /// Every n-th request is lost on the way.
    pub lose_requests: Option<u64>,
    /// Every n-th answer comes with a wrong byte.
    pub damage_answers: Option<u64>,
    /// Every n-th answer comes this much too late.
    pub delay_answers: Option<(u64, Duration)>,
    /// Of all answers, only those to requests for the status are lost, damaged or late.
    pub only_statuses: bool,
    /// Every n-th batch of telemetry since the last start of a run is lost on the way.
    pub lose_batches: Option<u64>,
    /// Every n-th batch comes with a wrong byte.
    pub damage_batches: Option<u64>,
    /// Every n-th batch comes twice.
    pub repeat_batches: Option<u64>,
    /// Parameter that cannot be changed.
    pub fixed_parameter: Option<&'static str>,
    /// Ticks after the start of a run at which a tendon goes slack.
    pub slack_after: Option<u64>,
    /// Ticks after the start of a run at which the board starts again.
    pub restart_after: Option<u64>,
    /// Ticks after the start of a run from which on control stands still.
    pub stand_still_after: Option<u64>,
}
