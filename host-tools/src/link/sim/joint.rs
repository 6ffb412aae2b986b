//! The joint of the paper's bench behind the board's converters: angles as encoder frames, the rest as ADC codes.

use std::f64::consts::TAU;

use bowden_control::parameters::Parameters;
use bowden_control::tick::{EncoderWord, TickInput};
use bowden_model::drive::BridgeInput;
use bowden_model::effect_set::EffectSet;
use bowden_model::parameters::{
    FrictionLaw, JointParameters, LoadParameters, MotorParameters, NOMINAL_PARAMETERS, PulleyParameters,
    SensorParameters, SheathParameters, TendonParameters,
};
use bowden_model::plant::{InputBoundary, OutputBoundary, Outside, Plant, PlantConfig, StepInput};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Slip elements of a tendon: coarse, because every control tick is a step.
const ELEMENTS: usize = 8;

/// Supply of the bench, V.
const SUPPLY_V: f64 = 24.0;

/// Counts a turn of both encoders.
const COUNTS_PER_TURN: f64 = 4096.0;

/// Largest code of the converters, and the volts that it stands for.
const FULL_CODE: f64 = 4095.0;
const REFERENCE_V: f64 = 3.3;

/// White noise of the channels, standard deviation.
const TENSION_NOISE_N: f64 = 0.1;
const CURRENT_NOISE_A: f64 = 0.02;
const BUS_NOISE_V: f64 = 0.02;

/// Volts at zero and volts a unit, of the amplifiers in front of the converter.
struct Amplifier {
    zero_v: f64,
    volts_per_unit: f64,
}

const TENSION: Amplifier = Amplifier { zero_v: 0.5, volts_per_unit: 0.023 };
const CURRENT: Amplifier = Amplifier { zero_v: 1.65, volts_per_unit: 0.12 };
const BUS: Amplifier = Amplifier { zero_v: 0.0, volts_per_unit: 1.0 / 11.0 };

impl Amplifier {
    fn code(&self, value: f64) -> u16 {
        let volts = self.zero_v + self.volts_per_unit * value;
        (volts / REFERENCE_V * FULL_CODE).round().clamp(0.0, FULL_CODE) as u16
    }
}

/// A joint and the sensors on it.
pub(super) struct SimJoint {
    config: PlantConfig,
    plant: Plant,
    input: StepInput,
    zeros: [f64; 2],
    noise: Pcg64,
    encoder_sequence: u8,
    frames: [u32; 2],
}

impl SimJoint {
    /// A joint at rest at angle zero, with encoders mounted as `parameters` say.
    ///
    /// # Panics
    /// Never: the nominal joint has all the parts that a forward run needs.
    pub(super) fn new(parameters: &Parameters, seed: u64) -> Self {
        let effects = EffectSet::from_slice(&[]).expect("no effects are few enough");
        let boundaries = (InputBoundary::Motor, OutputBoundary::Arm);
        let config = PlantConfig::new(nominal_joint(), ELEMENTS, effects, boundaries.0, boundaries.1)
            .expect("the nominal joint is complete");
        let mut plant = Plant::at_rest(&config, 0.0, 0.0);
        let input = StepInput {
            bridge: BridgeInput { duty: 0.0, bus_v: SUPPLY_V, enabled: false },
            theta_in_rad: 0.0,
            theta_out_rad: 0.0,
            input_torque_nm: 0.0,
            loose_pulley: Outside::NOTHING,
            external_torque_nm: 0.0,
        };
        plant.settle(&config, &input);
        let zero = |name| Parameters::index_of(name).and_then(|index| parameters.get(index)).unwrap_or(0.0);
        let zeros = [zero("encoder.input.zero").into(), zero("encoder.joint.zero").into()];
        let mut joint = Self {
            config,
            plant,
            input,
            zeros,
            noise: Pcg64::new(u128::from(seed), 0),
            encoder_sequence: 0,
            frames: [0; 2],
        };
        joint.read_encoders();
        joint
    }

    /// What the hardware has measured for the tick that begins now. Encoders were read since the tick before.
    pub(super) fn measure(&mut self) -> TickInput {
        let encoder = self.frames.map(|frame_raw| EncoderWord {
            frame_raw,
            sequence: self.encoder_sequence,
            bus_error: false,
        });
        let tension_raw = self
            .plant
            .end_tensions_n(&self.config)
            .map(|tension_n| TENSION.code(tension_n + self.normal(TENSION_NOISE_N)));
        let current_raw = CURRENT.code(self.plant.current_a() + self.normal(CURRENT_NOISE_A));
        let bus_raw = BUS.code(SUPPLY_V + self.normal(BUS_NOISE_V));
        // The transfer started by this tick is done long before the next one.
        self.read_encoders();
        TickInput { encoder, tension_raw, current_raw, bus_raw, bridge_fault: false }
    }

    /// Moves the joint on by `period_s` with the bridge as the tick set it.
    pub(super) fn advance(&mut self, duty: f64, bridge_on: bool, period_s: f64) {
        self.input.bridge.duty = duty;
        self.input.bridge.enabled = bridge_on;
        let steps = (period_s / self.config.stable_step_s() - 1e-9).ceil().max(1.0);
        for _ in 0..steps as usize {
            self.plant.step(&self.config, &self.input, period_s / steps);
        }
    }

    fn read_encoders(&mut self) {
        let angles = [self.plant.theta_in_rad(), self.plant.theta_out_rad()];
        for ((frame, angle_rad), zero) in self.frames.iter_mut().zip(angles).zip(self.zeros) {
            let count = (angle_rad / TAU * COUNTS_PER_TURN + zero).round().rem_euclid(COUNTS_PER_TURN);
            *frame = amt22_frame(count as u16).into();
        }
        self.encoder_sequence = self.encoder_sequence.wrapping_add(1);
    }

    fn normal(&mut self, std: f64) -> f64 {
        let sample: f64 = StandardNormal.sample(&mut self.noise);
        std * sample
    }
}

/// The bench of the paper: every parameter at its typical value.
fn nominal_joint() -> JointParameters {
    let mut joint = JointParameters {
        motor: Some(MotorParameters {
            supply_v: 0.0,
            resistance_ohm: 0.0,
            inductance_h: 0.0,
            torque_constant_nm_per_a: 0.0,
            gear_ratio: 0.0,
            rotor_inertia_kg_m2: 0.0,
            viscous_nm_s_per_rad: 0.0,
        }),
        pulleys: Some(PulleyParameters { input_radius_m: 0.0, output_radius_m: 0.0 }),
        tendon: Some(TendonParameters { length_m: 0.0, axial_stiffness_n: 0.0, pretension_n: 0.0 }),
        sheath: Some(SheathParameters { wrap_angle_rad: 0.0, friction_coefficient: 0.0 }),
        load: Some(LoadParameters {
            mass_kg: 0.0,
            arm_m: 0.0,
            inertia_kg_m2: 0.0,
            viscous_nm_s_per_rad: 0.0,
        }),
        sensors: SensorParameters::default(),
        friction: FrictionLaw::Distributed,
    };
    for parameter in &NOMINAL_PARAMETERS {
        parameter.set(&mut joint, parameter.spec.default);
    }
    joint
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
