//! A digest over many control ticks, to show that two machines compute the same.
//!
//! [`run`] drives the compensator and whole [`Controller`]s of several configurations through random, plausible and
//! adversarial inputs and hashes every output bit. The inputs come from the seed alone. A board, an emulated core and a
//! workstation that print the same number for the same seed have computed the same.

mod corrections;
mod steady_joint;
mod table;

use bowden_link::message::{Goal, Mode, Reference, Shape};
use bowden_link::{Fault, State};

use crate::compensator::{Compensator, CompensatorInput, CompensatorState, compensate};
use crate::controller::Controller;
use crate::correction::ripple_table::RippleTable;
use crate::parameters::Parameters;
use crate::scale::{Angle, Quantity, Speed, Torque};
use crate::tick::{Command, EncoderWord, Inbox, TickInput, TickOutput};
use crate::{reference_config, tick_config};

pub use corrections::correction_digest;
pub use steady_joint::{SINE, SteadyJoint};
pub use table::ripple_table_digest;

/// What a run came by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Hash over all outputs.
    pub digest: u32,
    /// Bit n: state number n was there.
    pub states: u8,
    /// Bit n: fault number n was found.
    pub faults: u64,
}

/// Hash over `ticks` ticks of each of three configurations; [`run`] tells more.
#[must_use]
pub fn digest(seed: u32, ticks: u32) -> u32 {
    run(seed, ticks).digest
}

/// Runs `ticks` ticks of compensator and controller for each of the three sources of the lag angle.
#[must_use]
pub fn run(seed: u32, ticks: u32) -> Outcome {
    run_with(seed, ticks, None, |_| {})
}

/// The same with a ripple table and other parameters than the usual ones.
fn run_with(seed: u32, ticks: u32, table: Option<&RippleTable>, prepare: fn(&mut Parameters)) -> Outcome {
    let mut hash = Hash::default();
    let mut outcome = Outcome::default();
    for source in 0..3_u8 {
        let mut random = Random(seed ^ u32::from(source) << 24);
        let mut parameters = parameters(source, &mut random);
        prepare(&mut parameters);
        let (Some(compensator), Ok(config)) = (Compensator::new(&parameters), tick_config(&parameters))
        else {
            continue;
        };
        let mut state = CompensatorState::default();
        for _ in 0..ticks {
            let input = compensator_input(&compensator, &mut random);
            let output = compensate(&compensator, &mut state, &input);
            hash.word(output.theta_c.to_bits().cast_unsigned());
            hash.word(output.theta_f.to_bits().cast_unsigned());
            hash.word(u32::from(output.limited));
        }
        let mut controller = Controller::new(config);
        let mut world = World::new(random);
        let mut table = table.map(|table| Command::Table(Some(*table)));
        for _ in 0..ticks {
            let (input, mut inbox) = world.next(&parameters, &controller);
            if inbox.command.is_none() {
                inbox.command = table.take();
            }
            let output = controller.tick(&input, &mut inbox);
            hash.output(&output);
            outcome.states |= 1 << output.sample.state as u8;
            if let Some(record) = output.tripped {
                outcome.faults |= 1 << record.fault as u8;
            }
        }
    }
    outcome.digest = hash.0;
    outcome
}

/// Inputs of the compensator under one set of parameters in [`compensator_digest`].
const INPUTS_A_SET: u32 = 2000;

