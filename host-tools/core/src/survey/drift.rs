//! Which parameters of a bench change from recording to recording.

use std::collections::BTreeMap;

use super::rows::SurveyRow;
use crate::diagnose::policy::POLICY;
use crate::fit::calibrated::wrong_from;

/// Fewest recordings that a line can be drawn through and judged.
const FEWEST: usize = 3;

/// A recalibrated parameter of a bench over its recordings, and the straight line through it.
#[derive(Clone, Debug, PartialEq)]
pub struct Drift {
    /// Bench.
    pub bench: String,
    /// `section.name`.
    pub parameter: String,
    /// Unit.
    pub unit: String,
    /// Value in the rig file.
    pub nominal: f64,
    /// Recording (its place among those of the bench), fitted value and standard deviation.
    pub points: Vec<(usize, f64, f64)>,
    /// The line at the first of the points.
    pub first: f64,
    /// The line at the last of the points.
    pub last: f64,
    /// Standard deviation of the line's change between them.
    pub change_std: f64,
}

impl Drift {
    /// Change from the first to the last recording over the value in the rig file.
    #[must_use]
    pub fn change(&self) -> f64 {
        (self.last - self.first) / self.nominal
    }

    /// Whether the change is sure, and as large as an error of the rig file would have to be to be reported.
    #[must_use]
    pub fn drifts(&self) -> bool {
        POLICY.is_sure(self.last - self.first, Some(self.change_std))
            && self.change().abs() > wrong_from(&self.parameter)
    }

    /// The line through points, by weighted least squares: `y = a + b x`, weights `1 / std^2`; standard deviations grow with the scatter
    /// about the line where that is larger than they say.
    fn through(points: Vec<(usize, f64, f64)>) -> Option<Self> {
        if points.len() < FEWEST {
            return None;
        }
        let sum = |value: &dyn Fn(f64, f64) -> f64| -> f64 {
            points.iter().map(|(x, y, std)| value(*x as f64, *y) / (std * std)).sum()
        };
        let (w, wx, wy) = (sum(&|_, _| 1.0), sum(&|x, _| x), sum(&|_, y| y));
        let (mean_x, mean_y) = (wx / w, wy / w);
        let spread = sum(&|x, _| (x - mean_x).powi(2));
        let slope = sum(&|x, y| (x - mean_x) * (y - mean_y)) / spread;
        let at = |x: usize| mean_y + slope * (x as f64 - mean_x);
        let scatter: f64 = points.iter().map(|(x, y, std)| ((y - at(*x)) / std).powi(2)).sum();
        let grown = (scatter / (points.len() - 2) as f64).max(1.0).sqrt();
        let (first, last) = (points[0].0, points[points.len() - 1].0);
        Some(Self {
            bench: String::new(),
            parameter: String::new(),
            unit: String::new(),
            nominal: 0.0,
            first: at(first),
            last: at(last),
            change_std: grown * (last - first) as f64 / spread.sqrt(),
            points,
        })
    }
}

/// Value in the rig file, unit, and the points of one parameter.
type ParameterPoints<'r> = (f64, &'r str, Vec<(usize, f64, f64)>);

/// Every parameter of every bench that three recordings at least tell of.
#[must_use]
pub fn drifts(rows: &[SurveyRow<'_>]) -> Vec<Drift> {
    let mut all = Vec::new();
    for (bench, rows) in SurveyRow::benches(rows) {
        let mut series: BTreeMap<&str, ParameterPoints<'_>> = BTreeMap::new();
        for (place, surveyed) in
            rows.iter().enumerate().filter_map(|(k, row)| Some((k, row.surveyed.as_ref()?)))
        {
            for found in &surveyed.diagnosis.recalibrated {
                if let Some(std) = found.std.filter(|std| *std > 0.0 && !found.at_bound) {
                    let entry = series.entry(&found.parameter);
                    let (_, _, points) = entry.or_insert((found.nominal, &found.unit, Vec::new()));
                    points.push((place, found.fitted, std));
                }
            }
        }
        for (parameter, (nominal, unit, points)) in series {
            if let Some(line) = Drift::through(points) {
                let (bench, parameter, unit) = (bench.to_owned(), parameter.to_owned(), unit.to_owned());
                all.push(Drift { bench, parameter, unit, nominal, ..line });
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn through(values: &[f64], std: f64) -> Drift {
        let points = values.iter().enumerate().map(|(k, value)| (k, *value, std)).collect();
        let parameter = "tendon.pretension_n".to_owned();
        Drift { nominal: 30.0, parameter, ..Drift::through(points).unwrap() }
    }

    #[test]
    fn a_line_is_that_of_the_textbook() {
        // By hand: y = 30 - 2 x, sum (x - 1.5)^2 = 5, so std(slope) = 0.1 / sqrt(5) and three times that over the whole length.
        let line = through(&[30.0, 28.0, 26.0, 24.0], 0.1);
        assert!((line.first - 30.0).abs() < 1e-12 && (line.last - 24.0).abs() < 1e-12);
        assert!((line.change_std - 0.3 / 5.0_f64.sqrt()).abs() < 1e-12, "{}", line.change_std);
        assert!((line.change() + 0.2).abs() < 1e-12 && line.drifts());
    }

    #[test]
    fn what_scatters_or_changes_little_is_no_drift() {
        assert!(
            !through(&[30.0, 29.5, 29.0, 28.5], 0.1).drifts(),
            "5 % of a pretension is what benches usually are off"
        );
        assert!(!through(&[30.0, 22.0, 34.0, 24.0], 0.1).drifts(), "up and down");
        assert!(!through(&[30.0, 28.0, 26.0, 24.0], 4.0).drifts(), "not sure");
        assert_eq!(Drift::through(vec![(0, 1.0, 0.1), (1, 2.0, 0.1)]), None);
    }
}
