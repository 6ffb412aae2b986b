//! Laws of a rig file: the tables `[[law]]`.
//!
//! ```toml
//! [[law]]
//! component = "joint"
//! port = "joint_friction_nm"
//! variables = ["omega_out_rad_s"]
//! formula = "amplitude_nm * abs(omega_out_rad_s)^exponent"
//! coefficients = { amplitude_nm = 0.083, exponent = 2.0 }
//! units = { amplitude_nm = "N·m", exponent = "1" }
//! ```
//!
//! A law of a sensor also names its `channel`. In place of a formula a law may state [`points`]. The formulas that a simulation can run are those of
//! [`bowden_model::law::LAWS`]; another one is refused with those of its port.

use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Effect, ParameterSpec, Target};
use bowden_model::law::{LAWS, Law};
use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, Value};

use super::points;
use super::section::{Bounds, Section, advice};
use crate::outcome::Failure;

/// Name of the tables in a rig file.
pub(super) const KEY: &str = "law";

/// Keys of a table.
const KEYS: [&str; 7] = ["component", "port", "variables", "formula", "coefficients", "units", "channel"];

/// Reads the laws in the order of the file.
pub(super) fn read(file: &Section) -> Result<Vec<ActiveEffect>, Failure> {
    file.sections(KEY, KEY)?.iter().map(read_law).collect()
}

fn read_law(section: &Section) -> Result<ActiveEffect, Failure> {
    if let Some(value) = section.get(points::POINTS) {
        return points::read(section, value);
    }
    section.refuse_unknown("key", KEYS)?;
    let (port, port_span) = section.text("port", "where it acts")?;
    let at_port = || LAWS.iter().filter(move |law| law.port().name() == port);
    if at_port().next().is_none() {
        let known = LAWS.iter().map(|law| law.port().name()).collect::<std::collections::BTreeSet<_>>();
        return Err(section.source.at(&port_span, format!("unknown port `{port}`; {}", advice(port, known))));
    }
    let (formula, span) = section.text("formula", "what it adds there")?;
    let law = at_port().find(|law| is_of(law, formula)).ok_or_else(|| {
        let known: Vec<String> = at_port().map(|law| format!("`{}`", law.formula())).collect();
        let reason = format!("no formula `{formula}` at port {port}; expected one of {}", known.join(", "));
        section.source.at(&span, reason)
    })?;
    let descriptor = law.descriptor();
    let (component, span) = section.text("component", "part of the joint")?;
    if component != descriptor.component.name() {
        let reason =
            format!("component: got `{component}`, port {port} belongs to `{}`", descriptor.component.name());
        return Err(section.source.at(&span, format!("{reason}; correct one of them")));
    }
    let variables =
        section.strings("variables")?.ok_or_else(|| section.lacks("variables", "what it depends on"))?;
    if !matches!(variables[..], [(name, _)] if name == law.variable().name()) {
        let span = variables.first().map_or_else(|| section.span.clone(), |(_, span)| span.clone());
        let reason =
            format!("variables: the formula depends on `{}` alone; write that", law.variable().name());
        return Err(section.source.at(&span, reason));
    }
    let coefficients = section
        .section("coefficients", "law.coefficients")?
        .ok_or_else(|| section.lacks("coefficients", "values of the formula"))?;
    // What has a number in the formula has no coefficient.
    let is_asked = |spec: &&ParameterSpec| formula.contains(spec.name);
    let asked = descriptor.parameters.iter().filter(is_asked).map(|spec| spec.name);
    coefficients.refuse_unknown("coefficient", asked)?;
    let mut parameters = descriptor.defaults();
    for (value, spec) in parameters.iter_mut().zip(descriptor.parameters) {
        let bounds = Bounds { lower: spec.lower, upper: spec.upper, unit: spec.unit };
        let stated =
            if is_asked(&spec) { coefficients.number(spec.name, bounds)? } else { Some(spec.default) };
        *value = stated
            .ok_or_else(|| coefficients.lacks(spec.name, &format!("{}, {}", spec.meaning, spec.unit)))?;
    }
    check_units(section, law)?;
    Ok(ActiveEffect { effect: law, parameters, target: target(section, law)?, bench: None })
}

