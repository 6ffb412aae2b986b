//! Functions of one or two variables as values at knots, linear between them and constant beyond.

/// Knots of one variable, strictly increasing, at least two.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis(Vec<f64>);

impl Axis {
    /// The axis with these knots; `None` unless they are finite, at least two, and strictly increasing.
    #[must_use]
    pub fn new(knots: Vec<f64>) -> Option<Self> {
        let rises = knots.windows(2).all(|pair| pair[0] < pair[1]);
        (knots.len() >= 2 && rises && knots.iter().all(|knot| knot.is_finite())).then_some(Self(knots))
    }

    /// The knots.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.0
    }

    /// The interval that holds `x`, by its left knot, and how far into it `x` lies, 0 to 1.
    fn place(&self, x: f64) -> (usize, f64) {
        let knots = &self.0;
        let left = knots.partition_point(|knot| *knot <= x).clamp(1, knots.len() - 1) - 1;
        let part = (x - knots[left]) / (knots[left + 1] - knots[left]);
        (left, part.clamp(0.0, 1.0))
    }
}

/// Values at the knots of one or two axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    axes: Vec<Axis>,
    /// One a combination of knots; the last axis runs fastest.
    values: Vec<f64>,
}

impl Table {
    /// A table; `None` unless there are one or two axes, and as many finite values as combinations of their knots.
    #[must_use]
    pub fn new(axes: Vec<Axis>, values: Vec<f64>) -> Option<Self> {
        let count: usize = axes.iter().map(|axis| axis.0.len()).product();
        let fits = matches!(axes.len(), 1 | 2) && values.len() == count;
        (fits && values.iter().all(|value| value.is_finite())).then_some(Self { axes, values })
    }

    /// Its axes.
    #[must_use]
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// Its values; the last axis runs fastest.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The value at a point, of which a table of one axis reads the first number only.
    #[must_use]
    pub fn at(&self, point: [f64; 2]) -> f64 {
        let between = |a: f64, b: f64, part: f64| a + part * (b - a);
        let (row, part) = self.axes[0].place(point[0]);
        let Some(across) = self.axes.get(1) else {
            return between(self.values[row], self.values[row + 1], part);
        };
        let width = across.0.len();
        let (column, part_across) = across.place(point[1]);
        let along = |row: usize| {
            let start = row * width + column;
            between(self.values[start], self.values[start + 1], part_across)
        };
        between(along(row), along(row + 1), part)
    }

