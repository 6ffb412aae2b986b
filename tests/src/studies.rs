//! Studies of three benches of one design: one hides an effect, or two, or all, or none.
//!
//! The benches are a few per cent off the one rig file, each in its own way, and the study says that they have these parameters for themselves.

use std::fmt::Write;

use bowden_core::diagnose::diagnose;
use bowden_core::diagnose::verdict::{Diagnosis, Verdict};
use bowden_core::outcome::Failure;
use bowden_core::progress::Quiet;
use bowden_core::rig::{Rig, RigParameter};
use bowden_core::study::{Bench, Role, Study, StudyRecording};
use rand_distr::{Distribution, Uniform};
use rand_pcg::Pcg64;
use virtual_bench::{Case, ConcealedEffect, MotionKind};

use crate::recording_of;

/// Names of the benches.
pub const BENCHES: [&str; 3] = ["left", "middle", "right"];

/// Length of the recording of each bench, s.
const SECONDS: f64 = 16.0;

/// Standard deviation, in per cent, by which stiffness and pretension of every bench are off the rig file.
const PERTURBED_PERCENT: f64 = 3.0;

/// What every bench has for itself.
const OWN: [&str; 7] = [
    "tendon.axial_stiffness_n",
    "tendon.pretension_n",
    "sheath.friction_coefficient",
    "pulleys.output_radius_m",
    "load.mass_kg",
    "motor.resistance_ohm",
    "motor.torque_constant_nm_per_a",
];

/// On how many of the benches the studies of a round hide their effect.
const HIDDEN_ON: [usize; 12] = [1, 1, 1, 1, 1, 1, 2, 2, 3, 3, 0, 0];

/// Studies of a round.
pub const ROUND: usize = HIDDEN_ON.len();

/// A study with what it hides.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// The study, as its user has it.
    pub study: Study,
    /// Rig file of all benches.
    pub rig_toml: String,
    /// What is hidden, and the bench; none where all benches hide the same.
    pub truth: Vec<(&'static str, Option<&'static str>)>,
}

/// A study of benches that hide these effects, drawn by seed.
///
/// # Errors
/// When a bench cannot be simulated.
pub fn study_of(seed: u64, hidden: [Vec<ConcealedEffect>; 3]) -> Result<(Study, String), Failure> {
    let cases: Vec<Case> = hidden
        .into_iter()
        .zip(3 * seed..)
        .map(|(effects, seed)| Case::new("bench", effects, seed, PERTURBED_PERCENT))
        .collect();
    let rig_toml = cases[0].rig_toml();
    let rig = Rig::parse(&rig_toml, "rig.toml")?;
    let own: Result<Vec<RigParameter>, String> = OWN.iter().map(|name| RigParameter::parse(name)).collect();
    let own = own.map_err(Failure::failed)?;
    let benches = BENCHES.map(|name| Bench { name: name.to_owned(), rig: rig.clone(), own: own.clone() });
    let recorded = |(bench, case): (usize, &Case)| {
        let recording = recording_of(&case.train(MotionKind::Lab, SECONDS).map_err(Failure::failed)?);
        Ok(StudyRecording { recording, bench, role: Role::Training, set: Vec::new() })
    };
    let recordings: Result<_, Failure> = cases.iter().enumerate().map(recorded).collect();
    let name = "three benches".to_owned();
    Ok((Study { name, benches: benches.to_vec(), recordings: recordings? }, rig_toml))
}

/// The study at `place` of a round, drawn by seed.
///
/// # Errors
/// When a bench cannot be simulated.
pub fn drawn(seed: u64, place: usize) -> Result<Drawn, Failure> {
    let mut random = Pcg64::new(u128::from(seed), 0x57D1);
    let mut below = |count: usize| Uniform::new(0, count).map_or(0, |uniform| uniform.sample(&mut random));
    let listed: Vec<&'static str> = ConcealedEffect::listed().collect();
    let id = listed[below(listed.len())];
    let (count, first) = (HIDDEN_ON[place % ROUND], below(BENCHES.len()));
    let mut hidden: [Vec<ConcealedEffect>; 3] = Default::default();
    let mut truth = Vec::new();
    for further in 0..count {
        let bench = (first + further) % BENCHES.len();
        // What all benches have is of their design, and the same.
        let of_bench = if count == BENCHES.len() { 0 } else { bench as u64 };
        let effect = ConcealedEffect::drawn(id, 1.0, seed + 1000 * of_bench);
        hidden[bench].push(effect.map_err(Failure::failed)?);
        truth.push((id, Some(BENCHES[bench])));
    }
    if count == BENCHES.len() {
        truth = vec![(id, None)];
    }
    let (study, rig_toml) = study_of(seed, hidden)?;
    Ok(Drawn { study, rig_toml, truth })
}

