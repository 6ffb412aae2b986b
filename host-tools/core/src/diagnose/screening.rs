//! Which candidates are worth a fit: each is simulated at its starting points, and what a recalibration could still take
//! off the difference is projected out with the slopes of the present model.
//!
//! With residuals `r` of the present model, slopes `J` over its parameters and residuals `r_c` of a candidate, the loss
//! after a refit is estimated as `min_b |P (r + b (r_c - r))|²` with the projection `P = 1 - J (JᵀJ)⁻¹ Jᵀ`: exact for an
//! effect that enters linearly, a ranking for the others; those that it ranks first are simulated at their estimated strength.
//!
//! Of a guided motor the first pass of the replay tells what changes, in half the time. Those that rank first by that are judged again by
//! whole replays.
//!
//! Where a parameter has taken the place of what is missing, as a weight that of a spring, most of what the effect changes is
//! what parameters change too; the little by which the two differ is lost in the curvature of so long a way. Such a start is
//! simulated again with the parameters where the slopes would put them, and once more from there if that was better. Those that
//! rank first start from such parameters wherever they predict better.

mod moments;
mod phases;

use bowden_model::effect::{ActiveEffect, Component};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::candidates::Candidate;
use super::layout::Layout;
use super::onset::moment_of;
use crate::fit::objective::{Objective, Part, Residuals};
use crate::fit::solver::{Solution, training_rows};
use crate::joint_model::JointModel;
use crate::progress::Progress;
use crate::simulation::{Passes, Prediction};
use moments::{Comparison, Span};

/// Times the length of the recordings before which something has set in that has always been there: what comes on in a tenth of its
/// time is there then.
const LONG_SINCE: f64 = 10.0;

/// Part of its time in which something fades that ends.
const FADES: f64 = 0.1;

/// Candidates whose estimated strength is simulated, of those that the estimate ranks first.
const VERIFIED: usize = 10;

/// Candidates that are judged by whole replays, of those that first passes rank first.
const JUDGED_AGAIN: usize = 20;

/// Part of a promising gain that a candidate shows in first passes at least to be judged again.
const NEARLY: f64 = 0.3;

/// Strength, in starting strengths, below which the linear estimate is not followed, on either side for what has either
/// sign: such an effect is hardly there.
const WEAKEST: f64 = 0.15;

/// Strength, in starting strengths, up to which the linear estimate is followed.
const STRONGEST: f64 = 3.0;

/// Times that a start is made that much stronger.
const STRENGTHENED: usize = 8;

/// Share of what an estimate promises below which half of the strength that it asks for is tried too: a loss that does not grow with the
/// square of large differences makes what changes them look weak.
const KEPT_OF_PROMISE: f64 = 0.5;

/// Share of what an effect changes that parameters change as well, from which on it is tried where they make room for it.
const IN_PLACE_OF: f64 = 0.5;

/// Farthest that a parameter makes room, in the optimiser's coordinate: a factor of two.
const ROOM: f64 = 0.7;

/// Times that they are asked to; the slopes are those of the present model.
const ROOM_ROUNDS: usize = 2;

/// A candidate after screening.
#[derive(Clone, Debug)]
pub struct Screened {
    /// The effect at its best starting point.
    pub start: ActiveEffect,
    /// Estimated share of the present loss that it would take off.
    pub gain: f64,
    /// Share of the present loss where it acts: less than 1 for an effect of one bench of several.
    pub weight: f64,
    /// Present model without the effect, with parameters that make room for it; `None` for those that it has.
    pub room: Option<JointModel>,
}

impl Screened {
    fn at(start: ActiveEffect, gain: f64, weight: f64) -> Self {
        Self { start, gain, weight, room: None }
    }

    /// Estimated share of the loss that it would take off where it acts.
    #[must_use]
    pub fn gain_there(&self) -> f64 {
        self.gain / self.weight
    }
}

/// A starting point that was simulated, and what follows from it for another strength.
struct Judged {
    start: Screened,
    linear: Option<Screened>,
}

impl Judged {
    fn best(&self) -> &Screened {
        self.linear.as_ref().filter(|linear| linear.gain > self.start.gain).unwrap_or(&self.start)
    }
}