    /// Largest size of its values.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()))
    }

    /// The same table without the knots that straight lines between the others replace, to `tolerance` of each value.
    #[must_use]
    pub fn thinned(&self, tolerance: f64) -> Self {
        let mut table = self.clone();
        for axis in 0..table.axes.len() {
            let kept = table.needed(axis, tolerance / self.axes.len() as f64);
            table = table.with_knots(axis, &kept);
        }
        table
    }

    /// Values along all lines of an axis at one of its knots.
    fn across(&self, axis: usize, knot: usize) -> impl Iterator<Item = f64> + '_ {
        let width = self.axes.get(1).map_or(1, |across| across.0.len());
        let (start, step, count) =
            if axis == 0 { (knot * width, 1, width) } else { (knot, width, self.axes[0].0.len()) };
        (0..count).map(move |line| self.values[start + line * step])
    }

    /// Knots of an axis that cannot be left out: from each kept one the next is the farthest that straight lines reach.
    fn needed(&self, axis: usize, tolerance: f64) -> Vec<usize> {
        let knots = &self.axes[axis].0;
        let last = knots.len() - 1;
        let reaches = |from: usize, to: usize| {
            (from + 1..to).all(|knot| {
                let part = (knots[knot] - knots[from]) / (knots[to] - knots[from]);
                let ends = self.across(axis, from).zip(self.across(axis, to));
                ends.zip(self.across(axis, knot))
                    .all(|((a, b), there)| (a + part * (b - a) - there).abs() <= tolerance)
            })
        };
        let mut kept = vec![0];
        let mut from = 0;
        while from < last {
            // Twice as far each time, then between: reach is not monotonic, but what is kept is checked whole.
            let mut step = 1;
            while from + 2 * step <= last && reaches(from, from + 2 * step) {
                step *= 2;
            }
            let mut to = from + step;
            while to < last && reaches(from, to + 1) {
                to += 1;
            }
            kept.push(to);
            from = to;
        }
        kept
    }

    fn with_knots(&self, axis: usize, kept: &[usize]) -> Self {
        let mut axes = self.axes.clone();
        axes[axis] = Axis(kept.iter().map(|knot| self.axes[axis].0[*knot]).collect());
        let width = self.axes.get(1).map_or(1, |across| across.0.len());
        let values = (0..self.values.len())
            .filter(|place| {
                kept.binary_search(&if axis == 0 { place / width } else { place % width }).is_ok()
            })
            .map(|place| self.values[place])
            .collect();
        Self { axes, values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(knots: &[f64]) -> Axis {
        Axis::new(knots.to_vec()).unwrap()
    }

    #[test]
    fn values_are_linear_between_knots_and_constant_beyond() {
        let table = Table::new(vec![axis(&[-1.0, 0.0, 2.0])], vec![3.0, 1.0, 5.0]).unwrap();
        for (x, y) in [(-9.0, 3.0), (-1.0, 3.0), (-0.25, 1.5), (0.0, 1.0), (0.5, 2.0), (2.0, 5.0), (7.0, 5.0)]
        {
            assert!((table.at([x, f64::NAN]) - y).abs() < 1e-15, "{x}: {}", table.at([x, 0.0]));
        }
        // x y is bilinear, so that a table of it is exact.
        let (xs, ys) = ([-1.0, 0.5, 2.0], [0.0, 1.0, 4.0, 5.0]);
        let values = xs.iter().flat_map(|x| ys.map(|y| x * y)).collect();
        let table = Table::new(vec![axis(&xs), axis(&ys)], values).unwrap();
        for (x, y) in [(-0.3, 2.2), (1.9, 4.9), (0.5, 1.0)] {
            assert!((table.at([x, y]) - x * y).abs() < 1e-12);
        }
        assert!((table.at([9.0, 9.0]) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn knots_that_lines_replace_are_left_out() {
        let knots: Vec<f64> = (0..=400).map(|k| f64::from(k) * 0.01 - 2.0).collect();
        let of = |f: fn(f64) -> f64| {
            Table::new(vec![axis(&knots)], knots.iter().map(|x| f(*x)).collect()).unwrap()
        };
        assert_eq!(of(f64::abs).thinned(1e-9).axes()[0].knots().len(), 3);
        let bump = of(|x| (-x * x / 0.1).exp());
        let thin = bump.thinned(1e-3);
        let count = thin.axes()[0].knots().len();
        assert!((10..80).contains(&count), "{count}");
        for x in &knots {
            assert!((thin.at([*x, 0.0]) - bump.at([*x, 0.0])).abs() <= 1e-3);
        }
        let ys: Vec<f64> = (0..=20).map(f64::from).collect();
        let values = knots.iter().flat_map(|x| ys.iter().map(move |y| x.abs() * y)).collect();
        let plane = Table::new(vec![axis(&knots), axis(&ys)], values).unwrap().thinned(1e-9);
        assert_eq!([plane.axes()[0].knots().len(), plane.axes()[1].knots().len()], [3, 2]);
        assert!((plane.at([-1.5, 7.0]) - 10.5).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_table_is_refused() {
        assert_eq!(Axis::new(vec![1.0]), None);
        assert_eq!(Axis::new(vec![1.0, 1.0]), None);
        assert_eq!(Axis::new(vec![1.0, f64::INFINITY]), None);
        assert_eq!(Table::new(vec![], vec![]), None);
        assert_eq!(Table::new(vec![axis(&[0.0, 1.0])], vec![0.0]), None);
        assert_eq!(Table::new(vec![axis(&[0.0, 1.0])], vec![0.0, f64::NAN]), None);
    }
}
