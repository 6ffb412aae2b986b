//! A joint in motion for those who count or time ticks: its encoders follow the reference, the current follows the duty, tensions are
//! at rest.

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
    /// Last change of the reference, 2⁻²⁰ rad a tick.
    turned_raw: i32,
    duty_raw: i16,
}

impl SteadyJoint {
    /// At angle zero.
    #[must_use]
    pub const fn new() -> Self {
        Self { random: 1, sequence: 0, reference_raw: 0, turned_raw: 0, duty_raw: 0 }
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
        // With the default parameters, A/code and all: 24 V at 2 Ω are 1787 codes, and 0.9 V·s/rad at 10⁴ ticks/s 0.64 code for 2⁻²⁰ rad a tick.
        let driven = (i32::from(self.duty_raw) * 1787) >> 15;
        let back_emf = (self.turned_raw * 654) >> 10;
        TickInput {
            encoder,
            // 30 N ± 0.5 N; a code that stays the same is a fault.
            tension_raw: [0; 4].map(|_| (1463 + self.below(28)) as u16),
            current_raw: (2043 + self.below(10).cast_signed() + driven - back_emf).clamp(0, 4095) as u16,
            bus_raw: (2700 + self.below(16)) as u16,
            bridge_fault: false,
        }
    }

    /// Follows the reference and the duty of a tick.
    pub const fn follow(&mut self, output: &TickOutput) {
        self.turned_raw = output.sample.reference_raw - self.reference_raw;
        self.reference_raw = output.sample.reference_raw;
        self.duty_raw = output.duty_raw;
    }
}

impl Default for SteadyJoint {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::Orders;
    use crate::controller::Controller;
    use crate::parameters::Parameters;
    use crate::tick::Command;
    use crate::{reference_config, tick_config};
    use bowden_link::State;
    use bowden_link::message::{Goal, Mode};

    /// A minute: a motor without current is a fault after 44 s.
    #[test]
    fn a_controller_runs_on_it() {
        let parameters = Parameters::default();
        let mut controller = Controller::new(tick_config(&parameters).unwrap());
        let (mut joint, mut orders) = (SteadyJoint::new(), Orders::default());
        let sine = reference_config(&parameters, SINE).unwrap();
        let commands = [
            (1, Command::Enter(Goal::Ready)),
            (100_000, Command::SetReference(sine)),
            (100_001, Command::Enter(Goal::Run(Mode::Position))),
        ];
        for tick in 0..700_000 {
            orders.command = commands.iter().find(|(at, _)| *at == tick).map(|(_, command)| *command);
            let output = controller.tick(&joint.input(), &mut orders);
            joint.follow(&output);
            assert_eq!(output.tripped, None, "in tick {tick}");
        }
        assert_eq!(controller.state(), State::Run);
    }
}
