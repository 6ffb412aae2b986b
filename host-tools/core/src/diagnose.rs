//! Finds which physics a simulation lacks, and proves it on data that the fit has not seen.
//!
//! 1. Parameters that are merely wrong are corrected first.
//! 2. What is left is placed: channel, component, regime.
//! 3. Every effect of the catalogue is tried: simulated at several starting points, ranked, the best refitted together
//!    with all nominal parameters.
//! 4. An effect is named only if it takes more off the loss than what any two realities differ by.
//! 5. The named physics is fitted once more at the rig's own resolution, a joint without tendons in a free run, and written as a rig file.
//! 6. What is held out has taken no part so far, and judges the result.

mod afterwards;
mod candidates;
mod constancy;
mod decide;
mod experiment;
mod hum;
mod hypotheses;
mod law_candidates;
mod layout;
mod locked;
mod off_centre;
mod one_body;
mod onset;
mod own_parameters;
mod place;
pub mod policy;
mod regimes;
mod residual_map;
mod screening;
mod selection;
mod stages;
mod stated_laws;
mod taken_up;
mod unexplained;
pub mod verdict;
pub(crate) mod words;

use std::collections::BTreeMap;

use bowden_model::effect::ActiveEffect;
use bowden_model::effect_set::MAX_ACTIVE;
use bowden_model::law;

use crate::fit::free_run::solve_freely;
use crate::fit::objective::{Objective, Part, Series};
use crate::fit::solver::{FINE_STEP, Solution, solve_in_rounds};
use crate::fit::variation::Variation;
use crate::hypothesis;
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::progress::{Progress, Quiet};
use crate::recording::Recording;
use crate::rig::{Rig, RigDocument, RigParameter, Undecided};
use crate::study::{Bench, Role, Study};
use afterwards::afterwards;
use decide::{Evidence, decide};
use experiment::{Bearable, Shown};
pub use experiment::{Experiment, SECONDS as EXPERIMENT_S};
use hum::Hum;
pub use hypotheses::Asked;
use layout::Layout;
use own_parameters::differing;
use policy::POLICY;
use selection::{Attempted, Chosen, Held, Round, Selected, Tried, compare_with_laws, select};
use stages::{Stage, Stages};
use verdict::{
    Attempt, ChannelFit, Diagnosis, Estimate, Findings, Fit, NamedEffect, OrdinaryEffect, Recalibrated,
    SCHEMA, SearchRound, Trace, TriedHypothesis, Unexplained,
};

/// Contacts of each tendon while candidates are tried: as many as keep the trapezoidal error `(μK)² / 12 n²` of its
/// elongation below this, within the range below.
const SEARCH_ERROR: f64 = 1e-3;

/// Range of the number of contacts while candidates are tried.
const SEARCH_ELEMENTS: std::ops::RangeInclusive<usize> = 4..=8;

/// Simulation step while candidates are tried, s.
const SEARCH_STEP_S: f64 = 1e-3;

/// Of these steps the pass that finds the torque which guides a motor takes so many at a time: a filter of 30 ms keeps what is slow.
const SEARCH_GUIDE_STRIDE: usize = 2;

/// Optimiser evaluations per parameter of the last fit.
const FINAL_PATIENCE: usize = 8;

/// Everything that a diagnosis yields.
#[derive(Clone, Debug)]
pub struct Diagnosed {
    /// Verdict, plots and numbers.
    pub findings: Findings,
    /// Motions that would part the named effects from those that could not be excluded.
    pub experiments: Vec<Experiment>,
    /// What was not compared, one line for each recording that has such a part.
    pub notes: Vec<String>,
    /// Every bench after its recordings.
    now: Vec<BenchNow>,
}

/// A bench after its recordings.
#[derive(Clone, Debug)]
struct BenchNow {
    joint: JointModel,
    /// Effects that the rig stated itself; they come first.
    stated_effects: usize,
    /// Parameters that the fit may have moved.
    fitted: Vec<RigParameter>,
    /// What else would fit.
    undecided: Vec<Undecided>,
}

