//! What a check hands to the supervisor when it finds a fault.

use bowden_link::Fault;

/// A fault that was found, before it is recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// What.
    pub fault: Fault,
    /// Which one.
    pub channel: u8,
    /// What was measured.
    pub got: f32,
    /// What is allowed.
    pub limit: f32,
}

impl Detection {
    /// A detection; `channel` counts from 0.
    #[must_use]
    pub const fn new(fault: Fault, channel: usize, got: f32, limit: f32) -> Self {
        Self { fault, channel: channel as u8, got, limit }
    }
}
