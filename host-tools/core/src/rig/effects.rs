//! Effects of a rig file: `simulation.effects` and the tables `[effects.ID]`.
//!
//! Where an effect of a sensor acts on several channels in different strength, its tables form a list,
//! `[[effects.ID]]`, one entry a channel. So do the instances of one that a part has several times, as the harmonics of cogging.

use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Descriptor, Effect, Target};
use bowden_model::effects::{CATALOGUE, find};
use toml::de::DeValue;

use super::parameter::refused;
use super::section::{Bounds, Located, Section, advice};
use crate::outcome::Failure;

/// Key of an effect's table that names the sensor.
pub(super) const CHANNEL_KEY: &str = "channel";

/// Name of all four tension channels together.
const TENSIONS: &str = "tensions";

/// Reads the effects in the order of `simulation.effects`.
pub(super) fn read(file: &Section, simulation: Option<&Section>) -> Result<Vec<ActiveEffect>, Failure> {
    let tables = file.section("effects", "effects")?;
    let ids = match simulation {
        Some(simulation) => simulation.strings("effects")?.unwrap_or_default(),
        None => Vec::new(),
    };
    let mut active = Vec::new();
    for (place, (id, span)) in ids.iter().enumerate() {
        let refuse = |reason: String| file.source.at(span, reason);
        let effect = known(id).map_err(refuse)?;
        if ids[..place].iter().any(|(before, _)| before == id) {
            return Err(refuse(format!("effect `{id}` is listed twice; list it once")));
        }
        let descriptor = effect.descriptor();
        match tables.as_ref().and_then(|tables| tables.get(id)) {
            Some(value) => read_tables(file, effect, value, &mut active)?,
            None if descriptor.channels.len() > 1 => {
                let channels = channel_names(descriptor).join(", ");
                return Err(refuse(format!(
                    "effect `{id}` needs a table [effects.{id}] with `channel`, one of {channels}; add it"
                )));
            }
            None => active.push(ActiveEffect::with_defaults(effect)),
        }
    }
    if let Some(tables) = tables {
        for (id, span, _) in tables.entries() {
            if ids.iter().all(|(listed, _)| *listed != id) {
                let reason = match find(id) {
                    Some(_) => {
                        format!("effect `{id}` is not in simulation.effects; list it there or drop its table")
                    }
                    None => format!("unknown effect `{id}`; {}", advice(id, ids.iter().map(|(id, _)| *id))),
                };
                return Err(file.source.at(&span, reason));
            }
        }
    }
    Ok(active)
}

/// The effect of the catalogue with this name, or what is wrong with the name.
pub(super) fn known(id: &str) -> Result<&'static dyn Effect, String> {
    find(id).ok_or_else(|| {
        let known = CATALOGUE.iter().map(|effect| effect.descriptor().id);
        format!("unknown effect `{id}`; {}", advice(id, known))
    })
}

/// Reads `[effects.ID]`, or each entry of `[[effects.ID]]`.
fn read_tables(
    file: &Section,
    effect: &'static dyn Effect,
    value: &Located,
    active: &mut Vec<ActiveEffect>,
) -> Result<(), Failure> {
    let name = format!("effects.{}", effect.descriptor().id);
    let entries = match value.get_ref() {
        DeValue::Array(array) => array.iter().collect(),
        _ => vec![value],
    };
    for entry in entries {
        let span = entry.span();
        let DeValue::Table(table) = entry.get_ref() else {
            return Err(file.source.at(&span, format!("{name}: expected a table; write [{name}]")));
        };
        let section = Section::new(file.source, &name, span, table);
        read_entry(&section, effect, active)?;
    }
    Ok(())
}

fn read_entry(
    section: &Section,
    effect: &'static dyn Effect,
    active: &mut Vec<ActiveEffect>,
) -> Result<(), Failure> {
    let descriptor = effect.descriptor();
    let names = descriptor.parameters.iter().map(|spec| spec.name);
    let sensor_key = (!descriptor.channels.is_empty()).then_some(CHANNEL_KEY);
    section.refuse_unknown("parameter", names.chain(sensor_key))?;
    let mut parameters = descriptor.defaults();
    for (value, spec) in parameters.iter_mut().zip(descriptor.parameters) {
        let bounds = Bounds { lower: spec.lower, upper: spec.upper, unit: spec.unit };
        if let Some(given) = section.number(spec.name, bounds)? {
            if let Some(reason) = refused(spec, given) {
                let span = section.get(spec.name).map_or(section.span.clone(), Located::span);
                let key = section.path(spec.name);
                return Err(section.source.at(&span, format!("{key}: {reason}; correct it")));
            }
            *value = given;
        }
    }
    for target in targets(section, descriptor)? {
        let one = ActiveEffect { effect, parameters, target, bench: None };
        if active.iter().any(|other| one.excludes(other)) {
            let named = target.name().map_or(String::new(), |name| format!(" on {name}"));
            let advice = effect.instances_differ_in().map_or(String::from("keep one table"), |name| {
                format!("let `{name}` differ by 5 % at least, or keep one table")
            });
            let reason = format!("effect `{}`{named} is described twice; {advice}", descriptor.id);
            return Err(section.source.at(&section.span, reason));
        }
        active.push(one);
    }
    Ok(())
}

/// Sensors on which an effect acts: one target each, all four tensions as one.
pub(super) fn targets(section: &Section, descriptor: &Descriptor) -> Result<Vec<Target>, Failure> {
    let given = match section.get(CHANNEL_KEY).map(Located::get_ref) {
        None => match descriptor.channels {
            [] => return Ok(vec![Target::None]),
            [only] => return Ok(vec![Target::One(*only)]),
            _ => {
                return Err(
                    section.lacks(CHANNEL_KEY, &format!("one of {}", channel_names(descriptor).join(", ")))
                );
            }
        },
        Some(DeValue::Array(_)) => section.strings(CHANNEL_KEY)?.unwrap_or_default(),
        Some(_) => section.string(CHANNEL_KEY)?.into_iter().collect(),
    };
    let names = channel_names(descriptor);
    let mut channels = Vec::new();
    for (name, span) in given {
        if !names.contains(&name) {
            let known = advice(name, names.iter().copied());
            let reason = format!("effect `{}` has no channel `{name}`; {known}", descriptor.id);
            return Err(section.source.at(&span, reason));
        }
        let meant = match Channel::from_role(name) {
            Some(one) => vec![one],
            None => Channel::TENSIONS.to_vec(),
        };
        for channel in meant {
            if channels.contains(&channel) {
                let reason = format!("channel `{}` is named twice; name it once", channel.role());
                return Err(section.source.at(&span, reason));
            }
            channels.push(channel);
        }
    }
    let all_tensions = Channel::TENSIONS.iter().all(|tension| channels.contains(tension));
    let mut targets = Vec::new();
    if all_tensions {
        targets.push(Target::Tensions);
        channels.retain(|channel| !Channel::TENSIONS.contains(channel));
    }
    targets.extend(channels.into_iter().map(Target::One));
    if targets.is_empty() {
        return Err(section.lacks(CHANNEL_KEY, &format!("one of {}", names.join(", "))));
    }
    Ok(targets)
}

/// Names that `channel` accepts for an effect.
fn channel_names(descriptor: &Descriptor) -> Vec<&'static str> {
    let tensions = Channel::TENSIONS.iter().all(|tension| descriptor.channels.contains(tension));
    descriptor.channels.iter().map(|channel| channel.role()).chain(tensions.then_some(TENSIONS)).collect()
}