impl Diagnosed {
    /// Writes the diagnosed physics into the rig file of a bench: the bench as it is after its recordings.
    ///
    /// # Errors
    /// When the file cannot take a value.
    pub fn write_into(&self, bench: usize, document: &mut RigDocument) -> Result<(), Failure> {
        let Some(BenchNow { joint, stated_effects, fitted, undecided }) = self.now.get(bench) else {
            return Ok(());
        };
        document.set_undecided(undecided);
        for parameter in fitted {
            match (parameter, joint.value(parameter)) {
                (RigParameter::Nominal(parameter), Some(value)) => {
                    document.set_nominal(parameter.section, parameter.spec.name, value)?;
                }
                (RigParameter::Effect { descriptor, .. }, Some(_)) => {
                    let stated = joint.effects[..*stated_effects].iter();
                    stated
                        .filter(|effect| effect.descriptor().id == descriptor.id)
                        .try_for_each(|effect| document.add_effect(effect))?;
                }
                _ => {}
            }
        }
        joint.effects[*stated_effects..].iter().try_for_each(|effect| document.add_effect(effect))
    }
}

/// Whether the bench may be driven along a reference, `theta_ref_rad` over time.
pub type Allowed<'a> = &'a (dyn Fn(&Recording) -> bool + Sync);

/// Diagnoses the recordings of a study together, and proves the result on those that are held out; where none is, stretches of
/// the others are. Effects that are tried on request only are tried if they are among `asked`.
///
/// # Errors
/// When there is no recording to learn from, one cannot drive its rig, or nothing can be compared.
pub fn diagnose(study: &Study, asked: &[&str], progress: &dyn Progress) -> Result<Diagnosed, Failure> {
    diagnose_within(study, asked, &|_| true, progress)
}

/// As [`diagnose`], with hypotheses of the user's own as further terms of the search; each is also tried by itself, see
/// [`verdict::TriedHypothesis`].
///
/// # Errors
/// As [`diagnose`]; also what a hypothesis says when it fails, or when it acts on a part that the rig lacks.
pub fn diagnose_hypotheses(
    study: &Study,
    asked: &Asked,
    progress: &dyn Progress,
) -> Result<Diagnosed, Failure> {
    diagnose_asked(study, asked, &|_| true, progress)
}

/// As [`diagnose`], for a bench with limits: of the motions that separate hypotheses those within are preferred; one that is
/// not allowed is named only where no allowed one separates them.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_within(
    study: &Study,
    asked: &[&str],
    allowed: Allowed,
    progress: &dyn Progress,
) -> Result<Diagnosed, Failure> {
    diagnose_asked(study, &Asked { effects: asked, hypotheses: &[] }, allowed, progress)
}

fn diagnose_asked(
    study: &Study,
    asked: &Asked,
    allowed: Allowed,
    progress: &dyn Progress,
) -> Result<Diagnosed, Failure> {
    let model = study.joint()?;
    let experiments: Vec<&Recording> = study.recordings_as(Role::Experiment).collect();
    let training: Vec<&Recording> =
        study.recordings_as(Role::Training).chain(experiments.iter().copied()).collect();
    let heldout = study.recordings_as(Role::HeldOut).collect();
    let judge = Objective::of(&model, study.observed(&model)?)?;
    judged(&judge, &training)?;
    let [objective, _] = judge.split();
    let benches: Result<Vec<(&Bench, Variation)>, Failure> = study
        .benches
        .iter()
        .enumerate()
        .map(|(index, bench)| Ok((bench, study.variation_of_bench(index, &model)?)))
        .collect();
    let case = Case {
        rig: &study.benches[0].rig,
        name: &study.name,
        training,
        partly: experiments,
        heldout,
        objective: &objective,
        judge: &judge,
        model: &model,
        benches: benches?,
        allowed,
    };
    let attentive = asked.settled(&objective, &model, progress)?;
    let diagnosed = case.diagnosed(asked, &attentive);
    asked.failure().map_or(diagnosed, Err)
}

/// Refuses recordings of which nothing is left to judge by.
fn judged(objective: &Objective, training: &[&Recording]) -> Result<(), Failure> {
    let mut blocks = (0..objective.recordings()).flat_map(|recording| objective.blocks(recording));
    if blocks.any(|block| block.part == Part::HeldOut) {
        return Ok(());
    }
    let longest = training.iter().max_by(|a, b| a.duration_s().total_cmp(&b.duration_s()));
    let (source, duration_s) = longest.map_or(("no recording", 0.0), |r| (r.source(), r.duration_s()));
    Err(Failure::bad_input(format!(
        "{source}: {duration_s:.2} s are too short to judge a diagnosis by, which holds out every third second; record at least \
         3 s, or name another recording with --heldout"
    )))
}

