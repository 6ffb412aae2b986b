//! Axes of the plots: range, tick positions, labels.

use super::figures;

/// Range of one axis with round ticks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    /// Value at the low end.
    pub(super) low: f64,
    /// Value at the high end.
    pub(super) high: f64,
    step: f64,
    exponent: i32,
}

impl Axis {
    /// Axis that holds all drawable `values` with a twentieth of room at either end.
    pub(super) fn around(values: impl Iterator<Item = f64>, most_ticks: usize) -> Self {
        let (low, high) = range(values).unwrap_or((-1.0, 1.0));
        let room = 0.05 * (high - low).max(1e-3 * low.abs().max(high.abs())).max(1e-12);
        Self::exact(low - room, high + room, most_ticks)
    }

    /// Axis from `low` to `high`; one of zero length is widened.
    pub(super) fn exact(low: f64, high: f64, most_ticks: usize) -> Self {
        let (low, high) = if high > low { (low, high) } else { (low - 0.5, low + 0.5) };
        let step = step(low, high, most_ticks.max(2));
        let exponent = figures::shared_exponent(low.abs().max(high.abs()));
        Self { low, high, step, exponent }
    }

    /// Ticks as value and label; labels are in what [`Axis::unit`] names.
    pub(super) fn ticks(&self) -> Vec<(f64, String)> {
        let unit = 10_f64.powi(self.exponent);
        let decimals = (-(self.step / unit).log10() - 1e-9).ceil().max(0.0) as usize;
        let (first, last) = tick_numbers(self.low, self.high, self.step);
        (first..=last)
            .map(|i| i as f64 * self.step)
            .map(|value| (value, figures::fixed(value / unit, decimals)))
            .collect()
    }

    /// What labels count in: the unit, with a power of ten where labels would be long.
    pub(super) fn unit(&self, unit: &str) -> String {
        figures::scaled_unit(self.exponent, unit)
    }

    /// Length, in the unit of the axis.
    pub(super) fn length(&self) -> f64 {
        self.high - self.low
    }

    /// Position of a value on a line from `from_px` (low end) to `to_px` (high end).
    pub(super) fn place(&self, value: f64, from_px: f64, to_px: f64) -> f64 {
        from_px + (value - self.low) / self.length() * (to_px - from_px)
    }
}

/// Smallest step of 1, 2 or 5 times a power of ten that leaves at most so many ticks.
fn step(low: f64, high: f64, most_ticks: usize) -> f64 {
    let decade = 10_f64.powf(((high - low) / most_ticks as f64).log10().floor());
    let mut steps = [1.0, 2.0, 5.0, 10.0, 20.0].into_iter().map(|multiple| multiple * decade);
    let fits = |step: &f64| {
        let (first, last) = tick_numbers(low, high, *step);
        (last - first + 1) as usize <= most_ticks
    };
    steps.find(fits).unwrap_or(50.0 * decade)
}

/// First and last multiple of `step` on the axis. One that a range of samples misses by a thousandth of a step, such
/// as 40 s in a recording that ends at 39.999 s, counts as on it.
fn tick_numbers(low: f64, high: f64, step: f64) -> (i64, i64) {
    ((low / step - 1e-3).ceil() as i64, (high / step + 1e-3).floor() as i64)
}

/// Whether a plot can show a value: finite, and far from where differences overflow.
pub(super) fn is_drawable(value: f64) -> bool {
    value.abs() < 1e150
}

/// Smallest and largest value that a plot can show.
pub(super) fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|v| is_drawable(*v)).fold(None, |range, v| match range {
        None => Some((v, v)),
        Some((low, high)) => Some((low.min(v), high.max(v))),
    })
}

#[cfg(test)]
mod tests {
    use super::Axis;

    fn labels(axis: &Axis) -> Vec<String> {
        axis.ticks().into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_are_round_and_inside() {
        let by_fives = ["0", "5", "10", "15", "20", "25", "30", "35", "40"];
        assert_eq!(labels(&Axis::exact(0.0, 40.0, 10)), by_fives);
        assert_eq!(labels(&Axis::exact(0.0, 39.999, 10)), by_fives);
        assert_eq!(labels(&Axis::exact(0.0, 40.0, 8)), ["0", "10", "20", "30", "40"]);
        assert_eq!(labels(&Axis::exact(-4.9, 4.9, 5)), ["−4", "−2", "0", "2", "4"]);
        assert_eq!(labels(&Axis::exact(-0.31, 0.29, 6)), ["−0.3", "−0.2", "−0.1", "0.0", "0.1", "0.2"]);
        assert_eq!(labels(&Axis::exact(11.9, 12.6, 4)), ["12.0", "12.2", "12.4", "12.6"]);
    }

    #[test]
    fn small_and_large_values_get_a_factor() {
        let small = Axis::exact(-2.1e-4, 2.1e-4, 3);
        assert_eq!(small.unit("1"), "10⁻⁶");
        assert_eq!(labels(&small), ["−200", "0", "200"]);
        let large = Axis::exact(0.0, 3.0e6, 4);
        assert_eq!(
            (large.unit("1").as_str(), labels(&large)),
            ("10⁶", vec!["0".into(), "1".into(), "2".into(), "3".into()])
        );
        assert_eq!(Axis::exact(0.0, 40.0, 8).unit("s"), "s");
    }

    #[test]
    fn constant_and_missing_values_still_have_an_axis() {
        for axis in [
            Axis::around([12.0; 3].into_iter(), 4),
            Axis::around([0.0].into_iter(), 4),
            Axis::around(std::iter::empty(), 4),
            Axis::around([f64::NAN].into_iter(), 4),
        ] {
            assert!(axis.high > axis.low, "{axis:?}");
            assert!(axis.place(axis.low, 0.0, 100.0).is_finite());
            assert!((1..=6).contains(&axis.ticks().len()), "{axis:?}: {:?}", axis.ticks());
        }
    }

    #[test]
    fn places_run_from_end_to_end() {
        let axis = Axis::exact(-1.0, 3.0, 4);
        assert_eq!([-1.0, 0.0, 3.0].map(|v| axis.place(v, 200.0, 100.0)), [200.0, 175.0, 100.0]);
    }
}
