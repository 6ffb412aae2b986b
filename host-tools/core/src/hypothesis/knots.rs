//! Where a function is asked for: knots along each of its variables.

use bowden_model::law::Variable;

use super::table::Axis;

/// Intervals of the only variable, and of each of two.
const INTERVALS: [usize; 2] = [1024, 64];

/// Part of the range that is added at either end: a fit goes beyond what the rig as stated does.
const MARGIN: f64 = 0.5;

/// Grading of the knots of speeds and torques: those at zero lie `6 / sinh 6`, a thirty-fourth, as far apart as they do in the mean.
const GRADING: f64 = 6.0;

/// Whether knots are to lie closer near zero, where drags and losses turn their sign.
const fn is_graded(variable: Variable) -> bool {
    matches!(variable, Variable::InputSpeed | Variable::JointSpeed | Variable::MotorTorque)
}

/// `seen` and a margin; what cannot be negative stays so.
pub(super) fn widened([low, high]: [f64; 2], variable: Variable) -> [f64; 2] {
    let width = (high - low).max(1e-3 * low.abs().max(high.abs())).max(1e-6);
    let positive = matches!(variable, Variable::Time | Variable::RelativeTension);
    let lowest = if positive { 0.0 } else { f64::NEG_INFINITY };
    [(low - MARGIN * width).max(lowest), high + MARGIN * width]
}

/// From a variable to where knots lie evenly, or back.
type Map = fn(f64) -> f64;

/// Knots over a range, one of them zero where the range holds it.
pub(super) fn axis([low, high]: [f64; 2], variable: Variable, variables: usize) -> Option<Axis> {
    let intervals = INTERVALS[usize::from(variables > 1)];
    let largest = low.abs().max(high.abs());
    let scale = largest / GRADING.sinh();
    let (to, from): (Map, Map) = if is_graded(variable) { (f64::asinh, f64::sinh) } else { (|x| x, |x| x) };
    let scale = if is_graded(variable) { scale } else { 1.0 };
    let (start, end) = (to(low / scale), to(high / scale));
    let step = (end - start) / intervals as f64;
    let first = (start / step).round();
    Axis::new((0..=intervals).map(|k| scale * from((first + k as f64) * step)).collect())
}

/// Six knots of a curve over a range that was seen.
pub(super) fn of_curve([low, high]: [f64; 2], variable: Variable) -> Option<Axis> {
    let knots: Vec<f64> = if is_graded(variable) {
        let largest = low.abs().max(high.abs());
        [-1.0, -1.0 / 3.0, -0.05, 0.05, 1.0 / 3.0, 1.0].map(|part| part * largest).to_vec()
    } else {
        (0..6).map(|k| low + (high - low) * f64::from(k) / 5.0).collect()
    };
    Axis::new(knots)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knots_cover_the_range_and_hold_zero() {
        for (range, variable) in [
            ([-3.0, 5.0], Variable::JointAngle),
            ([-3.0, 5.0], Variable::JointSpeed),
            ([-0.1, 40.0], Variable::InputSpeed),
        ] {
            let axis = axis(range, variable, 1).unwrap();
            let knots = axis.knots();
            assert_eq!(knots.len(), 1025);
            // Rounded to whole steps, the ends move by half a step at most.
            let step = [knots[1] - knots[0], knots[1024] - knots[1023]];
            assert!((knots[0] - range[0]).abs() <= step[0] && (knots[1024] - range[1]).abs() <= step[1]);
            assert!(knots.contains(&0.0), "{variable:?}");
        }
        assert_eq!(axis([2.0, 3.0], Variable::Value, 2).unwrap().knots().len(), 65);
    }

    #[test]
    fn speeds_have_their_knots_near_zero() {
        let axis = axis([-10.0, 10.0], Variable::JointSpeed, 1).unwrap();
        let least = axis.knots().windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
        let even = 20.0 / 1024.0;
        assert!((even / least - 6.0_f64.sinh() / 6.0).abs() < 0.1, "{}", even / least);
    }

    #[test]
    fn what_cannot_be_negative_stays_so() {
        assert_eq!(widened([0.2, 1.2], Variable::RelativeTension), [0.0, 1.7]);
        assert_eq!(widened([0.0, 10.0], Variable::Time), [0.0, 15.0]);
        assert_eq!(widened([-1.0, 1.0], Variable::JointAngle), [-2.0, 2.0]);
    }
}
