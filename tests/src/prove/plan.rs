//! Which rigs are drawn: groups, effects, strengths, noise, seeds.

use std::hash::{DefaultHasher, Hash, Hasher};

use rand_distr::{Distribution, Uniform};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use virtual_bench::{BenchConfig, BenchError, Case, Component, ConcealedEffect, Parameter};

use super::recorded::Recorded;

/// Standard deviation, in per cent, by which stiffness and pretension of every bench are off its rig file.
const PERTURBED_PERCENT: f64 = 3.0;

/// Noise of a noisy rig's tension and current channels over that of a quiet one; its rig file says so.
pub const NOISY: f64 = 3.0;

/// Strength of the weaker of the two cases of an effect, where a half would not show at all: a tendon hangs slack only
/// below the tensions of the motion.
const WEAK_STRENGTHS: [(&str, f64); 1] = [("tendon_slack", 0.8)];

/// Strength of the weaker case of every other effect; 1 is a clear fault.
const WEAK_STRENGTH: f64 = 0.5;

/// Number of pairs, triples, rigs that hide nothing, and rigs of which only parameters are wrong.
const PAIRS: usize = 20;
const TRIPLES: usize = 10;
const NOTHING: usize = 25;
const PARAMETERS: usize = 25;

/// Number of rigs with four or five effects, with wrong geometry, and without tensions.
const MANY: usize = 20;
const GEOMETRY: usize = 20;
const NO_TENSIONS: usize = 20;

/// Number of rigs with tensions at the motor alone, of dirty files and of slow ones.
const OTHERWISE_RECORDED: usize = 12;

/// Number of rigs with a listed effect and an unlisted law.
const MIXED: usize = 16;

/// One case in so many of those that are recorded otherwise hides nothing.
const HIDING_NOTHING: usize = 4;

/// Physics that a rig file of lumped friction leaves out; every bench has it.
pub const DISTRIBUTED_FRICTION: &str = "distributed_friction";

/// Kind of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Group {
    /// One effect of the catalogue.
    Single,
    /// Two effects of different components.
    Pair,
    /// Three effects of different components.
    Triple,
    /// Nothing beyond the few per cent that every bench is off.
    Nothing,
    /// Wrong parameters alone.
    Parameters,
    /// Physics that the catalogue has no name for.
    Outside,
    /// Four or five effects at once, at most two of a component.
    Many,
    /// Output radius and arm are wrong in the rig file; every other case conceals an effect as well.
    Geometry,
    /// Encoders and motor were recorded, no tension; one effect in three cases of four.
    NoTensions,
    /// Of the tensions those at the motor were recorded; one effect in three cases of four.
    MotorSide,
    /// Spikes, lost rows, a clock that jitters; one effect in three cases of four.
    Dirty,
    /// Recorded at 100 Hz; one effect in three cases of four.
    Slow,
    /// One effect of the catalogue and, in another component, one law that it has no name for.
    Mixed,
}

impl Group {
    /// All groups in the order of the run.
    pub const ALL: [Self; 13] = [
        Self::Single,
        Self::Pair,
        Self::Triple,
        Self::Nothing,
        Self::Parameters,
        Self::Outside,
        Self::Many,
        Self::Geometry,
        Self::NoTensions,
        Self::MotorSide,
        Self::Dirty,
        Self::Slow,
        Self::Mixed,
    ];

    /// What of the motion is in the training recording.
    #[must_use]
    pub const fn recorded(self) -> Recorded {
        match self {
            Self::NoTensions => Recorded::NoTensions,
            Self::MotorSide => Recorded::MotorSide,
            Self::Dirty => Recorded::Dirty,
            Self::Slow => Recorded::Slow,
            _ => Recorded::Everything,
        }
    }

