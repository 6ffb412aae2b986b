//! Which effects of a searched model are whose: those that the rig states come first, then ordinary ones that every bench
//! has, then those that the search has found.
//!
//! Every tendon gives way by some ten micrometres in its sheath before it slips, and every drive has a little dry
//! friction. The simulation of a plain rig leaves both out, and they make up half of what two realities differ by. The
//! search therefore carries them along at ordinary size, fits them, and names nothing for them: what they take off can no
//! longer hide a weak effect, nor be mistaken for one. The diagnosed rig does not contain them.

use std::ops::Range;
use std::sync::LazyLock;

use bowden_model::effect::{ActiveEffect, Effect};
use bowden_model::effects::CATALOGUE;
use bowden_model::friction_law::FrictionLaw;
use bowden_model::search::{Ordinary, OrdinaryUnit};

use crate::fit::free::Free;
use crate::fit::recalibrated::{own_of_effect, recalibrated, recalibrated_from};
use crate::joint_model::JointModel;

/// Standard deviation of the logarithm of an ordinary size.
const SPREAD: f64 = 0.5;

/// Part of its largest size at which an ordinary effect counts as that large.
const EXHAUSTED: f64 = 0.99;

/// The effects that every bench has a little of, told by their first parameter, from the joint's side to the motor's.
static ORDINARY: LazyLock<Vec<&'static dyn Effect>> =
    LazyLock::new(|| CATALOGUE.into_iter().rev().filter(|effect| effect.ordinary().is_some()).collect());

/// Usual and largest strength that every bench like `model` has of an effect, in the effect's unit; `None` where the model cannot have it.
fn ordinary_in(model: &JointModel, effect: &dyn Effect) -> Option<[f64; 2]> {
    let Ordinary { unit, usual, largest, .. } = effect.ordinary()?;
    let of_sheath = model.parameters.tendon.and(model.parameters.sheath).map(|_| 1.0);
    let one = match unit {
        OrdinaryUnit::OfSheath => of_sheath,
        OrdinaryUnit::OfBends => of_sheath.filter(|_| is_spread(model)),
        OrdinaryUnit::StallTorque => model.strength_nm(),
    }?;
    Some([usual * one, largest * one])
}

/// Whether friction is simulated along the sheaths, so that it matters where they are bent.
fn is_spread(model: &JointModel) -> bool {
    model.parameters.friction == FrictionLaw::Distributed && model.elements > 1
}

/// Whether something ordinary has a place beside what was found.
fn stands_beside(effect: &dyn Effect, found: &[ActiveEffect]) -> bool {
    found.iter().all(|found| found.descriptor().id != effect.descriptor().id)
}

/// Largest strength of an effect that is not worth a name; `None` for one that no bench has of itself, and for one that is named only where a user
/// asks for it.
pub(super) fn largest_ordinary(believed: &JointModel, effect: &dyn Effect) -> Option<f64> {
    ordinary_in(believed, effect).filter(|_| !effect.on_request()).map(|[_, largest]| largest)
}

/// Whether an ordinary effect is how the bench is built, and stays in what is simulated after a search.
fn is_geometry(effect: &dyn Effect) -> bool {
    effect.ordinary().is_some_and(|ordinary| ordinary.unit == OrdinaryUnit::OfBends)
}

/// How many parameters of the ordinary effect at `place` of [`ORDINARY`] are fitted.
fn fitted_of(place: usize) -> usize {
    ORDINARY[place].ordinary().map_or(0, |ordinary| ordinary.parameters)
}

/// Order of the effects of a searched model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    own: usize,
    /// Places in [`ORDINARY`] of the ordinary effects that the model contains.
    ordinary: Vec<usize>,
}

impl Layout {
    /// Of the model that a rig states.
    pub(super) fn of(model: &JointModel) -> Self {
        Self { own: model.effects.len(), ordinary: Vec::new() }
    }

