//! A test case: what the user believes, what is true, and the recordings that follow.

use serde_json::{Map, Value, json};

use crate::config::BenchConfig;
use crate::effects::ConcealedEffect;
use crate::error::BenchError;
use crate::motion::{Motion, MotionKind};
use crate::record::record;
use crate::recording::Recording;

/// A parameter that can be wrong in the rig file, by the short name of the truth record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// `mu`: friction coefficient.
    FrictionCoefficient,
    /// `ea`: axial stiffness.
    AxialStiffness,
    /// `f0`: pretension.
    Pretension,
    /// `res`: winding resistance.
    Resistance,
    /// `kt`: torque constant.
    TorqueConstant,
    /// `m`: mass of the load.
    Mass,
    /// `r2`: radius of the output pulley.
    OutputRadius,
    /// `l`: length of the arm.
    Arm,
}

impl Parameter {
    /// All of them with their short names.
    pub const NAMES: [(&'static str, Self); 8] = [
        ("mu", Self::FrictionCoefficient),
        ("ea", Self::AxialStiffness),
        ("f0", Self::Pretension),
        ("res", Self::Resistance),
        ("kt", Self::TorqueConstant),
        ("m", Self::Mass),
        ("r2", Self::OutputRadius),
        ("l", Self::Arm),
    ];

    fn short_name(self) -> &'static str {
        match self {
            Self::FrictionCoefficient => "mu",
            Self::AxialStiffness => "ea",
            Self::Pretension => "f0",
            Self::Resistance => "res",
            Self::TorqueConstant => "kt",
            Self::Mass => "m",
            Self::OutputRadius => "r2",
            Self::Arm => "l",
        }
    }

    fn of(self, config: &mut BenchConfig) -> &mut f64 {
        match self {
            Self::FrictionCoefficient => &mut config.friction_coefficient,
            Self::AxialStiffness => &mut config.axial_stiffness_n,
            Self::Pretension => &mut config.pretension_n,
            Self::Resistance => &mut config.resistance_ohm,
            Self::TorqueConstant => &mut config.torque_constant_nm_per_a,
            Self::Mass => &mut config.mass_kg,
            Self::OutputRadius => &mut config.output_radius_m,
            Self::Arm => &mut config.arm_m,
        }
    }
}

/// A bench with something to find in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Name in the rig file.
    pub name: String,
    /// What the user believes.
    pub nominal: BenchConfig,
    /// What is true, apart from the effects.
    pub truth: BenchConfig,
    /// What is concealed.
    pub effects: Vec<ConcealedEffect>,
    /// Parameters that are off by more than a real bench's few per cent.
    pub parameters_off: Vec<Parameter>,
    /// Seed of motions and noise.
    pub seed: u64,
}

/// Added to the seed of a training run for the heldout run's noise and motion.
const HELDOUT_SEED: u64 = 0x6865_6c64;

impl Case {
    /// A nominal bench `percent` off (see [`BenchConfig::perturbed`]) that conceals `effects`.
    pub fn new(name: &str, effects: Vec<ConcealedEffect>, seed: u64, percent: f64) -> Self {
        Self::of_bench(name, BenchConfig::default(), effects, seed, percent)
    }

    /// The same of a bench of which the user believes `nominal`.
    pub fn of_bench(
        name: &str,
        mut nominal: BenchConfig,
        effects: Vec<ConcealedEffect>,
        seed: u64,
        percent: f64,
    ) -> Self {
        for effect in &effects {
            effect.prepare(&mut nominal);
        }
        let truth = nominal.perturbed(seed, percent);
        Self { name: name.to_owned(), nominal, truth, effects, parameters_off: Vec::new(), seed }
    }

    /// Makes the true value of `parameter` `ratio` times the nominal one.
    #[must_use]
    pub fn off(mut self, parameter: Parameter, ratio: f64) -> Self {
        *parameter.of(&mut self.truth) = *parameter.of(&mut self.nominal) * ratio;
        self.parameters_off.push(parameter);
        self
    }

    /// Records `seconds` of `kind` with fresh effects.
    ///
    /// # Errors
    /// As [`record`].
    pub fn train(&self, kind: MotionKind, seconds: f64) -> Result<Recording, BenchError> {
        record(&self.truth, &self.effects, &Motion::new(kind, seconds, self.seed), self.seed)
    }

    /// Records `seconds` of `kind` with other seeds, effects being `age_s` old (the length of the training run).
    ///
    /// # Errors
    /// As [`record`].
    pub fn heldout(&self, kind: MotionKind, seconds: f64, age_s: f64) -> Result<Recording, BenchError> {
        let seed = self.seed.wrapping_add(HELDOUT_SEED);
        record(&self.truth, &self.effects, &Motion::new(kind, seconds, seed).starting_at(age_s), seed)
    }

    /// The rig file that the user has.
    pub fn rig_toml(&self) -> String {
        self.nominal.rig_toml(&self.name)
    }

    /// What was concealed: `effects`, `outside_catalogue`, `components`, `parameters_off`, `effect_parameters`
    /// (`id.parameter` to value) and `true_over_nominal`.
    ///
    /// `effects` holds catalogue ids only; physics outside it stands in `outside_catalogue`.
    pub fn truth_record(&self) -> Value {
        let ids = |outside: bool| -> Vec<&'static str> {
            let wanted = self.effects.iter().filter(|effect| effect.is_outside_catalogue() == outside);
            wanted.map(ConcealedEffect::id).collect()
        };
        let mut components: Vec<&str> =
            self.effects.iter().map(|effect| effect.component().as_str()).collect();
        components.sort_unstable();
        components.dedup();
        let effect_parameters: Map<String, Value> = self
            .effects
            .iter()
            .flat_map(|effect| {
                effect
                    .parameters()
                    .into_iter()
                    .map(|(name, value)| (format!("{}.{name}", effect.id()), value))
            })
            .collect();
        let (mut truth, mut nominal) = (self.truth.clone(), self.nominal.clone());
        let ratios: Map<String, Value> = Parameter::NAMES
            .into_iter()
            .map(|(name, parameter)| {
                (name.to_owned(), json!(*parameter.of(&mut truth) / *parameter.of(&mut nominal)))
            })
            .collect();
        let off: Vec<&str> = self.parameters_off.iter().map(|parameter| parameter.short_name()).collect();
        json!({
            "effects": ids(false),
            "outside_catalogue": ids(true),
            "components": components,
            "parameters_off": off,
            "effect_parameters": effect_parameters,
            "true_over_nominal": ratios,
        })
    }

    /// [`Self::truth_record`] as indented JSON with a line feed at its end.
    pub fn truth_json(&self) -> String {
        format!("{:#}\n", self.truth_record())
    }
}
