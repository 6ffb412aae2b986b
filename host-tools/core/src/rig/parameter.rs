//! Parameters by the names that files, the command line and reports give them.

use std::fmt;

use bowden_model::effect::{ActiveEffect, Descriptor, ParameterSpec};
use bowden_model::effects::{CATALOGUE, find};
use bowden_model::parameters::{JointParameters, NOMINAL_PARAMETERS, NominalParameter, nominal};

use super::section::advice;
use super::{ProportionalLaw, Rig, parse};
use crate::outcome::Failure;

/// A number of a rig: `load.mass_kg`, `effects.joint_spring.rest_rad`, `controller.gain_duty_per_rad`.
#[derive(Clone, Copy)]
pub enum RigParameter {
    /// A nominal parameter, `SECTION.NAME`.
    Nominal(&'static NominalParameter),
    /// A parameter of an effect, `effects.ID.NAME`.
    Effect {
        /// The effect.
        descriptor: &'static Descriptor,
        /// Index into its parameters.
        index: usize,
    },
    /// A parameter of the position loop, `controller.NAME`.
    Controller(ControllerParameter),
}

/// A number of `[controller]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControllerParameter {
    /// `gain_duty_per_rad`.
    Gain,
    /// `duty_limit`.
    DutyLimit,
    /// `delay_s`.
    Delay,
}

impl ControllerParameter {
    const ALL: [Self; 3] = [Self::Gain, Self::DutyLimit, Self::Delay];

    const fn name(self) -> &'static str {
        match self {
            Self::Gain => "gain_duty_per_rad",
            Self::DutyLimit => "duty_limit",
            Self::Delay => "delay_s",
        }
    }

    const fn slot(self, law: &mut ProportionalLaw) -> &mut f64 {
        match self {
            Self::Gain => &mut law.gain_duty_per_rad,
            Self::DutyLimit => &mut law.duty_limit,
            Self::Delay => &mut law.delay_s,
        }
    }
}

/// Section of effects in a rig file, and of their parameters' names.
const EFFECTS: &str = "effects";

/// Section of the position loop.
const CONTROLLER: &str = "controller";

impl RigParameter {
    /// The parameter of a name.
    ///
    /// # Errors
    /// What is unknown in `name`, with the nearest known name.
    pub fn parse(name: &str) -> Result<Self, String> {
        let parts: Vec<&str> = name.split('.').collect();
        match parts[..] {
            [EFFECTS, id, parameter] => {
                let effect = find(id).ok_or_else(|| {
                    let known = CATALOGUE.iter().map(|effect| effect.descriptor().id);
                    format!("unknown effect `{id}` in `{name}`; {}", advice(id, known))
                })?;
                let descriptor = effect.descriptor();
                let index = descriptor.index_of(parameter).ok_or_else(|| {
                    let known = descriptor.parameters.iter().map(|spec| spec.name);
                    format!("effect `{id}` has no parameter `{parameter}`; {}", advice(parameter, known))
                })?;
                Ok(Self::Effect { descriptor, index })
            }
            [CONTROLLER, parameter] => {
                let all = ControllerParameter::ALL;
                let found = all.into_iter().find(|known| known.name() == parameter);
                found.map(Self::Controller).ok_or_else(|| {
                    let known = all.map(ControllerParameter::name);
                    format!("[controller] has no parameter `{parameter}`; {}", advice(parameter, known))
                })
            }
            [section, parameter] => nominal(section, parameter).map(Self::Nominal).ok_or_else(|| {
                let known: Vec<String> =
                    NOMINAL_PARAMETERS.iter().map(|p| format!("{}.{}", p.section, p.spec.name)).collect();
                format!("unknown parameter `{name}`; {}", advice(name, known.iter().map(String::as_str)))
            }),
            _ => Err(format!(
                "unknown parameter `{name}`; expected SECTION.NAME, effects.ID.NAME or controller.NAME"
            )),
        }
    }

    /// Every nominal parameter.
    pub fn nominal() -> impl Iterator<Item = Self> {
        NOMINAL_PARAMETERS.iter().map(Self::Nominal)
    }

    /// Whether it belongs to an effect, which a rig need not contain yet.
    #[must_use]
    pub const fn is_of_effect(&self) -> bool {
        matches!(self, Self::Effect { .. })
    }

