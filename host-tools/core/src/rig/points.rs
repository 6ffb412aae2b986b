//! Laws of a rig file that state points in place of a formula.
//!
//! ```toml
//! [[law]]
//! name = "oil_drag"
//! component = "joint"
//! port = "joint_torque_nm"
//! variables = ["omega_out_rad_s"]
//! units = { omega_out_rad_s = "rad/s", joint_torque_nm = "N·m" }
//! points = [[-6.0, 0.21], [0.0, 0.0], [6.0, -0.21]]
//! ```
//!
//! Between points the law is linear, beyond them constant. Two variables have a point for each combination of their values,
//! `[x, y, value]`, in any order. A law of a sensor also names its `channel`.

use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Effect, MAX_PARAMETERS, Target};
use bowden_model::law::{Port, Variable};
use toml::de::DeValue;
use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Value};

use super::laws::KEY;
use super::section::{Located, Section, advice};
use crate::hypothesis::{Axis, Hypothesis, Table};
use crate::outcome::Failure;

/// Key of the points.
pub(super) const POINTS: &str = "points";

/// Keys of a table with points.
const KEYS: [&str; 7] = ["name", "component", "port", "variables", "units", "channel", POINTS];

/// Name of a law that has none.
const NAMELESS: &str = "points";

/// Most points: what a simulation keeps in memory, and an editor opens.
const MOST_POINTS: usize = 100_000;

pub(super) fn read(section: &Section, points: &Located) -> Result<ActiveEffect, Failure> {
    let at = |span: &std::ops::Range<usize>, reason: String| section.source.at(span, reason);
    section.refuse_unknown("key", KEYS)?;
    let (port, port_span) = section.text("port", "where it acts")?;
    let known = Port::ALL.into_iter().find(|known| known.name() == port);
    let port = known.ok_or_else(|| {
        let names = Port::ALL.into_iter().map(Port::name);
        at(&port_span, format!("unknown port `{port}`; {}", advice(port, names)))
    })?;
    let (component, span) = section.text("component", "part of the joint")?;
    if component != port.component().name() {
        let belongs = port.component().name();
        let reason = format!("component: got `{component}`, port {} belongs to `{belongs}`", port.name());
        return Err(at(&span, format!("{reason}; correct one of them")));
    }
    let listed =
        section.strings("variables")?.ok_or_else(|| section.lacks("variables", "what it depends on"))?;
    let mut variables = Vec::new();
    for (name, span) in &listed {
        let variable = Variable::from_name(name).filter(|variable| port.variables().contains(variable));
        variables.push(variable.ok_or_else(|| {
            let names = port.variables().iter().map(|variable| variable.name());
            at(span, format!("port {} has no variable `{name}`; {}", port.name(), advice(name, names)))
        })?);
    }
    check_units(section, port, &variables)?;
    let channel = channel(section, port)?;
    let rows = rows(section, points, variables.len() + 1)?;
    let refuse = |reason: String| at(&points.span(), format!("{POINTS}: {reason}"));
    let table = table(rows, variables.len()).map_err(refuse)?;
    let name = section.string("name")?.map_or(NAMELESS, |(name, _)| name);
    let law = Hypothesis::of_points(name, port, channel, variables, table)
        .map_err(|reason| at(&section.span, format!("law `{name}`: {reason}")))?;
    let target = channel.map_or(Target::None, Target::One);
    Ok(ActiveEffect { effect: law, parameters: [0.0; MAX_PARAMETERS], target, bench: None })
}

fn check_units(section: &Section, port: Port, variables: &[Variable]) -> Result<(), Failure> {
    let Some(units) = section.section("units", "law.units")? else { return Ok(()) };
    let expected = || {
        let of_variables = variables.iter().map(|variable| (variable.name(), variable.unit()));
        of_variables.chain([(port.name(), port.unit())])
    };
    units.refuse_unknown("quantity", expected().map(|(name, _)| name))?;
    for (name, unit) in expected() {
        if let Some((got, span)) = units.string(name)?
            && got != unit
        {
            let reason = format!("{name}: got the unit `{got}`, expected `{unit}`; convert the points");
            return Err(section.source.at(&span, reason));
        }
    }
    Ok(())
}

fn channel(section: &Section, port: Port) -> Result<Option<Channel>, Failure> {
    let given = section.string("channel")?;
    match (given, port) {
        (None, Port::Reading) => Err(section.lacks("channel", "the column role of the sensor")),
        (None, _) => Ok(None),
        (Some((name, span)), Port::Reading) => Channel::from_role(name).map(Some).ok_or_else(|| {
            let names = Channel::ALL.into_iter().map(Channel::role);
            section.source.at(&span, format!("unknown channel `{name}`; {}", advice(name, names)))
        }),
        (Some((_, span)), _) => {
            Err(section.source.at(&span, format!("port {} has no channel; drop it", port.name())))
        }
    }
}