impl Case<'_> {
    /// The whole diagnosis.
    fn diagnosed(&self, asked: &Asked, progress: &dyn Progress) -> Result<Diagnosed, Failure> {
        let Self { objective, judge, model, .. } = *self;
        let coarse = at_search_resolution(model, model);
        let mut selected = select(objective, &coarse, asked, progress)?;
        let before = Stage::of(judge, model)?;
        progress.stage("refining", 0);
        // Without tensions little more than the product of friction and pretension is seen. Fitted without what is ordinary, the two run off
        // against each other to make up for it, and the tensions with them: the values that were found beside it are kept.
        let rounds: &[f64] = if selected.complete && !model.tensions_unseen() { &[FINE_STEP] } else { &[] };
        let refined = |selected: &Selected| {
            refine(objective, model, &at_full_resolution(&selected.simulated(), model), rounds)
        };
        let unfaded = |mut selected: Selected| {
            let mut last = refined(&selected)?;
            let mut intervals_count = true;
            while let Some(fewer) =
                selected.complete.then(|| selected.without_faded(objective, &last, intervals_count)).flatten()
            {
                let left = refined(&fewer)?;
                let [without, with] =
                    [&left, &last].map(|fitted| objective.mean_loss(&fitted.residuals, Part::Training));
                // An interval is as wide as two parameters are alike, and contains zero also where what it belongs to is missing.
                if intervals_count
                    && (POLICY.worth_naming(without, with)
                        || selected.has_more_than_remainders(&fewer, objective, model)?)
                {
                    intervals_count = false;
                    continue;
                }
                (selected, last) = (fewer, left);
            }
            Ok::<_, Failure>((selected, last))
        };
        let mut last;
        (selected, last) = unfaded(selected)?;
        let found = selected.model.clone();
        selected = compare_with_laws(objective, &coarse, asked, progress, selected)?;
        if selected.model != found {
            (selected, last) = unfaded(selected)?;
        }
        let recalibrated = Stage::of(judge, &at_full_resolution(&selected.recalibrated, model))?;
        let pays = |bench: Option<u16>| {
            POLICY.pays(
                judge.mean_loss_on(bench, &recalibrated.residuals, Part::Training),
                objective.mean_loss_on(bench, &last.residuals, Part::Training),
            )
        };
        let pays_anywhere = pays(None) || selected.chosen.iter().any(|one| pays(one.effect.bench));
        if selected.complete && !selected.chosen.is_empty() && !pays_anywhere {
            selected = selected.withdrawn();
            last = refined(&selected)?;
        }
        let [_, judging] = judge.split();
        let judging = (judging.recordings() > 0).then_some(&judging);
        let mut unexplained = unexplained::unexplained(objective, judging, selected.searched())?;
        if unexplained.is_none() && selected.chosen.is_empty() {
            // The search may have explained what the rig that is written does not.
            unexplained = unexplained::far_off(objective, judging, &last.model)?;
        }
        let plain = last.model.clone();
        let hums = if selected.complete { self.add_hums(&mut last.model)? } else { Vec::new() };
        let mut stages = Stages { before, recalibrated, after: Stage::of(judge, &last.model)? };
        if selected.chosen.is_empty()
            && let Some(inconstant) =
                constancy::inconstant(judge, &stages.before.residuals, &stages.after.residuals)
        {
            unexplained = Some(inconstant);
        }
        if selected.complete
            && let Some(free_runs) = objective.freely(model)
        {
            // What will be simulated runs freely. Effects are not chosen anew: far from what is there, all free runs are equally wrong.
            let freely = |found: &JointModel, held: &Solution| {
                let free = Layout::of(model).free(model, found);
                solve_freely(&free_runs, found, &free, &held.slopes().stds, FINAL_PATIENCE, &Quiet)
            };
            last = freely(&plain, &last)?;
            last.model.effects.extend(hums.iter().map(|(hum, _)| hum.law));
            stages.after = Stage::of(judge, &last.model)?;
            stages.recalibrated = if selected.chosen.is_empty() {
                stages.after.clone()
            } else {
                let baseline = at_full_resolution(&selected.baseline.model, model);
                Stage::of(judge, &freely(&baseline, &selected.baseline)?.model)?
            };
        }
        let traces = stages::traces(judge, model, &last.model)?;
        let differing = if selected.complete {
            differing(objective, &coarse, &at_search_resolution(&selected.model, model))?
        } else {
            Vec::new()
        };
        let left = Left { hums, unexplained, differing };
        self.report(&selected, &last, &stages, left, traces)
    }
}