    /// Whether a fit may move it: no parameter of the position loop, and none that says which of two kinds is meant.
    #[must_use]
    pub const fn can_be_fitted(&self) -> bool {
        match self {
            Self::Nominal(_) => true,
            Self::Effect { descriptor, index } => !descriptor.parameters[*index].is_choice,
            Self::Controller(_) => false,
        }
    }

    /// Smallest and largest accepted value, and unit.
    #[must_use]
    pub fn range(&self) -> (f64, f64, &'static str) {
        match self {
            Self::Nominal(parameter) => (parameter.spec.lower, parameter.spec.upper, parameter.spec.unit),
            Self::Effect { descriptor, index } => {
                let spec = &descriptor.parameters[*index];
                (spec.lower, spec.upper, spec.unit)
            }
            Self::Controller(parameter) => {
                let bounds = parse::controller_bounds(parameter.name());
                (bounds.lower, bounds.upper, bounds.unit)
            }
        }
    }

    /// Value in the parts of a joint; `None` where the part or the effect is not there. Of several instances of an effect the
    /// first counts.
    pub(crate) fn value_in(
        &self,
        joint: &JointParameters,
        effects: &[ActiveEffect],
        controller: Option<&ProportionalLaw>,
    ) -> Option<f64> {
        match self {
            Self::Nominal(parameter) => parameter.get(joint),
            Self::Effect { descriptor, index } => {
                let instance = effects.iter().find(|active| active.descriptor().id == descriptor.id);
                instance.map(|active| active.parameters[*index])
            }
            Self::Controller(parameter) => controller.map(|law| *parameter.slot(&mut law.clone())),
        }
    }

    /// Replaces what [`Self::value_in`] finds; does nothing where it finds none.
    pub(crate) fn replace_in(
        &self,
        joint: &mut JointParameters,
        effects: &mut [ActiveEffect],
        controller: Option<&mut ProportionalLaw>,
        value: f64,
    ) {
        match self {
            Self::Nominal(parameter) => parameter.set(joint, value),
            Self::Effect { descriptor, index } => {
                let is_meant = |active: &&mut ActiveEffect| active.descriptor().id == descriptor.id;
                if let Some(active) = effects.iter_mut().find(is_meant) {
                    active.parameters[*index] = value;
                }
            }
            Self::Controller(parameter) => {
                if let Some(law) = controller {
                    *parameter.slot(law) = value;
                }
            }
        }
    }

    /// Value in a rig; `None` where the rig lacks the part, or has the effect not exactly once.
    #[must_use]
    pub fn get(&self, rig: &Rig) -> Option<f64> {
        let is_ambiguous = match self {
            Self::Effect { descriptor, .. } => {
                rig.effects.iter().filter(|active| active.descriptor().id == descriptor.id).count() > 1
            }
            Self::Nominal(_) | Self::Controller(_) => false,
        };
        if is_ambiguous {
            return None;
        }
        self.value_in(&rig.joint, &rig.effects, rig.controller.as_ref())
    }

    /// Replaces the value in a rig.
    ///
    /// # Errors
    /// A value outside the accepted range; a rig that lacks the part, or has the effect not exactly once.
    pub fn set(&self, rig: &mut Rig, value: f64) -> Result<(), String> {
        let (lower, upper, unit) = self.range();
        // Written so that NaN is refused too.
        if !(value >= lower && value <= upper) {
            let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
            return Err(format!(
                "{self}: got {value}, allowed {lower} to {upper}{unit}; check value and unit"
            ));
        }
        if let Self::Effect { descriptor, index } = self
            && let Some(reason) = refused(&descriptor.parameters[*index], value)
        {
            return Err(format!("{self}: {reason}"));
        }
        if self.get(rig).is_none() {
            let (lacking, advice) = match self {
                Self::Nominal(parameter) => {
                    (format!("no [{}]", parameter.section), "state the section there")
                }
                Self::Effect { .. } => {
                    ("not exactly one such effect".to_owned(), "list the effect there once")
                }
                Self::Controller(_) => ("no [controller]".to_owned(), "state the section there"),
            };
            return Err(format!("{self}: the rig has {lacking}; {advice}, or leave the parameter out"));
        }
        self.replace_in(&mut rig.joint, &mut rig.effects, rig.controller.as_mut(), value);
        Ok(())
    }
}

/// A parameter and its value as a command line states them, `load.mass_kg=2.0`.
#[derive(Clone, Debug, PartialEq)]
pub struct Assignment {
    /// What is set.
    pub parameter: RigParameter,
    /// To which value.
    pub value: f64,
}