/// A study and what a diagnosis says of it.
#[derive(Clone, Debug)]
pub struct Examined {
    /// What is hidden.
    pub truth: Vec<(&'static str, Option<&'static str>)>,
    /// What is said.
    pub diagnosis: Diagnosis,
}

/// Diagnoses a study.
///
/// # Errors
/// As [`diagnose`].
pub fn examine(drawn: &Drawn) -> Result<Examined, Failure> {
    let diagnosis = diagnose(&drawn.study, &[], &Quiet)?.findings.diagnosis;
    Ok(Examined { truth: drawn.truth.clone(), diagnosis })
}

impl Examined {
    fn named(&self) -> Vec<(&str, Option<&str>)> {
        let named = self.diagnosis.effects.iter().map(|effect| (effect.id.as_str(), effect.bench.as_deref()));
        let mut named: Vec<_> = named.collect();
        named.sort_unstable();
        named
    }

    /// Whether exactly what is hidden was named, each on its bench, and nothing else stated.
    #[must_use]
    pub fn is_right(&self) -> bool {
        let mut truth = self.truth.clone();
        truth.sort_unstable();
        let is_quiet =
            !truth.is_empty() || matches!(self.diagnosis.verdict, Verdict::Consistent | Verdict::Recalibrate);
        self.named() == truth && self.diagnosis.laws.is_empty() && is_quiet
    }

    /// Whether something is named that no bench hides.
    #[must_use]
    pub fn is_false(&self) -> bool {
        self.named().iter().any(|(id, _)| self.truth.iter().all(|(hidden, _)| hidden != id))
    }

    /// What was said, in short.
    #[must_use]
    pub fn said(&self) -> String {
        let on = |bench: Option<&str>| bench.map_or_else(String::new, |bench| format!(" ({bench})"));
        let mut said: Vec<String> = self
            .diagnosis
            .effects
            .iter()
            .map(|one| format!("{}{} {:.0} %", one.id, on(one.bench.as_deref()), 100.0 * one.probability))
            .collect();
        let laws = self.diagnosis.laws.iter();
        said.extend(laws.map(|law| format!("{} = {}{}", law.port, law.formula, on(law.bench.as_deref()))));
        if said.is_empty() {
            said.push(
                if self.diagnosis.verdict == Verdict::Unexplained { "unexplained" } else { "nothing" }
                    .to_owned(),
            );
        }
        said.join(", ")
    }
}

/// Table of a run, and how many are right.
#[must_use]
pub fn table(examined: &[(u64, Examined)]) -> String {
    let mut text = format!(
        "{:>6}  {:<46} {:<5} {:>12} {:>9}  said\n",
        "seed", "hidden", "right", "recalibrated", "diagnosed"
    );
    for (seed, one) in examined {
        let benches: Vec<&str> = one.truth.iter().map(|(_, bench)| bench.unwrap_or("all")).collect();
        let hidden = one
            .truth
            .first()
            .map_or_else(|| "nothing".to_owned(), |(id, _)| format!("{id} ({})", benches.join(", ")));
        let loss = &one.diagnosis.heldout_loss;
        let _ = writeln!(
            text,
            "{seed:>6}  {hidden:<46} {:<5} {:>12.2} {:>9.2}  {}",
            if one.is_right() { "yes" } else { "NO" },
            loss.recalibrated,
            loss.after,
            one.said()
        );
    }
    let right = |count: usize| {
        let benches = |one: &Examined| match one.truth[..] {
            [(_, None)] => BENCHES.len(),
            ref some => some.len(),
        };
        let of: Vec<&Examined> =
            examined.iter().map(|(_, one)| one).filter(|one| benches(one) == count).collect();
        format!("{} of {}", of.iter().filter(|one| one.is_right()).count(), of.len())
    };
    let _ = writeln!(
        text,
        "right: on one bench {}, on two {}, on all {}, nothing hidden {}; something false named in {} of {}",
        right(1),
        right(2),
        right(3),
        right(0),
        examined.iter().filter(|(_, one)| one.is_false()).count(),
        examined.len()
    );
    text
}
