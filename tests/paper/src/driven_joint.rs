//! The virtual bench behind encoders and converters, driven by the firmware's own fixed-point controller.
//!
//! One control tick is 100 µs, ten steps of the bench. As on the board, an encoder frame is one tick old, and a duty acts
//! from the next period on.

use std::f64::consts::TAU;

use bowden_control::controller::Controller;
use bowden_control::parameters::Parameters;
use bowden_control::tick::{Command, EncoderWord, Queues, TickInput, TickOutput};
use bowden_control::{reference_config, tick_config};
use bowden_link::State;
use bowden_link::message::{Goal, Reference};
use virtual_bench::{BenchConfig, Bridge, Channel, ConcealedEffect, LiveBench};

use crate::error::ExperimentError;

/// Counts of an AMT22 a turn.
const COUNTS_PER_TURN: f64 = 4096.0;
/// Largest code of a converter.
const LARGEST_CODE: f64 = 4095.0;
/// Steps of the generators and of streamed points: 2⁻²⁰ of the unit.
const STEPS_PER_UNIT: f64 = 1_048_576.0;
/// Longest time from power-on to ready \[s\]: self test and pretension check take 0.1 s each.
const READY_LIMIT_S: f64 = 1.0;

/// Bench, converters and controller.
#[derive(Debug)]
pub struct DrivenJoint {
    parameters: Parameters,
    /// Zeros and gains of encoders and converters as they are, whatever the controller believes of them.
    wiring: Parameters,
    controller: Controller,
    queues: Queues,
    bench: LiveBench,
    steps_per_tick: usize,
    bridge: Bridge,
    sequence: u8,
    words: [EncoderWord; 2],
}

/// Parameters of the controller that describe this bench, every other one at its default.
///
/// The controller knows the bench as its data sheet has it: pulleys, tendons, the nominal wrap angle, motor.
#[must_use]
pub fn parameters_of(bench: &BenchConfig) -> Parameters {
    let mut parameters = Parameters::default();
    parameters.motor.resistance = bench.resistance_ohm as f32;
    parameters.motor.torque_constant = bench.torque_constant_nm_per_a as f32;
    parameters.motor.gear_ratio = bench.gear_ratio as f32;
    parameters.motor.rotor_inertia = bench.rotor_inertia_kg_m2 as f32;
    parameters.motor.viscous = bench.motor_viscous_nm_s_per_rad as f32;
    parameters.pulley.input_radius = bench.input_radius_m as f32;
    parameters.pulley.output_radius = bench.output_radius_m as f32;
    parameters.tendon.length = bench.tendon_length_m as f32;
    parameters.tendon.axial_stiffness = bench.axial_stiffness_n as f32;
    parameters.tendon.pretension = bench.pretension_n as f32;
    parameters.sheath.friction_coefficient = bench.friction_coefficient as f32;
    parameters.sheath.wrap_angle = bench.wrap_angle_rad as f32;
    parameters.load.mass = bench.mass_kg as f32;
    parameters.load.arm = bench.arm_m as f32;
    parameters.load.inertia = bench.load_inertia_kg_m2 as f32;
    parameters
}

/// Frame of an AMT22 at `count`: two check bits, odd parity of the odd and of the even bits.
fn amt22_frame(count: u32) -> u32 {
    let field = (count & 0xfff) << 2;
    let odd = |mask: u32| (field & mask).count_ones() % 2;
    (1 - odd(0x2aaa)) << 15 | (1 - odd(0x1555)) << 14 | field
}

/// Code of a converter channel with this zero and gain.
fn code(value: f64, zero: f32, per_code: f32) -> u16 {
    (f64::from(zero) + value / f64::from(per_code)).round().clamp(0.0, LARGEST_CODE) as u16
}

impl DrivenJoint {
    /// A joint at rest at angle 0 with its board just switched on; `seed` is the sensor noise's.
    ///
    /// # Errors
    /// [`ExperimentError`] if bench or parameters are out of range.
    pub fn new(bench: &BenchConfig, parameters: Parameters, seed: u64) -> Result<Self, ExperimentError> {
        Self::concealing(bench, &[], parameters, seed)
    }

