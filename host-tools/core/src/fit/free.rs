//! Parameters that an optimiser may move, and the coordinates in which it does.

use bowden_model::effect::{ParameterSpec, Scale};
use bowden_model::law;
use bowden_model::parameters::{NOMINAL_PARAMETERS, NominalParameter};

use super::calibrated::spread;
use super::typical::typical;
use crate::joint_model::JointModel;
use crate::rig::RigParameter;

/// Where a free parameter stands in a model.
#[derive(Clone, Copy)]
pub enum Place {
    /// A nominal parameter.
    Nominal(&'static NominalParameter),
    /// Parameter `parameter` of effect `effect` of the model.
    Effect {
        /// Index into the model's effects.
        effect: usize,
        /// Index into its parameters.
        parameter: usize,
    },
    /// Value of a parameter on one bench: an index into the values of [`JointModel::own`].
    Own(usize),
}

impl Place {
    /// Whether it is one of `parameters`.
    pub(super) fn is_any_of(&self, parameters: &[RigParameter]) -> bool {
        match self {
            Self::Nominal(parameter) => parameters.contains(&RigParameter::Nominal(parameter)),
            Self::Effect { .. } | Self::Own(_) => false,
        }
    }
}

/// A parameter that is fitted.
///
/// The optimiser's coordinate is `x = ln(p / p0) / size` for a ratio and `x = (p - p0) / size` for a difference, with the
/// starting value `p0`; zero is the start.
#[derive(Clone, Copy)]
pub struct Free {
    place: Place,
    spec: ParameterSpec,
    start: f64,
    size: f64,
    /// Mean and standard deviation of the prior in the optimiser's coordinate; infinite spread for none.
    prior: (f64, f64),
}

/// Standard deviation of the logarithm of what is believed, below which the optimiser's coordinate is in proportion to it: a step of
/// its difference quotients is half of a standard deviation at most.
const CLOSELY_KNOWN: f64 = 0.2;

/// Whether a parameter is a moment at which something happens, and which is looked for.
#[must_use]
pub fn is_moment(spec: &ParameterSpec) -> bool {
    spec.unit == "s" && spec.scale == Scale::Linear && spec.searched
}

/// Size of the optimiser's coordinate of a rate: a wave that is a tenth faster is out of step after a few periods, and slopes over such a
/// step tell nothing.
fn rate_size(spec: &ParameterSpec, start: f64, is_of_law: bool) -> f64 {
    /// Change of a frequency, Hz: a coarse step is a fifth of a period within the forty seconds of a usual recording.
    const FREQUENCY_HZ: f64 = 0.05;
    /// Change of the periods in a turn: of a law that is sought over the travel of a joint, and of what is locked to a pulley, which
    /// may go round several times.
    const CYCLES: [f64; 2] = [4.0, 1.0];
    match spec.name {
        "frequency_hz" => (FREQUENCY_HZ / start).min(1.0),
        "cycles_per_turn" => (CYCLES[usize::from(!is_of_law)] / start).min(1.0),
        _ => 1.0,
    }
}

impl Free {
    /// A nominal parameter of `model`; `None` when the model lacks the part.
    #[must_use]
    pub fn nominal(model: &JointModel, section: &str, name: &str) -> Option<Self> {
        let parameter = NOMINAL_PARAMETERS.iter().find(|p| p.section == section && p.spec.name == name)?;
        let start = parameter.get(&model.parameters)?;
        let ratio = start > 0.0 && !name.starts_with("viscous");
        let mut spec = parameter.spec;
        spec.scale = if ratio { Scale::Log } else { Scale::Linear };
        let spread = spread(parameter);
        let size = match ratio {
            true if spread < CLOSELY_KNOWN => spread / CLOSELY_KNOWN,
            true => 1.0,
            false => spec.default.max(start),
        };
        let prior = (0.0, if ratio { spread / size } else { spread });
        Some(Self { place: Place::Nominal(parameter), spec, start, size, prior })
    }

    /// A parameter with a value of its own on one bench of `model`; `None` for one of an effect that the model lacks.
    #[must_use]
    pub fn own(model: &JointModel, index: usize) -> Option<Self> {
        let own = model.own.values.get(index)?;
        let free = match own.parameter {
            RigParameter::Nominal(parameter) => Self::nominal(model, parameter.section, parameter.spec.name)?,
            RigParameter::Effect { descriptor, index } => {
                let effect =
                    model.effects.iter().position(|active| active.descriptor().id == descriptor.id)?;
                Self::effect(model, effect, index)?
            }
            RigParameter::Controller(_) => return None,
        };
        let mut free = Self { place: Place::Own(index), ..free };
        if let Some(value) = own.value {
            free.start = value;
        }
        Some(free)
    }

    /// Parameter of an effect of `model`.
    #[must_use]
    pub fn effect(model: &JointModel, effect: usize, parameter: usize) -> Option<Self> {
        let active = model.effects.get(effect)?;
        let spec = *active.descriptor().parameters.get(parameter)?;
        let start = active.parameters[parameter];
        let size = match spec.scale {
            Scale::Linear if let Some([_, std]) = spec.believed => std,
            Scale::Log => rate_size(&spec, start, law::of(active).is_some()),
            Scale::Linear if spec.default != 0.0 => {
                typical(model, active.descriptor().component, &spec).abs()
            }
            Scale::Linear => 0.1 * (spec.upper - spec.lower),
        };
        let place = Place::Effect { effect, parameter };
        let free = Self { place, spec, start, size, prior: (0.0, f64::INFINITY) };
        Some(match spec.believed {
            Some([value, std]) => free.believed_within(value, std / size),
            None => free,
        })
    }

