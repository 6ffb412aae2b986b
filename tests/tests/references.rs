//! Random references of the driver board on the virtual bench: each is refused before anything moves, or runs without a slack
//! tendon on a joint that shares no code with the model.

#[path = "../../firmware/control/tests/bench/cases.rs"]
mod cases;

use std::f64::consts::TAU;

use bowden_control::controller::Controller;
use bowden_control::parameters::Parameters;
use bowden_control::tick::{Command, EncoderWord, Queues, TickInput, TickOutput};
use bowden_control::{reference_config, tick_config};
use bowden_link::State;
use bowden_link::message::{Goal, Mode};
use cases::{Case, Random, draw};
use virtual_bench::{BenchConfig, Bridge, Channel, LiveBench};

/// The virtual bench behind the board's converters.
struct Board {
    bench: LiveBench,
    controller: Controller,
    queues: Queues,
    words: [EncoderWord; 2],
    duty: f64,
    parameters: Parameters,
}

impl Board {
    /// A joint with this load that is ready to run.
    fn ready(mass_kg: f64, seed: u64) -> Self {
        let mut parameters = Parameters::default();
        parameters.load.mass = mass_kg as f32;
        let config = BenchConfig { mass_kg, ..BenchConfig::default() };
        let mut board = Self {
            bench: LiveBench::new(&config, &[], seed).unwrap(),
            controller: Controller::new(tick_config(&parameters).unwrap()),
            queues: Queues::default(),
            words: [EncoderWord::default(); 2],
            duty: 0.0,
            parameters,
        };
        board.queues.commands.push_back(Command::Enter(Goal::Ready));
        let ready = (0..5000).any(|_| {
            board.tick();
            board.controller.state() == State::Ready
        });
        assert!(ready, "{:?}", board.controller.fault());
        board
    }

    /// A control tick of 100 µs. A duty acts from the next tick on, as its register is preloaded.
    fn tick(&mut self) -> TickOutput {
        const STEPS: usize = 10;
        let code = |value: f64, zero: f64, gain: f64| (zero + value / gain).round().clamp(0.0, 4095.0) as u16;
        let tension_raw = [Channel::F1, Channel::F2, Channel::F3, Channel::F4]
            .map(|channel| code(self.bench.sensed(channel), 620.5, 0.035_037));
        let current_raw = code(self.bench.sensed(Channel::Current), 2047.5, 0.006_715_5);
        let bus_raw = code(self.bench.supply_v(), 0.0, 0.008_864_5);
        let input = TickInput { encoder: self.words, tension_raw, current_raw, bus_raw, bridge_fault: false };
        let channels = [(Channel::ThetaIn, 1000.0), (Channel::ThetaOut, 2000.0)];
        for (word, (channel, zero)) in self.words.iter_mut().zip(channels) {
            let count = (self.bench.sensed_angle_rad(channel) / TAU * 4096.0 + zero).round() as i64;
            word.frame_raw = bowden_control::conformance::amt22_frame(count.rem_euclid(4096) as u32);
            word.sequence = word.sequence.wrapping_add(1);
        }
        let output = self.controller.tick(&input, &mut self.queues);
        for _ in 0..STEPS {
            self.bench.step(if output.bridge_on { Bridge::Duty(self.duty) } else { Bridge::Open });
        }
        self.duty = f64::from(output.duty_raw) / 32_767.0;
        output
    }

    /// Runs a reference from where the joint is; the lowest true tension, N.
    fn follow(&mut self, case: &Case, seconds: f64) -> f64 {
        self.queues.points = case.points.iter().map(|point| (point * 1_048_576.0) as i32).collect();
        let config = reference_config(&self.parameters, case.reference).unwrap();
        self.queues.commands.push_back(Command::SetReference(config));
        let mut lowest_n = f64::MAX;
        for _ in 0..(seconds * 1e4) as usize {
            self.tick();
            let fault = self.controller.fault();
            assert_eq!(self.controller.state(), State::Run, "{:?}: {fault:?}", case.reference);
            lowest_n = self.bench.tensions_n().into_iter().fold(lowest_n, f64::min);
        }
        lowest_n
    }
}

#[test]
fn random_references_are_refused_or_run_on_another_joint() {
    const SESSIONS: u64 = 40;
    const CASES: usize = 15;
    const SECONDS: f64 = 0.5;
    let mut random = Random(0x5eed_0002);
    let (mut refused, mut reduced, mut ran) = (0, 0, 0);
    let mut lowest_n = f64::MAX;
    for session in 0..SESSIONS {
        let mode = if session % 3 == 2 { Mode::Torque } else { Mode::Position };
        let mut board = Board::ready(random.between(0.1, 3.0), session);
        board.queues.commands.push_back(Command::Enter(Goal::Run(mode)));
        for _ in 0..CASES {
            let Some(case) = draw(&mut random, &board.parameters, mode, SECONDS) else {
                refused += 1;
                continue;
            };
            reduced += usize::from(case.refused);
            ran += 1;
            lowest_n = lowest_n.min(board.follow(&case, SECONDS));
        }
    }
    println!(
        "{refused} refused, {reduced} reduced to what can be done, {ran} ran, lowest tension {lowest_n:.2} N"
    );
    assert!(refused > 60 && reduced > 120 && ran > 400);
    assert!(lowest_n > 1.0, "{lowest_n} N");
}
