//! Where the time of a diagnosis goes: `cargo bench -p bowden-tests --bench diagnosis`.
//!
//! Three rigs of the virtual bench, one that hides nothing, one with an effect of the catalogue and one with physics outside it, are
//! diagnosed from 40 s at 1 kHz on all threads; the table has the time from each stage's begin to that of the next.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use bowden_core::diagnose::diagnose;
use bowden_core::outcome::Failure;
use bowden_core::progress::Progress;
use bowden_core::rig::Rig;
use bowden_core::study::Study;
use bowden_tests::recording_of;
use virtual_bench::{Case, ConcealedEffect, JointLaw, JointSpring, MotionKind, UnlistedJoint};

/// Length of the recordings, s.
const SECONDS: f64 = 40.0;

/// Seed of the benches' deviations from their rig files, and of their noise.
const SEED: u64 = 505;

/// The stages that a diagnosis has begun, and when.
struct Stages(Mutex<Vec<(String, Instant)>>);

impl Progress for Stages {
    fn stage(&self, name: &str, _steps: u64) {
        self.0.lock().expect("no stage panics").push((name.to_owned(), Instant::now()));
    }

    fn advance(&self, _steps: u64) {}
}

fn main() -> Result<(), Failure> {
    let spring = JointSpring { stiffness_nm_per_rad: 0.4, hardening_per_rad2: 0.0, rest_rad: 0.0 };
    let drag = UnlistedJoint { law: JointLaw::SquareDrag, size_nm: 0.08, place: 0.0 };
    println!("{} threads, {SECONDS:.0} s at 1 kHz", rayon::current_num_threads());
    profile("nothing hidden", Vec::new())?;
    profile("joint_spring", vec![spring.into()])?;
    profile("drag with the square of speed", vec![drag.into()])
}

fn profile(name: &str, concealed: Vec<ConcealedEffect>) -> Result<(), Failure> {
    let case = Case::new("case", concealed, SEED, 3.0);
    let recorded = case.train(MotionKind::Lab, SECONDS).expect("the motion suits the bench");
    let rig = Rig::parse(&case.rig_toml(), "rig.toml")?;
    let study = Study::of_bench(rig, vec![recording_of(&recorded)], Vec::new());
    let stages = Stages(Mutex::new(vec![("preparing".to_owned(), Instant::now())]));
    let diagnosed = diagnose(&study, &[], &stages)?;
    let ended = Instant::now();
    let begun = stages.0.into_inner().expect("no stage panics");
    let mut spent: Vec<(&str, Duration)> = Vec::new();
    for (place, (stage, start)) in begun.iter().enumerate() {
        let next = begun.get(place + 1).map_or(ended, |(_, next)| *next);
        match spent.iter_mut().find(|(other, _)| other == stage) {
            Some((_, so_far)) => *so_far += next - *start,
            None => spent.push((stage, next - *start)),
        }
    }
    let total: Duration = spent.iter().map(|(_, time)| *time).sum();
    println!("\n{name}: {}", diagnosed.findings.diagnosis.summary);
    for (stage, time) in spent {
        let share = 100.0 * time.as_secs_f64() / total.as_secs_f64();
        println!("  {stage:<36} {:>6.2} s {share:>3.0} %", time.as_secs_f64());
    }
    println!("  {:<36} {:>6.2} s", "together", total.as_secs_f64());
    Ok(())
}