    /// Name in options, files and tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Pair => "pair",
            Self::Triple => "triple",
            Self::Nothing => "nothing",
            Self::Parameters => "parameters",
            Self::Outside => "outside",
            Self::Many => "many",
            Self::Geometry => "geometry",
            Self::NoTensions => "no-tensions",
            Self::MotorSide => "motor-side",
            Self::Dirty => "dirty",
            Self::Slow => "slow",
            Self::Mixed => "mixed",
        }
    }

    /// How many cases of this group a quick run takes.
    const fn quick(self) -> usize {
        match self {
            Self::Single => 12,
            Self::Pair | Self::Nothing | Self::Outside => 3,
            Self::Parameters => 2,
            Self::Triple
            | Self::Many
            | Self::Geometry
            | Self::NoTensions
            | Self::MotorSide
            | Self::Dirty
            | Self::Slow
            | Self::Mixed => 1,
        }
    }
}

/// One rig to be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Name of the case, unique within a run: group, what is hidden, strength and noise, or a number.
    pub name: String,
    /// Kind.
    pub group: Group,
    /// Seed of motion, noise, effect details and of how far the bench is off its rig file.
    pub seed: u64,
    /// Concealed effects with their strengths.
    pub effects: Vec<(&'static str, f64)>,
    /// Parameters that are wrong, true over claimed.
    pub off: Vec<(Parameter, f64)>,
    /// Noise over that of the nominal bench.
    pub noise: f64,
    /// Whether the rig file claims lumped friction.
    pub lumped: bool,
}

impl Plan {
    fn new(group: Group, tail: &str, seed: u64) -> Self {
        let name = format!("{}/{tail}", group.name());
        let seed = seed_of(seed, &name);
        Self { name, group, seed, effects: Vec::new(), off: Vec::new(), noise: 1.0, lumped: false }
    }

    /// The bench with its concealed effects.
    ///
    /// # Errors
    /// [`BenchError`] where the bench does not know an effect, which would be a mistake of this plan.
    pub fn case(&self) -> Result<Case, BenchError> {
        let effects =
            self.effects.iter().map(|(id, strength)| ConcealedEffect::drawn(id, *strength, self.seed));
        let title = self.name.rsplit('/').next().unwrap_or_default();
        // The rig's name must not tell what is hidden.
        let title = if title.chars().all(char::is_numeric) { title } else { "bench" };
        let mut case = Case::new(title, effects.collect::<Result<_, _>>()?, self.seed, PERTURBED_PERCENT);
        for (parameter, ratio) in &self.off {
            case = case.off(*parameter, *ratio);
        }
        for bench in [&mut case.nominal, &mut case.truth] {
            bench.tension_noise_n *= self.noise;
            bench.current_noise_a *= self.noise;
        }
        Ok(case)
    }

    /// Ids of all that is hidden, catalogued or not.
    #[must_use]
    pub fn hidden(&self) -> Vec<&'static str> {
        let lumped = self.lumped.then_some(DISTRIBUTED_FRICTION);
        self.effects.iter().map(|(id, _)| *id).chain(lumped).collect()
    }

    /// Whether a `--only` of this word takes the case: its group, an effect, or the beginning of its name.
    #[must_use]
    pub fn matches(&self, word: &str) -> bool {
        self.group.name() == word || self.hidden().contains(&word) || self.name.starts_with(word)
    }
}

/// Seed of a case: it does not move when cases are added before it.
fn seed_of(seed: u64, name: &str) -> u64 {
    // SipHash with its default keys, which no Rust version has changed.
    let mut hasher = DefaultHasher::new();
    (seed, name).hash(&mut hasher);
    hasher.finish() % 1_000_000
}

/// Ids that the bench can hide, of the catalogue or outside it, with their components.
fn ids(outside: bool) -> Vec<(&'static str, Component)> {
    let drawn =
        ConcealedEffect::IDS.iter().filter_map(|id| Some((*id, ConcealedEffect::drawn(id, 1.0, 0).ok()?)));
    drawn
        .filter(|(_, effect)| effect.is_outside_catalogue() == outside)
        .map(|(id, effect)| (id, effect.component()))
        .collect()
}

fn weak(id: &str) -> f64 {
    WEAK_STRENGTHS.iter().find(|(named, _)| *named == id).map_or(WEAK_STRENGTH, |(_, strength)| *strength)
}