/// The points as they stand in the file.
fn rows(section: &Section, points: &Located, width: usize) -> Result<Vec<Vec<f64>>, Failure> {
    let wrong = |value: &Located| {
        let expected = if width == 2 { "[x, value]" } else { "[x, y, value]" };
        section.wrong_type(POINTS, value, &format!("points {expected} of finite numbers"))
    };
    let DeValue::Array(list) = points.get_ref() else { return Err(wrong(points)) };
    if list.len() > MOST_POINTS {
        let reason =
            format!("{POINTS}: {} points, at most {MOST_POINTS} are read; leave some out", list.len());
        return Err(section.source.at(&points.span(), reason));
    }
    let number = |value: &Located| -> Option<f64> {
        let text = match value.get_ref() {
            DeValue::Float(float) => float.as_str(),
            DeValue::Integer(integer) => integer.as_str(),
            _ => return None,
        };
        text.replace('_', "").parse().ok().filter(|number: &f64| number.is_finite())
    };
    let row = |value: &Located| -> Option<Vec<f64>> {
        let DeValue::Array(numbers) = value.get_ref() else { return None };
        let numbers: Vec<f64> = numbers.iter().map(number).collect::<Option<_>>()?;
        (numbers.len() == width).then_some(numbers)
    };
    list.iter().map(|value| row(value).ok_or_else(|| wrong(value))).collect()
}

/// The table of points, in whatever order they stand.
fn table(mut rows: Vec<Vec<f64>>, variables: usize) -> Result<Table, String> {
    let mut axes = Vec::new();
    for variable in 0..variables {
        let mut knots: Vec<f64> = rows.iter().map(|row| row[variable]).collect();
        knots.sort_by(f64::total_cmp);
        knots.dedup();
        let axis = Axis::new(knots);
        axes.push(axis.ok_or_else(|| "give at least two values of each variable".to_owned())?);
    }
    let before = |a: &[f64], b: &[f64]| {
        let differing = a.iter().zip(b).take(variables).map(|(a, b)| a.total_cmp(b));
        differing.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
    };
    rows.sort_by(|a, b| before(a, b));
    if let Some(pair) = rows.windows(2).find(|pair| before(&pair[0], &pair[1]).is_eq()) {
        return Err(format!("{:?} stands twice; keep one", &pair[0][..variables]));
    }
    let count: usize = axes.iter().map(|axis| axis.knots().len()).product();
    if rows.len() != count {
        let reason = format!("{} points for {count} combinations of the variables' values", rows.len());
        return Err(format!("{reason}; give one for each"));
    }
    let values = rows.iter().map(|row| row[variables]).collect();
    Table::new(axes, values).ok_or_else(|| "one or two variables have points; correct `variables`".to_owned())
}

/// Adds a hypothesis by its points, or replaces those of the same name; `None` if `law` is something else in this file.
pub(super) fn insert(document: &mut DocumentMut, law: &Hypothesis, active: &ActiveEffect) -> Option<()> {
    let table = law.points(&active.parameters)?;
    let item = document.entry(KEY).or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new()));
    let list = item.as_array_of_tables_mut()?;
    let there = list.iter().position(|table| {
        let text = |key: &str| table.get(key).and_then(Item::as_str);
        table.contains_key(POINTS) && text("name").unwrap_or(NAMELESS) == law.name()
    });
    let place = there.unwrap_or(list.len());
    if there.is_none() {
        list.push(toml_edit::Table::new());
    }
    let entry = list.get_mut(place)?;
    let variables = law.variables();
    entry.insert("name", toml_edit::value(law.name()));
    entry.insert("component", toml_edit::value(law.descriptor().component.name()));
    entry.insert("port", toml_edit::value(law.port().name()));
    let names = variables.iter().map(|variable| variable.name()).collect::<Array>();
    entry.insert("variables", Item::Value(Value::Array(names)));
    if let Some(channel) = active.target.name() {
        entry.insert("channel", toml_edit::value(channel));
    }
    let mut units = InlineTable::new();
    for variable in variables {
        units.insert(variable.name(), variable.unit().into());
    }
    units.insert(law.port().name(), law.port().unit().into());
    entry.insert("units", Item::Value(Value::InlineTable(units)));
    entry.insert(POINTS, Item::Value(Value::Array(listed(&table))));
    Some(())
}

/// One point a line.
fn listed(table: &Table) -> Array {
    let mut points = Array::new();
    let mut push = |numbers: &[f64]| {
        let mut point = Value::Array(numbers.iter().copied().collect());
        point.decor_mut().set_prefix("\n    ");
        points.push_formatted(point);
    };
    let axes = table.axes();
    let width = axes.get(1).map_or(1, |axis| axis.knots().len());
    for (place, value) in table.values().iter().enumerate() {
        let x = axes[0].knots()[place / width];
        match axes.get(1) {
            Some(across) => push(&[x, across.knots()[place % width], *value]),
            None => push(&[x, *value]),
        }
    }
    points.set_trailing("\n");
    points.set_trailing_comma(true);
    points
}