/// Hash over the compensator's outputs for at least `inputs` inputs, a third for each source of the lag angle.
///
/// Half of the inputs are plausible, a quarter wild, a quarter at the edges: speeds at the threshold and one step beside
/// it, angles at the limit of the lag and beside it, extremes of the number range. Radii, friction and limits change every
/// 2000 inputs, so the computation of the coefficients is compared as well.
#[must_use]
pub fn compensator_digest(seed: u32, inputs: u32) -> u32 {
    let mut hash = Hash::default();
    let mut random = Random(seed);
    for set in 0..inputs.div_ceil(INPUTS_A_SET) {
        let mut parameters = parameters((set % 3) as u8, &mut random);
        parameters.pulley.input_radius = 0.012 + 1e-5 * random.below(600) as f32;
        parameters.sheath.wrap_angle = 1e-2 * random.below(1000) as f32;
        parameters.compensator.size_limit = 1e-3 * random.below(200) as f32;
        parameters.compensator.rate_limit = 0.1 + 1e-2 * random.below(2000) as f32;
        let Some(compensator) = Compensator::new(&parameters) else { continue };
        let edges = Edges {
            threshold: Speed::from_f32(parameters.compensator.speed_threshold).to_bits(),
            size: Angle::from_f32(parameters.compensator.size_limit).to_bits(),
        };
        let mut state = CompensatorState::default();
        for _ in 0..INPUTS_A_SET {
            let input = if random.rarely(4) {
                edges.input(&compensator, &mut random)
            } else {
                compensator_input(&compensator, &mut random)
            };
            let output = compensate(&compensator, &mut state, &input);
            hash.word(output.theta_c.to_bits().cast_unsigned());
            hash.word(output.theta_f.to_bits().cast_unsigned());
            hash.word(u32::from(output.limited));
        }
    }
    hash.0
}

/// Where the compensator's branches are.
struct Edges {
    threshold: i32,
    size: i32,
}

impl Edges {
    fn input(&self, config: &Compensator, random: &mut Random) -> CompensatorInput {
        let mut near = |edge: i32| {
            let edge = if random.rarely(2) { edge } else { edge.wrapping_neg() };
            match random.below(8) {
                0 => i32::MIN,
                1 => i32::MAX,
                _ => edge.wrapping_add(random.below(3).cast_signed() - 1),
            }
        };
        CompensatorInput {
            theta_d: Angle::from_bits(near(self.size)),
            omega_d: Speed::from_bits(near(self.threshold)),
            torque_out: Torque::from_bits(near(0)),
            friction: Angle::from_bits(near(self.size)),
            slips: near(0) >= 0,
            lag: lag(config, near(self.size), near(0)),
        }
    }
}

/// FNV-1a over little-endian words.
struct Hash(u32);

impl Default for Hash {
    fn default() -> Self {
        Self(0x811c_9dc5)
    }
}

impl Hash {
    fn word(&mut self, word: u32) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        }
    }

    fn output(&mut self, output: &TickOutput) {
        let sample = &output.sample;
        self.word(u32::from(output.duty_raw.cast_unsigned()) << 1 | u32::from(output.bridge_on));
        for count in sample.encoder_count_raw {
            self.word(count.cast_unsigned());
        }
        self.word(sample.reference_raw.cast_unsigned());
        self.word(sample.command_raw.cast_unsigned());
        self.word((sample.state as u32) << 16 | u32::from(sample.limits.0));
        if let Some(record) = output.tripped {
            self.word((record.fault as u32) << 8 | u32::from(record.channel));
            self.word(record.tick);
            self.word(record.got.to_bits());
            self.word(record.limit.to_bits());
        }
    }
}

/// Xorshift generator.
struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        // Zero would stay zero.
        let mut x = if self.0 == 0 { 0x9e37_79b9 } else { self.0 };
        x ^= x << 13;
        x ^= x >> 17;
        x ^= x << 5;
        self.0 = x;
        x
    }

    /// 0 to below `range`, which is at most 2¹⁶.
    fn below(&mut self, range: u32) -> u32 {
        ((self.next() >> 16) * range) >> 16
    }

    /// True once in `of` times.
    fn rarely(&mut self, of: u32) -> bool {
        self.below(of) == 0
    }

    /// Any bits; every second one an extreme.
    fn wild(&mut self) -> i32 {
        match self.below(8) {
            0 => i32::MIN,
            1 => i32::MAX,
            2 => 0,
            3 => -1,
            _ => self.next().cast_signed(),
        }
    }
}

fn parameters(source: u8, random: &mut Random) -> Parameters {
    let mut parameters = Parameters::default();
    parameters.compensator.source = f32::from(source);
    parameters.tension.fitted = [2.0, 1.0, 0.0][usize::from(source % 3)];
    // Wandering encoders contradict the tensions at once; where that is no fault, slack and overload are.
    parameters.tension.stretch_margin = [1000.0, 10.0, 10.0][usize::from(source % 3)];
    parameters.control.rate_divider = [2.0, 1.0, 5.0][usize::from(source % 3)];
    parameters.encoder.bad_frames = 20.0;
    parameters.encoder.speed_limit = 200.0;
    parameters.supervisor.self_test_time = 0.02;
    parameters.supervisor.self_test_timeout = 0.2;
    parameters.supervisor.homing_timeout = 0.3;
    parameters.pulley.output_radius = 0.012 + 1e-5 * random.below(600) as f32;
    parameters.sheath.friction_coefficient = 1e-3 * random.below(300) as f32;
    parameters
}

