//! The joint of `bowden-model` behind the board's pins: encoder frames, converter codes, bridge.

use std::f64::consts::TAU;

use bowden_control::controller::Controller;
use bowden_control::parameters::Parameters;
use bowden_control::tick::{Command, EncoderWord, Queues, TickInput, TickOutput};
use bowden_control::{reference_config, tick_config};
use bowden_link::State;
use bowden_link::message::{Goal, Reference};
use bowden_model::channel::Channel;
use bowden_model::drive::BridgeInput;
use bowden_model::effect::{ActiveEffect, SensorPort};
use bowden_model::effect_set::{EffectSet, FRESH_STATES};
use bowden_model::friction_law::FrictionLaw;
use bowden_model::parameters::{
    JointParameters, LoadParameters, MotorParameters, PulleyParameters, SensorParameters, SheathParameters,
    TendonParameters,
};
use bowden_model::plant::{InputBoundary, OutputBoundary, Plant, PlantConfig, StepInput};
use bowden_model::transmission::Outside;

/// The bench of the paper, as the parameters have it by default.
pub fn joint() -> JointParameters {
    JointParameters {
        motor: Some(MotorParameters {
            supply_v: 24.0,
            resistance_ohm: 2.0,
            inductance_h: 0.8e-3,
            torque_constant_nm_per_a: 0.03,
            gear_ratio: 30.0,
            rotor_inertia_kg_m2: 5e-6,
            viscous_nm_s_per_rad: 0.02,
        }),
        pulleys: Some(PulleyParameters { input_radius_m: 0.015, output_radius_m: 0.015 }),
        tendon: Some(TendonParameters { length_m: 1.0, axial_stiffness_n: 72_900.0, pretension_n: 30.0 }),
        sheath: Some(SheathParameters { wrap_angle_rad: std::f64::consts::PI, friction_coefficient: 0.12 }),
        load: Some(LoadParameters {
            mass_kg: 2.5,
            arm_m: 0.03,
            inertia_kg_m2: 0.0,
            viscous_nm_s_per_rad: 0.004,
        }),
        sensors: SensorParameters::default(),
        friction: FrictionLaw::Distributed,
    }
}

/// A frame of an AMT22 at this count, check bits by the equations of its data sheet.
pub fn amt22(count: u32) -> u32 {
    let field = (count & 0xfff) << 2;
    let odd = |mask: u32| (field & mask).count_ones() % 2;
    (1 - odd(0x2aaa)) << 15 | (1 - odd(0x1555)) << 14 | field
}

/// A frame of an AS5045 at this count, in the order of its data sheet: position, OCF, COF, LIN, INC, DEC, even parity.
pub fn as5045(count: u32) -> u32 {
    let bits = (count & 0xfff) << 6 | 1 << 5;
    bits | (bits.count_ones() % 2)
}

/// What can go wrong between the joint and the controller; changes the input of a tick.
pub type Disturbance = fn(&mut TickInput);

/// A joint and its physics beyond the nominal model.
pub struct Physics(JointParameters, EffectSet);

impl From<JointParameters> for Physics {
    fn from(joint: JointParameters) -> Self {
        Self(joint, EffectSet::EMPTY)
    }
}

impl From<(JointParameters, &[ActiveEffect])> for Physics {
    fn from((joint, effects): (JointParameters, &[ActiveEffect])) -> Self {
        Self(joint, EffectSet::from_slice(effects).unwrap())
    }
}

/// Joint, sensors, controller.
pub struct Bench {
    pub parameters: Parameters,
    pub controller: Controller,
    pub queues: Queues,
    pub plant: Plant,
    pub config: PlantConfig,
    enabled: bool,
    duty: f64,
    sequence: u8,
    words: [EncoderWord; 2],
    random: u32,
    pub disturbance: Option<Disturbance>,
    /// A lead of the motor is open.
    pub lead_open: bool,
    /// The leg of the bridge, 0 or 1, that stays at ground.
    pub leg_at_ground: Option<usize>,
    /// Voltage of the supply.
    pub bus_v: f64,
    /// Codes that the current sensor shows too much.
    pub current_offset_raw: i32,
}

impl Bench {
    pub fn new(parameters: Parameters, physics: impl Into<Physics>) -> Self {
        let Physics(joint, effects) = physics.into();
        let config = PlantConfig::new(joint, 12, effects, InputBoundary::Motor, OutputBoundary::Arm).unwrap();
        let plant = Plant::at_rest(&config, 0.0, 0.0);
        let controller = Controller::new(tick_config(&parameters).unwrap());
        Self {
            parameters,
            controller,
            queues: Queues::default(),
            plant,
            config,
            enabled: false,
            duty: 0.0,
            sequence: 0,
            words: [EncoderWord::default(); 2],
            random: 1,
            disturbance: None,
            lead_open: false,
            leg_at_ground: None,
            bus_v: 24.0,
            current_offset_raw: 0,
        }
    }