impl Assignment {
    /// Sets the value in a rig.
    ///
    /// # Errors
    /// See [`RigParameter::set`].
    pub fn apply(&self, rig: &mut Rig) -> Result<(), Failure> {
        self.parameter.set(rig, self.value).map_err(Failure::bad_input)
    }
}

impl std::str::FromStr for Assignment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, number) =
            text.split_once('=').ok_or("expected PARAMETER=VALUE, such as load.mass_kg=2.0")?;
        let parameter = RigParameter::parse(name.trim())?;
        let value = number.trim().parse().map_err(|_| format!("`{number}` is not a number"))?;
        Ok(Self { parameter, value })
    }
}

impl fmt::Display for RigParameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nominal(parameter) => write!(f, "{}.{}", parameter.section, parameter.spec.name),
            Self::Effect { descriptor, index } => {
                write!(f, "{EFFECTS}.{}.{}", descriptor.id, descriptor.parameters[*index].name)
            }
            Self::Controller(parameter) => write!(f, "{CONTROLLER}.{}", parameter.name()),
        }
    }
}

impl fmt::Debug for RigParameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl PartialEq for RigParameter {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            // Two nominal parameters of one place in the table are one.
            (Self::Nominal(a), Self::Nominal(b)) => (a.section, a.spec.name) == (b.section, b.spec.name),
            (
                Self::Effect { descriptor: a, index: a_index },
                Self::Effect { descriptor: b, index: b_index },
            ) => (a.id, a_index) == (b.id, b_index),
            (Self::Controller(a), Self::Controller(b)) => a == b,
            _ => false,
        }
    }
}

/// Why a value within the bounds of a parameter means nothing.
pub(super) fn refused(spec: &ParameterSpec, value: f64) -> Option<String> {
    let kinds: Vec<String> = spec.forms.iter().map(f64::to_string).collect();
    (!spec.takes(value)).then(|| format!("got {value}, expected {}", kinds.join(" or ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bench;

    #[test]
    fn names_lead_to_parameters_and_back() {
        for name in ["load.mass_kg", "effects.tendon_slack.looseness_m", "controller.gain_duty_per_rad"] {
            assert_eq!(RigParameter::parse(name).unwrap().to_string(), name);
        }
    }

    #[test]
    fn unknown_names_are_refused_with_the_nearest_one() {
        for (name, advice) in [
            ("load.mas_kg", "did you mean `load.mass_kg`?"),
            ("effects.tendon_slak.looseness_m", "did you mean `tendon_slack`?"),
            ("effects.tendon_slack.loosenes_m", "did you mean `looseness_m`?"),
            ("controller.gain", "did you mean `gain_duty_per_rad`?"),
            ("mass", "expected SECTION.NAME"),
        ] {
            let refused = RigParameter::parse(name).unwrap_err();
            assert!(refused.contains(advice), "{refused}");
        }
    }

    #[test]
    fn a_value_replaces_the_rigs_and_nothing_else() {
        let plain = test_bench::rig();
        let mut changed = plain.clone();
        "load.mass_kg=1.25".parse::<Assignment>().unwrap().apply(&mut changed).unwrap();
        assert_eq!(changed.joint.load.unwrap().mass_kg, 1.25);
        changed.joint.load = plain.joint.load;
        assert_eq!(changed, plain);
    }

    #[test]
    fn values_out_of_range_and_parts_that_the_rig_lacks_are_refused() {
        for (assignment, reason) in [
            ("load.mass_kg=-1", "load.mass_kg: got -1, allowed 0 to 1000 kg"),
            ("load.mass_kg=nan", "load.mass_kg: got NaN"),
            ("controller.duty_limit=0.5", "the rig has no [controller]"),
            ("effects.joint_backlash.gap_rad=0.01", "not exactly one such effect"),
        ] {
            let mut rig = test_bench::rig();
            let refused = assignment.parse::<Assignment>().unwrap().apply(&mut rig).unwrap_err();
            assert!(refused.message().contains(reason), "{}", refused.message());
            assert_eq!(rig, test_bench::rig());
        }
        for (text, reason) in [("load.mass_kg", "PARAMETER=VALUE"), ("load.mass_kg=heavy", "not a number")] {
            let refused = text.parse::<Assignment>().unwrap_err();
            assert!(refused.contains(reason), "{refused}");
        }
    }
}
