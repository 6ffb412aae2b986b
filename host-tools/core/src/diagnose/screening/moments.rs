//! Since when, and for how long: the moments at which an effect that sets in at one is worth trying.
//!
//! The effect is simulated once as if it had always been there. With what that changes, `d`, cut off before a moment `t`, and after the
//! end of what ends, `d_t`, and the part `l` of the residuals that no parameter takes off, the loss at the strength `b` is estimated as
//! `|l + b P d_t|²` with the projection `P` of the module above: for each `t` a sum over the blocks since then. A moment inside a second
//! that is held out costs the same as any other, and a weight that changes after eight seconds of forty is found though the recalibration
//! has taken what hangs in the other thirty-two for its own.

use nalgebra::{DMatrix, DVector};

/// Most moments that are compared; of more blocks than these, every second, third and so on begins one.
const MOST_MOMENTS: usize = 400;

/// Moments that are returned.
const RETURNED: usize = 3;

/// Part of the recordings by which two of them differ at least.
const APART: f64 = 1.0 / 12.0;

/// Part of what an effect changes, as a square, that the parameters must leave to tell anything of it.
const LEFT_BY_PARAMETERS: f64 = 1e-6;

/// What is compared with what, row by row.
pub(super) struct Comparison<'a> {
    /// Clock of the bench where the block of each row begins, s.
    pub clock_s: &'a [f64],
    /// Part of the residuals that no parameter takes off.
    pub left: &'a DVector<f64>,
    /// What the effect changes.
    pub change: &'a DVector<f64>,
    /// Orthonormal basis of what the parameters change; rows beyond those of `clock_s` are those of priors.
    pub basis: &'a DMatrix<f64>,
}

/// An estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Span {
    /// When it sets in, s.
    pub from_s: f64,
    /// When it ends, s; infinite for what stays.
    pub until_s: f64,
    /// Strength over that of the simulation.
    pub strength: f64,
    /// Loss that it takes off.
    pub gain: f64,
}

/// Sums over the rows of a block and of all later ones.
#[derive(Clone)]
struct Sums {
    clock_s: f64,
    left_by_change: f64,
    change_squared: f64,
    inside: DVector<f64>,
}

