//! The control tick against an f32 cascade of position, speed and current loops: prints one line of JSON for each, with its times.
//!
//! The cascade is position (P), speed (PI, filtered speed) and current (PI) with limits and anti-windup, all at every tick, and nothing else: no
//! checks of the encoders, no supervisor, compensator, reference or sample. The control tick has all of these and is fixed-point.

use std::hint::black_box;
use std::time::Instant;

use bowden_control::conformance::{Orders, SINE, SteadyJoint};
use bowden_control::controller::Controller;
use bowden_control::parameters::Parameters;
use bowden_control::tick::{Command, TickOutput};
use bowden_control::{reference_config, tick_config};
use bowden_link::State;
use bowden_link::message::{Goal, Mode};

const TICKS: u32 = 1_000_000;
const REPEATS: usize = 7;
const PERIOD_S: f32 = 1e-4;

/// Proportional and integral gain, and the integral's state.
struct Pi {
    gain: f32,
    gain_per_s: f32,
    limit: f32,
    integral: f32,
}

impl Pi {
    const fn new(gain: f32, gain_per_s: f32, limit: f32) -> Self {
        Self { gain, gain_per_s, limit, integral: 0.0 }
    }

    /// Integrates only while the output is within its limit, or the error leads back into it.
    fn step(&mut self, error: f32) -> f32 {
        let wanted = self.gain.mul_add(error, self.integral);
        let limited = wanted.clamp(-self.limit, self.limit);
        if wanted == limited || error * wanted < 0.0 {
            self.integral += self.gain_per_s * PERIOD_S * error;
        }
        limited
    }
}

struct Cascade {
    angle_rad: f32,
    speed_rad_s: f32,
    speed: Pi,
    current: Pi,
}

impl Cascade {
    const fn new() -> Self {
        Self {
            angle_rad: 0.0,
            speed_rad_s: 0.0,
            speed: Pi::new(0.8, 12.0, 5.0),
            current: Pi::new(1.5, 400.0, 24.0),
        }
    }

    /// Duty from the reference, and from encoder and ADC codes.
    fn step(&mut self, reference_rad: f32, encoder_raw: u16, current_raw: u16, bus_raw: u16) -> f32 {
        const RAD_PER_COUNT: f32 = std::f32::consts::TAU / 4096.0;
        let angle_rad = f32::from(encoder_raw) * RAD_PER_COUNT;
        let speed_rad_s = (angle_rad - self.angle_rad) * PERIOD_S.recip();
        self.angle_rad = angle_rad;
        self.speed_rad_s += 0.05 * (speed_rad_s - self.speed_rad_s);
        let current_a = (f32::from(current_raw) - 2048.0) * 0.01;
        let bus_v = (f32::from(bus_raw) * 0.01).max(1.0);
        let wanted_rad_s = (25.0 * (reference_rad - angle_rad)).clamp(-20.0, 20.0);
        let wanted_a = self.speed.step(wanted_rad_s - self.speed_rad_s);
        let volts = self.current.step(wanted_a - current_a);
        (volts / bus_v).clamp(-1.0, 1.0)
    }
}

/// A controller that runs on [`SteadyJoint`].
struct Bench {
    controller: Controller,
    orders: Orders,
    joint: SteadyJoint,
}

impl Bench {
    /// Self test and pretension check done, in position mode.
    fn running() -> Self {
        let parameters = Parameters::default();
        let config = tick_config(&parameters).expect("default parameters are allowed");
        let mut bench = Self {
            controller: Controller::new(config),
            orders: Orders::default(),
            joint: SteadyJoint::new(),
        };
        bench.tick();
        bench.orders.command = Some(Command::Enter(Goal::Ready));
        for _ in 0..100_000 {
            if bench.controller.state() == State::Ready {
                break;
            }
            bench.tick();
        }
        let sine = reference_config(&parameters, SINE).expect("the sine is within limits");
        for command in [Command::SetReference(sine), Command::Enter(Goal::Run(Mode::Position))] {
            bench.orders.command = Some(command);
            bench.tick();
        }
        bench.assert_runs();
        bench
    }

    fn assert_runs(&self) {
        let state = self.controller.state();
        assert!(state == State::Run, "the controller is in {state:?}: {:?}", self.controller.fault());
    }

    fn tick(&mut self) -> TickOutput {
        let output = self.controller.tick(black_box(&self.joint.input()), &mut self.orders);
        self.joint.follow(&output);
        output
    }
}

fn report(what: &str, mut work: impl FnMut()) {
    work();
    let times: Vec<String> = (0..REPEATS)
        .map(|_| {
            let start = Instant::now();
            work();
            format!("{:.3}", start.elapsed().as_secs_f64() * 1e9 / f64::from(TICKS))
        })
        .collect();
    println!("{{\"tick\": \"{what}\", \"ns\": [{}]}}", times.join(", "));
}

fn main() {
    let mut cascade = Cascade::new();
    report("f32 cascade", || {
        for tick in 0..TICKS {
            let count = ((tick >> 4) & 4095) as u16;
            black_box(cascade.step(black_box(0.5), black_box(count), black_box(2060), black_box(2700)));
        }
    });
    let mut bench = Bench::running();
    report("control tick", || {
        for _ in 0..TICKS {
            black_box(bench.tick());
        }
    });
    bench.assert_runs();
}
