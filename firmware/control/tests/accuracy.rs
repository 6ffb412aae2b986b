//! Fixed point against f64: the equations of `bowden-model`, and the steps around them. Limits come from the roundings.

use bowden_control::compensator::float::{FloatCompensator, FloatInput, FloatState, compensate_float};
use bowden_control::compensator::{Compensator, CompensatorInput, CompensatorState, LagAngles, compensate};
use bowden_control::parameters::Parameters;
use bowden_control::scale::{Angle, Quantity, Speed, Torque};
use bowden_model::paper::{
    CompensatorConfig, CompensatorState as ReferenceState, Direction, LagSource, LoopTorque, TendonPair,
    displacement_transmission,
};
use bowden_model::parameters::{PulleyParameters, SheathParameters, TendonParameters};

/// 2⁻²⁰.
const STEP: f64 = 1.0 / (1 << 20) as f64;

struct Random(u64);

impl Random {
    /// 0 to 1.
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// Maximum, RMS and mean of errors.
#[derive(Default, Debug)]
struct Errors {
    count: f64,
    sum: f64,
    squares: f64,
    largest: f64,
}

impl Errors {
    fn add(&mut self, error: f64) {
        self.count += 1.0;
        self.sum += error;
        self.squares += error * error;
        self.largest = self.largest.max(error.abs());
    }

    fn rms(&self) -> f64 {
        (self.squares / self.count).sqrt()
    }

