//! Motions that tell the parameters of a rig apart: D-optimal among those that the board makes.
//!
//! Every candidate is simulated with the rig; its Fisher information is that of relative changes of the nominal parameters, in units of
//! what the sensors leave. The set with the largest determinant is found by exchanging one motion for another until none gains
//! (Fedorov, Theory of Optimal Experiments, 1972), beginning with the best one after another.

use std::path::Path;

use bowden_control::parameters::{Parameters, Reach};
use bowden_control::reference::oscillator::{ONE, form};
use bowden_core::fit::identifiability::{Information, Sensitivity};
use bowden_core::fit::objective::Objective;
use bowden_core::joint_model::JointModel;
use bowden_core::outcome::Failure;
use bowden_core::recording::Recording;
use bowden_core::rig::Rig;
use bowden_core::simulate::{self, RunOptions};
use bowden_link::message::{Mode, Shape};
use bowden_model::channel::Channel;

use super::plan_file::{Limits, Motion};

/// Motions of an excitation.
const MOTIONS: usize = 3;

/// Shortest one, s.
const LEAST_SECONDS: f64 = 2.0;

/// Amplitudes, of the largest that the joint can do.
const SHARES: [f64; 2] = [1.0, 0.5];

/// Periods within a motion.
const PERIODS: [f64; 2] = [1.0, 4.0];

/// Forms.
const SHAPES: [Shape; 4] = [Shape::Sine, Shape::Triangle, Shape::Multisine, Shape::Staircase];

/// Smallest amplitude that is worth a recording, rad: twenty counts of an encoder.
const LEAST_AMPLITUDE_RAD: f64 = 0.03;

/// Rate of the simulations, Hz.
const RATE_HZ: f64 = 1000.0;

/// Information that is there before any motion: every parameter known to a factor e. It keeps a parameter that no motion shows from
/// deciding.
const BEFORE: f64 = 1.0;

/// A motion and what it would tell.
struct Candidate {
    motion: Motion,
    information: Information,
}

/// The best motions of `seconds` in all for the rig of a file, within the limits of board and plan.
///
/// # Errors
/// Exit status 2: an unusable rig, too little time, or limits that leave no motion.
pub fn choose(
    rig: &Path,
    seconds: f64,
    parameters: &Parameters,
    limits: &Limits,
) -> Result<Vec<Motion>, Failure> {
    let rig = Rig::load(rig)?;
    if rig.joint.motor.is_none() {
        return Err(Failure::bad_input(
            "the rig has no [motor], which a simulation of its motions needs; add it",
        ));
    }
    let each_s = (seconds / MOTIONS as f64 * 10.0).floor() / 10.0;
    if each_s < LEAST_SECONDS {
        let least_s = LEAST_SECONDS * MOTIONS as f64;
        return Err(Failure::bad_input(format!(
            "{seconds} s are too short for {MOTIONS} motions; give {least_s} s or more"
        )));
    }
    let candidates = candidates(&rig, each_s, parameters, limits)?;
    if candidates.is_empty() {
        return Err(Failure::bad_input(
            "the limits leave no motion; raise those of the plan or of the board, or give more seconds",
        ));
    }
    let chosen = best(&candidates);
    Ok(chosen.into_iter().map(|place| candidates[place].motion.clone()).collect())
}

fn candidates(
    rig: &Rig,
    seconds: f64,
    parameters: &Parameters,
    limits: &Limits,
) -> Result<Vec<Candidate>, Failure> {
    let mut candidates = Vec::new();
    for shape in SHAPES {
        for periods in PERIODS {
            // Four digits, downwards: a period less a little, so that the plan reads well.
            let frequency_hz = (periods / seconds * 1e4).floor() * 1e-4;
            for share in SHARES {
                let Some(motion) = largest(shape, frequency_hz, seconds, share, parameters, limits) else {
                    continue;
                };
                candidates.push(Candidate { information: information(rig, &motion)?, motion });
            }
        }
    }
    Ok(candidates)
}

/// The motion with a share of the largest amplitude that the joint can do.
fn largest(
    shape: Shape,
    frequency_hz: f64,
    seconds: f64,
    share: f64,
    parameters: &Parameters,
    limits: &Limits,
) -> Option<Motion> {
    let reach = Reach::new(parameters);
    let motion = |amplitude: f64| Motion {
        mode: Mode::Position,
        shape: Some(shape),
        amplitude,
        offset: 0.0,
        frequency_hz,
        seconds,
        every: 1,
    };
    let can = |amplitude: f64| motion(amplitude).check(parameters, &reach, limits).is_ok();
    if !can(LEAST_AMPLITUDE_RAD) {
        return None;
    }
    let (mut done, mut not) = (LEAST_AMPLITUDE_RAD, f64::from(reach.angle[1].max(-reach.angle[0])));
    for _ in 0..20 {
        let middle = 0.5 * (done + not);
        *(if can(middle) { &mut done } else { &mut not }) = middle;
    }
    // Three digits, downwards, so that the plan reads well and stays within its limits.
    let amplitude = (share * done * 1e3).floor() * 1e-3;
    (amplitude >= LEAST_AMPLITUDE_RAD).then(|| motion(amplitude))
}

