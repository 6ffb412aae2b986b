//! Parameter values while they are being computed from a rig.

use std::collections::BTreeMap;
use std::fmt::Display;

use bowden_control::scale::{Angle, Code, Quantity};
use bowden_core::outcome::Failure;
use bowden_link::message::Parameter;

use super::Change;
use crate::ParameterSet;
use crate::parameters::shortest;

/// Values for a board's parameters, each with the keys of the rig that it comes from.
pub(super) struct Draft<'p> {
    parameters: &'p ParameterSet,
    recorded: &'p [(u16, f32)],
    values: BTreeMap<u16, (f64, Vec<String>)>,
}

impl<'p> Draft<'p> {
    /// A draft without values.
    pub(super) fn new(parameters: &'p ParameterSet, recorded: &'p [(u16, f32)]) -> Self {
        Self { parameters, recorded, values: BTreeMap::new() }
    }

    fn parameter(&self, name: &str) -> Result<&'p Parameter, String> {
        let found = self.parameters.all().iter().find(|parameter| parameter.name.as_str() == name);
        found.ok_or_else(|| format!("this firmware has no parameter `{name}`"))
    }

    /// Value of a parameter: the drafted one, else that of the recording, else the board's.
    ///
    /// # Errors
    /// The board has no such parameter.
    pub(super) fn value(&self, name: &str) -> Result<f64, String> {
        let parameter = self.parameter(name)?;
        if let Some((value, _)) = self.values.get(&parameter.index) {
            return Ok(*value);
        }
        let recorded = self.recorded.iter().find(|(index, _)| *index == parameter.index);
        Ok(shortest(recorded.map_or(parameter.value, |(_, value)| *value)))
    }

    /// Whether the rig already gave this parameter a value.
    pub(super) fn has(&self, name: &str) -> bool {
        self.parameter(name).is_ok_and(|parameter| self.values.contains_key(&parameter.index))
    }

    /// Gives a parameter a value; `source` is the key of the rig that it comes from.
    ///
    /// # Errors
    /// The board has no such parameter.
    pub(super) fn set(&mut self, name: &str, value: f64, source: &dyn Display) -> Result<(), String> {
        let index = self.parameter(name)?.index;
        let (drafted, sources) = self.values.entry(index).or_default();
        *drafted = value;
        let source = source.to_string();
        // An effect clears the term before it sets its strength.
        if !sources.contains(&source) {
            sources.push(source);
        }
        Ok(())
    }

    /// What differs from the board, in the board's order.
    ///
    /// # Errors
    /// Exit status 2 for the first value outside the range of its parameter.
    pub(super) fn changes(&self, file: &str) -> Result<Vec<Change>, Failure> {
        let mut changes = Vec::new();
        for (index, (value, sources)) in &self.values {
            let Some(parameter) = self.parameters.all().get(usize::from(*index)) else { continue };
            let Parameter { name, unit, value: old, minimum, maximum, .. } = parameter;
            let new = *value as f32;
            if (f64::from(new) - f64::from(*old)).abs() <= resolution(parameter) {
                continue;
            }
            let sources = sources.join(", ");
            if !(new >= *minimum && new <= *maximum) {
                let allowed = format!("{minimum:?} to {maximum:?} {unit}");
                return Err(Failure::bad_input(format!(
                    "{file}: {sources}: {name}: got {new:?}, allowed {}; check value and unit",
                    allowed.trim_end()
                )));
            }
            let (name, unit) = (name.as_str().to_owned(), unit.as_str().to_owned());
            changes.push(Change { index: *index, name, old: *old, new, unit, sources });
        }
        Ok(changes)
    }
}

/// Difference below which the board's control treats two values of a parameter as one: a step of the fixed-point
/// quantity or of the counter that it becomes, and never less than the precision of the parameter itself.
fn resolution(parameter: &Parameter) -> f64 {
    let step = |fraction_bits: u32| (-f64::from(fraction_bits)).exp2();
    let of_unit = match parameter.unit.as_str() {
        "count" => 0.5,
        "code" => step(Code::FRACTION_BITS),
        // Angle, speed, torque, tension, current and voltage have the same step.
        "rad" | "rad/s" | "N·m" | "N" | "A" | "V" => step(Angle::FRACTION_BITS),
        _ => 0.0,
    };
    of_unit.max(f64::from(f32::EPSILON) * f64::from(parameter.value.abs()))
}
