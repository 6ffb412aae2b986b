//! What recordings cannot tell: parameters whose changes the predictions answer alike, or not at all.
//!
//! Column j of the sensitivity is the change of the weighted training residuals for a relative change of parameter j,
//! `(r(p e^h) - r(p e^-h)) / 2h`. Two columns that are parallel belong to parameters of which only a product is known:
//! `a_i ln p_i + a_j ln p_j` with the columns' lengths `a`, negative where they point against each other. The test is
//! the one of the angle between them, as in Belsley, Kuh, Welsch, Regression Diagnostics (1980), ch. 3.

use std::fmt;

use bowden_model::parameters::{NOMINAL_PARAMETERS, NominalParameter};
use rayon::prelude::*;

use super::calibrated::calibrated;
use super::objective::{Objective, Part, soft};
use crate::joint_model::JointModel;
use crate::outcome::Failure;

/// Columns whose cosine is larger cannot be told apart: with 0.999 the data leave of each parameter less than a
/// twentieth of what they would say with the other one known.
const ALIKE_COSINE: f64 = 0.999;

/// Relative step of the difference quotients; large enough to average over stick and slip.
const RELATIVE_STEP: f64 = 0.05;

/// Shortest column of a parameter that the data see: a change by a factor e moves the residuals by one scale in three
/// independent tenths of a second.
const SEEN_LENGTH: f64 = 5.5;

/// Exponents of a product that differ by less are written as equal.
const EXPONENT_TOLERANCE: f64 = 0.1;

/// Parameters of which the data know one product.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// `section.name` and exponent in the product that is known; the first exponent is 1.
    pub members: Vec<(String, f64)>,
}

impl Group {
    /// Names of the members.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        self.members.iter().map(|(name, _)| name.clone()).collect()
    }
}

impl fmt::Display for Group {
    /// The product that is known, for example `tendon.axial_stiffness_n / tendon.length_m`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (name, exponent)) in self.members.iter().enumerate() {
            let sign = match (index, *exponent < 0.0) {
                (0, _) => "",
                (_, false) => " * ",
                (_, true) => " / ",
            };
            write!(f, "{sign}{name}")?;
            if (exponent.abs() - 1.0).abs() > EXPONENT_TOLERANCE {
                write!(f, "^{:.2}", exponent.abs())?;
            }
        }
        Ok(())
    }
}

/// How the predictions answer to each nominal parameter.
#[derive(Clone, Debug)]
pub struct Sensitivity {
    columns: Vec<(String, Vec<f64>)>,
}

impl Sensitivity {
    /// Varies every nominal parameter that `model` has, those that no fit moves too.
    ///
    /// # Errors
    /// When the model cannot be driven.
    pub fn of(objective: &Objective, model: &JointModel) -> Result<Self, Failure> {
        let columns = NOMINAL_PARAMETERS
            .par_iter()
            .filter_map(|parameter| {
                let ends = ends_of(parameter, model)?;
                Some(column(objective, model, parameter, &ends).map(|values| (path(parameter), values)))
            })
            .collect::<Result<Vec<_>, Failure>>()?;
        Ok(Self { columns })
    }

    /// Groups of parameters that the data cannot tell apart; the one that a recalibration moves stands first.
    #[must_use]
    pub fn groups(&self) -> Vec<Group> {
        let seen: Vec<&(String, Vec<f64>)> =
            self.columns.iter().filter(|(_, values)| length(values) >= SEEN_LENGTH).collect();
        let mut taken = vec![false; seen.len()];
        let mut groups = Vec::new();
        for first in 0..seen.len() {
            if std::mem::replace(&mut taken[first], true) {
                continue;
            }
            let (name, direction) = seen[first];
            let mut members = vec![(name.clone(), 1.0)];
            for other in first + 1..seen.len() {
                let cosine = cosine(direction, &seen[other].1);
                if !taken[other] && cosine.abs() > ALIKE_COSINE {
                    taken[other] = true;
                    let exponent = (length(&seen[other].1) / length(direction)).copysign(cosine);
                    members.push((seen[other].0.clone(), exponent));
                }
            }
            if members.len() > 1 {
                // The one that a recalibration moves for all of them comes first.
                members.sort_by_key(|(name, _)| !is_recalibrated(name));
                let unit = members[0].1;
                for (_, exponent) in &mut members {
                    *exponent /= unit;
                }
                groups.push(Group { members });
            }
        }
        groups
    }

    /// What the training data tell of relative changes of the parameters: the inverse covariance of their logarithms.
    #[must_use]
    pub fn information(&self) -> Information {
        let columns = &self.columns;
        Information {
            names: columns.iter().map(|(name, _)| name.clone()).collect(),
            matrix: columns.iter().map(|(_, a)| columns.iter().map(|(_, b)| dot(a, b)).collect()).collect(),
        }
    }

    /// Parameters that the predictions do not depend on as far as the data can show.
    #[must_use]
    pub fn unseen(&self) -> Vec<String> {
        let short = |(_, values): &&(String, Vec<f64>)| length(values) < SEEN_LENGTH;
        self.columns.iter().filter(short).map(|(name, _)| name.clone()).collect()
    }
}

/// Fisher information of parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Information {
    /// `section.name`.
    pub names: Vec<String>,
    /// Rows and columns in the order of the names.
    pub matrix: Vec<Vec<f64>>,
}