    /// `model` with every ordinary effect that it lacks and that has a place beside what the rig states and what was found.
    pub(super) fn with_ordinary(&self, model: &JointModel) -> (Self, JointModel) {
        let (mut layout, mut with) = (self.clone(), model.clone());
        for (place, effect) in ORDINARY.iter().enumerate() {
            let is_stated = !stands_beside(*effect, &model.effects[..self.own]);
            let found = &model.effects[self.first_found()..];
            if is_stated || self.ordinary.contains(&place) || !stands_beside(*effect, found) {
                continue;
            }
            if let Some([usual, _]) = ordinary_in(model, *effect) {
                let mut effect = ActiveEffect::with_defaults(*effect);
                effect.parameters[0] = usual;
                let index = layout.ordinary.partition_point(|other| *other < place);
                layout.ordinary.insert(index, place);
                with.effects.insert(self.own + index, effect);
            }
        }
        (layout, with)
    }

    /// Index of the first effect that the search has found.
    pub(super) fn first_found(&self) -> usize {
        self.own + self.ordinary.len()
    }

    /// The ordinary effects of `model`.
    pub(super) fn ordinary<'m>(&self, model: &'m JointModel) -> &'m [ActiveEffect] {
        &model.effects[self.own..self.first_found()]
    }

    /// The ordinary effect of `model` that is geometry: where its sheaths are bent, which no rig file states and every simulation has.
    pub(super) fn bends(&self, model: &JointModel) -> Option<ActiveEffect> {
        self.ordinary(model).iter().find(|effect| is_geometry(effect.effect)).copied()
    }

    /// `model` without the ordinary effects but for those that are geometry.
    pub(super) fn with_bends_alone(&self, model: &JointModel) -> (Self, JointModel) {
        self.with_those(model, |effect| is_geometry(effect.effect))
    }

    /// `model` with the ordinary effects that are to stay.
    fn with_those(&self, model: &JointModel, stays: impl Fn(&ActiveEffect) -> bool) -> (Self, JointModel) {
        let (mut layout, mut left) = (self.clone(), model.clone());
        for index in (0..self.ordinary.len()).rev() {
            if !stays(&model.effects[self.own + index]) {
                layout.ordinary.remove(index);
                left.effects.remove(self.own + index);
            }
        }
        (layout, left)
    }

    /// `model` without the ordinary effects.
    pub(super) fn without_ordinary(&self, model: &JointModel) -> JointModel {
        let mut without = model.clone();
        without.effects.drain(self.own..self.first_found());
        without
    }

    /// `model` with one more effect, in the last place. More of what is ordinary takes the place of the ordinary.
    pub(super) fn with(&self, model: &JointModel, effect: ActiveEffect) -> (Self, JointModel) {
        let (layout, mut with) = self.with_those(model, |ordinary| stands_beside(ordinary.effect, &[effect]));
        with.effects.push(effect);
        (layout, with)
    }

    /// `model` without the found effect `index`; what is ordinary comes back where that had taken its place.
    pub(super) fn without(&self, model: &JointModel, index: usize) -> (Self, JointModel) {
        let mut without = model.clone();
        without.effects.remove(self.first_found() + index);
        self.with_ordinary(&without)
    }

    /// `model` without the ordinary effects that have grown as large as they may: then there is more than the ordinary, and
    /// what it is a search must find. `None` where none has.
    pub(super) fn without_exhausted(
        &self,
        believed: &JointModel,
        model: &JointModel,
    ) -> Option<(Self, JointModel)> {
        let (layout, without) = self.with_those(model, |effect| {
            let largest = largest_ordinary(believed, effect.effect);
            largest.is_none_or(|largest| effect.parameters[0] < EXHAUSTED * largest)
        });
        (layout != *self).then_some((layout, without))
    }

    /// Places, among the parameters of [`Self::free`], of the ordinary effects that `other` lacks.
    pub(super) fn parameters_missing_in(&self, other: &Self, model: &JointModel) -> Vec<usize> {
        let mut next = self.calibrated(model).len();
        let mut missing = Vec::new();
        for place in &self.ordinary {
            let of_effect = next..next + fitted_of(*place);
            next = of_effect.end;
            if !other.ordinary.contains(place) {
                missing.extend(of_effect);
            }
        }
        missing
    }

    /// Parameters that a search fits: the nominal ones, believed to be what the rig states, sizes of ordinary effects within
    /// their limits, and those of all found effects.
    pub(super) fn free(&self, believed: &JointModel, model: &JointModel) -> Vec<Free> {
        let mut free = recalibrated_from(believed, model);
        free.extend(self.stated(model));
        for (index, place) in self.ordinary.iter().enumerate() {
            let of_effect = |parameter: usize| Free::effect(model, self.own + index, parameter);
            if is_geometry(ORDINARY[*place]) {
                // A straight part may have no length, which no ratio comes to.
                let largest =
                    ordinary_in(believed, ORDINARY[*place]).map_or(f64::INFINITY, |[_, largest]| largest);
                free.extend(of_effect(0).map(|straight| straight.up_to(largest)));
                free.extend((1..fitted_of(*place)).filter_map(of_effect));
            } else if let (Some([usual, largest]), Some(strength)) =
                (ordinary_in(believed, ORDINARY[*place]), of_effect(0))
            {
                free.push(strength.as_ratio().up_to(largest).believed_within(usual, SPREAD));
            }
        }
        for effect in self.first_found()..model.effects.len() {
            free.extend(Self::of_found(model, effect));
        }
        free
    }

    /// Parameters that are fitted without any effect beyond those of the rig: the first of [`Self::free`].
    pub(super) fn calibrated(&self, model: &JointModel) -> Vec<Free> {
        let mut free = recalibrated(model);
        free.extend(self.stated(model));
        free
    }

    /// Parameters of the rig's own effects that single benches have for themselves.
    fn stated(&self, model: &JointModel) -> Vec<Free> {
        (0..self.own).flat_map(|effect| own_of_effect(model, effect)).collect()
    }

    /// Places, among the parameters of [`Self::free`], of the shared parameters of the found effect `index`.
    pub(super) fn values_of_found(&self, model: &JointModel, index: usize) -> Range<usize> {
        let found = self.first_found();
        let others: usize = (found..found + index).map(|effect| Self::of_found(model, effect).len()).sum();
        let ordinary: usize = self.ordinary.iter().map(|place| fitted_of(*place)).sum();
        let first = self.calibrated(model).len() + ordinary + others;
        first..first + Free::of_effect(model, found + index).len()
    }

    /// Parameters of a found effect, shared ones first.
    pub(super) fn of_found(model: &JointModel, effect: usize) -> Vec<Free> {
        let mut free = Free::of_effect(model, effect);
        free.extend(own_of_effect(model, effect));
        free
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;
    use bowden_model::effects::find;

    use super::*;
    use crate::recording::Recording;
    use crate::test_bench;

    /// Stall torque of the bench of these tests, N·m: 0.03 · 30 · 24 / 2.
    const STALL_NM: f64 = 10.8;

    fn bench() -> JointModel {
        let rig = test_bench::rig();
        let every = [Channel::ThetaIn, Channel::ThetaOut, Channel::Duty, Channel::F1];
        let recording =
            every.into_iter().fold(Recording::new("any", vec![0.0, 1.0]), |recording, channel| {
                recording.with(channel, vec![0.0, 0.0])
            });
        JointModel::from_rig(&rig, &recording).unwrap()
    }

    fn ids(model: &JointModel) -> Vec<&'static str> {
        model.effects.iter().map(|effect| effect.descriptor().id).collect()
    }

    fn effect(id: &str) -> ActiveEffect {
        ActiveEffect::with_defaults(find(id).unwrap())
    }

    #[test]
    fn ordinary_effects_stand_between_those_of_the_rig_and_those_found_and_leave_no_trace() {
        let mut bench = bench();
        bench.effects.push(effect("joint_spring"));
        let (layout, with) = Layout::of(&bench).with_ordinary(&bench);
        let (layout, with) = layout.with(&with, effect("tendon_creep"));
        let ordinary = ["straight_ends", "presliding_compliance", "motor_coulomb_friction"];
        assert_eq!(ids(&with), [&["joint_spring"], &ordinary[..], &["tendon_creep"]].concat());
        assert_eq!(layout.first_found(), 4);
        assert_eq!(ids(&layout.without_ordinary(&with)), ["joint_spring", "tendon_creep"]);
    }

    #[test]
    fn parameters_of_a_found_effect_are_found_in_their_places() {
        let bench = bench();
        let (layout, with) = Layout::of(&bench).with_ordinary(&bench);
        let (layout, with) = layout.with(&with, effect("motor_stribeck_friction"));
        let (layout, with) = layout.with(&with, effect("tendon_creep"));
        let free = layout.free(&bench, &with);
        for (index, id, first) in [(0, "motor_stribeck_friction", "excess_nm"), (1, "tendon_creep", "ratio")]
        {
            let places = layout.values_of_found(&with, index);
            let paths: Vec<String> = free[places].iter().map(|free| free.path(&with)).collect();
            assert_eq!(paths[0], format!("{id}.{first}"));
            assert!(paths.iter().all(|path| path.starts_with(id)), "{paths:?}");
        }
        assert_eq!(layout.values_of_found(&with, 1).end, free.len());
    }

    #[test]
    fn more_than_the_ordinary_takes_its_place() {
        let bench = bench();
        let (layout, with) = Layout::of(&bench).with_ordinary(&bench);
        let (layout, with) = layout.with(&with, effect("presliding_compliance"));
        assert_eq!(ids(&with), ["straight_ends", "motor_coulomb_friction", "presliding_compliance"]);
        assert_eq!(ids(&layout.without_ordinary(&with)), ["presliding_compliance"]);
    }

    #[test]
    fn an_ordinary_effect_that_is_as_large_as_it_may_be_leaves_its_place() {
        let bench = bench();
        let (layout, mut with) = Layout::of(&bench).with_ordinary(&bench);
        assert_eq!(layout.without_exhausted(&bench, &with), None);
        // However long the straight parts are, they are no finding.
        with.effects[0].parameters[0] = 0.3;
        assert_eq!(layout.without_exhausted(&bench, &with), None);
        with.effects[2].parameters[0] = 1.5e-3 * STALL_NM;
        let (left, without) = layout.without_exhausted(&bench, &with).unwrap();
        assert_eq!(ids(&without), ["straight_ends", "presliding_compliance"]);
        let (back, with) = left.with_ordinary(&without);
        let all = vec!["straight_ends", "presliding_compliance", "motor_coulomb_friction"];
        assert_eq!((ids(&with), back), (all, layout));
    }

    #[test]
    fn what_a_rig_states_or_cannot_have_is_not_added() {
        let mut bench = bench();
        bench.effects.push(effect("presliding_compliance"));
        let (layout, with) = Layout::of(&bench).with_ordinary(&bench);
        assert_eq!(ids(&with), ["presliding_compliance", "straight_ends", "motor_coulomb_friction"]);
        assert_eq!(layout.first_found(), 3);
        bench.effects.clear();
        bench.parameters.tendon = None;
        bench.parameters.motor = None;
        let layout = Layout::of(&bench);
        assert_eq!(layout.with_ordinary(&bench), (layout, bench));
    }

    #[test]
    fn what_is_ordinary_comes_back_when_more_of_it_turns_out_to_be_superfluous() {
        let bench = bench();
        let (ordinary, with) = Layout::of(&bench).with_ordinary(&bench);
        let (layout, with) = ordinary.with(&with, effect("joint_spring"));
        let (layout, with) = layout.with(&with, effect("presliding_compliance"));
        let found = ["joint_spring", "presliding_compliance"];
        assert_eq!(ids(&with), [&["straight_ends", "motor_coulomb_friction"], &found[..]].concat());
        // The contact's parameter stood behind the seven nominal ones and the two of the bends.
        assert_eq!(ordinary.parameters_missing_in(&layout, &bench), [9]);
        let (back, without) = layout.without(&with, 1);
        let all = ["straight_ends", "presliding_compliance", "motor_coulomb_friction", "joint_spring"];
        assert_eq!(ids(&without), all);
        assert_eq!(back, ordinary);
        assert!(without.effects[1].parameters[0] < 2e-5, "{}", without.effects[1].parameters[0]);
        let (layout, without) = layout.without(&with, 0);
        assert_eq!(ids(&without), ["straight_ends", "motor_coulomb_friction", "presliding_compliance"]);
        assert_eq!(layout.first_found(), 2);
    }

    #[test]
    fn where_a_sheath_is_bent_stays_in_what_is_simulated_and_matters_where_friction_is_spread_alone() {
        let bench = bench();
        let (layout, mut with) = Layout::of(&bench).with_ordinary(&bench);
        with.effects[0].parameters[1] = 0.07;
        let (layout, with) = layout.with(&with, effect("joint_spring"));
        assert_eq!(layout.bends(&with), Some(with.effects[0]));
        let (alone, left) = layout.with_bends_alone(&with);
        assert_eq!(ids(&left), ["straight_ends", "joint_spring"]);
        assert_eq!((alone.first_found(), alone.bends(&left)), (1, Some(with.effects[0])));
        let lumped = |change: fn(&mut JointModel)| {
            let mut model = bench.clone();
            change(&mut model);
            let (layout, with) = Layout::of(&model).with_ordinary(&model);
            layout.bends(&with)
        };
        assert_eq!(lumped(|model| model.parameters.friction = FrictionLaw::Lumped), None);
        assert_eq!(lumped(|model| model.elements = 1), None);
    }

    #[test]
    fn an_ordinary_effect_stays_below_the_size_of_a_finding() {
        let bench = bench();
        let (layout, with) = Layout::of(&bench).with_ordinary(&bench);
        let free = layout.free(&bench, &with);
        let of = |path: &str| *free.iter().find(|free| free.path(&with) == path).unwrap();
        for (path, usual, largest) in [
            ("presliding_compliance.displacement_m", 1e-5, 4e-5),
            ("motor_coulomb_friction.torque_nm", 4e-4 * STALL_NM, 1.5e-3 * STALL_NM),
        ] {
            let free = of(path);
            let limit = largest_ordinary(&bench, find(path.split('.').next().unwrap()).unwrap()).unwrap();
            assert!((limit / largest - 1.0).abs() < 1e-9, "{path}: {limit}");
            assert!((free.value_at(0.0) / usual - 1.0).abs() < 1e-9, "{path}");
            assert!((free.value_at(10.0) / largest - 1.0).abs() < 1e-9, "{path}: {}", free.value_at(10.0));
            // Half a standard deviation of the logarithm above the usual size.
            assert!((free.prior_residual(0.25) - 0.5).abs() < 1e-9, "{path}: {}", free.prior_residual(0.25));
        }
    }

    #[test]
    fn parameters_are_believed_to_be_what_the_rig_states_wherever_the_search_is() {
        let bench = bench();
        let mut moved = bench.clone();
        moved.parameters.load.as_mut().unwrap().mass_kg *= 2.0;
        let free = Layout::of(&bench).free(&bench, &moved);
        let mass = free.iter().find(|free| free.path(&moved) == "load.mass_kg").unwrap();
        // A standard deviation is a factor of e^0.3 either way.
        assert!((mass.prior_residual(0.0) - 2.0_f64.ln() / 0.3).abs() < 1e-9, "{}", mass.prior_residual(0.0));
        assert!(mass.prior_residual(-2.0_f64.ln()).abs() < 1e-9);
    }
}
