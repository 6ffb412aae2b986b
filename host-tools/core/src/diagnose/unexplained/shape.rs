//! Free forms: curves and waves over a variable, fitted by linear least squares to rows that a fit may see, and judged on
//! the others. They say how a difference varies, not why.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::samples::{RowUse, Samples, Variable};

/// Part of the mean diagonal that is added to each one: a node that no row touches stays at zero.
const RIDGE: f64 = 1e-3;

/// Seconds between the nodes of a curve over time.
const TIME_NODE_S: f64 = 3.0;

/// What a curve is multiplied with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Factor {
    /// Nothing.
    One,
    /// One curve as it is, and one that turns its sign with the direction of motion.
    Direction,
    /// The motor's current.
    Current,
}

/// A free form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    /// Straight lines between evenly spaced nodes.
    Curve {
        /// Of what.
        of: Variable,
        /// How many; over time as many as its length asks for.
        nodes: usize,
        /// Multiplied with what.
        times: Factor,
    },
    /// `Σ a_k sin(k c x) + b_k cos(k c x)` with `waves` terms, or that and a constant, times the current.
    Wave {
        /// Of what.
        of: Variable,
        /// c, rad per unit of the variable.
        rate: f64,
        /// How many.
        waves: usize,
        /// Multiplied with what; a wave does not turn with the direction.
        times: Factor,
    },
    /// One bump, `a (1 − ((x − at) / reach)²)²`, whose sign is that of the last motion: what rubs at one place.
    Spot {
        /// Of what.
        of: Variable,
        /// Its middle.
        at: f64,
        /// Half its width.
        reach: f64,
    },
}

/// How well a free form does on rows that it was not fitted to.
#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    /// Mean square of what was there, in squared scales, over the rows that the form reaches.
    before: f64,
    /// Mean square of what is left there.
    after: f64,
    /// Those rows as a part of all that could judge.
    reached: f64,
    /// Value of the form at every row, in scales; zero where it is not defined.
    pub(crate) form: Vec<f64>,
    /// Coefficients of the first recording, or of all where one set serves all.
    pub(crate) coefficients: Vec<f64>,
    /// Rows that confirm it: none that it does not reach.
    pub(crate) confirmed_by: Vec<bool>,
}

impl Fitted {
    /// Squared scales that it takes off rows that it has not seen, in the mean of all of them.
    pub(crate) fn removed(&self) -> f64 {
        self.reached * (self.before - self.after)
    }

    /// Whether it takes such a share off the rows that confirm it in most of the recordings: what is fitted to each recording by itself, and
    /// shows in one of several, is how that motion rings.
    pub(crate) fn shows_in_most(&self, samples: &Samples, values: &[f64], share: f64) -> bool {
        let mut squares: BTreeMap<usize, [f64; 2]> = BTreeMap::new();
        for k in (0..samples.len()).filter(|k| self.confirmed_by[*k] && values[*k].is_finite()) {
            let of = squares.entry(samples.recording[k]).or_default();
            *of = [of[0] + values[k].powi(2), of[1] + (values[k] - self.form[k]).powi(2)];
        }
        let shown = squares.values().filter(|[before, after]| before - after >= share * before).count();
        2 * shown > squares.len()
    }

    /// What it takes off, as a share of what was there where it reaches.
    pub(crate) fn share(&self) -> f64 {
        if self.before > 0.0 { (self.before - self.after) / self.before } else { 0.0 }
    }
}

impl Shape {
    /// Variable along which it runs.
    pub(crate) const fn variable(self) -> Variable {
        match self {
            Self::Curve { of, .. } | Self::Wave { of, .. } | Self::Spot { of, .. } => of,
        }
    }

    /// Whether every recording has its own: clocks start anew.
    pub(crate) fn is_of_one_recording(self) -> bool {
        self.variable() == Variable::Time
    }

    /// Whether it is multiplied with the current.
    const fn grows_with_current(self) -> bool {
        matches!(self, Self::Curve { times: Factor::Current, .. } | Self::Wave { times: Factor::Current, .. })
    }