    /// The same on a bench that conceals `effects`.
    ///
    /// # Errors
    /// As [`DrivenJoint::new`], and if an effect is given twice.
    pub fn concealing(
        bench: &BenchConfig,
        effects: &[ConcealedEffect],
        parameters: Parameters,
        seed: u64,
    ) -> Result<Self, ExperimentError> {
        let controller = Controller::new(tick_config(&parameters)?);
        let steps_per_tick = (1.0 / (f64::from(parameters.tick_rate_hz()) * bench.step_s)).round() as usize;
        Ok(Self {
            bench: LiveBench::new(bench, effects, seed)?,
            parameters,
            wiring: Parameters::default(),
            controller,
            queues: Queues::default(),
            steps_per_tick,
            bridge: Bridge::Open,
            sequence: 0,
            words: [EncoderWord::default(); 2],
        })
    }

    /// A joint that has passed self test and pretension check.
    ///
    /// # Errors
    /// As [`DrivenJoint::new`]; [`ExperimentError::Stopped`] or [`ExperimentError::NotReady`] if a check does not pass.
    pub fn ready(bench: &BenchConfig, parameters: Parameters, seed: u64) -> Result<Self, ExperimentError> {
        let mut joint = Self::new(bench, parameters, seed)?;
        joint.make_ready()?;
        Ok(joint)
    }

    /// Self test and pretension check of a joint whose board was just switched on.
    ///
    /// # Errors
    /// [`ExperimentError::Stopped`] or [`ExperimentError::NotReady`] if a check does not pass.
    pub fn make_ready(&mut self) -> Result<(), ExperimentError> {
        // Encoder frames are a tick old: the first ones are not there yet.
        for _ in 0..100 {
            self.tick()?;
        }
        self.order(Goal::Ready);
        self.reach_ready(READY_LIMIT_S)
    }

    /// Moves a ready joint to angle zero, within `limit_s`.
    ///
    /// # Errors
    /// [`ExperimentError::Stopped`] or [`ExperimentError::NotReady`] if it does not arrive.
    pub fn home(&mut self, limit_s: f64) -> Result<(), ExperimentError> {
        self.order(Goal::Home);
        // The order is taken in this tick.
        self.tick()?;
        self.reach_ready(limit_s)
    }

    fn reach_ready(&mut self, limit_s: f64) -> Result<(), ExperimentError> {
        let ticks = (limit_s * self.tick_rate_hz()) as usize;
        for _ in 0..ticks {
            self.tick()?;
            if self.controller.state() == State::Ready {
                return Ok(());
            }
        }
        Err(ExperimentError::NotReady)
    }

    /// The bench, with everything true.
    #[must_use]
    pub fn bench(&self) -> &LiveBench {
        &self.bench
    }

    /// Parameters of the controller.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Control ticks a second \[Hz\].
    #[must_use]
    pub fn tick_rate_hz(&self) -> f64 {
        f64::from(self.parameters.tick_rate_hz())
    }

    /// True torque that the tendons take from the input pulley, (F1 - F3) r1 \[Nm\].
    #[must_use]
    pub fn torque_in_nm(&self) -> f64 {
        let [f1, _, f3, _] = self.bench.tensions_n();
        (f1 - f3) * self.bench.config().input_radius_m
    }

    /// True torque that the tendons give to the joint, (F2 - F4) r2 \[Nm\].
    #[must_use]
    pub fn torque_out_nm(&self) -> f64 {
        let [_, f2, _, f4] = self.bench.tensions_n();
        (f2 - f4) * self.bench.config().output_radius_m
    }

    /// Moves the sheaths of cable a and b to these wrap angles \[rad\].
    ///
    /// # Errors
    /// [`ExperimentError::Bench`] if one is out of range.
    pub fn set_wrap_angle_rad(&mut self, wrap_angle_rad: [f64; 2]) -> Result<(), ExperimentError> {
        Ok(self.bench.set_wrap_angle_rad(wrap_angle_rad)?)
    }