/// Whether a formula is that of `law`. Spaces do not count, and a bump may be written as files of before its edges had a steepness have it.
fn is_of(law: &Law, formula: &str) -> bool {
    let squeezed = |formula: &str| formula.split_whitespace().collect::<String>();
    let own = squeezed(law.formula());
    let round = own.replace("-abs((", "-((").replace("^steepness", "^2");
    [own, round].contains(&squeezed(formula))
}

/// Units may be left out, but not be others than the formula's.
fn check_units(section: &Section, law: &Law) -> Result<(), Failure> {
    let Some(units) = section.section("units", "law.units")? else { return Ok(()) };
    let parameters = law.descriptor().parameters;
    units.refuse_unknown("coefficient", parameters.iter().map(|spec| spec.name))?;
    for spec in parameters {
        if let Some((unit, span)) = units.string(spec.name)?
            && unit != spec.unit
        {
            let reason =
                format!("{}: got the unit `{unit}`, the formula has it in `{}`", spec.name, spec.unit);
            return Err(section.source.at(&span, format!("{reason}; convert the value")));
        }
    }
    Ok(())
}

fn target(section: &Section, law: &Law) -> Result<Target, Failure> {
    let channels = law.descriptor().channels;
    let names = || channels.iter().map(|channel| channel.role());
    match (section.string("channel")?, channels) {
        (None, []) => Ok(Target::None),
        (Some((_, span)), []) => {
            Err(section.source.at(&span, format!("port {} has no channel; drop it", law.port().name())))
        }
        (None, _) => {
            Err(section.lacks("channel", &format!("one of {}", names().collect::<Vec<_>>().join(", "))))
        }
        (Some((name, span)), channels) => {
            let channel = Channel::from_role(name).filter(|channel| channels.contains(channel));
            channel.map(Target::One).ok_or_else(|| {
                section
                    .source
                    .at(&span, format!("the law has no channel `{name}`; {}", advice(name, names())))
            })
        }
    }
}

/// Adds a law to a document, or replaces the coefficients of the same one; `None` if `law` is something else in this file.
pub(super) fn insert(document: &mut DocumentMut, law: &Law, active: &ActiveEffect) -> Option<()> {
    let item = document.entry(KEY).or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new()));
    let list = item.as_array_of_tables_mut()?;
    let channel = active.target.name();
    let is_same = |table: &Table| {
        let text = |key: &str| table.get(key).and_then(Item::as_str);
        text("port") == Some(law.port().name())
            && text("formula").is_some_and(|formula| is_of(law, formula))
            && text("channel") == channel
    };
    let there = list.iter().position(is_same);
    let place = there.unwrap_or(list.len());
    if there.is_none() {
        list.push(Table::new());
    }
    let table = list.get_mut(place)?;
    table.insert("component", toml_edit::value(active.descriptor().component.name()));
    table.insert("port", toml_edit::value(law.port().name()));
    table.insert("variables", Item::Value(Value::Array(Array::from_iter([law.variable().name()]))));
    if let Some(channel) = channel {
        table.insert("channel", toml_edit::value(channel));
    }
    table.insert("formula", toml_edit::value(law.formula()));
    let (mut coefficients, mut units) = (InlineTable::new(), InlineTable::new());
    for (spec, value) in active.descriptor().parameters.iter().zip(active.parameters) {
        coefficients.insert(spec.name, value.into());
        units.insert(spec.name, spec.unit.into());
    }
    table.insert("coefficients", Item::Value(Value::InlineTable(coefficients)));
    table.insert("units", Item::Value(Value::InlineTable(units)));
    Some(())
}