/// What candidates are judged against.
pub struct Present<'a> {
    /// What the rig states.
    pub believed: &'a JointModel,
    /// Model so far, fitted.
    pub solution: &'a Solution,
    /// Whose its effects are.
    pub layout: &'a Layout,
    /// What it predicts.
    pub predictions: &'a [Prediction],
}

/// Ranks candidates, best first; a gain is asked of them that is above `promising` where they act.
#[must_use]
pub fn screen(
    objective: &Objective,
    present: &Present<'_>,
    candidates: &[Candidate],
    promising: f64,
    progress: &dyn Progress,
) -> Vec<Screened> {
    let [objective, _] = &objective.split();
    let basis = Basis::new(&present.solution.slopes().jacobian);
    let rows_now = rows(objective, &present.solution.residuals);
    let now = basis.without(&rows_now);
    let model = &present.solution.model;
    let missing_in = |passes: Passes| {
        let seen = objective.residuals_in(passes, model).ok().filter(Residuals::is_finite)?;
        Some(&rows_now - rows(objective, &seen))
    };
    let missing = Passes::are_two(model)
        .then(|| Some(Missing { first: missing_in(Passes::First)?, rough: missing_in(Passes::Rough)? }))
        .flatten();
    let loss_now = now.norm_squared();
    let background = Background { objective, present, basis, missing, rows_now, now, loss_now };
    let starts: Vec<(usize, &[ActiveEffect])> = candidates
        .iter()
        .enumerate()
        .flat_map(|(c, candidate)| phases::grouped(&candidate.starts).map(move |starts| (c, starts)))
        .collect();
    let judged: Vec<(usize, Option<Judged>)> = starts
        .par_iter()
        .map(|(candidate, starts)| {
            let judged = match starts {
                _ if progress.interrupted() => None,
                [start] => background.judge_at_moments(*start).or_else(|| background.judge(*start)),
                phases => background.judge_wave(phases, promising),
            };
            progress.advance(starts.len() as u64);
            (*candidate, judged)
        })
        .collect();
    let mut best: Vec<Option<Judged>> = candidates.iter().map(|_| None).collect();
    for (candidate, judged) in judged {
        if let Some(judged) = judged
            && best[candidate].as_ref().is_none_or(|b| judged.best().gain > b.best().gain)
        {
            best[candidate] = Some(judged);
        }
    }
    let mut ranked: Vec<Judged> = best.into_iter().flatten().collect();
    ranked.sort_by(|a, b| b.best().gain.total_cmp(&a.best().gain));
    let is_rough = background.missing.is_some();
    let background = Background { missing: None, ..background };
    if is_rough {
        let nearly = |judged: &&Judged| judged.best().gain_there() > NEARLY * promising;
        let again = ranked.iter().take(JUDGED_AGAIN).take_while(nearly).count();
        ranked[..again].par_iter_mut().for_each(|judged| {
            if !progress.interrupted()
                && let Some(whole) = background.judge_again(judged)
            {
                *judged = whole;
            }
        });
        ranked.sort_by(|a, b| b.best().gain.total_cmp(&a.best().gain));
    }
    let mut screened: Vec<Screened> = ranked
        .into_par_iter()
        .enumerate()
        .map(|(place, judged)| {
            let best = match &judged.linear {
                Some(linear) if place < VERIFIED && linear.gain > judged.start.gain => {
                    background.stronger(judged)
                }
                _ => judged.best().clone(),
            };
            if place < VERIFIED && best.room.is_none() {
                background.with_room(&best).map_or(best, |(with_room, _)| with_room)
            } else {
                best
            }
        })
        .collect();
    screened.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    screened
}

/// What rows of first passes lack to those of whole replays, as the present model shows it.
struct Missing {
    first: DVector<f64>,
    rough: DVector<f64>,
}

impl Missing {
    /// What is enough to rank a start, and what lacks there. What happens at a moment shows in few residuals.
    fn of(&self, start: &ActiveEffect) -> (Passes, &DVector<f64>) {
        if moment_of(start).is_some() { (Passes::First, &self.first) } else { (Passes::Rough, &self.rough) }
    }
}

