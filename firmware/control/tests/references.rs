//! Random references on the joint of `bowden-model`: each is refused before anything moves, or runs without a slack tendon.

mod bench;
#[path = "bench/cases.rs"]
mod cases;

use bench::{Bench, joint};
use bowden_control::parameters::{Parameters, check_reference};
use bowden_link::State;
use bowden_link::message::{Goal, Mode, Reference, Shape};
use bowden_model::parameters::JointParameters;
use cases::{Random, draw};

/// A joint with this weight, and the parameters that say so.
fn loaded(mass_kg: f64) -> (Parameters, JointParameters) {
    let (mut parameters, mut joint) = (Parameters::default(), joint());
    parameters.load.mass = mass_kg as f32;
    if let Some(load) = &mut joint.load {
        load.mass_kg = mass_kg;
    }
    (parameters, joint)
}

/// Runs `reference` from where the joint is, and returns the lowest tension, N, and the largest reference.
fn follow(bench: &mut Bench, reference: Reference, points: &[f32], seconds: f64) -> (f64, f64) {
    bench.queues.points.clear();
    bench.queues.points.extend(points.iter().map(|point| (point * 1_048_576.0) as i32));
    bench.refer(reference);
    let (mut lowest_n, mut largest) = (f64::MAX, 0.0_f64);
    for _ in 0..(seconds * f64::from(bench.parameters.tick_rate_hz())) as usize {
        let output = bench.tick();
        // By hand from the front end: 0.5 V at 0 N, 23 mV/N.
        let tensions = output.sample.tension_raw.map(|code| (f64::from(code) - 620.5) * 0.035_037);
        lowest_n = tensions.into_iter().fold(lowest_n, f64::min);
        largest = largest.max(f64::from(output.sample.reference_raw).abs() / 1_048_576.0);
        let state = bench.controller.state();
        assert_eq!(state, State::Run, "{reference:?}: {:?}", bench.controller.fault());
    }
    (lowest_n, largest)
}

#[test]
fn random_references_are_refused_or_run() {
    const SESSIONS: usize = 66;
    const CASES: usize = 20;
    const SECONDS: f64 = 0.7;
    let mut random = Random(0x5eed_0001);
    let (mut refused, mut reduced, mut ran) = (0, 0, 0);
    let mut lowest_n = f64::MAX;
    for session in 0..SESSIONS {
        let mode = if session % 3 == 2 { Mode::Torque } else { Mode::Position };
        let (mut parameters, joint) = loaded(random.between(0.1, 3.0));
        parameters.control.rate_divider = [2.0, 1.0, 2.0, 5.0, 2.0, 10.0][session % 6];
        let mut bench = Bench::ready(parameters.clone(), joint);
        bench.order(Goal::Run(mode));
        for _ in 0..CASES {
            let Some(case) = draw(&mut random, &parameters, mode, SECONDS) else {
                refused += 1;
                continue;
            };
            reduced += usize::from(case.refused);
            ran += 1;
            lowest_n = lowest_n.min(follow(&mut bench, case.reference, &case.points, SECONDS).0);
        }
    }
    println!(
        "{refused} refused, {reduced} reduced to what can be done, {ran} ran, lowest tension {lowest_n:.2} N"
    );
    assert!(refused > 50 && reduced > 200 && ran > 600);
    assert!(lowest_n > 0.5, "{lowest_n} N");
}

#[test]
fn every_form_runs_at_its_largest_amplitude() {
    for mode in [Mode::Position, Mode::Torque] {
        for shape in [Shape::Sine, Shape::Triangle, Shape::Multisine, Shape::Staircase] {
            for frequency_hz in [0.5, 2.0] {
                let (parameters, joint) = loaded(2.5);
                let reference =
                    |amplitude| Reference::Generated { shape, amplitude, offset: 0.0, frequency_hz };
                let refused = check_reference(&parameters, mode, reference(99.0)).unwrap_err();
                let largest = refused.maximum;
                println!("{mode:?} {shape:?} {frequency_hz} Hz: {largest}");
                assert_eq!(check_reference(&parameters, mode, reference(0.3)).is_ok(), largest >= 0.3);
                assert!(frequency_hz > 0.5 || largest >= 0.3, "{mode:?} {shape:?}: {largest}");
                let mut bench = Bench::ready(parameters, joint);
                bench.order(Goal::Run(mode));
                follow(&mut bench, reference(largest), &[], 0.5);
                let (_, reached) =
                    follow(&mut bench, reference(largest), &[], 0.5 + 2.0 / f64::from(frequency_hz));
                // The steep parts of a multisine are cut.
                let part = 0.9;
                assert!(
                    reached > part * f64::from(largest),
                    "{mode:?} {shape:?} {frequency_hz} Hz: {reached} of {largest}"
                );
            }
        }
    }
}