    /// Sum of twelve uniform numbers less six: normal enough, standard deviation 1.
    fn normal(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            sum += f64::from(self.random) / 4_294_967_296.0;
        }
        sum
    }

    /// What an encoder shows; effects on encoders have no memory.
    fn shown(&self, channel: Channel, value: f64) -> f64 {
        let mut port = SensorPort { t_s: self.plant.t_s(), dt_s: 0.0, value };
        self.config.effects().measure(channel, &mut FRESH_STATES.clone(), &mut port);
        port.value
    }

    fn code(&mut self, value: f64, zero: f64, per_code: f64, noise: f64) -> u16 {
        let noisy = value + noise * self.normal();
        (zero + noisy / per_code).round().clamp(0.0, 4095.0) as u16
    }

    /// What the hardware measures now. Encoders are a tick old, as on the board.
    pub fn input(&mut self) -> TickInput {
        let tensions = self.plant.end_tensions_n(&self.config);
        let tension_raw = tensions.map(|tension| self.code(tension, 620.5, 0.035_037, 0.1));
        // Where a direction is -1, the wires are the other way round.
        let encoders = &self.parameters.encoder;
        let turned = [encoders.input.direction, encoders.joint.direction].map(f64::from);
        let wired = f64::from(self.parameters.bridge.direction);
        let current_raw = self.code(wired * self.plant.current_a(), 2047.5, 0.006_715_5, 0.01);
        let current_raw = current_raw.saturating_add_signed(self.current_offset_raw as i16);
        let encoder = self.words;
        let angles = [
            turned[0] * self.shown(Channel::ThetaIn, self.plant.theta_in_rad()),
            turned[1] * self.shown(Channel::ThetaOut, self.plant.theta_out_rad()),
        ];
        self.sequence = self.sequence.wrapping_add(1);
        for (word, (angle, zero)) in self.words.iter_mut().zip(angles.into_iter().zip([1000.0, 2000.0])) {
            let count = (angle / TAU * 4096.0 + zero).round() as i64;
            let count = count.rem_euclid(4096) as u32;
            let frame_raw =
                if self.parameters.encoder.input.part == 1.0 { as5045(count) } else { amt22(count) };
            *word = EncoderWord { frame_raw, sequence: self.sequence, bus_error: false };
        }
        let bus_raw = (self.bus_v / 0.008_864_5).round() as u16;
        TickInput { encoder, tension_raw, current_raw, bus_raw, bridge_fault: false }
    }

    /// One control tick and the time up to the next one.
    pub fn tick(&mut self) -> TickOutput {
        let mut input = self.input();
        if let Some(disturbance) = self.disturbance {
            disturbance(&mut input);
        }
        let output = self.controller.tick(&input, &mut self.queues);
        let period_s = 1.0 / f64::from(self.parameters.tick_rate_hz());
        let steps = (period_s / self.config.stable_step_s()).ceil() as usize;
        let step = StepInput {
            // Without a lead the current ends as it does with the bridge open, within 0.1 ms.
            bridge: BridgeInput {
                // Duties of the legs are (1 + d)/2 and (1 - d)/2.
                duty: match self.leg_at_ground {
                    None => self.duty,
                    Some(0) => -0.5 * (1.0 - self.duty),
                    Some(_) => 0.5 * (1.0 + self.duty),
                },
                bus_v: self.bus_v,
                enabled: self.enabled && !self.lead_open,
            },
            theta_in_rad: 0.0,
            theta_out_rad: 0.0,
            input_torque_nm: 0.0,
            loose_pulley: Outside::NOTHING,
            external_torque_nm: 0.0,
        };
        for _ in 0..steps {
            self.plant.step(&self.config, &step, period_s / steps as f64);
        }
        // The compare registers are preloaded: a duty acts from the next period on. Switching off acts at once.
        let wired = f64::from(self.parameters.bridge.direction);
        self.duty = wired * f64::from(output.duty_raw) / 32767.0;
        self.enabled = output.bridge_on;
        output
    }

    /// From power-on to ready.
    pub fn ready(parameters: Parameters, physics: impl Into<Physics>) -> Self {
        let mut bench = Self::new(parameters, physics);
        bench.run(0.01);
        bench.order(Goal::Ready);
        assert!(bench.reaches(State::Ready, 1.0), "{:?}", bench.controller.fault());
        bench
    }

    pub fn run(&mut self, seconds: f64) {
        let ticks = (seconds * f64::from(self.parameters.tick_rate_hz())) as usize;
        for _ in 0..ticks {
            self.tick();
        }
    }

    pub fn order(&mut self, goal: Goal) {
        self.queues.commands.push_back(Command::Enter(goal));
    }

    pub fn refer(&mut self, reference: Reference) {
        let config = reference_config(&self.parameters, reference).unwrap();
        self.queues.commands.push_back(Command::SetReference(config));
    }

    /// Runs until `state` or for this long; whether it came.
    pub fn reaches(&mut self, state: State, seconds: f64) -> bool {
        let ticks = (seconds * f64::from(self.parameters.tick_rate_hz())) as usize;
        (0..ticks).any(|_| {
            self.tick();
            self.controller.state() == state
        })
    }
}
