//! Benches of other sizes and proportions than the nominal one, each with its own rig file: effects or a law hidden in most, nothing in the rest.

use std::fmt::Write;
use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::Path;

use bowden_core::diagnose::diagnose;
use bowden_core::diagnose::verdict::{Diagnosis, FoundLaw, NamedEffect, Verdict};
use bowden_core::outcome::Failure;
use bowden_core::progress::Quiet;
use bowden_core::rig::Rig;
use bowden_core::study::Study;
use clap::ValueEnum;
use rand_distr::{Distribution, Uniform};
use rand_pcg::Pcg64;
use virtual_bench::{BenchConfig, Case, ConcealedEffect, MotionKind, Size};

use crate::prove::recorded::Recorded;
use crate::prove::true_law::true_law;
use crate::recording_of;

/// Length of the recording that is learned from, and of the one of another motion that judges, s.
const TRAINING_S: f64 = 40.0;
const HELDOUT_S: f64 = 20.0;

/// Standard deviation, in per cent, by which stiffness and pretension of every bench are off its rig file.
const PERTURBED_PERCENT: f64 = 3.0;

/// Benches of a round, and how many of them hide nothing.
pub const ROUND: usize = 12;
const NOTHING: usize = 3;

/// Its limit is set by what the motion of the nominal bench reaches.
const OF_THE_NOMINAL_BENCH: &str = "sensor_saturation";

/// Physics that no catalogue names, each of several kinds.
const UNLISTED: [&str; 4] = ["unlisted_joint", "unlisted_motor", "unlisted_transmission", "unlisted_sensor"];

/// What most benches of a round hide.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Hides {
    /// An effect of the catalogue
    Effect,
    /// Two effects of the catalogue
    Two,
    /// Four effects of the catalogue
    Four,
    /// A law that no catalogue names
    Law,
}

impl Hides {
    /// What a bench of this size hides, by seed, as far as `recorded` shows it: errors of channels that were not recorded are left out.
    fn drawn(self, seed: u64, size: &Size, recorded: Recorded) -> Result<Vec<ConcealedEffect>, Failure> {
        let (mut ids, count): (Vec<&str>, usize) = match self {
            Self::Effect => (listed(), 1),
            Self::Two => (listed(), 2),
            Self::Four => (listed(), 4),
            Self::Law => (UNLISTED.to_vec(), 1),
        };
        let mut random = Pcg64::new(u128::from(seed), 0xBE9C);
        let mut hidden = Vec::new();
        while hidden.len() < count && !ids.is_empty() {
            let id = ids.remove(Uniform::new(0, ids.len()).map_or(0, |uniform| uniform.sample(&mut random)));
            let effect = ConcealedEffect::drawn(id, 1.0, seed).map_err(Failure::failed)?.sized(size);
            let is_unseen =
                channel_of(&effect).is_some_and(|name| recorded.missing().contains(&name.as_str()));
            if !is_unseen {
                hidden.push(effect);
            }
        }
        Ok(hidden)
    }
}

fn listed() -> Vec<&'static str> {
    ConcealedEffect::listed().filter(|id| *id != OF_THE_NOMINAL_BENCH).collect()
}

/// Name of the channel that the effect acts on, if it is one of a sensor.
fn channel_of(effect: &ConcealedEffect) -> Option<String> {
    effect.parameters().get("channel").and_then(|name| name.as_str()).map(str::to_owned)
}

/// The bench at `place` of the round, with what it hides and `recorded` shows.
///
/// # Errors
/// When the virtual bench does not know an effect.
pub fn drawn(hides: Hides, seed: u64, place: usize, recorded: Recorded) -> Result<Case, Failure> {
    let bench = BenchConfig::drawn(seed);
    let is_hiding = place % ROUND < ROUND - NOTHING;
    let hidden = if is_hiding { hides.drawn(seed, &Size::of(&bench), recorded)? } else { Vec::new() };
    Ok(Case::of_bench("bench", bench, hidden, seed, PERTURBED_PERCENT))
}

/// A bench and what a diagnosis says of it.
#[derive(Clone, Debug)]
pub struct Examined {
    /// The bench with what it hides.
    pub case: Case,
    /// What is said.
    pub diagnosis: Diagnosis,
}

/// The recording that is learned from, and that of another motion, which holds everything.
fn recordings(case: &Case, recorded: Recorded) -> Result<[virtual_bench::Recording; 2], Failure> {
    let training = case.train(MotionKind::Lab, TRAINING_S).map_err(Failure::failed)?;
    let training = recorded.of(training, case.seed);
    let heldout = case.heldout(MotionKind::LabHeldout, HELDOUT_S, TRAINING_S).map_err(Failure::failed)?;
    Ok([training, heldout])
}

/// Writes the files of a bench into a folder, which is made: rig file, `train.csv`, `heldout.csv` and `truth.json`.
///
/// # Errors
/// When the bench cannot be simulated or a file cannot be written.
pub fn write(case: &Case, recorded: Recorded, folder: &Path) -> Result<(), Failure> {
    let failed = |error: io::Error| Failure::failed(format!("{}: {error}", folder.display()));
    fs::create_dir_all(folder).map_err(failed)?;
    for (name, text) in [("rig.toml", case.rig_toml()), ("truth.json", case.truth_json())] {
        fs::write(folder.join(name), text).map_err(failed)?;
    }
    for (name, recording) in ["train.csv", "heldout.csv"].iter().zip(recordings(case, recorded)?) {
        let file = File::create(folder.join(name)).map_err(failed)?;
        recording.write_csv(BufWriter::new(file)).map_err(failed)?;
    }
    Ok(())
}