    /// Gives an order to the controller.
    pub fn order(&mut self, goal: Goal) {
        self.queues.commands.push_back(Command::Enter(goal));
    }

    /// Pushes the joint from outside, towards +θ \[Nm\], until it is set anew.
    pub fn push(&mut self, torque_nm: f64) {
        self.bench.set_outer_torque_nm(torque_nm);
    }

    /// Changes the parameters of the controller, also while the joint moves.
    ///
    /// # Errors
    /// [`ExperimentError::Parameters`] if they do not fit together.
    pub fn configure(&mut self, parameters: Parameters) -> Result<(), ExperimentError> {
        self.queues.commands.push_back(Command::Configure(tick_config(&parameters)?));
        self.parameters = parameters;
        Ok(())
    }

    /// Gives a reference to the controller.
    ///
    /// # Errors
    /// [`ExperimentError::Parameters`] if it is out of range.
    pub fn refer(&mut self, reference: Reference) -> Result<(), ExperimentError> {
        let config = reference_config(&self.parameters, reference)?;
        self.queues.commands.push_back(Command::SetReference(config));
        Ok(())
    }

    /// Sends the next point of a streamed reference \[rad or Nm\].
    pub fn stream(&mut self, point: f64) {
        self.queues.points.push_back((point * STEPS_PER_UNIT).round() as i32);
    }

    /// Reference of a tick \[rad or Nm\].
    #[must_use]
    pub fn reference(output: &TickOutput) -> f64 {
        f64::from(output.sample.reference_raw) / STEPS_PER_UNIT
    }

    /// One control tick and the time up to the next one.
    ///
    /// # Errors
    /// [`ExperimentError::Stopped`] in the tick in which the supervisor stops the joint.
    pub fn tick(&mut self) -> Result<TickOutput, ExperimentError> {
        let input = self.input();
        let output = self.controller.tick(&input, &mut self.queues);
        for _ in 0..self.steps_per_tick {
            self.bench.step(self.bridge);
        }
        self.bridge = if output.bridge_on {
            Bridge::Duty(f64::from(output.duty_raw) / f64::from(i16::MAX))
        } else {
            Bridge::Open
        };
        match output.tripped {
            Some(fault) => Err(ExperimentError::Stopped { fault, at_s: self.bench.time_s() }),
            None => Ok(output),
        }
    }

    /// What the hardware measures now.
    fn input(&mut self) -> TickInput {
        let parameters = &self.wiring;
        let channels = [
            (Channel::F1, parameters.tension.f1),
            (Channel::F2, parameters.tension.f2),
            (Channel::F3, parameters.tension.f3),
            (Channel::F4, parameters.tension.f4),
        ];
        let tension_raw =
            channels.map(|(channel, scale)| code(self.bench.sensed(channel), scale.zero, scale.gain));
        let bridge = &parameters.bridge;
        let current_raw = code(self.bench.sensed(Channel::Current), bridge.current_zero, bridge.current_gain);
        let bus_raw = code(self.bench.supply_v(), 0.0, bridge.bus_gain);
        let encoder = self.words;
        self.sequence = self.sequence.wrapping_add(1);
        let zeros = [self.wiring.encoder.input.zero, self.wiring.encoder.joint.zero];
        for (word, (channel, zero)) in
            self.words.iter_mut().zip([Channel::ThetaIn, Channel::ThetaOut].into_iter().zip(zeros))
        {
            let turns = self.bench.sensed_angle_rad(channel) / TAU;
            let count = (turns * COUNTS_PER_TURN + f64::from(zero)).round().rem_euclid(COUNTS_PER_TURN);
            *word = EncoderWord {
                frame_raw: amt22_frame(count as u32),
                sequence: self.sequence,
                bus_error: false,
            };
        }
        TickInput { encoder, tension_raw, current_raw, bus_raw, bridge_fault: false }
    }
}