/// What every start is compared with.
struct Background<'a> {
    objective: &'a Objective,
    present: &'a Present<'a>,
    basis: Basis,
    /// `None` where replays are simulated whole.
    missing: Option<Missing>,
    /// Residuals of the present model.
    rows_now: DVector<f64>,
    /// What the present parameters cannot take off.
    now: DVector<f64>,
    loss_now: f64,
}

impl Background<'_> {
    /// An effect that sets in at a moment, at the best of the moments that tell most of it: what is simulated there says which, with
    /// parameters that make room for it. `None` for one that has no moment, or whose moments tell nothing.
    ///
    /// A moment at which nothing happened is promised much too where the parameters have taken the place of the change, and no
    /// simulation keeps that.
    fn judge_at_moments(&self, base: ActiveEffect) -> Option<Judged> {
        let judged = self.moments(base).into_iter().filter_map(|start| {
            let judged = self.judge(start)?;
            let (start, loss) = self.with_room(&judged.start)?;
            Some((loss, Judged { start, ..judged }))
        });
        judged.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, judged)| judged)
    }

    /// Starts of an effect at the moments that tell most of it.
    fn moments(&self, base: ActiveEffect) -> Vec<ActiveEffect> {
        let descriptor = base.descriptor();
        let (Some(onset), Some(neutral)) = (moment_of(&base), descriptor.neutral) else { return Vec::new() };
        let duration = descriptor.index_of("duration_s");
        let total_s = self.objective.duration_s();
        let lasting = |from_s: f64, lasts_s: f64| {
            let mut effect = base;
            effect.parameters[onset] = from_s;
            if let Some(duration) = duration {
                effect.parameters[duration] = lasts_s;
            }
            effect
        };
        let always = lasting(-LONG_SINCE * total_s, 2.0 * LONG_SINCE * total_s);
        let Some(there) = self.rows_of(always) else { return Vec::new() };
        let change = there - &self.rows_now;
        let clock_s: Vec<f64> = self
            .objective
            .entries()
            .filter(|entry| entry.block.part == Part::Training)
            .map(|entry| self.objective.input(entry.recording).clock_at_s(entry.block.start))
            .collect();
        let end_s = clock_s.iter().copied().fold(0.0, f64::max);
        let strength = descriptor.parameters[0];
        let one = base.parameters[0] - neutral;
        let limits = [strength.lower, strength.upper]
            .map(|limit| ((limit - neutral) / one).clamp(-STRONGEST, STRONGEST));
        let limits = [limits[0].min(limits[1]), limits[0].max(limits[1])];
        let compared =
            Comparison { clock_s: &clock_s, left: &self.now, change: &change, basis: &self.basis.q };
        let started = |span: Span| {
            // What lasts beyond the recordings must not fade before their end.
            let until_s = if span.until_s.is_finite() { span.until_s } else { end_s + FADES * total_s };
            let mut start = lasting(span.from_s, until_s - span.from_s);
            start.parameters[0] = neutral + span.strength * one;
            start
        };
        compared.spans(limits, duration.is_some()).into_iter().map(started).collect()
    }

    fn judge(&self, start: ActiveEffect) -> Option<Judged> {
        Some(self.judge_rows(start, &self.rows_of(start)?))
    }

    /// The same from the rows of a simulation.
    fn judge_rows(&self, start: ActiveEffect, there: &DVector<f64>) -> Judged {
        let Self { basis, now, .. } = self;
        let whole_change = (there - &self.rows_now).norm_squared();
        let inside = basis.inside(there);
        let there = basis.without(there);
        let weight = self.weight(start.bench);
        let mut at_start = Screened::at(start, self.gain_of(there.norm_squared()), weight);
        let direction = &there - now;
        let along = direction.norm_squared();
        let step = if along > 0.0 { -now.dot(&direction) / along } else { 0.0 };
        let step = step.clamp(-STRONGEST, STRONGEST);
        let linear = start.descriptor().neutral.filter(|_| step.abs() >= WEAKEST).and_then(|neutral| {
            let spec = start.descriptor().parameters[0];
            let mut moved = start;
            moved.parameters[0] = neutral + step * (start.parameters[0] - neutral);
            let possible = step > 0.0 || moved.parameters[0] >= spec.lower;
            moved.parameters[0] = moved.parameters[0].clamp(spec.lower, spec.upper);
            let gain = self.gain_of((now + direction * step).norm_squared());
            possible.then(|| Screened::at(moved, gain, weight))
        });
        if along < (1.0 - IN_PLACE_OF) * whole_change {
            let mut x = DVector::zeros(inside.len());
            let mut too_much = inside;
            for _ in 0..ROOM_ROUNDS {
                x -= basis.steps(&too_much);
                x.apply(|x| *x = x.clamp(-ROOM, ROOM));
                let room = self.with_parameters_at(&x);
                let Some(there) = self.rows_beside(&room, start) else { break };
                let gain = self.gain_of(basis.without(&there).norm_squared());
                if gain <= at_start.gain {
                    break;
                }
                at_start = Screened { gain, room: Some(room), ..at_start };
                too_much = basis.inside(&there);
            }
        }
        Judged { start: at_start, linear }
    }

    /// Share of the present loss that is gone where `loss` is left.
    fn gain_of(&self, loss: f64) -> f64 {
        1.0 - loss / self.loss_now.max(f64::MIN_POSITIVE)
    }

    /// Share of the present loss that is left on a bench, or on all.
    fn weight(&self, bench: Option<u16>) -> f64 {
        let Some(bench) = bench else { return 1.0 };
        let fitted = self.objective.entries().filter(|entry| entry.block.part == Part::Training);
        let rows = fitted.zip(self.now.iter());
        let there = rows.filter(|(entry, _)| self.objective.bench(entry.recording) == bench);
        let loss: f64 = there.map(|(_, row)| row * row).sum();
        (loss / self.loss_now.max(f64::MIN_POSITIVE)).max(f64::MIN_POSITIVE)
    }

    /// What first passes have found, judged by whole replays.
    fn judge_again(&self, judged: &Judged) -> Option<Judged> {
        let Some(room) = &judged.start.room else { return self.judge(judged.start.start) };
        let there = self.rows_beside(room, judged.start.start)?;
        let gain = self.gain_of(self.basis.without(&there).norm_squared());
        let start = Screened { gain, ..judged.start.clone() };
        Some(Judged { start, linear: judged.linear.clone() })
    }

    /// The start at the strength that its estimate says, where that predicts better, and so on while it asks for more than is trusted:
    /// a rig that lacks a part tells nothing of how strong its effects are. Play and stick bend the way between two strengths; only a
    /// simulation tells.
    fn stronger(&self, judged: Judged) -> Screened {
        let Judged { start: mut best, mut linear } = judged;
        let neutral = best.start.descriptor().neutral.unwrap_or(0.0);
        let strength = |start: &Screened| (start.start.parameters[0] - neutral).abs();
        for _ in 0..STRENGTHENED {
            let Some(asked) = linear else { break };
            let mut there = self.judge(asked.start);
            if there.as_ref().is_none_or(|there| there.start.gain < KEPT_OF_PROMISE * asked.gain) {
                let mut weaker = asked.start;
                weaker.parameters[0] = neutral + 0.5 * (weaker.parameters[0] - neutral);
                let gain =
                    |judged: &Option<Judged>| judged.as_ref().map_or(f64::MIN, |there| there.start.gain);
                there = [there, self.judge(weaker)]
                    .into_iter()
                    .max_by(|a, b| gain(a).total_cmp(&gain(b)))
                    .flatten();
            }
            let Some(there) = there.filter(|there| there.start.gain > best.gain) else { break };
            let grown = strength(&there.start) / strength(&best);
            best = there.start;
            if grown < 0.99 * STRONGEST {
                break;
            }
            linear = there.linear;
        }
        best
    }

    /// The same start, and its loss, with parameters where the slopes of the present model put them beside it, or half-way there, where
    /// that predicts better than the present ones: stick and slip leave the optimiser no way there in small steps. A start that has
    /// such parameters keeps them; `None` for one that cannot be simulated.
    fn with_room(&self, start: &Screened) -> Option<(Screened, f64)> {
        if let Some(room) = &start.room {
            let there = self.rows_beside(room, start.start)?;
            return Some((start.clone(), there.norm_squared()));
        }
        let here = self.rows_of(start.start)?;
        let mut x = -self.basis.steps(&self.basis.inside(&here));
        x.apply(|x| *x = x.clamp(-ROOM, ROOM));
        let moved = [1.0, 0.5].into_iter().filter_map(|part| {
            let room = self.with_parameters_at(&(&x * part));
            Some((self.rows_beside(&room, start.start)?.norm_squared(), room))
        });
        let best = moved.min_by(|(a, _), (b, _)| a.total_cmp(b));
        let loss = here.norm_squared();
        Some(match best.filter(|(moved, _)| *moved < loss) {
            Some((loss, room)) => (Screened { room: Some(room), ..start.clone() }, loss),
            None => (start.clone(), loss),
        })
    }

    /// The present model with its parameters at `x`, in the optimiser's coordinates.
    fn with_parameters_at(&self, x: &DVector<f64>) -> JointModel {
        let Present { solution, layout, believed, .. } = self.present;
        let mut model = solution.model.clone();
        for (free, x) in layout.free(believed, &solution.model).iter().zip(x.iter()) {
            free.apply(*x, &mut model);
        }
        model
    }

    /// Rows of an effect beside a model, as whole replays would show them; `None` where they cannot be simulated.
    fn rows_beside(&self, model: &JointModel, start: ActiveEffect) -> Option<DVector<f64>> {
        let with = self.present.layout.with(model, start).1;
        let missing = self.missing.as_ref().map(|missing| missing.of(&start));
        let passes = missing.map_or(Passes::All, |(passes, _)| passes);
        let there = self.objective.residuals_in(passes, &with).ok().filter(Residuals::is_finite)?;
        let there = rows(self.objective, &there);
        Some(match missing {
            Some((_, missing)) => there + missing,
            None => there,
        })
    }

    /// The same beside the present model.
    fn rows_of(&self, start: ActiveEffect) -> Option<DVector<f64>> {
        let Present { solution, predictions, .. } = self.present;
        let model = &solution.model;
        // A sensor that drives nothing changes nothing but what is seen of the same motion.
        let only_seen = start.descriptor().component == Component::Sensors
            && !model.inputs.iter().any(|channel| start.target.includes(*channel));
        if only_seen {
            let there = self.objective.residuals_seen_through(predictions, start).ok();
            Some(rows(self.objective, &there.filter(Residuals::is_finite)?))
        } else {
            self.rows_beside(model, start)
        }
    }
}

