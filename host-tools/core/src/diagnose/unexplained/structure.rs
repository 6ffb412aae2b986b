//! Which free form describes what is left of a series, and whether that is more than two descriptions of the same contact
//! differ by.

use std::f64::consts::{PI, TAU};

use bowden_model::channel::Channel;
use rayon::prelude::*;

use super::repeated::{period_s, without_what_repeats};
use super::samples::{Left, Samples, Variable};
use super::shape::{Factor, Fitted, Rows, Shape, best_rate, best_spot, ends_of};
use crate::diagnose::locked::FEWEST_PERIODS;
use crate::fit::objective::Series;

/// Nodes of a curve over position: wide features with few, narrow ones with many.
const NODES: [usize; 2] = [16, 40];

/// Waves of a pattern that repeats with position.
const WAVES: usize = 2;

/// Half widths of a spot that rubs, as parts of the travel: what is wider is a curve.
const REACHES: [f64; 4] = [0.04, 0.055, 0.075, 0.1];

/// Most radians of a pattern per radian of travel.
const HIGHEST_POSITION_RATE: f64 = 240.0;

/// Most rates of position that are tried, however far the travel.
const MOST_RATES: f64 = 20_000.0;

/// Frequencies in time that are looked for, Hz: slower is a curve over time, or a law that swings; faster is not resolved.
const FREQUENCIES_HZ: (f64, f64) = (2.0, 45.0);

/// Fewest periods of a swing that grows with the current, in the recording, and its highest frequency, Hz.
const FEWEST_SWINGS: f64 = 2.0;
const FASTEST_SWING_HZ: f64 = 1.0;

/// Length of the part of one recording in which a frequency is looked for, s.
const FREQUENCY_WINDOW_S: f64 = 60.0;

/// Rows in which a period of position is looked for.
const POSITION_ROWS: usize = 6000;

/// A form that needs fewer numbers is preferred as long as it takes off so much of what the best one does.
const AS_GOOD: f64 = 0.75;

/// Least that a form must take off rows which it has not seen.
#[derive(Clone, Copy, Debug)]
struct Bar {
    /// As a share of what was there.
    share: f64,
    /// In squared scales.
    removed: f64,
}

/// A free form of one series that held-out data confirm.
#[derive(Clone, Debug)]
pub(crate) struct Structure {
    /// Series in which it is strongest.
    pub(crate) series: Series,
    /// Form.
    pub(crate) shape: Shape,
    /// What it takes off.
    pub(crate) fitted: Fitted,
}

/// Bar of a form on a series.
///
/// Forty rigs of the virtual bench whose only fault, if any, was in parameters (`prove`, seed 1, groups `nothing` and
/// `parameters`; with those of seed 2 for the swing) show what a form takes off where nothing is missing, because contact and
/// mesh differ: over time by frequency 0.02 squared scales, over position 1.9 or a third, with position and direction 1.5 or a
/// quarter (either half where there is less than one squared scale), a swing that grows with the current 0.12 of the motor's
/// torque and current, other changes over time that do 1.1 of the joint's angle and 0.3 of the motor's torque, speed or time
/// alone 2.7 or half, a spot that rubs 0.26 where it takes a sixth off what is there, and 0.07 where it takes two fifths or more.
/// Each bar stands above its own. Where the motion repeats itself, every place is passed in the same way again: what is left at a place may
/// as well be what the speed and the steps there leave, and a curve over position has the bar of one over speed.
fn bar(shape: Shape, series: Series, repeats: bool) -> Bar {
    let position = matches!(shape.variable(), Variable::ThetaIn | Variable::ThetaOut);
    match (shape, series) {
        (Shape::Wave { times: Factor::Current, .. }, Series::Guide) => Bar { share: 0.2, removed: 0.28 },
        (Shape::Wave { times: Factor::Current, .. }, Series::Channel(Channel::MotorCurrent)) => {
            Bar { share: 0.2, removed: 0.13 }
        }
        (Shape::Wave { times: Factor::Current, .. } | Shape::Curve { times: Factor::Current, .. }, _) => {
            Bar { share: 0.6, removed: 3.0 }
        }
        (Shape::Wave { of: Variable::Time, .. }, _) => Bar { share: 0.2, removed: 0.3 },
        (Shape::Spot { .. }, _) => Bar { share: 0.5, removed: 0.35 },
        (Shape::Wave { .. }, _) => Bar { share: 0.35, removed: 1.0 },
        (Shape::Curve { times: Factor::Direction, .. }, _) if !repeats => Bar { share: 0.4, removed: 2.2 },
        (Shape::Curve { .. }, _) if position && !repeats => Bar { share: 0.38, removed: 2.2 },
        (Shape::Curve { .. }, _) => Bar { share: 0.6, removed: 6.0 },
    }
}