/// Contacts that are enough while candidates are tried.
fn search_elements(model: &JointModel) -> usize {
    let wrap_friction =
        model.parameters.sheath.map_or(0.0, |sheath| sheath.friction_coefficient * sheath.wrap_angle_rad);
    let enough = (wrap_friction / (12.0 * SEARCH_ERROR).sqrt()).ceil() as usize;
    enough.clamp(*SEARCH_ELEMENTS.start(), *SEARCH_ELEMENTS.end())
}

/// What has no name.
struct Left {
    /// Hum of sensors, and what is left of the channel on held-out data without and with it.
    hums: Vec<(Hum, [f64; 2])>,
    unexplained: Option<Unexplained>,
    /// Parameters in which benches differ that are said to share them.
    differing: Vec<String>,
}

/// What a diagnosis is about.
struct Case<'a> {
    /// Rig of the first bench.
    rig: &'a Rig,
    /// Name in the report.
    name: &'a str,
    training: Vec<&'a Recording>,
    /// Those of `training` of which stretches are held out although others are held out as a whole.
    partly: Vec<&'a Recording>,
    heldout: Vec<&'a Recording>,
    /// What is learned from.
    objective: &'a Objective,
    /// The same and the recordings that only judge; its residuals begin with those of `objective`.
    judge: &'a Objective,
    /// The joint that all recordings share, as the first rig states it.
    model: &'a JointModel,
    /// The benches, and what turns the shared joint into each.
    benches: Vec<(&'a Bench, Variation)>,
    /// Where the motions that separate hypotheses may go.
    allowed: Allowed<'a>,
}

/// `model` as coarse as `stated` may be while candidates are tried.
fn at_search_resolution(model: &JointModel, stated: &JointModel) -> JointModel {
    JointModel {
        elements: stated.elements.min(search_elements(stated)),
        step_s: stated.step_s.max(SEARCH_STEP_S),
        guide_stride: SEARCH_GUIDE_STRIDE,
        ..model.clone()
    }
}

fn at_full_resolution(searched: &JointModel, model: &JointModel) -> JointModel {
    JointModel {
        elements: model.elements,
        step_s: model.step_s,
        guide_stride: model.guide_stride,
        ..searched.clone()
    }
}

/// Fits `start`, which is `model` with other values and more effects, to all data that may be fitted; without rounds only its
/// standard deviations are found.
fn refine(
    objective: &Objective,
    model: &JointModel,
    start: &JointModel,
    rounds: &[f64],
) -> Result<Solution, Failure> {
    solve_in_rounds(objective, start, &Layout::of(model).free(model, start), FINAL_PATIENCE, rounds)
}