    /// The same parameter, measured as a ratio to its start, which must be positive.
    #[must_use]
    pub fn as_ratio(mut self) -> Self {
        if self.start > 0.0 {
            self.spec.scale = Scale::Log;
            self.size = 1.0;
        }
        self
    }

    /// The same parameter with what was believed of it before any recording: a value, and a standard deviation in the optimiser's
    /// coordinate.
    #[must_use]
    pub fn believed_within(mut self, value: f64, spread: f64) -> Self {
        let mean = match self.spec.scale {
            Scale::Log if self.start > 0.0 && value > 0.0 => (value / self.start).ln() / self.size,
            _ => (value - self.start) / self.size,
        };
        self.prior = (mean, spread);
        self
    }

    /// The same parameter, believed to be what a fit found, its start, within the standard deviation `std` in the parameter's unit.
    #[must_use]
    pub fn believed_as_found(self, std: f64) -> Self {
        self.believed_within(self.start, std / self.slope_at(self.start))
    }

    /// The same parameter, believed to be `value` as firmly as before.
    #[must_use]
    pub fn believed_to_be(self, value: f64) -> Self {
        self.believed_within(value, self.prior.1)
    }

    /// The same parameter with a lower end of its range's upper end.
    #[must_use]
    pub fn up_to(mut self, upper: f64) -> Self {
        self.spec.upper = self.spec.upper.min(upper);
        self
    }

    /// The parameters of one effect of `model` that a search for missing physics fits.
    #[must_use]
    pub fn of_effect(model: &JointModel, effect: usize) -> Vec<Self> {
        let count = model.effects.get(effect).map_or(0, |active| active.descriptor().parameters.len());
        (0..count)
            .filter_map(|parameter| Self::effect(model, effect, parameter))
            .filter(|free| free.spec.searched)
            .collect()
    }

    /// Where it stands.
    #[must_use]
    pub const fn place(&self) -> Place {
        self.place
    }

    /// Name, unit and range.
    #[must_use]
    pub const fn spec(&self) -> &ParameterSpec {
        &self.spec
    }

    /// Value before the fit.
    #[must_use]
    pub const fn start(&self) -> f64 {
        self.start
    }

    /// The parameter by its name in rig files; `None` where the model lacks the effect.
    #[must_use]
    pub fn parameter(&self, model: &JointModel) -> Option<RigParameter> {
        match self.place {
            Place::Nominal(parameter) => Some(RigParameter::Nominal(parameter)),
            Place::Effect { effect, parameter } => model
                .effects
                .get(effect)
                .map(|active| RigParameter::Effect { descriptor: active.descriptor(), index: parameter }),
            Place::Own(index) => model.own.values.get(index).map(|own| own.parameter),
        }
    }

    /// Bench that has the parameter for itself; `None` for a shared one.
    #[must_use]
    pub fn bench(&self, model: &JointModel) -> Option<usize> {
        match self.place {
            Place::Own(index) => model.own.values.get(index).map(|own| own.bench),
            Place::Nominal(_) | Place::Effect { .. } => None,
        }
    }

    /// Name as reports write it, `section.name`.
    #[must_use]
    pub fn path(&self, model: &JointModel) -> String {
        match self.place {
            Place::Nominal(parameter) => format!("{}.{}", parameter.section, parameter.spec.name),
            Place::Effect { effect, .. } => {
                let id = model.effects.get(effect).map_or("effect", |active| active.descriptor().id);
                format!("{id}.{}", self.spec.name)
            }
            Place::Own(index) => match model.own.values.get(index).map(|own| own.parameter) {
                Some(RigParameter::Effect { descriptor, index }) => {
                    format!("{}.{}", descriptor.id, descriptor.parameters[index].name)
                }
                Some(parameter) => parameter.to_string(),
                None => self.spec.name.to_owned(),
            },
        }
    }

    /// Value at the optimiser's coordinate `x`, kept inside the accepted range.
    #[must_use]
    pub fn value_at(&self, x: f64) -> f64 {
        let value = match self.spec.scale {
            Scale::Log if self.start > 0.0 => self.start * (self.size * x).exp(),
            _ => self.start + self.size * x,
        };
        value.clamp(self.spec.lower, self.spec.upper)
    }

    /// Slope of the value over the coordinate at `value`.
    #[must_use]
    pub fn slope_at(&self, value: f64) -> f64 {
        match self.spec.scale {
            Scale::Log if self.start > 0.0 => self.size * value,
            _ => self.size,
        }
    }

    /// Whether it is a moment at which something happens.
    #[must_use]
    pub fn is_moment(&self) -> bool {
        is_moment(&self.spec)
    }

    /// Whether `value` lies at an end of the accepted range.
    #[must_use]
    pub fn at_bound(&self, value: f64) -> bool {
        let tolerance = 1e-9 * (self.spec.upper - self.spec.lower);
        value <= self.spec.lower + tolerance || value >= self.spec.upper - tolerance
    }

    /// Residual of the prior at `x`; zero where there is none.
    #[must_use]
    pub fn prior_residual(&self, x: f64) -> f64 {
        (x - self.prior.0) / self.prior.1
    }

    /// Slope of [`Self::prior_residual`].
    #[must_use]
    pub fn prior_slope(&self) -> f64 {
        self.prior.1.recip()
    }

    /// Writes the value at `x` into a model.
    pub fn apply(&self, x: f64, model: &mut JointModel) {
        let value = self.value_at(x);
        match self.place {
            Place::Nominal(parameter) => parameter.set(&mut model.parameters, value),
            Place::Effect { effect, parameter } => {
                if let Some(active) = model.effects.get_mut(effect) {
                    active.parameters[parameter] = value;
                }
            }
            Place::Own(index) => {
                if let Some(own) = model.own.values.get_mut(index) {
                    own.value = Some(value);
                }
            }
        }
    }
}