/// All cases of a seed.
#[must_use]
pub fn plans(seed: u64) -> Vec<Plan> {
    let mut plans = Vec::new();
    let noises = [("quiet", 1.0), ("noisy", NOISY)];
    for (group, outside) in [(Group::Single, false), (Group::Outside, true)] {
        for (id, _) in ids(outside) {
            for (strength_name, strength) in [("clear", 1.0), ("weak", weak(id))] {
                for (noise_name, noise) in noises {
                    let plan = Plan::new(group, &format!("{id}/{strength_name}/{noise_name}"), seed);
                    plans.push(Plan { effects: vec![(id, strength)], noise, ..plan });
                }
            }
        }
    }
    for (noise_name, noise) in noises {
        let plan = Plan::new(Group::Single, &format!("{DISTRIBUTED_FRICTION}/clear/{noise_name}"), seed);
        plans.push(Plan { lumped: true, noise, ..plan });
    }
    for (group, cases, effects) in [(Group::Pair, PAIRS, 2), (Group::Triple, TRIPLES, 3)] {
        for number in 0..cases {
            let plan = Plan::new(group, &format!("{number:02}"), seed);
            plans.push(Plan { effects: of_different_components(effects, plan.seed), ..plan });
        }
    }
    for (group, cases) in [(Group::Nothing, NOTHING), (Group::Parameters, PARAMETERS)] {
        for number in 0..cases {
            let plan = Plan::new(group, &format!("{number:02}"), seed);
            let noise = noises[number % 2].1;
            let off = if group == Group::Parameters { wrong_parameters(plan.seed) } else { Vec::new() };
            plans.push(Plan { off, noise, ..plan });
        }
    }
    for number in 0..MANY {
        let plan = Plan::new(Group::Many, &format!("{number:02}"), seed);
        plans.push(Plan { effects: many(4 + number % 2, plan.seed, &[]), ..plan });
    }
    for number in 0..GEOMETRY {
        let plan = Plan::new(Group::Geometry, &format!("{number:02}"), seed);
        let effects = if number % 2 == 0 { Vec::new() } else { many(1, plan.seed, &[]) };
        plans.push(Plan { effects, off: wrong_geometry(plan.seed), ..plan });
    }
    for number in 0..MIXED {
        let plan = Plan::new(Group::Mixed, &format!("{number:02}"), seed);
        plans.push(Plan { effects: with_a_law(plan.seed), ..plan });
    }
    for (group, cases) in [
        (Group::NoTensions, NO_TENSIONS),
        (Group::MotorSide, OTHERWISE_RECORDED),
        (Group::Dirty, OTHERWISE_RECORDED),
        (Group::Slow, OTHERWISE_RECORDED),
    ] {
        for number in 0..cases {
            let plan = Plan::new(group, &format!("{number:02}"), seed);
            let effects = if number % HIDING_NOTHING == 0 {
                Vec::new()
            } else {
                many(1, plan.seed, group.recorded().missing())
            };
            plans.push(Plan { effects, ..plan });
        }
    }
    plans.sort_by_key(|plan| plan.group);
    plans
}