impl Case<'_> {
    /// Bench `index` after its recordings; its diagnosed joint is a variation of `diagnosed`, the outcome of `selected`.
    fn now(
        &self,
        index: usize,
        selected: &Selected,
        diagnosed: &JointModel,
        recalibrated: &[Recalibrated],
    ) -> Result<BenchNow, Failure> {
        let (bench, variation) = &self.benches[index];
        let clock_s = self.objective.on(Some(index as u16)).duration_s();
        let joint = variation.apply(diagnosed);
        let stated_effects = variation.base().effects.len();
        let calibrated = Layout::of(self.model).calibrated(self.model);
        let fitted = calibrated.iter().filter_map(|free| free.parameter(self.model)).collect();
        let of_bench: Vec<&Recalibrated> = recalibrated.iter().filter(|one| one.is_of(&bench.name)).collect();
        let mut undecided =
            off_centre::undecided(self.objective, &joint, &of_bench, &joint.effects, &bench.rig.undecided);
        if selected.complete {
            let believed = at_search_resolution(self.model, self.model);
            let instead_of =
                |held: Held, ids: &[&str]| selected.instead_of(held, ids, self.objective, &believed);
            undecided = taken_up::undecided(self.model, &of_bench, &joint.effects, undecided, instead_of)?;
        }
        Ok(BenchNow { joint: afterwards(&joint, stated_effects, clock_s), stated_effects, fitted, undecided })
    }

    /// Adds the hum of sensors that `model` leaves.
    fn add_hums(&self, model: &mut JointModel) -> Result<Vec<(Hum, [f64; 2])>, Failure> {
        let predictions = self.judge.predict(model)?;
        let mut found = hum::hums(self.objective, &predictions);
        found.truncate(MAX_ACTIVE.saturating_sub(model.effects.len()));
        model.effects.extend(found.iter().map(|hum| hum.law));
        Ok(found.into_iter().map(|hum| (hum, hum.heldout(self.judge, &predictions))).collect())
    }

    /// Held-out losses without and with an effect, where it acts, as the search compared them.
    fn heldout_losses(&self, chosen: &Chosen) -> Result<[f64; 2], Failure> {
        let [without, with] = &chosen.compared;
        let loss = |model| self.heldout_loss(chosen.effect.bench, model);
        Ok([loss(without)?, loss(with)?])
    }

    fn heldout_loss(&self, bench: Option<u16>, model: &JointModel) -> Result<f64, Failure> {
        Ok(self.judge.mean_loss_on(bench, &self.judge.residuals(model)?, Part::HeldOut))
    }

    fn search_round(&self, round: &Round) -> SearchRound {
        let attempt = |Attempted { effect, promised, loss }: &Attempted| Attempt {
            id: effect.descriptor().id.to_owned(),
            channel: effect.target.name().map(str::to_owned),
            bench: self.bench_of(effect),
            parameters: values_of(effect),
            promised: *promised,
            loss: *loss,
        };
        SearchRound { loss_before: round.loss_before, tried: round.candidates.iter().map(attempt).collect() }
    }

    /// Name of the one bench that has an effect.
    fn bench_of(&self, effect: &ActiveEffect) -> Option<String> {
        let (bench, _) = self.benches.get(usize::from(effect.bench?))?;
        Some(bench.name.clone())
    }

    fn report(
        &self,
        selected: &Selected,
        last: &Solution,
        stages: &Stages,
        Left { hums, unexplained, differing }: Left,
        traces: Vec<Trace>,
    ) -> Result<Diagnosed, Failure> {
        let Self { rig, objective, judge, model, .. } = *self;
        let (training, heldout) = (&self.training, &self.heldout);
        let nominal = Layout::of(model).calibrated(model);
        let stds = &last.slopes().stds;
        let recalibrated_parameters: Vec<Recalibrated> = nominal
            .iter()
            .zip(&last.values)
            .zip(stds)
            .map(|((free, value), std)| Recalibrated {
                bench: free.bench(model).map(|bench| self.benches[bench].0.name.clone()),
                parameter: free.path(model),
                nominal: free.start(),
                fitted: *value,
                std: *std,
                unit: free.spec().unit.to_owned(),
                at_bound: free.at_bound(*value),
            })
            .collect();
        let own = model.effects.len();
        let clock_s = objective.duration_s();
        let shown = Shown::by(training);
        let bearable = Bearable { shown, allowed: self.allowed, scales: objective.scales() };
        let mut experiments = Vec::new();
        let mut effects: Vec<(ActiveEffect, NamedEffect)> = Vec::new();
        let mut laws = Vec::new();
        for (index, chosen) in selected.chosen.iter().enumerate() {
            let active = last.model.effects[own + index];
            let values = Layout::of(model).values_of_found(&last.model, index);
            let heldout = self.heldout_losses(chosen)?;
            if let Some(law) = law::of(&active) {
                let improvement = improvement([chosen.loss_before, chosen.loss_after]);
                let mut stated = stated_laws::stated(law, &active, heldout, improvement, &stds[values]);
                if let Some(bench) = self.bench_of(&active) {
                    stated.sentence = words::on_bench(&bench, &stated.sentence);
                    stated.bench = Some(bench);
                }
                laws.push((stated, active));
                continue;
            }
            if let Some(hypothesis) = hypothesis::of(&active) {
                let improvement = improvement([chosen.loss_before, chosen.loss_after]);
                laws.push((
                    hypotheses::stated(hypothesis, &active, heldout, improvement, &stds[values]),
                    active,
                ));
                continue;
            }
            if let Some((_, named)) = effects.iter_mut().find(|(other, _)| other.is_beside(&active)) {
                named.further.push(estimates(&active, &stds[values]));
                continue;
            }
            let separate = |tried: &Tried| {
                if one_body::are_one(&tried.model, &active, &tried.effect) {
                    return Some(one_body::INSEPARABLE.to_owned());
                }
                let found = experiment::separating(rig, chosen, tried, &bearable, clock_s)?;
                let words = found.in_words();
                experiments.push(found);
                Some(words)
            };
            let recorded_s = objective.on(active.bench).duration_s();
            let mut named = named(active, chosen, heldout, &stds[values], recorded_s, separate);
            // The clock of effects begins with the bench's first sample.
            named.onset_s = named.onset_s.map(|onset_s| onset_s + objective.begins_at_s(active.bench));
            if let Some(bench) = self.bench_of(&active) {
                named.sentence = words::on_bench(&bench, &named.sentence);
                named.bench = Some(bench);
            }
            effects.push((active, named));
        }
        let mut effects: Vec<NamedEffect> =
            effects.into_iter().map(|(active, named)| strongest_first(&active, named)).collect();
        laws.extend(hums.iter().filter_map(|(hum, heldout)| Some((hum.stated(*heldout)?, hum.law))));
        let mismatch = place::mismatch(judge, &stages.recalibrated.residuals);
        let unexplained = stated_laws::unexplained(&laws, unexplained, &mismatch);
        effects.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        let wrong = !differing.is_empty() || recalibrated_parameters.iter().any(Recalibrated::is_wrong);
        let [heldout_loss, training_loss] =
            [Part::HeldOut, Part::Training].map(|part| stages.loss(judge, part));
        let evidence = Evidence {
            names: effects.len(),
            structure_is_left: unexplained.is_some(),
            parameters_are_wrong: wrong,
            loss_before: training_loss.before,
            loss_recalibrated: training_loss.recalibrated,
        };
        let verdict = decide(&evidence, &POLICY);
        let compared: Vec<(Series, ChannelFit)> = judge
            .scales()
            .iter()
            .enumerate()
            .map(|(place, (series, _))| {
                let fit = ChannelFit {
                    before_rmse: stages.before.heldout_rmse[place],
                    recalibrated_rmse: stages.recalibrated.heldout_rmse[place],
                    after_rmse: stages.after.heldout_rmse[place],
                    noise_rmse: judge.noise_variance(*series).sqrt(),
                    free_run: model.guided_by.is_some() && *series != Series::Guide,
                };
                (*series, fit)
            })
            .collect();
        let by_a_law = !laws.is_empty();
        let summary = words::summary(
            verdict,
            &effects,
            &recalibrated_parameters,
            &differing,
            by_a_law,
            &heldout_loss,
            &compared,
        );
        let channels: BTreeMap<String, ChannelFit> =
            compared.into_iter().map(|(series, fit)| (series.name().to_owned(), fit)).collect();
        let coarse = at_search_resolution(&last.model, model);
        let mut indistinguishable =
            crate::fit::identifiability::indistinguishable(objective, &coarse).unwrap_or_default();
        let benches = 0..self.benches.len();
        let now: Result<Vec<BenchNow>, Failure> =
            benches.map(|bench| self.now(bench, selected, &last.model, &recalibrated_parameters)).collect();
        let now = now?;
        for ((bench, _), now) in self.benches.iter().zip(&now) {
            for undecided in &now.undecided {
                let is_it =
                    |one: &&Recalibrated| one.parameter == undecided.parameter && one.is_of(&bench.name);
                let name = recalibrated_parameters.iter().find(is_it).map(Recalibrated::name);
                let name = name.unwrap_or_else(|| undecided.parameter.clone());
                let group = vec![name, format!("effects.{}", undecided.rival())];
                if !indistinguishable.contains(&group) {
                    indistinguishable.push(group);
                }
            }
        }
        let trials = selected.trials.iter();
        let hypotheses: Result<Vec<TriedHypothesis>, Failure> = trials
            .map(|trial| hypotheses::tried(trial, selected, |model| self.heldout_loss(None, model)))
            .collect();
        let hypotheses = hypotheses?;
        let diagnosis = Diagnosis {
            schema: SCHEMA.to_owned(),
            verdict,
            summary: if selected.complete { summary } else { format!("{summary} {}", words::STOPPED) },
            complete: selected.complete,
            effects,
            recalibrated: recalibrated_parameters,
            differing,
            indistinguishable,
            mismatch,
            residual_map: residual_map::residual_map(judge, stages),
            unexplained,
            hypotheses,
            laws: laws.into_iter().map(|(law, _)| law).collect(),
            fit: Fit { heldout: true, channels },
            heldout_loss,
            training_loss,
            ordinary: selected
                .ordinary()
                .iter()
                .map(|effect| OrdinaryEffect {
                    id: effect.descriptor().id.to_owned(),
                    parameters: values_of(effect),
                })
                .collect(),
            policy: POLICY,
            search: selected.rounds.iter().map(|round| self.search_round(round)).collect(),
            rig: self.name.to_owned(),
            recordings: training.iter().map(|r| r.source().to_owned()).collect(),
            heldout: if heldout.is_empty() {
                vec!["every third second of each recording".to_owned()]
            } else {
                let whole = heldout.iter().map(|recording| recording.source().to_owned());
                let partly = self.partly.iter();
                whole.chain(partly.map(|r| format!("every third second of {}", r.source()))).collect()
            },
            written_by: format!("bowden {}", env!("CARGO_PKG_VERSION")),
        };
        let regimes = regimes::regimes(judge, stages);
        let notes = self.judge.notes().map(str::to_owned).collect();
        Ok(Diagnosed { findings: Findings { diagnosis, traces, regimes }, experiments, notes, now })
    }
}

