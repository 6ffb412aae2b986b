//! The virtual bench behind the board's converters: angles as encoder frames, the rest as ADC codes.
//!
//! The bench shares no code with the model that diagnoses simulate. As on the board, an encoder frame is one tick old, and
//! a duty acts from the next tick on.

use std::f64::consts::TAU;

use bowden_control::parameters::Parameters;
use bowden_control::tick::{EncoderWord, TickInput};
use virtual_bench::{BenchError, Bridge, Channel, LiveBench};

use super::board::Joint;
use super::concealed::Concealed;
use super::wiring::Wiring;

/// Counts a turn of both encoders.
const COUNTS_PER_TURN: f64 = 4096.0;

/// Largest code of the converters, and the volts that it stands for.
const FULL_CODE: f64 = 4095.0;
const REFERENCE_V: f64 = 3.3;

/// Volts at zero and volts a unit, of the amplifiers in front of the converter.
struct Amplifier {
    zero_v: f64,
    volts_per_unit: f64,
}

/// Volts of a tension input whose wire is broken: the amplifier's output rests at its low rail.
const BROKEN_V: f64 = 0.02;

const TENSION: Amplifier = Amplifier { zero_v: 0.5, volts_per_unit: 0.023 };
const CURRENT: Amplifier = Amplifier { zero_v: 1.65, volts_per_unit: 0.12 };
const BUS: Amplifier = Amplifier { zero_v: 0.0, volts_per_unit: 1.0 / 11.0 };

impl Amplifier {
    fn code(&self, value: f64) -> u16 {
        code_of(self.zero_v + self.volts_per_unit * value)
    }
}

fn code_of(volts: f64) -> u16 {
    (volts / REFERENCE_V * FULL_CODE).round().clamp(0.0, FULL_CODE) as u16
}

/// A joint and the sensors on it.
pub struct SimJoint {
    bench: LiveBench,
    bridge: Bridge,
    zeros: [f64; 2],
    wiring: Wiring,
    encoder_sequence: u8,
    frames: [u32; 2],
}

impl SimJoint {
    /// A joint at rest at angle zero, with encoders mounted as `parameters` say.
    ///
    /// # Errors
    /// When the bench cannot be what `concealed` says.
    pub(super) fn new(parameters: &Parameters, concealed: &Concealed) -> Result<Self, BenchError> {
        let bench = LiveBench::new(&concealed.bench, &concealed.effects, concealed.seed)?;
        let zero = |name| Parameters::index_of(name).and_then(|index| parameters.get(index)).unwrap_or(0.0);
        let wiring = concealed.wiring.clone();
        let zeros = match wiring.mounted_counts {
            Some(counts) => counts.map(f64::from),
            None => [zero("encoder.input.zero").into(), zero("encoder.joint.zero").into()],
        };
        let mut joint =
            Self { bench, bridge: Bridge::Open, zeros, wiring, encoder_sequence: 0, frames: [0; 2] };
        joint.read_encoders();
        Ok(joint)
    }

    /// The bench, for a hand.
    pub(super) fn bench(&mut self) -> &mut LiveBench {
        &mut self.bench
    }

    fn read_encoders(&mut self) {
        let mut angles =
            [Channel::ThetaIn, Channel::ThetaOut].map(|channel| self.bench.sensed_angle_rad(channel));
        if self.wiring.encoders_swapped {
            angles.swap(0, 1);
        }
        let reversed = self.wiring.encoder_reversed;
        for (((frame, angle_rad), zero), reversed) in
            self.frames.iter_mut().zip(angles).zip(self.zeros).zip(reversed)
        {
            let angle_rad = if reversed { -angle_rad } else { angle_rad };
            let count = (angle_rad / TAU * COUNTS_PER_TURN + zero).round().rem_euclid(COUNTS_PER_TURN);
            *frame = amt22_frame(count as u16).into();
        }
        self.encoder_sequence = self.encoder_sequence.wrapping_add(1);
    }
}

impl Joint for SimJoint {
    fn measure(&mut self) -> TickInput {
        let encoder = self.frames.map(|frame_raw| EncoderWord {
            frame_raw,
            sequence: self.encoder_sequence,
            bus_error: false,
        });
        let tensions = [Channel::F1, Channel::F2, Channel::F3, Channel::F4];
        let sensed_n = tensions.map(|channel| self.bench.sensed(channel));
        let tension_raw =
            self.wiring.cell.map(|cell| cell.map_or(code_of(BROKEN_V), |cell| TENSION.code(sensed_n[cell])));
        // The shunt is in the bridge's line to the motor: it sees the leads as the bridge does.
        let sign = if self.wiring.motor_reversed { -1.0 } else { 1.0 };
        let current_raw = CURRENT.code(sign * self.bench.sensed(Channel::Current));
        let bus_raw = BUS.code(self.bench.supply_v());
        // The transfer started by this tick is done long before the next one.
        self.read_encoders();
        TickInput { encoder, tension_raw, current_raw, bus_raw, bridge_fault: false }
    }

    fn advance(&mut self, duty: f64, bridge_on: bool, period_s: f64) {
        let at_motor = match self.bridge {
            Bridge::Duty(duty) if self.wiring.motor_reversed => Bridge::Duty(-duty),
            other => other,
        };
        let steps = (period_s / self.bench.config().step_s).round().max(1.0);
        for _ in 0..steps as usize {
            self.bench.step(at_motor);
        }
        self.bridge = if bridge_on { Bridge::Duty(duty) } else { Bridge::Open };
    }
}

/// Frame of a 12-bit AMT22: two check bits that make the number of ones odd over every second bit, the count, two zeros.
fn amt22_frame(count: u16) -> u16 {
    let position = count << 2;
    let odd = |mask: u16| u16::from((position & mask).count_ones().is_multiple_of(2));
    odd(0xaaaa) << 15 | odd(0x5555) << 14 | position
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_their_check_bits() {
        // By hand: count 0 has no ones, so both check bits are set; count 1 is bit 2, which K0 covers.
        assert_eq!(amt22_frame(0), 0b1100_0000_0000_0000);
        assert_eq!(amt22_frame(1), 0b1000_0000_0000_0100);
        assert_eq!(amt22_frame(0xfff), 0b1111_1111_1111_1100);
    }

    #[test]
    fn codes_are_those_of_the_front_end() {
        // 30 N: 0.5 V + 0.69 V = 1.19 V of 3.3 V in 4095 steps. 24 V: 2.1818 V.
        assert_eq!(TENSION.code(30.0), 1477);
        assert_eq!(CURRENT.code(0.0), 2048);
        assert_eq!(BUS.code(24.0), 2707);
        assert_eq!((TENSION.code(-100.0), TENSION.code(500.0)), (0, 4095));
    }
}