fn rows(objective: &Objective, residuals: &Residuals) -> DVector<f64> {
    DVector::from_vec(training_rows(objective, residuals))
}

/// What the present parameters can change: an orthonormal basis, and what a step of each parameter is in it.
struct Basis {
    q: DMatrix<f64>,
    r: DMatrix<f64>,
}

impl Basis {
    fn new(jacobian: &DMatrix<f64>) -> Self {
        if jacobian.ncols() == 0 || jacobian.nrows() == 0 {
            return Self { q: DMatrix::zeros(0, 0), r: DMatrix::zeros(0, 0) };
        }
        let (q, r) = jacobian.clone().qr().unpack();
        Self { q, r }
    }

    /// The part of `rows` that they can take off, in the basis. The rows of priors, last in the basis, count as zero.
    fn inside(&self, rows: &DVector<f64>) -> DVector<f64> {
        if self.q.ncols() == 0 {
            return DVector::zeros(0);
        }
        self.q.rows(0, rows.len()).tr_mul(rows)
    }

    /// The part that they cannot take off.
    fn without(&self, rows: &DVector<f64>) -> DVector<f64> {
        if self.q.ncols() == 0 {
            return rows.clone();
        }
        let mut extended = rows.clone().resize_vertically(self.q.nrows(), 0.0);
        extended -= &self.q * self.inside(rows);
        extended
    }