/// Part of the loss that is removed from the first to the second.
fn improvement([without, with]: [f64; 2]) -> f64 {
    1.0 - with / without
}

fn named(
    active: ActiveEffect,
    chosen: &Chosen,
    heldout: [f64; 2],
    stds: &[Option<f64>],
    recorded_s: f64,
    separate: impl FnMut(&Tried) -> Option<String>,
) -> NamedEffect {
    let descriptor = active.descriptor();
    let heldout_improvement = improvement(heldout);
    let training_improvement = improvement([chosen.loss_before, chosen.loss_after]);
    // Held-out data that do not show it leave it as likely as not.
    let (probability, rivals) =
        words::rivals(chosen, training_improvement.min(heldout_improvement), separate);
    let onset_s = descriptor
        .parameters
        .iter()
        .position(|spec| spec.name == "time_s" || spec.name == "start_s")
        .map(|index| active.parameters[index]);
    NamedEffect {
        id: descriptor.id.to_owned(),
        component: descriptor.component.name().to_owned(),
        probability,
        onset_s,
        channel: active.target.name().map(str::to_owned),
        bench: None,
        parameters: estimates(&active, stds),
        further: Vec::new(),
        heldout_improvement,
        training_improvement,
        sentence: words::sentence(&active, heldout_improvement, recorded_s),
        rivals,
    }
}

