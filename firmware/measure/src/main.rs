//! Control code alone on the processor: no HAL, no interrupts, clocks as after reset, FPU on as cortex-m-rt leaves it.
//!
//! It works through steps and leaves in [`RESULTS`] what somebody who reads the memory wants to know:
//!
//! | word | what |
//! |---|---|
//! | 0 | steps done |
//! | 1 | seed of the digests |
//! | 2, 3 | inputs and digest of `conformance::compensator_digest` |
//! | 4, 5 | ticks and digest of `conformance::run` |
//! | 6, 7, 8 | states and faults (low, high word) that `conformance::run` met |
//! | 9, 10, 11 | ticks and digests of `conformance::correction_digest` and `conformance::ripple_table_digest` |
//!
//! | step | what |
//! |---|---|
//! | 1, 3, 5 | a joint that runs on a sine is made ready: lag angle off, from the torque, from the encoders |
//! | 2, 4, 6 | calls of `compensate`, `compensate_float` and [`control_tick`] on it, to be counted |
//! | 7 | digest over compensator inputs |
//! | 8 | digest over control ticks |
//! | 9 | digests with every correction, and with a ripple table |
//!
//! A pause of 1 ms follows each step, so that whoever counts calls can tell the steps apart.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use bowden_control::compensator::float::{FloatCompensator, FloatInput, FloatState, compensate_float};
use bowden_control::compensator::{Compensator, CompensatorInput, CompensatorState, compensate};
use bowden_control::conformance::{
    amt22_frame, compensator_digest, correction_digest, ripple_table_digest, run,
};
use bowden_control::controller::Controller;
use bowden_control::parameters::Parameters;
use bowden_control::scale::{Angle, Quantity, Speed, Torque};
use bowden_control::tick::{Command, EncoderWord, Inbox, TickInput, TickOutput};
use bowden_control::{reference_config, tick_config};
use bowden_link::State;
use bowden_link::message::{Goal, Mode, Reference, Shape};

/// Seed of the digests.
const SEED: u32 = 20_260;
/// Inputs of the compensator's digest.
const INPUTS: u32 = 1_200_000;
/// Ticks of each configuration in the digest of whole ticks.
const TICKS: u32 = 60_000;
/// The same with corrections.
const CORRECTED_TICKS: u32 = 20_000;
/// Calls that are counted in a step.
const CALLS: u32 = 20_000;
/// 1 ms of the 16 MHz that the processor starts with.
const PAUSE_CYCLES: u32 = 16_000;

/// Results, see the table above.
#[used]
static RESULTS: [AtomicU32; 12] = [const { AtomicU32::new(0) }; 12];

fn tell(word: usize, value: u32) {
    RESULTS[word].store(value, Ordering::SeqCst);
}

fn step_done(step: u32) {
    tell(0, step);
    cortex_m::asm::delay(PAUSE_CYCLES);
}

#[cortex_m_rt::entry]
fn main() -> ! {
    for source in 0..3_u8 {
        let mut bench = Bench::new(source);
        bench.reach_run();
        step_done(2 * u32::from(source) + 1);
        bench.count_compensators();
        for _ in 0..CALLS {
            bench.tick();
        }
        step_done(2 * u32::from(source) + 2);
    }
    tell(1, SEED);
    tell(2, INPUTS);
    tell(3, compensator_digest(SEED, INPUTS));
    step_done(7);
    tell(4, TICKS);
    let outcome = run(SEED, TICKS);
    tell(5, outcome.digest);
    tell(6, u32::from(outcome.states));
    tell(7, outcome.faults as u32);
    tell(8, (outcome.faults >> 32) as u32);
    step_done(8);
    tell(9, CORRECTED_TICKS);
    tell(10, correction_digest(SEED, CORRECTED_TICKS));
    tell(11, ripple_table_digest(SEED, CORRECTED_TICKS));
    step_done(9);
    loop {
        cortex_m::asm::wfi();
    }
}

/// The whole control tick, out of line so that it can be counted.
#[inline(never)]
fn control_tick(controller: &mut Controller, input: &TickInput, orders: &mut Orders) -> TickOutput {
    controller.tick(input, orders)
}