/// Records a bench and diagnoses the recordings.
///
/// # Errors
/// When the bench cannot be simulated, and as [`diagnose`].
pub fn examine(case: Case, recorded: Recorded) -> Result<Examined, Failure> {
    let rig = Rig::parse(&case.rig_toml(), "rig.toml")?;
    let [training, heldout] = recordings(&case, recorded)?.map(|recorded| recording_of(&recorded));
    let study = Study::of_bench(rig, vec![training], vec![heldout]);
    let diagnosis = diagnose(&study, &[], &Quiet)?.findings.diagnosis;
    Ok(Examined { case, diagnosis })
}

/// Whether the named effect is the hidden one, on its channel.
fn names(effect: &NamedEffect, hidden: &ConcealedEffect) -> bool {
    hidden.id() == effect.id && channel_of(hidden) == effect.channel
}

/// Whether the law is the hidden one: where it acts and on what it depends.
fn states(law: &FoundLaw, hidden: &ConcealedEffect) -> bool {
    true_law(hidden).is_some_and(|hidden| {
        law.port == hidden.port && law.channel == hidden.channel && law.variables == [hidden.variable]
    })
}

impl Examined {
    /// What is hidden, in short: a law by where it acts and on what it depends.
    #[must_use]
    pub fn hides(&self) -> String {
        let words = self.case.effects.iter().map(|effect| {
            true_law(effect)
                .map_or_else(|| effect.id().to_owned(), |law| format!("{} of {}", law.port, law.variable))
        });
        if self.case.effects.is_empty() {
            "nothing".to_owned()
        } else {
            words.collect::<Vec<_>>().join(" + ")
        }
    }

    /// Ids of what is hidden, in alphabetical order.
    #[must_use]
    pub fn hidden(&self) -> Vec<&'static str> {
        let mut ids: Vec<&str> = self.case.effects.iter().map(ConcealedEffect::id).collect();
        ids.sort_unstable();
        ids
    }

    /// Whether exactly what is hidden was said, each once, and nothing else: effects by their names, on their channels, a law by where it acts
    /// and on what it depends.
    #[must_use]
    pub fn is_right(&self) -> bool {
        let hidden = &self.case.effects;
        let Diagnosis { effects, laws, verdict, .. } = &self.diagnosis;
        let is_quiet = !hidden.is_empty() || matches!(verdict, Verdict::Consistent | Verdict::Recalibrate);
        let is_said = |hidden: &ConcealedEffect| {
            effects.iter().any(|effect| names(effect, hidden)) || laws.iter().any(|law| states(law, hidden))
        };
        effects.len() + laws.len() == hidden.len() && hidden.iter().all(is_said) && is_quiet
    }

    /// Whether something is named, or a law stated, that the bench does not hide, or does not hide on that channel.
    #[must_use]
    pub fn is_false(&self) -> bool {
        let hidden = &self.case.effects;
        let Diagnosis { effects, laws, .. } = &self.diagnosis;
        effects.iter().any(|effect| !hidden.iter().any(|hidden| names(effect, hidden)))
            || laws.iter().any(|law| !hidden.iter().any(|hidden| states(law, hidden)))
    }

    /// What was said, in short.
    #[must_use]
    pub fn said(&self) -> String {
        let effects = self.diagnosis.effects.iter();
        let mut said: Vec<String> = effects
            .map(|one| {
                let channel =
                    one.channel.as_ref().map_or_else(String::new, |channel| format!(" on {channel}"));
                format!("{}{channel} {:.0} %", one.id, 100.0 * one.probability)
            })
            .collect();
        said.extend(self.diagnosis.laws.iter().map(|law| format!("{} = {}", law.port, law.formula)));
        if said.is_empty() {
            let is_open = self.diagnosis.verdict == Verdict::Unexplained;
            said.push(if is_open { "unexplained" } else { "nothing" }.to_owned());
        }
        said.join(", ")
    }
}

/// Table of a run, and how many are right.
#[must_use]
pub fn table(examined: &[(u64, Examined)]) -> String {
    let mut text = format!(
        "{:>6} {:>5} {:>5} {:>6} {:>6} {:>6}  {:<45} {:<5} {:>12} {:>9}  said\n",
        "seed", "r1 mm", "F0 N", "m kg", "mu K", "EA kN", "hidden", "right", "recalibrated", "diagnosed"
    );
    for (seed, one) in examined {
        let (bench, loss) = (&one.case.nominal, &one.diagnosis.heldout_loss);
        let _ = writeln!(
            text,
            "{seed:>6} {:>5.1} {:>5.1} {:>6.2} {:>6.2} {:>6.1}  {:<45} {:<5} {:>12.2} {:>9.2}  {}",
            1e3 * bench.input_radius_m,
            bench.pretension_n,
            bench.mass_kg,
            bench.friction_coefficient * bench.wrap_angle_rad,
            1e-3 * bench.axial_stiffness_n,
            one.hides(),
            if one.is_right() { "yes" } else { "NO" },
            loss.recalibrated,
            loss.after,
            one.said()
        );
    }
    let right = |hides: bool| {
        let of = examined.iter().map(|(_, one)| one).filter(|one| one.case.effects.is_empty() != hides);
        let (right, all) =
            of.fold((0, 0), |(right, all), one| (right + usize::from(one.is_right()), all + 1));
        format!("{right} of {all}")
    };
    let _ = writeln!(
        text,
        "right: something hidden {}, nothing hidden {}; something false named or stated in {} of {}",
        right(true),
        right(false),
        examined.iter().filter(|(_, one)| one.is_false()).count(),
        examined.len()
    );
    text
}