/// Fitted parameters with their standard deviations.
fn estimates(active: &ActiveEffect, stds: &[Option<f64>]) -> BTreeMap<String, Estimate> {
    let mut stds = stds.iter();
    let specs = active.descriptor().parameters.iter().zip(active.parameters);
    specs
        .filter_map(|(spec, value)| {
            let fitted = spec.searched;
            let std = if fitted { *stds.next()? } else { None };
            let at_bound = fitted && (value <= spec.lower || value >= spec.upper);
            let estimate = Estimate { value, std, unit: spec.unit.to_owned(), at_bound };
            (fitted || !spec.forms.is_empty()).then(|| (spec.name.to_owned(), estimate))
        })
        .collect()
}

/// The same effect with the strongest of its instances in front, and a sentence that tells the others.
fn strongest_first(active: &ActiveEffect, mut named: NamedEffect) -> NamedEffect {
    if named.further.is_empty() {
        return named;
    }
    let strength = active.descriptor().parameters[0].name;
    let mut all = std::mem::take(&mut named.further);
    all.push(std::mem::take(&mut named.parameters));
    let size = |one: &BTreeMap<String, Estimate>| one.get(strength).map_or(0.0, |it| it.value.abs());
    all.sort_by(|a, b| size(b).total_cmp(&size(a)));
    named.parameters = all.remove(0);
    named.further = all;
    named.sentence = words::sentence_of_instances(active, &named);
    named
}

fn values_of(effect: &ActiveEffect) -> BTreeMap<String, f64> {
    let specs = effect.descriptor().parameters;
    specs.iter().zip(effect.parameters).map(|(spec, value)| (spec.name.to_owned(), value)).collect()
}