/// At most one command.
struct Orders(Option<Command>);

impl Inbox for Orders {
    fn command<R>(&mut self, act: impl FnOnce(&Command) -> R) -> Option<R> {
        self.0.take().map(|command| act(&command))
    }

    fn stream_point(&mut self) -> Option<i32> {
        None
    }
}

/// A joint whose encoders follow the reference, with tensions and current at rest.
struct Bench {
    parameters: Parameters,
    controller: Controller,
    orders: Orders,
    random: u32,
    sequence: u8,
    reference_raw: i32,
}

impl Bench {
    fn new(source: u8) -> Self {
        let mut parameters = Parameters::default();
        parameters.compensator.source = f32::from(source);
        let Ok(config) = tick_config(&parameters) else { stop() };
        let controller = Controller::new(config);
        Self { parameters, controller, orders: Orders(None), random: 1, sequence: 0, reference_raw: 0 }
    }

    /// 0 to below `range`, at most 2¹⁶.
    fn below(&mut self, range: u32) -> u32 {
        self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((self.random >> 16) * range) >> 16
    }

    /// Self test, pretension check, then a sine of 0.5 rad at 0.2 Hz.
    fn reach_run(&mut self) {
        self.tick();
        self.orders.0 = Some(Command::Enter(Goal::Ready));
        while self.controller.state() != State::Ready {
            self.tick();
            if self.controller.state() == State::Fault {
                stop();
            }
        }
        let sine =
            Reference::Generated { shape: Shape::Sine, amplitude: 0.5, offset: 0.0, frequency_hz: 0.2 };
        let Ok(sine) = reference_config(&self.parameters, sine) else { stop() };
        for command in [Command::SetReference(sine), Command::Enter(Goal::Run(Mode::Position))] {
            self.orders.0 = Some(command);
            self.tick();
        }
    }

    fn tick(&mut self) {
        self.sequence = self.sequence.wrapping_add(1);
        // 4096 counts a turn, the reference in 2⁻²⁰ rad.
        let turned = (i64::from(self.reference_raw) * 652) >> 20;
        let encoder = [1000, 2000].map(|zero| EncoderWord {
            frame_raw: amt22_frame((zero + turned) as u32),
            sequence: self.sequence,
            bus_error: false,
        });
        let input = TickInput {
            encoder,
            // 30 N ± 0.5 N.
            tension_raw: [0; 4].map(|_| (1463 + self.below(28)) as u16),
            current_raw: (2043 + self.below(10)) as u16,
            bus_raw: (2700 + self.below(16)) as u16,
            bridge_fault: false,
        };
        let output = control_tick(&mut self.controller, black_box(&input), &mut self.orders);
        self.reference_raw = output.sample.reference_raw;
    }

    /// Both compensators on the same inputs: angles within 2 rad, speeds within 2 rad/s, torques within 2 N·m.
    fn count_compensators(&mut self) {
        let Some(fixed) = Compensator::new(&self.parameters) else { stop() };
        let float = FloatCompensator::new(&self.parameters);
        let (mut fixed_state, mut float_state) = (CompensatorState::default(), FloatState::default());
        for _ in 0..CALLS {
            let mut small = || (self.below(1 << 16).cast_signed() << 6) - (1 << 21);
            let input = CompensatorInput {
                theta_d: Angle::from_bits(small()),
                omega_d: Speed::from_bits(small()),
                torque_out: Torque::from_bits(small()),
                friction: Angle::from_bits(small()),
                slips: small() > 0,
                lag: Angle::from_bits(small()),
            };
            let float_input = FloatInput {
                theta_d_rad: input.theta_d.to_f32(),
                omega_d_rad_s: input.omega_d.to_f32(),
                torque_out_nm: input.torque_out.to_f32(),
                friction_rad: input.friction.to_f32(),
                slips: input.slips,
                lag_rad: input.lag.to_f32(),
            };
            black_box(compensate(&fixed, &mut fixed_state, black_box(&input)));
            black_box(compensate_float(&float, &mut float_state, black_box(&float_input)));
        }
    }
}

/// Nothing goes on: an undefined instruction, which the emulated board reports.
fn stop() -> ! {
    cortex_m::asm::udf()
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    stop()
}