/// The strongest structure that stands above its bar.
pub(crate) fn strongest(samples: &Samples) -> Option<Structure> {
    let repeats = longest(samples).is_some_and(|recording| motion_period_s(samples, recording).is_some());
    let clear = |left: &Left, (shape, fitted): &(Shape, Fitted)| {
        let bar = bar(*shape, left.series, repeats);
        fitted.share() >= bar.share
            && fitted.removed() >= bar.removed
            && (!shape.is_of_one_recording() || fitted.shows_in_most(samples, &left.soft, bar.share))
    };
    let all: Vec<Vec<(Shape, Fitted)>> = samples
        .left
        .par_iter()
        .map(|left| tried(samples, left).filter(|form| clear(left, form)).collect())
        .collect();
    let (left, forms) = samples.left.iter().zip(all).max_by(|(_, a), (_, b)| most(a).total_cmp(&most(b)))?;
    // Of equals the first, which needs fewest numbers.
    let best = forms.iter().rev().max_by(|(_, a), (_, b)| a.removed().total_cmp(&b.removed()))?;
    let (variable, enough) = (best.0.variable(), AS_GOOD * best.1.removed());
    let as_good =
        |(shape, fitted): &(Shape, Fitted)| shape.variable() == variable && fitted.removed() >= enough;
    let (shape, fitted) = forms.into_iter().find(as_good)?;
    Some(Structure { series: left.series, shape, fitted })
}

/// Variables that account for a good part of what is left of a series, with the best form over the first of them.
pub(crate) fn dependence(samples: &Samples, left: &Left) -> Vec<(Shape, Fitted)> {
    /// Share that a variable must account for to be named.
    const NAMED_SHARE: f64 = 0.2;
    let mut found: Vec<(Shape, Fitted)> = Vec::new();
    let mut forms: Vec<_> = tried(samples, left).filter(|(_, fitted)| fitted.share() > NAMED_SHARE).collect();
    forms.sort_by(|(_, a), (_, b)| b.removed().total_cmp(&a.removed()));
    for form in forms {
        if found.iter().all(|(shape, _)| shape.variable() != form.0.variable()) {
            found.push(form);
        }
    }
    found
}

fn most(forms: &[(Shape, Fitted)]) -> f64 {
    forms.iter().map(|(_, fitted)| fitted.removed()).fold(0.0, f64::max)
}

/// Most rates that [`rates_along`] yields, and [`frequencies_hz`] of fast ones.
const MOST_STARTS: usize = 2;

/// Radians of a wave per radian of a position in which what is left of any series repeats most clearly, the clearest first.
pub(crate) fn rates_along(samples: &Samples, of: Variable) -> Vec<f64> {
    clearest(samples.left.par_iter().filter_map(|left| {
        let shape = period(samples, left, of)?;
        rate_and_gain(shape, samples, left)
    }))
}

/// Frequencies at which what is left of any series, or of one alone, swings most clearly, Hz: the fast ones, the clearest first, and the
/// clearest slow one.
pub(crate) fn frequencies_hz(samples: &Samples, of: Option<Series>) -> Vec<f64> {
    let rates = |band| {
        clearest(samples.left.par_iter().filter_map(|left| {
            let shape = of
                .is_none_or(|series| series == left.series)
                .then(|| wave_over_time(samples, left, Factor::One, band))??;
            rate_and_gain(shape, samples, left)
        }))
    };
    let (fast, slow) = (rates(Band::Fast), rates(Band::Slow));
    fast.iter().chain(slow.first()).map(|rate| rate / TAU).collect()
}