/// Lag between these angles of input pulley and joint.
fn lag(config: &Compensator, theta_in: i32, theta_out: i32) -> Angle {
    Angle::from_bits(theta_in).minus(config.at_input(Angle::from_bits(theta_out)))
}

fn compensator_input(config: &Compensator, random: &mut Random) -> CompensatorInput {
    if random.rarely(4) {
        return CompensatorInput {
            theta_d: Angle::from_bits(random.wild()),
            omega_d: Speed::from_bits(random.wild()),
            torque_out: Torque::from_bits(random.wild()),
            friction: Angle::from_bits(random.wild()),
            slips: random.rarely(2),
            lag: lag(config, random.wild(), random.wild()),
        };
    }
    // Within 2 rad, 2 rad/s and 2 N·m.
    let mut small = || random.next().cast_signed() >> 10;
    CompensatorInput {
        theta_d: Angle::from_bits(small()),
        omega_d: Speed::from_bits(small()),
        torque_out: Torque::from_bits(small()),
        friction: Angle::from_bits(small()),
        slips: small() >= 0,
        lag: lag(config, small(), small()),
    }
}

/// A joint that wanders, and everything that can go wrong with it.
struct World {
    random: Random,
    counts: [u32; 2],
    sequence: u8,
    /// Ticks for which what is wrong stays wrong, and what it is.
    trouble: (u32, u32),
}

/// At most a command and a stream point.
#[derive(Clone, Debug, Default)]
pub struct Orders {
    /// For the next tick.
    pub command: Option<Command>,
    /// The same.
    pub point: Option<i32>,
}

impl Inbox for Orders {
    fn command<R>(&mut self, act: impl FnOnce(&Command) -> R) -> Option<R> {
        self.command.take().map(|command| act(&command))
    }

    fn stream_point(&mut self) -> Option<i32> {
        self.point.take()
    }
}

impl World {
    fn new(random: Random) -> Self {
        Self { random, counts: [1000, 2000], sequence: 0, trouble: (0, 0) }
    }

    fn next(&mut self, parameters: &Parameters, controller: &Controller) -> (TickInput, Orders) {
        let moving = controller.state().drives();
        self.sequence = self.sequence.wrapping_add(1);
        for count in &mut self.counts {
            let step = if moving { self.random.below(5) } else { 2 };
            *count = count.wrapping_add(step).wrapping_sub(2) & 0xfff;
        }
        let mut input = TickInput {
            encoder: self.counts.map(|count| EncoderWord {
                frame_raw: amt22_frame(count),
                sequence: self.sequence,
                bus_error: false,
            }),
            // 30 N ± 0.5 N.
            tension_raw: [0; 4].map(|_| (1463 + self.random.below(28)) as u16),
            current_raw: (2043 + self.random.below(10)) as u16,
            bus_raw: (2700 + self.random.below(16)) as u16,
            bridge_fault: false,
        };
        self.disturb(&mut input, moving);
        (input, self.orders(parameters, controller))
    }

    fn disturb(&mut self, input: &mut TickInput, moving: bool) {
        if self.trouble.0 == 0 {
            let often = if moving { 2000 } else { 4000 };
            if !self.random.rarely(often) {
                return;
            }
            self.trouble = (1 + self.random.below(600), self.random.below(16));
        }
        self.trouble.0 -= 1;
        let which = (self.trouble.1 & 1) as usize;
        match self.trouble.1 {
            0 | 1 => input.encoder[which].frame_raw ^= 1 << self.random.below(18),
            2 | 3 => input.encoder[which].sequence = 0,
            4 | 5 => input.encoder[which].bus_error = true,
            6 => input.encoder[which].frame_raw = amt22_frame(self.random.below(4096)),
            7 => input.encoder[which].frame_raw = self.random.next(),
            8 => input.tension_raw[3] = 0,
            9 => input.tension_raw[1] = 640,
            10 => input.tension_raw[2] = 3400,
            11 => input.tension_raw[0] = 2600,
            12 => input.current_raw = self.random.below(4096) as u16,
            13 => input.bus_raw = self.random.below(1800) as u16,
            14 => input.bus_raw = u16::MAX,
            _ => input.bridge_fault = true,
        }
    }