impl Comparison<'_> {
    /// The best moments for strengths in `[lower, upper]`, best first; with `ends`, the best spans.
    pub(super) fn spans(&self, [lower, upper]: [f64; 2], ends: bool) -> Vec<Span> {
        let sums = self.sums();
        let (Some(first), Some(last)) = (sums.first(), sums.last()) else { return Vec::new() };
        let apart_s = APART * (last.clock_s - first.clock_s);
        let span = |from: usize, until: usize| {
            let (from, until) = (&sums[from], &sums[until]);
            let along = from.left_by_change - until.left_by_change;
            let squared = from.change_squared - until.change_squared;
            let left = squared - from.inside.metric_distance(&until.inside).powi(2);
            if left <= LEFT_BY_PARAMETERS * squared {
                return None;
            }
            let strength = (-along / left).clamp(lower, upper);
            let gain = -strength * (2.0 * along + strength * left);
            let until_s = if until.clock_s < last.clock_s { until.clock_s } else { f64::INFINITY };
            Some(Span { from_s: from.clock_s, until_s, strength, gain })
        };
        let end = sums.len() - 1;
        let mut all: Vec<Span> = (0..end)
            .filter_map(|from| {
                let untils = if ends { from + 1 } else { end }..=end;
                // What has been there all along is no moment.
                let spans =
                    untils.filter(|until| (from, *until) != (0, end)).filter_map(|until| span(from, until));
                spans.max_by(|a, b| a.gain.total_cmp(&b.gain))
            })
            .collect();
        all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let mut best: Vec<Span> = Vec::new();
        for span in all {
            let is_new = best.iter().all(|other| (other.from_s - span.from_s).abs() > apart_s);
            if span.gain > 0.0 && is_new && best.len() < RETURNED {
                best.push(span);
            }
        }
        best
    }

    /// One for each moment that is compared, and one for the end, where nothing is left to come.
    fn sums(&self) -> Vec<Sums> {
        let mut order: Vec<usize> = (0..self.clock_s.len()).collect();
        order.sort_by(|a, b| self.clock_s[*a].total_cmp(&self.clock_s[*b]));
        let mut moments: Vec<f64> = order.iter().map(|row| self.clock_s[*row]).collect();
        moments.dedup();
        let every = moments.len().div_ceil(MOST_MOMENTS).max(1);
        let mut rows = order.into_iter().rev().peekable();
        let Some(last_s) = moments.last() else { return Vec::new() };
        let mut sums = vec![Sums {
            clock_s: last_s + f64::EPSILON * last_s.abs().max(1.0),
            left_by_change: 0.0,
            change_squared: 0.0,
            inside: DVector::zeros(self.basis.ncols()),
        }];
        for moment_s in moments.iter().step_by(every).rev() {
            let mut sum = sums[sums.len() - 1].clone();
            sum.clock_s = *moment_s;
            while let Some(row) = rows.next_if(|row| self.clock_s[*row] >= *moment_s) {
                let change = self.change[row];
                sum.left_by_change += self.left[row] * change;
                sum.change_squared += change * change;
                if !self.basis.is_empty() {
                    sum.inside.axpy(change, &self.basis.row(row).transpose(), 1.0);
                }
            }
            sums.push(sum);
        }
        sums.reverse();
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Forty seconds, ten rows a second.
    const ROWS: usize = 400;

    fn clock_s() -> Vec<f64> {
        (0..ROWS).map(|row| row as f64 / 10.0).collect()
    }

    /// A motion with three frequencies, which is what the effect changes.
    fn change() -> DVector<f64> {
        let of = |t_s: f64| (1.3 * t_s).sin() + 0.7 * (2.9 * t_s).cos() + 0.4 * (5.1 * t_s).sin();
        DVector::from_iterator(ROWS, clock_s().into_iter().map(of))
    }

    /// What is left of `made` by a parameter that changes the same as the effect, and that parameter's direction.
    fn left(made: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let one = change().normalize();
        let left = made - &one * one.dot(made);
        (left, DMatrix::from_columns(&[one]))
    }

    fn found(made: &DVector<f64>, limits: [f64; 2], ends: bool) -> Vec<Span> {
        let (left, basis) = left(made);
        let (clock_s, change) = (clock_s(), change());
        Comparison { clock_s: &clock_s, left: &left, change: &change, basis: &basis }.spans(limits, ends)
    }

    /// The residuals are what is missing: the effect at half of its strength takes them off.
    fn made(within: impl Fn(f64) -> bool, strength: f64) -> DVector<f64> {
        let there = clock_s().into_iter().map(|t_s| if within(t_s) { -strength } else { 0.0 });
        DVector::from_iterator(ROWS, there).component_mul(&change())
    }

    #[test]
    fn a_change_that_a_parameter_has_made_its_own_is_found_at_its_moment() {
        let best = found(&made(|t_s| t_s >= 8.0, 0.5), [-3.0, 3.0], false)[0];
        assert_eq!((best.from_s, best.until_s), (8.0, f64::INFINITY));
        assert!((best.strength - 0.5).abs() < 1e-9, "{best:?}");
        // All that the parameter leaves.
        let (left, _) = left(&made(|t_s| t_s >= 8.0, 0.5));
        assert!((best.gain / left.norm_squared() - 1.0).abs() < 1e-9, "{best:?}");
    }

    #[test]
    fn what_ends_is_found_with_its_end() {
        let made = made(|t_s| (12.0..17.0).contains(&t_s), -0.8);
        let best = found(&made, [-3.0, 3.0], true)[0];
        assert_eq!((best.from_s, best.until_s), (12.0, 17.0));
        assert!((best.strength + 0.8).abs() < 1e-9, "{best:?}");
        let without_end = found(&made, [-3.0, 3.0], false)[0];
        assert!(without_end.gain < 0.7 * best.gain, "{without_end:?}");
    }

    #[test]
    fn a_strength_stays_within_its_limits_and_moments_stay_apart() {
        let spans = found(&made(|t_s| t_s >= 8.0, 0.5), [0.0, 0.2], false);
        assert_eq!((spans[0].from_s, spans[0].strength), (8.0, 0.2));
        for (index, span) in spans.iter().enumerate() {
            assert!(spans[..index].iter().all(|other| (other.from_s - span.from_s).abs() > 3.0), "{spans:?}");
        }
        let other_side = found(&made(|t_s| t_s >= 8.0, 0.5), [-3.0, 0.0], false);
        assert!(other_side.iter().all(|span| span.gain < 0.3 * spans[0].gain), "{other_side:?}");
    }

    #[test]
    fn what_has_been_there_all_along_is_no_moment() {
        let all_along = found(&made(|_| true, 0.5), [-3.0, 3.0], false);
        assert!(all_along.iter().all(|span| span.gain < 1e-20), "{all_along:?}");
        let nothing = DVector::zeros(0);
        let basis = DMatrix::zeros(0, 0);
        let none = Comparison { clock_s: &[], left: &nothing, change: &nothing, basis: &basis };
        assert_eq!(none.spans([-3.0, 3.0], true), []);
    }

    /// Two recordings of two benches on one clock: rows need not come in order.
    #[test]
    fn rows_in_any_order_give_the_same() {
        let (made, change, clock_s) = (made(|t_s| t_s >= 21.0, 1.5), change(), clock_s());
        let (left, basis) = left(&made);
        let order: Vec<usize> = (0..ROWS).map(|row| row * 7 % ROWS).collect();
        let of = |values: &DVector<f64>| DVector::from_iterator(ROWS, order.iter().map(|row| values[*row]));
        let shuffled = Comparison {
            clock_s: &order.iter().map(|row| clock_s[*row]).collect::<Vec<f64>>(),
            left: &of(&left),
            change: &of(&change),
            basis: &basis.select_rows(&order),
        }
        .spans([-3.0, 3.0], false)[0];
        assert_eq!(shuffled.from_s, 21.0);
        assert!((shuffled.strength - 1.5).abs() < 1e-9, "{shuffled:?}");
    }
}