/// What a motion would tell of the rig's parameters.
fn information(rig: &Rig, motion: &Motion) -> Result<Information, Failure> {
    let samples = (motion.seconds * RATE_HZ) as usize + 1;
    let t_s: Vec<f64> = (0..samples).map(|sample| sample as f64 / RATE_HZ).collect();
    let shape = motion.shape.unwrap_or(Shape::Sine);
    let angle = |t_s: &f64| {
        // The phase wraps with the period.
        let phase = (t_s * motion.frequency_hz).fract() * 2.0_f64.powi(32);
        motion.offset + motion.amplitude * f64::from(form(shape, phase as u32)) / f64::from(ONE)
    };
    let theta_ref_rad = t_s.iter().map(angle).collect();
    let reference = Recording::new("motion", t_s).with(Channel::ThetaRef, theta_ref_rad);
    let reference = simulate::Reference::of_recording(&reference)?;
    let options = RunOptions { seconds: motion.seconds, rate_hz: RATE_HZ, seed: 1 };
    let recording = simulate::run(rig, &reference, options)?;
    let model = JointModel::from_rig(rig, &recording)?;
    let objective = Objective::new(&model, &[recording], &[], false)?;
    Ok(Sensitivity::of(&objective, &model)?.information())
}

/// Logarithm of the determinant of the information of some candidates.
fn worth(candidates: &[Candidate], chosen: &[usize]) -> f64 {
    Information::log_determinant(chosen.iter().map(|place| &candidates[*place].information), BEFORE)
}

/// Indices of the best set, in their order.
fn best(candidates: &[Candidate]) -> Vec<usize> {
    let count = MOTIONS.min(candidates.len());
    let mut chosen: Vec<usize> = Vec::new();
    let with = |chosen: &[usize], place: usize, other: usize| {
        let mut set = chosen.to_vec();
        if place < set.len() {
            set[place] = other;
        } else {
            set.push(other);
        }
        worth(candidates, &set)
    };
    let free =
        |chosen: &[usize]| (0..candidates.len()).filter(|other| !chosen.contains(other)).collect::<Vec<_>>();
    while chosen.len() < count {
        let next = free(&chosen).into_iter().max_by(|a, b| {
            with(&chosen, chosen.len(), *a).total_cmp(&with(&chosen, chosen.len(), *b)).then(b.cmp(a))
        });
        chosen.extend(next);
    }
    loop {
        let now = worth(candidates, &chosen);
        let exchanges =
            (0..count).flat_map(|place| free(&chosen).into_iter().map(move |other| (place, other)));
        let better = exchanges
            .map(|(place, other)| (with(&chosen, place, other), place, other))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        match better {
            Some((worth, place, other)) if worth > now + 1e-9 => chosen[place] = other,
            _ => break,
        }
    }
    chosen.sort_unstable();
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(information: [[f64; 2]; 2]) -> Candidate {
        let motion = Motion {
            mode: Mode::Position,
            shape: Some(Shape::Sine),
            amplitude: 0.1,
            offset: 0.0,
            frequency_hz: 1.0,
            seconds: 4.0,
            every: 1,
        };
        let names = ["a", "b"].map(str::to_owned).to_vec();
        Candidate {
            motion,
            information: Information { names, matrix: information.map(|row| row.to_vec()).to_vec() },
        }
    }

    #[test]
    fn motions_that_complete_each_other_are_chosen_before_strong_ones_that_are_alike() {
        // Four that tell of a alone, and two weaker ones of b: by hand, a a b has (1 + 200)(1 + 50), a a a has 1 + 300.
        let mut candidates: Vec<Candidate> = (0..4).map(|_| candidate([[100.0, 0.0], [0.0, 0.0]])).collect();
        candidates.extend((0..2).map(|_| candidate([[0.0, 0.0], [0.0, 50.0]])));
        let chosen = best(&candidates);
        assert_eq!(chosen.iter().filter(|place| **place < 4).count(), 2, "{chosen:?}");
        assert!((worth(&candidates, &chosen) - (201.0_f64 * 51.0).ln()).abs() < 1e-12);
    }
}
