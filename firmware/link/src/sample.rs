//! All signals of one control tick, as the hardware gives them.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::codes::{Limits, State};

/// Samples that one batch holds at most.
pub const BATCH_LENGTH: usize = 24;

/// One control tick. SI values follow from the board's parameters, see each field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Sample {
    /// Encoder counts over all turns since boot, input pulley and joint, before zero and direction:
    /// `angle = direction·(count − zero)·2π/4096`.
    pub encoder_count_raw: [i32; 2],
    /// ADC codes of f1 to f4: `tension = (code − zero)·gain`.
    pub tension_raw: [u16; 4],
    /// ADC code of the motor current: `current = (code − zero)·gain`.
    pub current_raw: u16,
    /// ADC code of the bus voltage: `voltage = code·gain`.
    pub bus_raw: u16,
    /// Duty of the bridge that this tick set, in 1/32767.
    pub duty_raw: i16,
    /// Reference of the joint: desired angle in 2⁻²⁰ rad, or desired torque in 2⁻²⁰ N·m in torque mode.
    pub reference_raw: i32,
    /// Angle that the input pulley is asked to take, 2⁻²⁰ rad.
    pub command_raw: i32,
    /// State of the supervisor.
    pub state: State,
    /// Limits that act.
    pub limits: Limits,
}

/// Samples of consecutive control ticks.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Batch {
    /// Tick of the first sample, counted from boot.
    pub first_tick: u32,
    /// Time between two ticks, ns.
    pub period_ns: u32,
    /// Samples lost on the board since boot because the link was too slow.
    pub lost: u32,
    /// The samples.
    pub samples: Vec<Sample, BATCH_LENGTH>,
}