    fn bias(&self) -> f64 {
        self.sum / self.count
    }
}

/// A pair within everything that is built: a = mu K up to 2, radii 8 to 30 mm, stretch up to 4 mm.
fn random_parameters(random: &mut Random, source: f32) -> Parameters {
    let mut parameters = Parameters::default();
    let draw = |random: &mut Random, low, high| random.between(low, high) as f32;
    parameters.pulley.input_radius = draw(random, 0.008, 0.03);
    parameters.pulley.output_radius = draw(random, 0.008, 0.03);
    parameters.tendon.length = draw(random, 0.2, 3.0);
    parameters.tendon.axial_stiffness = draw(random, 2e4, 2e5);
    parameters.tendon.pretension = draw(random, 5.0, 80.0);
    parameters.sheath.friction_coefficient = draw(random, 0.0, 0.3);
    parameters.sheath.wrap_angle = draw(random, 0.0, 6.5);
    parameters.compensator.source = source;
    // Filters and limits as open as they go, so that the equations stand alone.
    parameters.compensator.rate_limit = 100.0;
    parameters.compensator.size_limit = 1.0;
    parameters.compensator.torque_filter = 1e-4;
    parameters.compensator.encoder_time = 0.01;
    parameters
}

fn pair(parameters: &Parameters) -> TendonPair {
    TendonPair::uniform(
        &PulleyParameters {
            input_radius_m: f64::from(parameters.pulley.input_radius),
            output_radius_m: f64::from(parameters.pulley.output_radius),
        },
        &TendonParameters {
            length_m: f64::from(parameters.tendon.length),
            axial_stiffness_n: f64::from(parameters.tendon.axial_stiffness),
            pretension_n: f64::from(parameters.tendon.pretension),
        },
        &SheathParameters {
            wrap_angle_rad: f64::from(parameters.sheath.wrap_angle),
            friction_coefficient: f64::from(parameters.sheath.friction_coefficient),
        },
    )
    .unwrap()
}

#[test]
fn angles_match_the_reference() {
    // Six to eight f32 operations of 6e-8 each, and tanh within 2 of them: below 1e-6.
    let mut random = Random(3);
    for n in 0..2000 {
        let mut parameters = random_parameters(&mut random, 1.0);
        if n % 10 == 0 {
            parameters.sheath.friction_coefficient = 0.0;
        }
        let angles = LagAngles::new(&parameters);
        let pair = pair(&parameters);
        let ratio = pair.output_radius_m() / pair.input_radius_m();
        let lag = |torque_nm| {
            ratio
                * displacement_transmission::lag_angle_rad(
                    &pair,
                    Direction::Positive,
                    LoopTorque::Output(torque_nm),
                )
        };
        let (friction, stretch) = (lag(0.0), lag(1.0) - lag(0.0));
        let close =
            |got: f32, expected: f64| (f64::from(got) - expected).abs() <= 1e-6 * expected.abs() + 1e-12;
        assert!(close(angles.friction_rad, friction), "{} for {friction}", angles.friction_rad);
        assert!(close(angles.stretch_rad_per_nm, stretch), "{} for {stretch}", angles.stretch_rad_per_nm);
    }
}

/// Roundings of `theta_c` in steps of 2⁻²⁰ rad: `theta_d` by r2/r1 0.5, torque by the stretch 0.5, the friction angle 0.5, and
/// 0.03 from the low-pass that rounds down (1 step of torque at up to 0.5 rad/(N·m) adds 0.5 in the stiffest of the drawn pairs);
/// the f32 gains add 6e-8 of 2 rad, 0.13, and 1e-6 of the lag. Sum 2.2. Each rounding spreads evenly: RMS √(4/12)
/// = 0.58, so 0.7. Rounding is half up, the low-pass down: bias -0.25 at most.
#[test]
fn errors_against_f64() {
    let mut random = Random(1);
    let mut errors = Errors::default();
    for _ in 0..300 {
        let parameters = random_parameters(&mut random, 1.0);
        let config = Compensator::new(&parameters).unwrap();
        let reference = CompensatorConfig::new(pair(&parameters), 0.0).unwrap();
        for _ in 0..10 {
            let direction = if random.unit() < 0.5 { -1.0 } else { 1.0 };
            let input = CompensatorInput {
                theta_d: Angle::from_f32(random.between(-2.0, 2.0) as f32),
                omega_d: Speed::from_f32((direction * random.between(0.01, 3.0)) as f32),
                torque_out: Torque::from_f32(random.between(-0.5, 0.5) as f32),
                friction: Angle::from_f32(LagAngles::new(&parameters).friction_rad),
                ..CompensatorInput::default()
            };
            let mut state = CompensatorState::default();
            let mut got = compensate(&config, &mut state, &input);
            // A weight of 1/2 a tick and 0.01 rad a tick: settled after 40.
            for _ in 0..200 {
                got = compensate(&config, &mut state, &input);
            }
            let value = |bits: i32| f64::from(bits) * STEP;
            let torque = LoopTorque::Output(value(input.torque_out.to_bits()));
            let expected = ReferenceState::new()
                .step(
                    &reference,
                    value(input.theta_d.to_bits()),
                    value(input.omega_d.to_bits()),
                    LagSource::Torque(torque),
                )
                .unwrap();
            if expected.theta_f_rad.abs() < 0.99 {
                errors.add(value(got.theta_c.to_bits()) / STEP - expected.theta_c_rad / STEP);
            }
        }
    }
    println!("slip: {errors:?} rms {} bias {}", errors.rms(), errors.bias());
    assert!(errors.count > 2500.0);
    assert!(errors.largest < 2.2 && errors.largest > 0.5, "{errors:?}");
    assert!(errors.rms() < 0.7, "{}", errors.rms());
    assert!(errors.bias().abs() < 0.25, "{}", errors.bias());
}

/// With both encoders the state follows the measured lag; settled it is Eq. (22) of the last angles. Roundings: 0.5 each
/// of `theta_d` and `theta_out`, one down of the sum, f32 ratio 0.13 twice.
#[test]
fn encoder_source_settles_at_the_measured_lag() {
    let mut random = Random(5);
    let mut errors = Errors::default();
    for _ in 0..100 {
        let parameters = random_parameters(&mut random, 2.0);
        let config = Compensator::new(&parameters).unwrap();
        let reference = CompensatorConfig::new(pair(&parameters), 0.0).unwrap();
        let ratio = f64::from(parameters.pulley.output_radius) / f64::from(parameters.pulley.input_radius);
        let theta_out = random.between(-1.0, 1.0);
        let theta_in = Angle::from_f32((ratio * theta_out + random.between(-0.1, 0.1)) as f32);
        let theta_out = Angle::from_f32(theta_out as f32);
        let input = CompensatorInput {
            theta_d: theta_out,
            omega_d: Speed::from_f32(0.5),
            torque_out: Torque::ZERO,
            friction: Angle::ZERO,
            slips: true,
            lag: theta_in.minus(config.at_input(theta_out)),
        };
        let mut state = CompensatorState::default();
        let mut got = compensate(&config, &mut state, &input);
        // 0.01 s are 100 ticks; e^-30 of 0.1 rad is nothing.
        for _ in 0..3000 {
            got = compensate(&config, &mut state, &input);
        }
        let value = |angle: Angle| f64::from(angle.to_bits()) * STEP;
        let lag = LagSource::Encoders { theta_in_rad: value(theta_in), theta_out_rad: value(theta_out) };
        let expected = ReferenceState::new().step(&reference, value(input.theta_d), 0.5, lag).unwrap();
        errors.add((value(got.theta_c) - expected.theta_c_rad) / STEP);
    }
    assert!(errors.largest < 2.3 && errors.rms() < 1.0, "{errors:?}");
}

/// A run of 3 s with turns, standstill, noise, rate and size limits: fixed point and f32 against the same steps in f64. The
/// sums do not drift: low-passes forget, and their 31 bits below a step round by 2⁻³¹ of one.
#[test]
fn a_run_stays_with_its_f64_twin() {
    let mut random = Random(9);
    let mut parameters = Parameters::default();
    parameters.compensator.size_limit = 0.018;
    let config = Compensator::new(&parameters).unwrap();
    let float = FloatCompensator::new(&parameters);
    let (mut state, mut float_state) = (CompensatorState::default(), FloatState::default());
    let pair = pair(&parameters);
    let (mut torque_nm, mut target_rad, mut theta_f_rad) = (0.0_f64, 0.0_f64, 0.0_f64);
    let (mut fixed_errors, mut float_errors) = (Errors::default(), Errors::default());
    let (mut limited, mut stood) = (0, 0);
    for n in 0..30_000 {
        let t_s = f64::from(n) * 1e-4;
        // Stands from 1.0 to 1.5 s.
        let moving = !(1.0..1.5).contains(&t_s);
        let phase = 2.0 * std::f64::consts::PI * 0.7 * t_s;
        let omega = if moving { 0.5 * 4.4 * phase.cos() } else { 0.0 };
        let input = CompensatorInput {
            theta_d: Angle::from_f32((0.5 * phase.sin()) as f32),
            omega_d: Speed::from_f32(omega as f32),
            torque_out: Torque::from_f32((0.6 * phase.sin() + random.between(-0.01, 0.01)) as f32),
            friction: Angle::from_f32(LagAngles::new(&parameters).friction_rad),
            ..CompensatorInput::default()
        };
        let got = compensate(&config, &mut state, &input);
        let in_f32 = compensate_float(
            &float,
            &mut float_state,
            &FloatInput {
                theta_d_rad: input.theta_d.to_f32(),
                omega_d_rad_s: input.omega_d.to_f32(),
                torque_out_nm: input.torque_out.to_f32(),
                friction_rad: input.friction.to_f32(),
                ..FloatInput::default()
            },
        );
        limited += usize::from(got.limited);
        let value = |bits: i32| f64::from(bits) * STEP;
        torque_nm += 1e-4 / 0.0501 * (value(input.torque_out.to_bits()) - torque_nm);
        let omega = value(input.omega_d.to_bits());
        let direction = Direction::of_speed(omega).filter(|_| omega.abs() > 0.002);
        match direction {
            Some(direction) => {
                let torque = LoopTorque::Output(torque_nm);
                target_rad = displacement_transmission::lag_angle_rad(&pair, direction, torque);
            }
            None => stood += 1,
        }
        // The limits are whole steps: 0.018 rad are 18 874.4, 1e-4 rad a tick are 104.9.
        let (size_rad, rate_rad) = (18_874.0 * STEP, 105.0 * STEP);
        theta_f_rad += (target_rad.clamp(-size_rad, size_rad) - theta_f_rad).clamp(-rate_rad, rate_rad);
        let expected = value(input.theta_d.to_bits()) + theta_f_rad;
        fixed_errors.add((value(got.theta_c.to_bits()) - expected) / STEP);
        float_errors.add((f64::from(in_f32) - expected) / STEP);
    }
    println!("run: fixed {fixed_errors:?} rms {} bias {}", fixed_errors.rms(), fixed_errors.bias());
    println!("run: f32 {float_errors:?} rms {} bias {}", float_errors.rms(), float_errors.bias());
    assert!(limited > 1000 && stood >= 5000, "{limited} ticks limited, {stood} at rest");
    // As in slip, without the roundings of r2/r1 = 1: 1.6 at most.
    assert!(fixed_errors.largest < 1.6 && fixed_errors.rms() < 0.7, "{fixed_errors:?}");
    assert!(fixed_errors.bias().abs() < 0.25, "{fixed_errors:?}");
    // The f32 twin is limited at 104.86 steps a tick: 0.14 ahead for each of the 360 ticks of a full swing.
    assert!(float_errors.largest < 55.0, "{float_errors:?}");
}

#[test]
fn extremes_saturate() {
    for source in [0.0, 1.0, 2.0] {
        let mut parameters = Parameters::default();
        parameters.compensator.source = source;
        parameters.pulley.output_radius = 1.0;
        let config = Compensator::new(&parameters).unwrap();
        for theta in [i32::MIN, -1, 0, i32::MAX] {
            for omega in [i32::MIN, 0, i32::MAX] {
                for torque in [i32::MIN, i32::MAX] {
                    let input = CompensatorInput {
                        theta_d: Angle::from_bits(theta),
                        omega_d: Speed::from_bits(omega),
                        torque_out: Torque::from_bits(torque),
                        friction: Angle::from_bits(omega),
                        slips: omega > 0,
                        lag: Angle::from_bits(torque).minus(config.at_input(Angle::from_bits(theta))),
                    };
                    let mut state = CompensatorState::starting_at(&config, &input);
                    let mut got = compensate(&config, &mut state, &input);
                    for _ in 0..5 {
                        got = compensate(&config, &mut state, &input);
                    }
                    // 66.7 times ±2048 rad is beyond the range, and what is there has the right sign.
                    match theta {
                        i32::MIN => assert!(got.theta_c.to_f32() < -2047.0),
                        i32::MAX => assert!(got.theta_c.to_f32() > 2047.0),
                        _ => assert!(got.theta_c.to_f32().abs() < 0.1),
                    }
                    assert!(got.theta_f.to_f32().abs() < 0.060_001);
                }
            }
        }
    }
}