/// Effects of a clear size, at most two of a component and none of a sensor whose channel is `missing`: nobody could find that.
fn many(wanted: usize, seed: u64, missing: &[&str]) -> Vec<(&'static str, f64)> {
    let mut draw = Draw::new(seed);
    let mut left = ids(false);
    let mut effects: Vec<(&'static str, Component)> = Vec::new();
    while effects.len() < wanted && !left.is_empty() {
        let drawn = left.swap_remove(draw.index(left.len()));
        let has_room = effects.iter().filter(|(_, component)| *component == drawn.1).count() < 2;
        if has_room && !is_of_a_channel(drawn.0, seed, missing) {
            effects.push(drawn);
        }
    }
    effects.into_iter().map(|(id, _)| (id, 1.0)).collect()
}

/// Whether an effect, as it is drawn from a seed, is of the sensor of one of these channels.
fn is_of_a_channel(id: &str, seed: u64, channels: &[&str]) -> bool {
    let effect = ConcealedEffect::drawn(id, 1.0, seed);
    let parameters = effect.map(|effect| effect.parameters()).unwrap_or_default();
    parameters
        .get("channel")
        .and_then(|channel| channel.as_str())
        .is_some_and(|name| channels.contains(&name))
}

/// A listed effect and a law of another component.
fn with_a_law(seed: u64) -> Vec<(&'static str, f64)> {
    let mut draw = Draw::new(seed);
    let laws: Vec<_> = ids(true).into_iter().filter(|(id, _)| id.starts_with("unlisted_")).collect();
    let (law, component) = laws[draw.index(laws.len())];
    let listed: Vec<_> = ids(false).into_iter().filter(|(_, other)| *other != component).collect();
    vec![(listed[draw.index(listed.len())].0, 1.0), (law, 1.0)]
}

/// Output radius and arm, each off by 4 to 6 % either way: more than a caliper errs, less than a glance at a plot shows.
fn wrong_geometry(seed: u64) -> Vec<(Parameter, f64)> {
    let mut draw = Draw::new(seed.wrapping_add(1));
    [Parameter::OutputRadius, Parameter::Arm]
        .map(|parameter| {
            let change = draw.between(0.04, 0.06);
            (parameter, if draw.index(2) == 0 { 1.0 - change } else { 1.0 + change })
        })
        .to_vec()
}

fn of_different_components(wanted: usize, seed: u64) -> Vec<(&'static str, f64)> {
    let mut draw = Draw::new(seed);
    let mut left = ids(false);
    let mut effects = Vec::new();
    while effects.len() < wanted && !left.is_empty() {
        let (id, component) = left[draw.index(left.len())];
        effects.push((id, 1.0));
        left.retain(|(_, other)| *other != component);
    }
    effects
}

/// One to three parameters, each off by more than a bench ever is by itself.
fn wrong_parameters(seed: u64) -> Vec<(Parameter, f64)> {
    let mut draw = Draw::new(seed);
    let mut left = vec![
        (Parameter::FrictionCoefficient, [0.5, 0.75], [1.3, 1.7]),
        (Parameter::AxialStiffness, [0.65, 0.85], [1.2, 1.45]),
        (Parameter::Pretension, [0.65, 0.85], [1.2, 1.4]),
        (Parameter::Resistance, [0.7, 0.85], [1.2, 1.4]),
        (Parameter::TorqueConstant, [0.8, 0.9], [1.12, 1.25]),
        (Parameter::Mass, [0.7, 0.85], [1.2, 1.35]),
    ];
    (0..=draw.index(3))
        .map(|_| {
            let (parameter, low, high) = left.swap_remove(draw.index(left.len()));
            let [from, to] = if draw.index(2) == 0 { low } else { high };
            (parameter, draw.between(from, to))
        })
        .collect()
}

/// Random choices of a plan.
struct Draw(Pcg64);

impl Draw {
    fn new(seed: u64) -> Self {
        Self(Pcg64::new(u128::from(seed), 0x0070_6c61_6e73))
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        Uniform::new(low, high).map_or(low, |uniform| uniform.sample(&mut self.0))
    }

    fn index(&mut self, length: usize) -> usize {
        Uniform::new(0, length).map_or(0, |uniform| uniform.sample(&mut self.0))
    }
}

/// A sample of every group, spread over its effects, strengths and noise levels.
#[must_use]
pub fn quick_sample(plans: Vec<Plan>) -> Vec<Plan> {
    let sizes = Group::ALL.map(|group| plans.iter().filter(|plan| plan.group == group).count());
    by_place(plans, |group, place| {
        let (size, wanted) = (sizes[group as usize], group.quick());
        // One of every `size / wanted`; the remainder of the division moves it through strength and noise.
        place == 0 || place * wanted / size != (place - 1) * wanted / size
    })
}

/// Each `every`-th case of every group. Effects have four cases each, by strength and noise; from one to the next others of them are taken.
#[must_use]
pub fn thinned(plans: Vec<Plan>, every: usize) -> Vec<Plan> {
    by_place(plans, |_, place| (place + place / 4) % every == 0)
}

/// The cases that are wanted by group and place in it.
fn by_place(plans: Vec<Plan>, wanted: impl Fn(Group, usize) -> bool) -> Vec<Plan> {
    let mut seen = [0; Group::ALL.len()];
    let is_wanted = |plan: &Plan| {
        let place = seen[plan.group as usize];
        seen[plan.group as usize] += 1;
        wanted(plan.group, place)
    };
    plans.into_iter().filter(is_wanted).collect()
}

/// What the bench of a noise level shows, for the page.
#[must_use]
pub fn noise_levels_n() -> [f64; 2] {
    let nominal = BenchConfig::default().tension_noise_n;
    [nominal, NOISY * nominal]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn count(plans: &[Plan], group: Group) -> usize {
        plans.iter().filter(|plan| plan.group == group).count()
    }

    #[test]
    fn every_catalogued_effect_of_the_bench_stands_at_two_strengths_and_two_noise_levels() {
        let plans = plans(1);
        let singles: Vec<&Plan> = plans.iter().filter(|plan| plan.group == Group::Single).collect();
        for (id, _) in ids(false) {
            let of_it: Vec<_> = singles.iter().filter(|plan| plan.hidden() == [id]).collect();
            let strengths: BTreeSet<u64> = of_it.iter().map(|plan| plan.effects[0].1.to_bits()).collect();
            let noises: BTreeSet<u64> = of_it.iter().map(|plan| plan.noise.to_bits()).collect();
            assert_eq!((of_it.len(), strengths.len(), noises.len()), (4, 2, 2), "{id}");
        }
        assert_eq!(count(&plans, Group::Single), 32 * 4 + 2);
        let others = [Group::Pair, Group::Triple, Group::Nothing, Group::Parameters];
        assert_eq!(others.map(|group| count(&plans, group)), [20, 10, 25, 25]);
        assert!(count(&plans, Group::Outside) >= 3 * 4);
        let recorded = [Group::NoTensions, Group::MotorSide, Group::Dirty, Group::Slow];
        assert_eq!(recorded.map(|group| count(&plans, group)), [20, 12, 12, 12]);
        let more = [Group::Many, Group::Geometry, Group::Mixed];
        assert_eq!(more.map(|group| count(&plans, group)), [20, 20, 16]);
    }

    #[test]
    fn effects_of_a_pair_or_triple_sit_in_different_components() {
        for plan in plans(3).iter().filter(|plan| matches!(plan.group, Group::Pair | Group::Triple)) {
            let case = plan.case().unwrap();
            let components: BTreeSet<_> = case.effects.iter().map(ConcealedEffect::component).collect();
            let wanted = if plan.group == Group::Pair { 2 } else { 3 };
            assert_eq!((components.len(), case.effects.len()), (wanted, wanted), "{}", plan.name);
        }
    }

    #[test]
    fn rigs_without_effects_hide_none_and_only_those_of_wrong_parameters_are_far_off() {
        for plan in plans(1) {
            let case = plan.case().unwrap();
            let ratio = case.truth.friction_coefficient / case.nominal.friction_coefficient;
            match plan.group {
                Group::Nothing => {
                    assert!(case.effects.is_empty() && plan.off.is_empty() && (ratio - 1.0).abs() < 0.16);
                }
                Group::Parameters => {
                    assert!(case.effects.is_empty() && (1..=3).contains(&plan.off.len()), "{}", plan.name);
                    assert!(plan.off.iter().all(|(_, ratio)| (ratio - 1.0).abs() > 0.09), "{:?}", plan.off);
                }
                Group::Geometry => {
                    let off = |ratio: f64| (0.039..0.061).contains(&(ratio - 1.0).abs());
                    assert!(plan.off.len() == 2 && plan.off.iter().all(|(_, ratio)| off(*ratio)));
                    assert!(plan.hidden().len() <= 1);
                }
                Group::NoTensions | Group::MotorSide | Group::Dirty | Group::Slow => {
                    assert!(plan.off.is_empty() && plan.hidden().len() <= 1, "{}", plan.name);
                }
                Group::Mixed => {
                    let [listed, law] = &case.effects[..] else { panic!("{}", plan.name) };
                    assert!(!listed.is_outside_catalogue() && law.is_outside_catalogue());
                    assert!(listed.component() != law.component(), "{}", plan.name);
                }
                Group::Many => assert!((4..=5).contains(&plan.hidden().len()), "{}", plan.name),
                _ => assert!(plan.off.is_empty() && !plan.hidden().is_empty()),
            }
        }
    }

    /// Of the first draws of thirty seeds some are of such a sensor: they are drawn again, and the others are not.
    #[test]
    fn what_is_wrong_with_a_sensor_is_hidden_only_where_its_channel_is_recorded() {
        let (mut kept, mut drawn_again) = (0, 0);
        for plan in (1..=30).flat_map(plans) {
            let missing = plan.group.recorded().missing();
            let Some((id, _)) = plan.effects.first().filter(|_| !missing.is_empty()) else { continue };
            assert!(!is_of_a_channel(id, plan.seed, missing), "{}: {id}", plan.name);
            let first = many(1, plan.seed, &[]);
            if first == plan.effects {
                kept += 1;
            } else {
                assert!(is_of_a_channel(first[0].0, plan.seed, missing), "{}: {first:?}", plan.name);
                drawn_again += 1;
            }
        }
        assert!(drawn_again > 20 && kept > 5 * drawn_again, "{drawn_again} of {}", kept + drawn_again);
    }

    #[test]
    fn a_seed_moves_every_case_and_names_are_unique() {
        let (one, two) = (plans(1), plans(2));
        let names: BTreeSet<&str> = one.iter().map(|plan| plan.name.as_str()).collect();
        assert_eq!(names.len(), one.len());
        assert!(one.iter().zip(&two).all(|(a, b)| a.name == b.name && a.seed != b.seed));
        assert_eq!(one, plans(1));
    }

    #[test]
    fn a_quick_sample_has_all_groups_and_mixes_strength_and_noise() {
        let sample = quick_sample(plans(1));
        assert_eq!(Group::ALL.map(|group| count(&sample, group)), [12, 3, 1, 3, 2, 3, 1, 1, 1, 1, 1, 1, 1]);
        let singles: Vec<&Plan> = sample.iter().filter(|plan| plan.group == Group::Single).collect();
        let kinds: BTreeSet<&str> = singles
            .iter()
            .filter_map(|plan| plan.name.split_once('/')?.1.split_once('/'))
            .map(|(_, kind)| kind)
            .collect();
        assert!(kinds.len() >= 3, "{kinds:?}");
        let effects: BTreeSet<&str> = singles.iter().map(|plan| plan.hidden()[0]).collect();
        assert_eq!(effects.len(), 12);
    }

    #[test]
    fn half_of_the_cases_has_half_of_every_group_and_each_effect_at_both_strengths() {
        assert_eq!(thinned(plans(1), 1), plans(1));
        let (all, half) = (plans(1), thinned(plans(1), 2));
        for group in Group::ALL {
            let (of, kept) = (count(&all, group), count(&half, group));
            assert!(2 * kept == of || 2 * kept == of + 1, "{}: {kept} of {of}", group.name());
        }
        let named = |word: &str| half.iter().filter(|plan| plan.name.contains(word)).count();
        for (id, _) in ids(false) {
            // Friction along the sheath or at one place has no strength.
            let strengths =
                [format!("single/{id}/clear/"), format!("single/{id}/weak/")].map(|word| named(&word));
            assert!(strengths == [1, 1] || id == "distributed_friction", "{id}: {strengths:?}");
        }
        let noise = ["/quiet", "/noisy"].map(named);
        assert!(noise[0].abs_diff(noise[1]) <= 4, "{noise:?}");
    }

    #[test]
    fn a_name_in_the_rig_file_does_not_tell_what_is_hidden() {
        for plan in plans(1) {
            let rig = plan.case().unwrap().rig_toml();
            assert!(plan.hidden().iter().all(|id| !rig.contains(id)), "{rig}");
        }
    }
}