    /// Steps of the parameters that change what `inside` says; zero for a parameter that changes nothing.
    fn steps(&self, inside: &DVector<f64>) -> DVector<f64> {
        let mut steps = DVector::zeros(inside.len());
        for i in (0..inside.len()).rev() {
            let others: f64 = (i + 1..inside.len()).map(|j| self.r[(i, j)] * steps[j]).sum();
            let own = self.r[(i, i)];
            if own.abs() > 1e-9 * self.r.amax() {
                steps[i] = (inside[i] - others) / own;
            }
        }
        steps
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;
    use bowden_model::effect::Target;
    use bowden_model::effects::find;

    use super::*;
    use crate::fit::solver::{COARSE_STEP, FINE_STEP, solve_in_rounds};
    use crate::progress::Quiet;
    use crate::recording::Recording;
    use crate::simulation::{ReplayInput, replay};
    use crate::test_bench;

    /// `model` with one more effect answers the motion of `recording`, which then holds that.
    fn record(model: &JointModel, effect: ActiveEffect, recording: &mut Recording) {
        let mut real = model.clone();
        real.effects.push(effect);
        let measured = replay(&real, &ReplayInput::new(model, recording).unwrap()).unwrap();
        for (channel, values) in measured.channels() {
            recording.set(channel, values.to_vec());
        }
    }

    /// What screening makes of one candidate beside `model`, recalibrated in `rounds`.
    fn screened(
        model: &JointModel,
        recording: Recording,
        rounds: &[f64],
        starts: Vec<ActiveEffect>,
    ) -> (Screened, JointModel) {
        let objective = Objective::new(model, &[recording], &[], true).unwrap();
        let layout = Layout::of(model);
        let free = layout.free(model, model);
        let solution = solve_in_rounds(&objective, model, &free, 5, rounds).unwrap();
        let predictions = objective.predict(&solution.model).unwrap();
        let present =
            Present { believed: model, solution: &solution, layout: &layout, predictions: &predictions };
        let found = screen(&objective, &present, &[Candidate { starts }], 0.0, &Quiet).remove(0);
        (found, solution.model.clone())
    }

    /// What an effect of either sign is tried at says where it really is, on the other side and beyond what is trusted.
    #[test]
    fn a_strong_effect_is_promised_on_the_other_side_of_its_start() {
        let mut recording = test_bench::swung(6000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let start = ActiveEffect::with_defaults(find("asymmetric_friction").unwrap());
        let strong = -1.1 * STRONGEST * start.parameters[0];
        record(&model, start.with("asymmetry", strong), &mut recording);
        let (found, _) = screened(&model, recording, &[], vec![start]);
        assert!((found.start.parameters[0] / strong - 1.0).abs() < 0.3, "{:?}", found.start.parameters[0]);
        assert!(found.gain > 0.8, "{}", found.gain);
    }

    /// Tensions that swing by many times their scale, tried with the wrong sign: the estimate asks for twice what is right.
    #[test]
    fn what_is_asked_for_too_strongly_is_tried_at_half_of_it() {
        let mut recording = test_bench::swung(6000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let law = bowden_model::law::find("law_tendon_length_over_time").unwrap();
        let start = ActiveEffect::with_defaults(law).with("amplitude", 0.1).with("frequency_hz", 0.5);
        record(&model, start.with("amplitude", -0.15), &mut recording);
        let (found, _) = screened(&model, recording, &[], vec![start]);
        assert!((found.start.parameters[0] / -0.15 - 1.0).abs() < 0.4, "{:?}", found.start.parameters[0]);
        assert!(found.gain > 0.5, "{}", found.gain);
    }

    /// Halfway between two phases and half as strong again as both; of either phase alone a wave half as large is the best.
    #[test]
    fn a_wave_is_tried_at_the_phase_that_both_of_its_phases_say() {
        use std::f64::consts::FRAC_PI_2;
        let mut recording = test_bench::swung(6000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let law = bowden_model::law::find("law_tendon_length_over_time").unwrap();
        let start = ActiveEffect::with_defaults(law).with("amplitude", 0.02).with("frequency_hz", 0.5);
        record(&model, start.with("amplitude", 0.03).with("phase_rad", -FRAC_PI_2 / 2.0), &mut recording);
        let both = vec![start.with("phase_rad", 0.0), start.with("phase_rad", FRAC_PI_2)];
        let alone = screened(&model, recording.clone(), &[], both[..1].to_vec()).0;
        assert!(alone.gain < 0.7, "{}", alone.gain);
        let (found, _) = screened(&model, recording, &[], both);
        let [amplitude, _, phase_rad, ..] = found.start.parameters;
        assert!((amplitude / 0.03 - 1.0).abs() < 0.2, "{amplitude}");
        assert!((phase_rad + FRAC_PI_2 / 2.0).abs() < 0.2, "{phase_rad} rad");
        assert!(found.gain > 0.9, "{}", found.gain);
    }

    /// An effect that does nothing at one and not at zero is made stronger too, from one tenth more to nine tenths.
    #[test]
    fn strength_is_counted_from_where_an_effect_does_nothing() {
        let mut recording = test_bench::swung(6000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let gain = find("sensor_gain_error").unwrap();
        let start = ActiveEffect { target: Target::One(Channel::F2), ..ActiveEffect::with_defaults(gain) };
        record(&model, start.with("gain", 1.9), &mut recording);
        let (found, _) = screened(&model, recording, &[], vec![start.with("gain", 1.1)]);
        assert!((found.start.parameters[0] - 1.9).abs() < 0.05, "{:?}", found.start.parameters[0]);
    }

    /// A fifth of the weight is taken off inside a second that is held out; the recalibration takes the weight that hangs most of the time.
    #[test]
    fn a_weight_that_was_taken_off_is_tried_at_its_moment() {
        const TAKEN_OFF_S: f64 = 2.6;
        let mut recording = test_bench::swung(12_000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let start = ActiveEffect::with_defaults(find("payload_change").unwrap());
        record(&model, start.with("change_kg", -0.5).with("time_s", TAKEN_OFF_S), &mut recording);
        let (found, present) = screened(&model, recording, &[COARSE_STEP, FINE_STEP], vec![start]);
        let mass_kg = |model: &JointModel| model.parameters.load.unwrap().mass_kg;
        let (believed, taken) = (mass_kg(&model), mass_kg(&present));
        assert!(taken < 0.9 * believed, "{taken} kg taken for {believed} kg");
        let [change_kg, time_s, ..] = found.start.parameters;
        assert!((time_s - TAKEN_OFF_S).abs() < 0.5, "{time_s} s");
        assert!((change_kg / -0.5 - 1.0).abs() < 0.5, "{change_kg} kg");
        assert!(found.gain > 0.5, "{}", found.gain);
        let room = mass_kg(&found.room.expect("room"));
        assert!((room - believed).abs() < (taken - believed).abs() / 2.0, "{room} kg for {believed} kg");
    }

    /// A spring whose torque the recalibration took for that of half as much weight again.
    #[test]
    fn a_parameter_makes_room_for_what_it_has_taken_the_place_of() {
        let mut recording = test_bench::swung(6000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let start = ActiveEffect::with_defaults(find("joint_spring").unwrap());
        record(&model, start.with("stiffness_nm_per_rad", 0.4).with("rest_rad", 0.05), &mut recording);
        let starts = vec![start.with("rest_rad", 0.05)];
        let (found, present) = screened(&model, recording, &[COARSE_STEP, FINE_STEP], starts);
        let mass_kg = |model: &JointModel| model.parameters.load.unwrap().mass_kg;
        let (believed, taken) = (mass_kg(&model), mass_kg(&present));
        assert!(taken > 1.3 * believed, "{taken} kg taken for {believed} kg");
        let room = mass_kg(&found.room.expect("room"));
        assert!(
            (room - believed).abs() < 0.6 * (taken - believed),
            "{room} kg of {taken} kg for {believed} kg"
        );
        assert!(found.gain > 0.5, "{}", found.gain);
    }
}