    /// Fits the form to `values`, one a row. Of one that grows with the current only the change over time counts: what is in the
    /// same proportion to the current all the time is a gain, and no form describes it.
    pub(crate) fn fit(self, samples: &Samples, values: &[f64]) -> Option<Fitted> {
        let x = samples.variable(self.variable())?;
        let factor = match self {
            _ if self.grows_with_current() => Some(samples.variable(Variable::Current)?),
            Self::Curve { times: Factor::Direction, .. } => Some(samples.direction.as_slice()),
            Self::Spot { .. } => Some(samples.last_direction.as_slice()),
            _ => None,
        };
        let alone = self.is_of_one_recording();
        let without_gain;
        let values = match factor {
            Some(current) if self.grows_with_current() => {
                without_gain = less_a_gain(samples, current, values);
                &without_gain
            }
            _ => values,
        };
        let mut form = vec![0.0; samples.len()];
        let mut first = None;
        let mut start = 0;
        while start < samples.len() {
            let end = if alone {
                start + samples.recording[start..].partition_point(|r| *r == samples.recording[start])
            } else {
                samples.len()
            };
            let ends = self.ends(samples, start..end);
            let mut terms = Vec::new();
            let count = self.count(ends);
            let (mut normal, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
            let usable = |k: usize| values[k].is_finite();
            for k in (start..end).filter(|k| usable(*k) && samples.is_fitted(*k)) {
                self.terms(x[k], factor.map_or(1.0, |f| f[k]), ends, &mut terms);
                for &(i, a) in &terms {
                    right[i] += a * values[k];
                    for &(j, b) in &terms {
                        normal[(i, j)] += a * b;
                    }
                }
            }
            let ridge = RIDGE * normal.trace() / count as f64 + f64::MIN_POSITIVE.sqrt();
            (0..count).for_each(|i| normal[(i, i)] += ridge);
            let coefficients = normal.cholesky()?.solve(&right);
            for k in (start..end).filter(|k| usable(*k)) {
                self.terms(x[k], factor.map_or(1.0, |f| f[k]), ends, &mut terms);
                form[k] = terms.iter().map(|&(i, a)| a * coefficients[i]).sum();
            }
            first.get_or_insert_with(|| coefficients.iter().copied().collect::<Vec<f64>>());
            start = end;
        }
        let confirms = |row: usize| samples.used_for[row] == RowUse::Confirming;
        let confirmed_by: Vec<bool> = (0..samples.len()).map(|k| confirms(k) && self.reaches(x[k])).collect();
        let (mut before, mut after, mut rows) = (0.0, 0.0, 0.0);
        for k in (0..samples.len()).filter(|k| confirmed_by[*k] && values[*k].is_finite()) {
            before += values[k].powi(2);
            after += (values[k] - form[k]).powi(2);
            rows += 1.0;
        }
        let all = (0..samples.len()).filter(|k| confirms(*k) && values[*k].is_finite()).count();
        (rows > 0.0).then(|| Fitted {
            before: before / rows,
            after: after / rows,
            reached: rows / all as f64,
            form,
            coefficients: first.unwrap_or_default(),
            confirmed_by,
        })
    }

    /// Ends of the variable over the rows by which something may be chosen; over all where those are the only ones.
    fn ends(self, samples: &Samples, rows: Range<usize>) -> (f64, f64) {
        let x = samples.variable(self.variable()).unwrap_or_default();
        let choosing: Vec<f64> = rows.clone().filter(|k| samples.may_choose(*k)).map(|k| x[k]).collect();
        if choosing.is_empty() { ends_of(&x[rows]) } else { ends_of(&choosing) }
    }

    /// Value of the form, as it was fitted to `samples`, at every row of a table, in scales; not a number where it says nothing.
    ///
    /// A form of one recording alone says nothing of another.
    pub(crate) fn at_rows_of(self, table: &Samples, samples: &Samples, fitted: &Fitted) -> Vec<f64> {
        let nothing = vec![f64::NAN; table.len()];
        let (Some(x), false) = (table.variable(self.variable()), self.is_of_one_recording()) else {
            return nothing;
        };
        let factor = match self {
            _ if self.grows_with_current() => table.variable(Variable::Current),
            Self::Curve { times: Factor::Direction, .. } => Some(table.direction.as_slice()),
            Self::Spot { .. } => Some(table.last_direction.as_slice()),
            _ => None,
        };
        let ends = self.ends(samples, 0..samples.len());
        let mut terms = Vec::new();
        let at = |(k, x): (usize, &f64)| {
            if !self.reaches(*x) {
                return f64::NAN;
            }
            self.terms(*x, factor.map_or(1.0, |f| f[k]), ends, &mut terms);
            terms.iter().map(|&(i, a)| a * fitted.coefficients[i]).sum()
        };
        x.iter().enumerate().map(at).collect()
    }

    /// Whether the form says anything at `x`.
    fn reaches(self, x: f64) -> bool {
        match self {
            Self::Spot { at, reach, .. } => (x - at).abs() < reach,
            Self::Curve { .. } | Self::Wave { .. } => true,
        }
    }

    /// Whether the form turns with the direction of motion.
    pub(crate) const fn turns(self) -> bool {
        matches!(self, Self::Curve { times: Factor::Direction, .. } | Self::Spot { .. })
    }

    /// The form over its variable, for the first recording where each has its own; at direction `direction` for one that
    /// turns with it, for one ampere for one that grows with the current.
    pub(crate) fn drawn(self, samples: &Samples, fitted: &Fitted, direction: f64) -> Vec<(f64, f64)> {
        /// Points of a wave's period, and of a spot.
        const POINTS: usize = 32;
        if samples.variable(self.variable()).is_none() {
            return Vec::new();
        }
        let rows = if self.is_of_one_recording() {
            samples.recording.partition_point(|r| *r == samples.recording[0])
        } else {
            samples.len()
        };
        let ends = self.ends(samples, 0..rows);
        let (from, to, points) = match self {
            Self::Curve { .. } => (ends.0, ends.1, self.nodes(ends) - 1),
            Self::Wave { rate, .. } => (0.0, TAU / rate, POINTS),
            Self::Spot { at, reach, .. } => (at - reach, at + reach, POINTS),
        };
        let factor = if self.turns() { direction } else { 1.0 };
        let mut terms = Vec::new();
        (0..=points)
            .map(|point| {
                let x = from + (to - from) * point as f64 / points.max(1) as f64;
                self.terms(x, factor, ends, &mut terms);
                (x, terms.iter().map(|&(i, a)| a * fitted.coefficients[i]).sum())
            })
            .collect()
    }

    fn nodes(self, ends: (f64, f64)) -> usize {
        match self {
            Self::Curve { of: Variable::Time, .. } => {
                (((ends.1 - ends.0) / TIME_NODE_S) as usize + 1).clamp(4, 60)
            }
            Self::Curve { nodes, .. } => nodes.max(2),
            Self::Wave { .. } | Self::Spot { .. } => 0,
        }
    }

    fn count(self, ends: (f64, f64)) -> usize {
        match self {
            Self::Curve { times: Factor::Direction, .. } => 2 * self.nodes(ends),
            Self::Curve { .. } => self.nodes(ends),
            Self::Wave { waves, times, .. } => 2 * waves + usize::from(times == Factor::Current),
            Self::Spot { .. } => 1,
        }
    }

    /// Index and value of every term that is not zero at `x`.
    fn terms(self, x: f64, factor: f64, ends: (f64, f64), terms: &mut Vec<(usize, f64)>) {
        terms.clear();
        match self {
            Self::Spot { at, reach, .. } => {
                let x = (x - at) / reach;
                terms.push((0, factor * (1.0 - x * x).max(0.0).powi(2)));
            }
            Self::Wave { rate, waves, times, .. } => {
                let factor = if times == Factor::Current { factor } else { 1.0 };
                terms.extend((0..waves).flat_map(|k| {
                    let (sin, cos) = ((k + 1) as f64 * rate * x).sin_cos();
                    [(2 * k, factor * sin), (2 * k + 1, factor * cos)]
                }));
                if times == Factor::Current {
                    terms.push((2 * waves, factor));
                }
            }
            Self::Curve { times, .. } => {
                let nodes = self.nodes(ends);
                let place = ((x - ends.0) / (ends.1 - ends.0)).clamp(0.0, 1.0) * (nodes - 1) as f64;
                let node = (place as usize).min(nodes - 2);
                let share = place - node as f64;
                let pair = [(node, 1.0 - share), (node + 1, share)];
                match times {
                    Factor::One => terms.extend(pair),
                    Factor::Current => terms.extend(pair.map(|(i, a)| (i, a * factor))),
                    Factor::Direction => {
                        terms.extend(pair);
                        terms.extend(pair.map(|(i, a)| (nodes + i, a * factor)));
                    }
                }
            }
        }
    }
}

/// `values` of every recording without their part in proportion to `current`, as the rows have it that forms are fitted to.
fn less_a_gain(samples: &Samples, current: &[f64], values: &[f64]) -> Vec<f64> {
    let recordings = samples.recording.last().map_or(0, |last| last + 1);
    let mut sums = vec![(0.0, f64::MIN_POSITIVE); recordings];
    for k in (0..samples.len()).filter(|k| samples.is_fitted(*k) && values[*k].is_finite()) {
        let (along, power) = &mut sums[samples.recording[k]];
        *along += current[k] * values[k];
        *power += current[k] * current[k];
    }
    let left = |(k, value): (usize, &f64)| {
        let (along, power) = sums[samples.recording[k]];
        value - along / power * current[k]
    };
    values.iter().enumerate().map(left).collect()
}

/// Smallest and largest value, never the same.
pub(super) fn ends_of(x: &[f64]) -> (f64, f64) {
    let (low, high) =
        x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
    if high > low { (low, high) } else { (low - 0.5, low + 0.5) }
}

/// Rate, in radians per unit of `x`, of the wave that takes most off `values` when it is multiplied with `weights`; `None` where
/// nothing can be told.
///
/// A periodogram by least squares (Lomb, Astrophys. Space Sci. 39 (1976) 447), for rows at any distance: rates from `from` to
/// `to` in steps of `step`, then finer about the best.
pub(crate) fn best_rate(rows: &Rows, (from, to): (f64, f64), step: f64) -> Option<f64> {
    let coarse = scan(rows, from, step, ((to - from) / step) as usize + 1)?;
    let fine = 0.05 * step;
    scan(rows, (coarse - step).max(from), fine, 41)
}

/// What a rate is looked for in, one entry a row.
pub(crate) struct Rows {
    /// Variable.
    pub(crate) x: Vec<f64>,
    /// What the wave describes.
    pub(crate) values: Vec<f64>,
    /// What the wave is multiplied with.
    pub(crate) weights: Vec<f64>,
}

fn scan(rows: &Rows, from: f64, step: f64, count: usize) -> Option<f64> {
    let mut wave: Vec<(f64, f64)> = rows.x.iter().map(|x| (from * x).sin_cos()).collect();
    let turn: Vec<(f64, f64)> = rows.x.iter().map(|x| (step * x).sin_cos()).collect();
    let mut best: Option<(f64, f64)> = None;
    for index in 0..count {
        let (mut ss, mut cc, mut sc, mut sv, mut cv) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let told = rows.values.iter().zip(&rows.weights);
        for (((sin, cos), (turn_sin, turn_cos)), (value, weight)) in wave.iter_mut().zip(&turn).zip(told) {
            let (a, b) = (weight * *sin, weight * *cos);
            ss += a * a;
            cc += b * b;
            sc += a * b;
            sv += a * value;
            cv += b * value;
            (*sin, *cos) = (*sin * turn_cos + *cos * turn_sin, *cos * turn_cos - *sin * turn_sin);
        }
        let determinant = ss * cc - sc * sc;
        if determinant > 1e-3 * ss * cc {
            let gain = (cc * sv * sv - 2.0 * sc * sv * cv + ss * cv * cv) / determinant;
            if best.is_none_or(|(most, _)| gain > most) {
                best = Some((gain, from + step * index as f64));
            }
        }
    }
    best.map(|(_, rate)| rate)
}

/// Middle of the spot of half width `reach` that takes most off `values`, and how much it takes off the sum of their squares;
/// `None` where no place is passed often enough, both ways.
///
/// `x` are the places of the rows, `directions` the signs that the spot has there.
pub(super) fn best_spot(x: &[f64], directions: &[f64], values: &[f64], reach: f64) -> Option<(f64, f64)> {
    /// Rows, weighted with the bump, that a place must have in either direction.
    const FEWEST_ROWS: f64 = 15.0;
    /// Places within half a width.
    const PLACES: f64 = 6.0;
    let (low, high) = ends_of(x);
    let count = ((high - low - 2.0 * reach) / reach * PLACES).max(0.0) as usize;
    let gain = |at: f64| {
        let (mut along, mut forward, mut backward) = (0.0, 0.0, 0.0);
        for ((x, direction), value) in x.iter().zip(directions).zip(values) {
            let place = (x - at) / reach;
            let bump = direction * (1.0 - place * place).max(0.0).powi(2);
            along += bump * value;
            *if bump > 0.0 { &mut forward } else { &mut backward } += bump * bump;
        }
        (forward.min(backward) > FEWEST_ROWS).then(|| along * along / (forward + backward))
    };
    (0..=count)
        .filter_map(|place| {
            let at = low + reach * (1.0 + place as f64 / PLACES);
            Some((at, gain(at)?))
        })
        .max_by(|(_, a), (_, b)| a.total_cmp(b))
}
