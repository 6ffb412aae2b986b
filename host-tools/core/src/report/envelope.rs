//! Thins a series to what a plot of given width can show.

use super::axis;

/// Lowest and highest sample of each of `columns` equal spans of time, in order of time.
///
/// A column gives at most two points, so a line through them covers the same pixels, to one column's width, as a line
/// through all samples, and a spike of one sample keeps its full height. `t_s` increases; samples outside
/// `t_start_s..=t_end_s` or not drawable are left out.
pub(super) fn envelope(
    t_s: &[f64],
    values: &[f64],
    (t_start_s, t_end_s): (f64, f64),
    columns: usize,
) -> Vec<(f64, f64)> {
    let span_s = t_end_s - t_start_s;
    let mut points = Vec::with_capacity(2 * columns.min(t_s.len()));
    let mut open: Option<Column> = None;
    for (&t, &value) in t_s.iter().zip(values) {
        if !axis::is_drawable(value) || !(t_start_s..=t_end_s).contains(&t) {
            continue;
        }
        let index = if span_s > 0.0 {
            (((t - t_start_s) / span_s * columns as f64) as usize).min(columns.saturating_sub(1))
        } else {
            0
        };
        match &mut open {
            Some(column) if column.index == index => column.include((t, value)),
            _ => {
                if let Some(column) = open.replace(Column::new(index, (t, value))) {
                    column.emit(&mut points);
                }
            }
        }
    }
    if let Some(column) = open {
        column.emit(&mut points);
    }
    points
}

/// Extremes of the samples seen in one column.
struct Column {
    index: usize,
    lowest: (f64, f64),
    highest: (f64, f64),
}

impl Column {
    fn new(index: usize, point: (f64, f64)) -> Self {
        Self { index, lowest: point, highest: point }
    }

    fn include(&mut self, point: (f64, f64)) {
        if point.1 < self.lowest.1 {
            self.lowest = point;
        }
        if point.1 > self.highest.1 {
            self.highest = point;
        }
    }

    fn emit(self, points: &mut Vec<(f64, f64)>) {
        let (first, second) = if self.lowest.0 <= self.highest.0 {
            (self.lowest, self.highest)
        } else {
            (self.highest, self.lowest)
        };
        points.push(first);
        if second != first {
            points.push(second);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::envelope;

    /// Repeatable numbers in 0..1 without any structure that columns could align with.
    fn noise(n: usize) -> Vec<f64> {
        let mut state = 12_345_u32;
        (0..n)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 8) / f64::from(1_u32 << 24)
            })
            .collect()
    }

    #[test]
    fn spike_of_one_sample_keeps_its_height() {
        let t_s: Vec<f64> = (0..40_000).map(|i| f64::from(i) * 1e-3).collect();
        for at in [0, 1, 17_321, 39_998, 39_999] {
            let mut values: Vec<f64> = t_s.iter().map(|t| t.sin()).collect();
            values[at] = -25.0;
            let points = envelope(&t_s, &values, (0.0, 39.999), 500);
            assert!(points.len() <= 1000, "{} points", points.len());
            assert!(points.contains(&(t_s[at], -25.0)), "spike at sample {at} is lost");
        }
    }

    #[test]
    fn extremes_of_every_column_are_those_of_a_search() {
        // Uneven sampling with a hole, so that columns hold many samples, few, or none.
        let values = noise(3000);
        let t_s: Vec<f64> =
            (0..3000).map(|i| f64::from(i * i) * 1e-6 + if i > 1500 { 4.0 } else { 0.0 }).collect();
        let end_s = t_s[2999];
        let columns = 64;
        let points = envelope(&t_s, &values, (0.0, end_s), columns);
        assert!(points.is_sorted_by(|a, b| a.0 < b.0));
        let width_s = end_s / columns as f64;
        let mut seen = 0;
        for column in 0..columns {
            let inside = |t: f64| {
                let (from, to) = (column as f64 * width_s, (column + 1) as f64 * width_s);
                t >= from && (t < to || column + 1 == columns)
            };
            let all: Vec<f64> =
                t_s.iter().zip(&values).filter(|(t, _)| inside(**t)).map(|(_, v)| *v).collect();
            let kept: Vec<f64> = points.iter().filter(|(t, _)| inside(*t)).map(|(_, v)| *v).collect();
            let extremes = |of: &[f64]| {
                (
                    of.iter().copied().fold(f64::INFINITY, f64::min),
                    of.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                )
            };
            assert_eq!(extremes(&kept), extremes(&all), "column {column}");
            assert!(kept.len() <= 2, "column {column} has {} points", kept.len());
            seen += kept.len();
        }
        assert_eq!(seen, points.len());
    }

    #[test]
    fn few_samples_pass_unchanged_and_gaps_stay_out() {
        let points = envelope(&[0.0, 1.0, 2.0, 3.0], &[5.0, f64::NAN, 7.0, 6.0], (0.0, 3.0), 100);
        assert_eq!(points, [(0.0, 5.0), (2.0, 7.0), (3.0, 6.0)]);
        assert!(envelope(&[], &[], (0.0, 1.0), 100).is_empty());
        assert_eq!(envelope(&[2.0], &[1.5], (2.0, 2.0), 100), [(2.0, 1.5)]);
    }
}