/// Rate of a wave, and how much it takes off what is left of a series.
fn rate_and_gain(shape: Shape, samples: &Samples, left: &Left) -> Option<(f64, f64)> {
    let gain = shape.fit(samples, &left.soft)?.removed();
    match shape {
        Shape::Wave { rate, .. } if gain > 0.0 => Some((rate, gain)),
        _ => None,
    }
}

/// The rates with the largest gains that differ by more than a tenth.
fn clearest(rates: impl ParallelIterator<Item = (f64, f64)>) -> Vec<f64> {
    let mut rates: Vec<(f64, f64)> = rates.collect();
    rates.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    let mut kept: Vec<f64> = Vec::new();
    for (rate, _) in rates {
        if kept.len() < MOST_STARTS && kept.iter().all(|other| (rate / other).ln().abs() > 0.1) {
            kept.push(rate);
        }
    }
    kept
}

/// Every form that can be fitted to a series, those with few numbers first.
fn tried(samples: &Samples, left: &Left) -> impl Iterator<Item = (Shape, Fitted)> {
    let curve = |of, nodes, times| Shape::Curve { of, nodes, times };
    let positions = [Variable::ThetaOut, Variable::ThetaIn];
    let mut shapes: Vec<Shape> = Vec::new();
    shapes.extend(frequency(samples, left, Factor::One));
    shapes.extend(positions.iter().filter_map(|of| period(samples, left, *of)));
    shapes.extend(spot(samples, left));
    shapes.extend(frequency(samples, left, Factor::Current));
    shapes.push(curve(Variable::Time, 0, Factor::Current));
    for nodes in NODES {
        shapes.extend(positions.map(|of| curve(of, nodes, Factor::One)));
    }
    for nodes in NODES {
        shapes.extend(positions.map(|of| curve(of, nodes, Factor::Direction)));
    }
    shapes.push(curve(Variable::Speed, NODES[0], Factor::One));
    shapes.push(curve(Variable::Tension, NODES[0], Factor::One));
    shapes.push(curve(Variable::Time, 0, Factor::One));
    shapes.into_iter().filter_map(|shape| Some((shape, shape.fit(samples, &left.soft)?)))
}

/// Frequencies among which a wave over time is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Band {
    /// [`FREQUENCIES_HZ`].
    Fast,
    /// From two periods in the recording up to those.
    Slow,
}

/// Wave over time, times the current or not. What grows with the current is looked for among slow ones alone.
fn frequency(samples: &Samples, left: &Left, times: Factor) -> Option<Shape> {
    wave_over_time(samples, left, times, if times == Factor::Current { Band::Slow } else { Band::Fast })
}

/// Wave over time, times the current or not, that takes most off the rows that may be fitted, in the longest recording. Where the motion
/// repeats itself, what is left in the same way in every period is left out: it may as well follow the motion.
fn wave_over_time(samples: &Samples, left: &Left, times: Factor, band: Band) -> Option<Shape> {
    let t_s = samples.variable(Variable::Time)?;
    let weights = if times == Factor::Current { Some(samples.variable(Variable::Current)?) } else { None };
    let longest = longest(samples)?;
    let usable = |k: &usize| {
        samples.recording[*k] == longest
            && samples.is_fitted(*k)
            && t_s[*k] < FREQUENCY_WINDOW_S
            && left.soft[*k].is_finite()
    };
    let rows: Vec<usize> = (0..samples.len()).filter(usable).collect();
    let mut table = centred(t_s, weights, left, &rows);
    let (first_s, last_s) = ends_of(&table.x);
    // Rows farther apart than half a period tell nothing of it.
    let all =
        samples.recording.iter().zip(t_s).filter(|(r, t)| **r == longest && **t < FREQUENCY_WINDOW_S).count();
    let spacing_s = (last_s - first_s) / all as f64;
    let (lowest_hz, highest_hz) = match (band, times) {
        (Band::Fast, _) => FREQUENCIES_HZ,
        (Band::Slow, Factor::Current) => (FEWEST_SWINGS / (last_s - first_s), FASTEST_SWING_HZ),
        (Band::Slow, _) => (FEWEST_SWINGS / (last_s - first_s), FREQUENCIES_HZ.0),
    };
    let highest_hz = highest_hz.min(0.45 / spacing_s);
    if rows.len() < 100 || highest_hz <= lowest_hz {
        return None;
    }
    if let Some(period_s) = motion_period_s(samples, longest) {
        without_what_repeats(&mut table.values, &table.x, period_s, spacing_s);
    }
    let step = PI / (last_s - first_s) / if band == Band::Slow { 2.0 } else { 1.0 };
    let rate = best_rate(&table, (TAU * lowest_hz, TAU * highest_hz), step)?;
    Some(Shape::Wave { of: Variable::Time, rate, waves: 1, times })
}

