//! What a user states: checks, starting points, and the points at which the function is first asked.

use bowden_model::channel::Channel;
use bowden_model::effect::{MAX_PARAMETERS, ParameterSpec};
use bowden_model::law::{Port, Variable};

use super::table::Axis;
use super::{Function, registry};

/// Most starting points.
pub const MOST_STARTS: usize = 64;

/// A coefficient of a function.
#[derive(Clone, Debug, PartialEq)]
pub struct Coefficient {
    /// Name, as the function has it.
    pub name: String,
    /// Unit; `1` for a ratio.
    pub unit: String,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Values from which a search starts, at least one.
    pub starts: Vec<f64>,
}

/// What a user states.
pub struct Statement {
    /// Name of the hypothesis.
    pub name: String,
    /// Where it acts.
    pub port: Port,
    /// Channel, at the port of a sensor's reading.
    pub channel: Option<Channel>,
    /// On what it depends.
    pub variables: Vec<Variable>,
    /// Coefficients; the first is the strength.
    pub coefficients: Vec<Coefficient>,
    /// Ranges of the variables, in place of those that a replay of the rig shows.
    pub ranges: Vec<Option<[f64; 2]>>,
    /// The function.
    pub function: Box<dyn Function>,
}

/// All combinations of the knots, one column a variable; the last variable runs fastest.
pub(super) fn columns_of(axes: &[Axis]) -> Vec<Vec<f64>> {
    let [first, rest @ ..] = axes else { return Vec::new() };
    let Some(across) = rest.first() else { return vec![first.knots().to_vec()] };
    let (rows, width) = (first.knots(), across.knots().len());
    let slow = rows.iter().flat_map(|x| std::iter::repeat_n(*x, width)).collect();
    vec![slow, across.knots().repeat(rows.len())]
}

/// Some points within the ranges that a user stated, or of ordinary size.
pub(super) fn few_points(variables: &[Variable], ranges: &[Option<[f64; 2]>]) -> Vec<Vec<f64>> {
    let axis = |(index, variable): (usize, &Variable)| {
        let usual = match variable {
            Variable::Time | Variable::RelativeTension => [0.0, 2.0],
            _ => [-1.0, 1.0],
        };
        let [low, high] = ranges.get(index).copied().flatten().unwrap_or(usual);
        Axis::new((0..5).map(|k| low + (high - low) * f64::from(k) / 4.0).collect())
    };
    columns_of(&variables.iter().enumerate().filter_map(axis).collect::<Vec<_>>())
}

pub(super) fn check_name(name: &str) -> Result<(), String> {
    let letters = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    if name.is_empty() || !name.chars().all(letters) || name.starts_with(|c: char| c.is_ascii_digit()) {
        return Err("a name has lower-case letters, digits and `_`; choose another".to_owned());
    }
    if bowden_model::effects::find(name).is_some() || bowden_model::law::find(name).is_some() {
        return Err("an effect or a law of the catalogue has that name; choose another".to_owned());
    }
    Ok(())
}

pub(super) fn check_variables(port: Port, variables: &[Variable]) -> Result<(), String> {
    let known = || port.variables().iter().map(|variable| variable.name()).collect::<Vec<_>>().join(", ");
    let alien = variables.iter().find(|variable| !port.variables().contains(variable));
    if let Some(alien) = alien {
        return Err(format!("port {} has no variable {}; take of {}", port.name(), alien.name(), known()));
    }
    if !matches!(variables.len(), 1 | 2) || (variables.len() == 2 && variables[0] == variables[1]) {
        return Err(format!("{} variables; take one or two of {}", variables.len(), known()));
    }
    Ok(())
}

pub(super) fn spec_of(coefficient: &Coefficient) -> Result<ParameterSpec, String> {
    /// Ratio of the ends of a range from which on steps are ratios.
    const DECADE: f64 = 10.0;
    let Coefficient { name, unit, range: [lower, upper], starts } = coefficient;
    if !(lower < upper && lower.is_finite() && upper.is_finite()) {
        return Err(format!("{name}: got the range {lower} to {upper}; state two numbers that rise"));
    }
    let outside = starts.iter().find(|start| !(**start >= *lower && *start <= upper));
    if let Some(outside) = outside {
        return Err(format!("{name}: the start {outside} is outside {lower} to {upper}; move one of them"));
    }
    let Some(start) = starts.first() else { return Err(format!("{name}: has no start; state one")) };
    let (name, unit) = (registry::text(name), registry::text(unit));
    let of = if *lower > 0.0 && upper / lower >= DECADE { ParameterSpec::log } else { ParameterSpec::linear };
    Ok(of(name, unit, [*lower, *upper], *start, name))
}

/// All combinations of the coefficients' starts.
pub(super) fn starts_of(coefficients: &[Coefficient]) -> Result<Vec<[f64; MAX_PARAMETERS]>, String> {
    let mut all = vec![[0.0; MAX_PARAMETERS]];
    for (index, coefficient) in coefficients.iter().enumerate() {
        all = all
            .iter()
            .flat_map(|start| {
                coefficient.starts.iter().map(move |value| {
                    let mut start = *start;
                    start[index] = *value;
                    start
                })
            })
            .collect();
    }
    if all.len() > MOST_STARTS {
        return Err(format!("{} combinations of starts; state at most {MOST_STARTS}", all.len()));
    }
    Ok(all)
}