impl Information {
    /// Logarithm of the determinant of a sum, with `before` on the diagonal: known of each parameter without any data. All are of the
    /// same parameters.
    ///
    /// By Cholesky's factors, which exist for every `before` above 0.
    pub fn log_determinant<'i>(all: impl IntoIterator<Item = &'i Self>, before: f64) -> f64 {
        let mut sum: Vec<Vec<f64>> = Vec::new();
        for Self { matrix, .. } in all {
            sum.resize_with(matrix.len(), || vec![0.0; matrix.len()]);
            sum.iter_mut().flatten().zip(matrix.iter().flatten()).for_each(|(sum, value)| *sum += value);
        }
        let mut logarithm = 0.0;
        for row in 0..sum.len() {
            for column in 0..=row {
                let done = dot(&sum[row][..column], &sum[column][..column]);
                if row == column {
                    let pivot = sum[row][row] + before - done;
                    logarithm += pivot.ln();
                    sum[row][row] = pivot.sqrt();
                } else {
                    sum[row][column] = (sum[row][column] - done) / sum[column][column];
                }
            }
        }
        logarithm
    }
}

/// Names of the nominal parameters that the training data cannot tell apart, group by group.
///
/// # Errors
/// When the model cannot be driven.
pub fn indistinguishable(objective: &Objective, model: &JointModel) -> Result<Vec<Vec<String>>, Failure> {
    Ok(Sensitivity::of(objective, model)?.groups().iter().map(Group::names).collect())
}

fn path(parameter: &NominalParameter) -> String {
    format!("{}.{}", parameter.section, parameter.spec.name)
}

fn is_recalibrated(name: &str) -> bool {
    name.split_once('.').is_some_and(|(section, key)| calibrated(section, key).is_some())
}

/// Values below and above the present one, and their distance in units of the relative change.
struct Ends {
    low: f64,
    high: f64,
    distance: f64,
}

fn ends_of(parameter: &NominalParameter, model: &JointModel) -> Option<Ends> {
    let value = parameter.get(&model.parameters)?;
    let spec = parameter.spec;
    if value > 0.0 {
        let low = (value * (-RELATIVE_STEP).exp()).max(spec.lower);
        let high = (value * RELATIVE_STEP.exp()).min(spec.upper);
        return Some(Ends { low, high, distance: (high / low).ln() });
    }
    // A parameter at zero has no relative change; a typical value takes its place, for the inertia that of the weight.
    let weight_inertia = model.parameters.load.map_or(0.0, |load| load.mass_kg * load.arm_m * load.arm_m);
    let typical = if spec.default > 0.0 { spec.default } else { weight_inertia };
    let high = (RELATIVE_STEP * typical).min(spec.upper);
    (high > 0.0).then_some(Ends { low: 0.0, high, distance: RELATIVE_STEP })
}

fn column(
    objective: &Objective,
    model: &JointModel,
    parameter: &NominalParameter,
    ends: &Ends,
) -> Result<Vec<f64>, Failure> {
    let at = |value: f64| {
        let mut changed = model.clone();
        parameter.set(&mut changed.parameters, value);
        objective.residuals(&changed)
    };
    let (low, high) = (at(ends.low)?, at(ends.high)?);
    Ok(objective
        .entries()
        .zip(low.values.iter().zip(&high.values))
        .filter(|(entry, _)| entry.block.part == Part::Training)
        .map(|(_, (low, high))| (soft(*high) - soft(*low)) / ends.distance)
        .collect())
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn length(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

fn cosine(a: &[f64], b: &[f64]) -> f64 {
    dot(a, b) / (length(a) * length(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensitivity(columns: &[(&str, [f64; 3])]) -> Sensitivity {
        let columns = columns.iter().map(|(name, values)| ((*name).to_owned(), values.to_vec())).collect();
        Sensitivity { columns }
    }

    #[test]
    fn the_determinant_of_a_sum_is_that_by_hand() {
        let of = |matrix: [[f64; 2]; 2]| Information {
            names: vec!["a".to_owned(), "b".to_owned()],
            matrix: matrix.map(|row| row.to_vec()).to_vec(),
        };
        // (3 + 1)(5 + 1) - 2·2 with 1 on the diagonal; of nothing 1.
        let both = [of([[1.0, 2.0], [2.0, 4.0]]), of([[2.0, 0.0], [0.0, 1.0]])];
        assert!((Information::log_determinant(&both, 1.0) - 20.0_f64.ln()).abs() < 1e-12);
        assert_eq!(Information::log_determinant([], 1.0), 0.0);
    }

    #[test]
    fn parallel_columns_are_one_group_and_their_product_is_named() {
        // b is -2 a, c is perpendicular to both, d is too short to be seen.
        let columns = sensitivity(&[
            ("s.a", [10.0, 0.0, 5.0]),
            ("s.b", [-20.0, 0.0, -10.0]),
            ("s.c", [5.0, 30.0, -10.0]),
            ("s.d", [1.0, 0.0, 0.5]),
        ]);
        let groups = columns.groups();
        assert_eq!(groups.len(), 1);
        assert_eq!(groups[0].names(), ["s.a", "s.b"]);
        assert_eq!(groups[0].to_string(), "s.a / s.b^2.00");
        assert_eq!(columns.unseen(), ["s.d"]);
    }

    #[test]
    fn columns_at_three_degrees_are_told_apart_and_at_two_degrees_not() {
        // cos 3° = 0.99863, cos 2° = 0.99939.
        for (degrees, groups) in [(3.0_f64, 0), (2.0, 1)] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let columns = sensitivity(&[("s.a", [50.0, 0.0, 0.0]), ("s.b", [50.0 * cos, 50.0 * sin, 0.0])]);
            assert_eq!(columns.groups().len(), groups, "{degrees}°");
        }
    }
}