    fn orders(&mut self, parameters: &Parameters, controller: &Controller) -> Orders {
        let point = self.random.rarely(3).then(|| self.random.wild());
        let command = if self.random.rarely(40) { self.command(parameters, controller) } else { None };
        Orders { command, point }
    }

    fn command(&mut self, parameters: &Parameters, controller: &Controller) -> Option<Command> {
        let random = &mut self.random;
        let reference = match random.below(7) {
            0 => Reference::Hold(random.below(1000) as f32 * 1e-3),
            1 => Reference::Stream,
            shape => Reference::Generated {
                shape: [Shape::Sine, Shape::Triangle, Shape::Multisine, Shape::Staircase]
                    [(shape & 3) as usize],
                amplitude: random.below(2000) as f32 * 1e-3,
                offset: random.below(400) as f32 * 1e-3 - 0.2,
                frequency_hz: 0.1 + random.below(300) as f32 * 1e-2,
            },
        };
        let goal = match controller.state() {
            State::Off => Goal::Ready,
            State::Ready if random.rarely(3) => Goal::Home,
            State::Ready => Goal::Run(
                [Mode::Position, Mode::Torque, Mode::Hybrid, Mode::Impedance][random.below(4) as usize],
            ),
            State::Fault => Goal::ClearFault,
            State::SelfTest | State::PretensionCheck | State::Homing | State::Run => {
                return match random.below(40) {
                    0 => Some(Command::Enter(Goal::Off)),
                    1 => Some(Command::Trip(Fault::HostSilent, 0, 0.75, 0.5)),
                    2 => tick_config(parameters).ok().map(Command::Configure),
                    _ => reference_config(parameters, reference).ok().map(Command::SetReference),
                };
            }
        };
        Some(Command::Enter(goal))
    }
}

/// Frame of a 12-bit AMT22 at `count`, its two check bits odd over odd and even bits.
#[must_use]
pub fn amt22_frame(count: u32) -> u32 {
    let field = (count & 0xfff) << 2;
    let even = |mask: u32| u32::from((field & mask).count_ones().is_multiple_of(2));
    even(0x2aaa) << 15 | even(0x1555) << 14 | field
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_meets_every_state_and_most_faults() {
        let outcome = run(1, 60_000);
        assert_eq!(outcome.states, 0x7f, "states {:#09b}", outcome.states);
        for fault in [
            Fault::EncoderCheck,
            Fault::EncoderStatus,
            Fault::EncoderMissing,
            Fault::EncoderJump,
            Fault::TensionRail,
            Fault::Slack,
            Fault::OverTension,
            Fault::TensionInconsistent,
            Fault::OverCurrent,
            Fault::BusUnderVoltage,
            Fault::BusOverVoltage,
            Fault::BridgeFault,
            Fault::HostSilent,
        ] {
            assert!(outcome.faults >> fault as u8 & 1 == 1, "{fault:?} missing in {:#x}", outcome.faults);
        }
    }

    #[test]
    fn the_digest_follows_seed_and_length() {
        assert_eq!(digest(7, 3000), digest(7, 3000));
        assert_ne!(digest(7, 3000), digest(8, 3000));
        assert_ne!(digest(7, 3000), digest(7, 3001));
    }

    #[test]
    fn the_compensator_digest_follows_seed_and_length() {
        assert_eq!(compensator_digest(3, 20_000), compensator_digest(3, 20_000));
        assert_ne!(compensator_digest(3, 20_000), compensator_digest(4, 20_000));
        assert_ne!(compensator_digest(3, 20_000), compensator_digest(3, 20_001));
    }

    /// Frozen: another value means that the control computes something else than before. Whoever changes the control on
    /// purpose writes the new one here.
    #[test]
    fn regress_digest() {
        assert_eq!(digest(1, 2000), 2_117_322_071);
    }
}