/// Recording with the most rows.
fn longest(samples: &Samples) -> Option<usize> {
    let recordings = samples.recording.last()? + 1;
    let rows_of = |recording: &usize| samples.recording.iter().filter(|r| *r == recording).count();
    (0..recordings).max_by_key(rows_of)
}

/// Time after which the motion of a recording repeats itself, s, in the window in which a frequency is looked for.
fn motion_period_s(samples: &Samples, recording: usize) -> Option<f64> {
    let (t_s, theta_rad) = (samples.variable(Variable::Time)?, samples.variable(Variable::ThetaIn)?);
    let of_it = |k: &usize| samples.recording[*k] == recording && t_s[*k] < FREQUENCY_WINDOW_S;
    let rows: Vec<usize> = (0..samples.len()).filter(of_it).collect();
    let of_rows = |values: &[f64]| -> Vec<f64> { rows.iter().map(|k| values[*k]).collect() };
    period_s(&of_rows(t_s), &of_rows(theta_rad))
}

/// Wave over a position that takes most off the rows that may be fitted.
fn period(samples: &Samples, left: &Left, of: Variable) -> Option<Shape> {
    let theta_rad = samples.variable(of)?;
    let usable = |k: &usize| samples.is_fitted(*k) && left.soft[*k].is_finite();
    let all: Vec<usize> = (0..samples.len()).filter(usable).collect();
    let rows: Vec<usize> = all.iter().copied().step_by(all.len().div_ceil(POSITION_ROWS).max(1)).collect();
    let table = centred(theta_rad, None, left, &rows);
    let (low, high) = ends_of(&table.x);
    let lowest = FEWEST_PERIODS * TAU / (high - low);
    if rows.len() < 100 || lowest >= HIGHEST_POSITION_RATE {
        return None;
    }
    let step = (PI / (4.0 * (high - low))).max((HIGHEST_POSITION_RATE - lowest) / MOST_RATES);
    let rate = best_rate(&table, (lowest, HIGHEST_POSITION_RATE), step)?;
    Some(Shape::Wave { of, rate, waves: WAVES, times: Factor::One })
}

/// Place at which a sheath or a bearing rubs, by the angle of the input pulley.
fn spot(samples: &Samples, left: &Left) -> Option<Shape> {
    let of = Variable::ThetaIn;
    let theta_rad = samples.variable(of)?;
    let rows: Vec<usize> =
        (0..samples.len()).filter(|k| samples.is_fitted(*k) && left.soft[*k].is_finite()).collect();
    let of_rows = |values: &[f64]| -> Vec<f64> { rows.iter().map(|k| values[*k]).collect() };
    let (x, directions, values) = (of_rows(theta_rad), of_rows(&samples.last_direction), of_rows(&left.soft));
    let (low, high) = ends_of(&x);
    let places = REACHES.iter().filter_map(|part| {
        let reach = part * (high - low);
        let (at, gain) = best_spot(&x, &directions, &values, reach)?;
        Some((Shape::Spot { of, at, reach }, gain))
    });
    places.max_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(shape, _)| shape)
}

/// Rows of a variable and of a series, the latter without its part that is constant but for the weights.
fn centred(x: &[f64], weights: Option<&[f64]>, left: &Left, rows: &[usize]) -> Rows {
    let weights: Vec<f64> = rows.iter().map(|k| weights.map_or(1.0, |weights| weights[*k])).collect();
    let power: f64 = weights.iter().map(|weight| weight * weight).sum();
    let along: f64 = rows.iter().zip(&weights).map(|(k, weight)| left.soft[*k] * weight).sum();
    let constant = if power > 0.0 { along / power } else { 0.0 };
    Rows {
        x: rows.iter().map(|k| x[*k]).collect(),
        values: rows.iter().zip(&weights).map(|(k, weight)| left.soft[*k] - constant * weight).collect(),
        weights,
    }
}
