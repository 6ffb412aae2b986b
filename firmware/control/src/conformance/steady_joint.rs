//! A joint in motion for those who count or time ticks: its encoders follow the reference, tensions and current are at rest.

use super::amt22_frame;
use crate::tick::{EncoderWord, TickInput, TickOutput};
use bowden_link::message::{Reference, Shape};

/// A sine of 0.5 rad at 0.2 Hz.
pub const SINE: Reference =
    Reference::Generated { shape: Shape::Sine, amplitude: 0.5, offset: 0.0, frequency_hz: 0.2 };

/// The joint.
#[derive(Clone, Debug)]
pub struct SteadyJoint {
    random: u32,
    sequence: u8,
    reference_raw: i32,
}

impl SteadyJoint {
    /// At angle zero.
    #[must_use]
    pub const fn new() -> Self {
        Self { random: 1, sequence: 0, reference_raw: 0 }
    }

    /// 0 to below `range`, at most 2¹⁶.
    pub const fn below(&mut self, range: u32) -> u32 {
        self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((self.random >> 16) * range) >> 16
    }

    /// What a tick reads.
    pub fn input(&mut self) -> TickInput {
        self.sequence = self.sequence.wrapping_add(1);
        // 4096 counts a turn, the reference in 2⁻²⁰ rad.
        let turned = (i64::from(self.reference_raw) * 652) >> 20;
        let encoder = [1000, 2000].map(|zero| EncoderWord {
            frame_raw: amt22_frame((zero + turned) as u32),
            sequence: self.sequence,
            bus_error: false,
        });
        TickInput {
            encoder,
            // 30 N ± 0.5 N; a code that stays the same is a fault.
            tension_raw: [0; 4].map(|_| (1463 + self.below(28)) as u16),
            current_raw: (2043 + self.below(10)) as u16,
            bus_raw: (2700 + self.below(16)) as u16,
            bridge_fault: false,
        }
    }

    /// Follows the reference of a tick.
    pub const fn follow(&mut self, output: &TickOutput) {
        self.reference_raw = output.sample.reference_raw;
    }
}

impl Default for SteadyJoint {
    fn default() -> Self {
        Self::new()
    }
}
