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
    Orders, SINE, SteadyJoint, compensator_digest, correction_digest, ripple_table_digest, run,
};
use bowden_control::controller::Controller;
use bowden_control::parameters::Parameters;
use bowden_control::scale::{Angle, Quantity, Speed, Torque};
use bowden_control::tick::{Command, TickInput, TickOutput};
use bowden_control::{reference_config, tick_config};
use bowden_link::State;
use bowden_link::message::{Goal, Mode};

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

/// A controller that runs on [`SteadyJoint`].
struct Bench {
    parameters: Parameters,
    controller: Controller,
    orders: Orders,
    joint: SteadyJoint,
}

impl Bench {
    fn new(source: u8) -> Self {
        let mut parameters = Parameters::default();
        parameters.compensator.source = f32::from(source);
        let Ok(config) = tick_config(&parameters) else { stop() };
        let controller = Controller::new(config);
        Self { parameters, controller, orders: Orders::default(), joint: SteadyJoint::new() }
    }

    /// Self test, pretension check, then the sine.
    fn reach_run(&mut self) {
        self.tick();
        self.orders.command = Some(Command::Enter(Goal::Ready));
        while self.controller.state() != State::Ready {
            self.tick();
            if self.controller.state() == State::Fault {
                stop();
            }
        }
        let Ok(sine) = reference_config(&self.parameters, SINE) else { stop() };
        for command in [Command::SetReference(sine), Command::Enter(Goal::Run(Mode::Position))] {
            self.orders.command = Some(command);
            self.tick();
        }
    }

    fn tick(&mut self) {
        let input = self.joint.input();
        let output = control_tick(&mut self.controller, black_box(&input), &mut self.orders);
        self.joint.follow(&output);
    }

    /// Both compensators on the same inputs: angles within 2 rad, speeds within 2 rad/s, torques within 2 N·m.
    fn count_compensators(&mut self) {
        let Some(fixed) = Compensator::new(&self.parameters) else { stop() };
        let float = FloatCompensator::new(&self.parameters);
        let (mut fixed_state, mut float_state) = (CompensatorState::default(), FloatState::default());
        for _ in 0..CALLS {
            let mut small = || (self.joint.below(1 << 16).cast_signed() << 6) - (1 << 21);
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
