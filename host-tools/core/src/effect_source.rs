//! A law that a diagnosis has found, as a file of the catalogue: the list of names grows by use.

use std::fmt::Write;

use bowden_model::effect::{ActiveEffect, Scale};
use bowden_model::law::{self, Law};

use crate::formula::evaluate;
use crate::outcome::Failure;
use crate::rig::Rig;

/// Place at which the file's test holds the formula.
const TESTED_AT: f64 = 0.4;

/// The laws of a rig file, in its order.
#[must_use]
pub fn laws_of(rig: &Rig) -> Vec<(&'static Law, ActiveEffect)> {
    rig.effects.iter().filter_map(|active| Some((law::of(active)?, *active))).collect()
}

/// Source of `model/src/effects/ID.rs`: the law under the name `id`, with what was fitted as the defaults, and a test that holds it
/// against its formula.
///
/// # Errors
/// When `id` is no name for an effect, or one that is taken.
pub fn effect_source(law: &Law, active: &ActiveEffect, id: &str) -> Result<String, Failure> {
    check_id(id)?;
    let descriptor = active.descriptor();
    let name = id.to_uppercase();
    let (formula, meaning) = (law.formula(), law.port().meaning());
    let mut text = format!(
        "//! {}: `{} = {formula}`.\n//!\n//! A diagnosis found it as a law; the defaults are what was fitted.\n\n",
        capitalised(meaning),
        law.port().name()
    );
    let channels = if descriptor.channels.is_empty() { "" } else { "use crate::channel::Channel;\n" };
    // Writing to a String cannot fail.
    let _ = write!(
        text,
        "{channels}use crate::effect::{{Component, Descriptor, ParameterSpec}};\n\
         use crate::law::{{Form, Law, Port, Variable}};\n\n\
         /// {}: `{formula}`.\n\
         pub static {name}: Law =\n    Law::named(Port::{:?}, Variable::{:?}, Form::{:?}, FORMULA, &DESCRIPTOR);\n\n\
         const FORMULA: &str = {formula:?};\n\n\
         static DESCRIPTOR: Descriptor = Descriptor {{\n    id: {id:?},\n    component: Component::{:?},\n    summary: {meaning:?},\n    \
         parameters: &[\n",
        capitalised(meaning),
        law.port(),
        law.variable(),
        law.form(),
        descriptor.component,
    );
    for (spec, value) in descriptor.parameters.iter().zip(active.parameters) {
        let scale = if spec.scale == Scale::Log { "log" } else { "linear" };
        let _ = writeln!(
            text,
            "        ParameterSpec::{scale}({:?}, {:?}, [{:?}, {:?}], {value:?}, {:?}),",
            spec.name, spec.unit, spec.lower, spec.upper, spec.meaning
        );
    }
    let channels: Vec<String> =
        descriptor.channels.iter().map(|channel| format!("Channel::{channel:?}")).collect();
    let _ = write!(
        text,
        "    ],\n    neutral: Some(0.0),\n    channels: &[{}],\n}};\n\n{}",
        channels.join(", "),
        test(law, active, &name)?
    );
    Ok(text)
}

/// The test of the file: the value that the text of the formula has.
fn test(law: &Law, active: &ActiveEffect, name: &str) -> Result<String, Failure> {
    let parameters = active.descriptor().parameters;
    let mut values: Vec<(&str, f64)> =
        parameters.iter().map(|spec| spec.name).zip(active.parameters).collect();
    values.push((law.variable().name(), TESTED_AT));
    let value = evaluate(law.formula(), &values).map_err(Failure::failed)?;
    Ok(format!(
        "#[cfg(test)]\nmod tests {{\n    use super::{{DESCRIPTOR, {name}}};\n    use crate::effect::MAX_STATE;\n\n    \
         /// The formula at `{}` = {TESTED_AT}, reached from zero.\n    #[test]\n    fn it_has_the_value_of_its_formula() {{\n        \
         let (p, mut memory) = (DESCRIPTOR.defaults(), [0.0; MAX_STATE]);\n        \
         {name}.form().remembered(&p, &mut memory, 0.0);\n        \
         let (found, want) = ({name}.form().remembered(&p, &mut memory, {TESTED_AT:?}), {value:.4e});\n        \
         assert!((found - want).abs() <= 1e-3 * found.abs(), \"{{found}}, expected {{want}}\");\n    }}\n}}\n",
        law.variable().name()
    ))
}

/// Where the file has to be registered, in words for whoever has to do it.
#[must_use]
pub fn registration(id: &str) -> String {
    let name = id.to_uppercase();
    format!(
        "to register it: put the file into model/src/effects/ and add to model/src/effects.rs\n  mod {id};\n  use {id}::{name};\n  \
         &{name},    in CATALOGUE, whose length grows by one\n`bowden diagnose ... --also {id}` then tries it by its name\n"
    )
}

fn check_id(id: &str) -> Result<(), Failure> {
    let letters = id.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    if !letters || !id.starts_with(|c: char| c.is_ascii_lowercase()) {
        return Err(Failure::bad_input(format!(
            "--id {id}: not a name for an effect; use lower-case letters, digits and `_`, for example joint_oil_drag"
        )));
    }
    if bowden_model::effects::find(id).is_some() || law::find(id).is_some() {
        return Err(Failure::bad_input(format!("--id {id}: there is one with this name; choose another")));
    }
    Ok(())
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
