//! One concealed effect of the virtual bench, fitted by the same effect of bowden's model.

use bowden_core::fit::free::Free;
use bowden_core::fit::objective::{Objective, Part};
use bowden_core::fit::recalibrated::recalibrated;
use bowden_core::fit::solver::solve;
use bowden_core::joint_model::JointModel;
use bowden_core::rig::Rig;
use bowden_model::effect::{ActiveEffect, Target};
use bowden_model::effects;
use virtual_bench::{BenchConfig, ConcealedEffect, Motion, MotionKind, nominal_rig_toml, record};

use crate::recording_of;

/// Length of the recordings, s.
const SECONDS: f64 = 22.0;

/// Standard deviation, in per cent, by which the bench's stiffness and pretension are off the rig file.
const PERTURBED_PERCENT: f64 = 3.0;

/// Evaluations per parameter and round of the optimiser.
const PATIENCE: usize = 8;

/// What a fit has made of an effect.
#[derive(Clone, Debug)]
pub struct Recovery {
    /// The effect with its fitted parameters.
    pub effect: ActiveEffect,
    /// Held-out loss of the recalibrated rig without the effect.
    pub loss_without: f64,
    /// Held-out loss with it.
    pub loss_with: f64,
}

impl Recovery {
    /// Records the lab's motion on a perturbed bench that conceals one effect, and fits the nominal rig with that effect,
    /// begun at its defaults and at what `start` changes of them.
    ///
    /// # Panics
    /// If the bench refuses the effect, the model has none of that name, or the fit fails.
    #[must_use]
    pub fn of(
        concealed: impl Into<ConcealedEffect>,
        seed: u64,
        start: impl Fn(ActiveEffect) -> ActiveEffect,
    ) -> Self {
        let concealed = concealed.into();
        let effect =
            effects::find(concealed.id()).expect("bowden's catalogue has every effect of the bench's");
        let bench = BenchConfig::default().perturbed(seed, PERTURBED_PERCENT);
        let motion = Motion::new(MotionKind::Lab, SECONDS, seed);
        let recording = recording_of(&record(&bench, &[concealed], &motion, seed).expect("the bench runs"));
        let rig = Rig::parse(&nominal_rig_toml("bench"), "rig.toml").expect("the nominal rig is readable");
        let nominal = JointModel {
            elements: 8,
            step_s: 1e-3,
            ..JointModel::from_rig(&rig, &recording).expect("the recording drives the rig")
        };
        let objective =
            Objective::new(&nominal, &[recording], &[], true).expect("the recording can be compared");
        let loss = |model: &JointModel, free: &[Free]| {
            let solution = solve(&objective, model, free, PATIENCE).expect("the model can be driven");
            (objective.mean_loss(&solution.residuals, Part::HeldOut), solution)
        };
        let (loss_without, _) = loss(&nominal, &recalibrated(&nominal));
        let mut with = nominal.clone();
        with.effects.push(start(ActiveEffect::with_defaults(effect)));
        let mut free = recalibrated(&with);
        free.extend(Free::of_effect(&with, 0));
        let (loss_with, fitted) = loss(&with, &free);
        println!(
            "held-out loss {loss_without:.3} without, {loss_with:.3} with, ratio {:.3}",
            loss_with / loss_without
        );
        for ((free, value), std) in free.iter().zip(&fitted.values).zip(&fitted.slopes().stds) {
            println!("  {} {value:.5} ± {:.5}", free.path(&with), std.unwrap_or(f64::NAN));
        }
        Self { effect: fitted.model.effects[0], loss_without, loss_with }
    }

    /// Asserts one parameter against the bench's.
    ///
    /// # Panics
    /// If it is farther off than `tolerance`, or the effect has no parameter of that name.
    #[must_use]
    #[track_caller]
    pub fn finds(&self, parameter: &str, truth: f64, tolerance: f64) -> &Self {
        let index = self.effect.descriptor().index_of(parameter);
        let found = index.map(|index| self.effect.parameters[index]);
        assert!(
            found.is_some_and(|found| (found - truth).abs() <= tolerance),
            "{parameter}: {found:?} for {truth} ± {tolerance}"
        );
        self
    }

    /// Asserts that the effect leaves less than `share` of the held-out loss that a recalibration alone leaves.
    ///
    /// # Panics
    /// If it leaves more.
    #[track_caller]
    pub fn leaves_less_than(&self, share: f64) {
        assert!(
            self.loss_with < share * self.loss_without,
            "held-out loss {} with the effect, {} without",
            self.loss_with,
            self.loss_without
        );
    }
}

/// The effect begun at its defaults.
#[must_use]
pub fn as_it_is(effect: ActiveEffect) -> ActiveEffect {
    effect
}

/// The effect on one sensor.
pub fn on(channel: bowden_model::channel::Channel) -> impl Fn(ActiveEffect) -> ActiveEffect {
    move |effect| ActiveEffect { target: Target::One(channel), ..effect }
}
