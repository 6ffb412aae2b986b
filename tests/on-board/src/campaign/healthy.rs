//! Runs without a fault: what each phase asks of the joint, and how far it is from it then.

use std::collections::HashMap;

use super::case::BENCH_SEEDS;
use super::operator::Look;
use super::phase::Phase;
use super::run::{Run, healthy};
use crate::parallel::in_parallel;
use crate::{Failure, Outcome, fail};

/// Factor on the largest value of the healthy runs of a phase beyond which a run is not harmless \[1\].
pub const FACTOR: f64 = 1.5;
/// A count of an encoder, on top of that for the angle \[rad\].
pub const COUNT_RAD: f64 = std::f64::consts::TAU / 4096.0;

/// What a fault may delay the joint by, for which the healthy runs go on behind the last moment of a fault \[s\].
const DELAY_S: f64 = 0.2;

/// Largest values of the healthy runs of a phase.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Envelope {
    /// Error of the true angle \[rad\].
    pub error_rad: f64,
    /// Tension \[N\].
    pub tension_n: f64,
    /// Motor current \[A\].
    pub current_a: f64,
}

impl Envelope {
    /// Bounds within which a run is harmless.
    #[must_use]
    pub fn bounds(self) -> Self {
        Self {
            error_rad: FACTOR * self.error_rad + COUNT_RAD,
            tension_n: FACTOR * self.tension_n,
            current_a: FACTOR * self.current_a,
        }
    }

    fn widen(&mut self, other: Self) {
        self.error_rad = self.error_rad.max(other.error_rad);
        self.tension_n = self.tension_n.max(other.tension_n);
        self.current_a = self.current_a.max(other.current_a);
    }
}

/// Reference over the time since the bridge closed, one a time that it closed.
#[derive(Debug, Clone, Default)]
struct Legs(HashMap<u64, Vec<(f64, f64)>>);

impl Legs {
    fn of(run: &Run) -> Self {
        let mut legs: HashMap<u64, Vec<(f64, f64)>> = HashMap::new();
        for look in &run.looks {
            if let Ok(at) = run.references.binary_search_by_key(&look.tick, |(tick, _)| *tick) {
                legs.entry(look.leg).or_default().push((look.t_s, run.references[at].1));
            }
        }
        Self(legs)
    }

    /// Reference at the moment of `look` \[rad\]; `None` where the healthy run was not driven.
    fn at(&self, look: &Look) -> Option<f64> {
        let points = self.0.get(&look.leg)?;
        let next = points.partition_point(|(t_s, _)| *t_s < look.t_s);
        let ((before_s, before), (next_s, next)) = (points.get(next.checked_sub(1)?)?, points.get(next)?);
        Some(before + (next - before) * (look.t_s - before_s) / (next_s - before_s))
    }
}

/// All healthy runs of the phases in use.
#[derive(Debug, Default)]
pub struct Healthy {
    envelopes: HashMap<Phase, Envelope>,
    references: HashMap<(Phase, u64), Legs>,
}

impl Healthy {
    /// Makes the runs of these phases.
    ///
    /// # Errors
    /// If one of them does not end with the joint driven.
    pub fn measure(elf: &[u8], flash: &[u8], phases: &[Phase], jobs: usize) -> Outcome<Self> {
        let runs: Vec<(Phase, u64)> =
            phases.iter().flat_map(|phase| BENCH_SEEDS.map(|seed| (*phase, seed))).collect();
        let results = in_parallel(jobs, &runs, |(phase, seed)| {
            healthy(elf, flash, *phase, *seed, phase.instants_s()[1] + DELAY_S)
                .map_err(|Failure(text)| Failure(format!("healthy {phase}, seed {seed}: {text}")))
        })?;
        let mut this = Self::default();
        for ((phase, seed), run) in runs.into_iter().zip(results) {
            let run = run?;
            if !run.drives {
                return fail(format!("healthy {phase}, seed {seed}: the joint is not driven at the end"));
            }
            this.references.insert((phase, seed), Legs::of(&run));
            let seen = Envelope {
                error_rad: this.largest_error_rad(phase, seed, &run, 0.0),
                tension_n: run.peaks.tensions_n.into_iter().fold(0.0, f64::max),
                current_a: run.peaks.current_a,
            };
            this.envelopes.entry(phase).or_default().widen(seen);
        }
        Ok(this)
    }

    /// What the healthy runs of `phase` came to.
    pub fn envelope(&self, phase: Phase) -> Envelope {
        self.envelopes.get(&phase).copied().unwrap_or_default()
    }

    /// Largest error of the true angle from board time `since_s` on against the reference of the healthy run of the same phase and
    /// seed \[rad\]; infinite if the joint was driven where the healthy one was not.
    pub fn largest_error_rad(&self, phase: Phase, seed: u64, run: &Run, since_s: f64) -> f64 {
        let Some(legs) = self.references.get(&(phase, seed)) else { return f64::INFINITY };
        let (mut largest_rad, mut compared, mut driven) = (0.0_f64, 0, 0);
        for look in run.looks.iter().filter(|look| look.at_s >= since_s) {
            driven += 1;
            if let Some(reference_rad) = legs.at(look) {
                largest_rad = largest_rad.max((look.angle_rad - reference_rad).abs());
                compared += 1;
            }
        }
        if 2 * compared < driven { f64::INFINITY } else { largest_rad }
    }

    /// The same while the run goes on, by its looks so far: whether it is off its reference.
    pub fn is_off(&self, phase: Phase, seed: u64, looks: &[Look], since_s: f64) -> bool {
        let Some(legs) = self.references.get(&(phase, seed)) else { return false };
        let bound_rad = self.envelope(phase).bounds().error_rad;
        let mut errors = looks
            .iter()
            .filter(|look| look.at_s >= since_s)
            .filter_map(|look| Some((look.angle_rad - legs.at(look)?).abs()));
        errors.any(|error_rad| error_rad > bound_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_the_factor_and_a_count() {
        let bounds = Envelope { error_rad: 0.01, tension_n: 50.0, current_a: 1.0 }.bounds();
        assert!((bounds.error_rad - 0.016_534).abs() < 1e-6, "{bounds:?}");
        assert_eq!((bounds.tension_n, bounds.current_a), (75.0, 1.5));
    }

    #[test]
    fn a_reference_is_looked_up_by_the_time_since_its_leg_began() {
        let look = |leg, t_s| Look { leg, t_s, tick: 0, at_s: 0.0, angle_rad: 0.0 };
        let legs = Legs(HashMap::from([(2, vec![(0.0, 1.0), (1e-3, 2.0), (2e-3, 4.0)])]));
        assert_eq!(legs.at(&look(2, 1.5e-3)), Some(3.0));
        assert_eq!(legs.at(&look(2, 2.5e-3)), None, "not driven");
        assert_eq!(legs.at(&look(1, 1e-3)), None);
    }
}
