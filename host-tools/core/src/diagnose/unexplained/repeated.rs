//! A motion that repeats itself: what is left repeats with it, and an oscillation at a multiple of its rate is not told from that.

/// Longest part of the recording that a period may take: a motion that is passed twice.
const LONGEST_PART: f64 = 0.5;

/// Mean square by which a motion may miss the one a period before, over that of two motions that know nothing of each other.
const ALIKE: f64 = 0.02;

/// The same from which on two motions differ: a period is looked for once the motion has gone elsewhere.
const UNLIKE: f64 = 0.3;

/// Time after which `motion` repeats itself \[s\], `None` for one that does not within half of its length; it has to go on from row
/// to row by about the same time.
pub(super) fn period_s(t_s: &[f64], motion: &[f64]) -> Option<f64> {
    let n = t_s.len().min(motion.len());
    let mut steps: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.len() < 2 {
        return None;
    }
    let middle = steps.len() / 2;
    let step_s = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    if step_s <= 0.0 {
        return None;
    }
    let length = ((t_s[n - 1] - t_s[0]) / step_s).round() as usize + 1;
    // Far more places than rows: the recording has holes, and little in it is twice a period apart.
    if length > 4 * n {
        return None;
    }
    let mut even = vec![f64::NAN; length];
    for (t, value) in t_s.iter().zip(motion) {
        even[((t - t_s[0]) / step_s).round() as usize] = *value;
    }
    let known = || motion[..n].iter().copied().filter(|value| value.is_finite());
    let count = known().count() as f64;
    let mean = known().sum::<f64>() / count;
    let variance = known().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    let unlike = |lag: usize| {
        let (mut sum, mut pairs) = (0.0, 0_u32);
        for (a, b) in even.iter().zip(&even[lag..]) {
            let difference = a - b;
            if difference.is_finite() {
                sum += difference * difference;
                pairs += 1;
            }
        }
        if pairs == 0 { f64::INFINITY } else { sum / f64::from(pairs) / (2.0 * variance) }
    };
    let mut away = false;
    let mut before = [0.0, 0.0];
    for lag in 1..=(LONGEST_PART * length as f64) as usize {
        let here = unlike(lag);
        let [earlier, last] = before;
        away |= here > UNLIKE;
        if away && last < ALIKE && last <= earlier && last <= here {
            // Where the parabola through the three has its least.
            let bend = earlier - 2.0 * last + here;
            let beside = if bend > 0.0 { 0.5 * (earlier - here) / bend } else { 0.0 };
            return Some(((lag - 1) as f64 + beside) * step_s);
        }
        before = [last, here];
    }
    None
}

/// Takes off `values` at `t_s` what they are in the mean at the same place in every period.
pub(super) fn without_what_repeats(values: &mut [f64], t_s: &[f64], period_s: f64, step_s: f64) {
    let places = (period_s / step_s).round().max(1.0);
    let place = |t_s: f64| ((t_s / period_s).fract() * places).round() as usize % places as usize;
    let mut sums = vec![(0.0, 0_u32); places as usize];
    for (t, value) in t_s.iter().zip(values.iter()) {
        let (sum, count) = &mut sums[place(*t)];
        *sum += value;
        *count += 1;
    }
    for (t, value) in t_s.iter().zip(values) {
        let (sum, count) = sums[place(*t)];
        *value -= sum / f64::from(count);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn rows(seconds: f64) -> Vec<f64> {
        (0..(100.0 * seconds) as u32).map(|k| 0.01 * f64::from(k)).collect()
    }

    /// Lines at 0.25, 0.75 and 3.25 Hz repeat every 4 s.
    fn lines(t_s: f64) -> f64 {
        (TAU * 0.25 * t_s).sin() + 0.5 * (TAU * 0.75 * t_s).cos() + 0.2 * (TAU * 3.25 * t_s).sin()
    }

    #[test]
    fn a_period_is_found_between_rows_and_beside_a_gap() {
        let t_s = rows(16.0);
        let found = |motion: &dyn Fn(f64) -> f64, t_s: &[f64]| {
            period_s(t_s, &t_s.iter().map(|t| motion(*t)).collect::<Vec<_>>())
        };
        assert!((found(&lines, &t_s).unwrap() - 4.0).abs() < 1e-3);
        // 0.7 Hz: 1.42857 s, between two rows.
        let sine = |t: f64| (TAU * 0.7 * t).sin();
        assert!((found(&sine, &t_s).unwrap() - 1.0 / 0.7).abs() < 1e-3);
        let gap: Vec<f64> = t_s.iter().copied().filter(|t| !(5.0..6.5).contains(t)).collect();
        assert!((found(&lines, &gap).unwrap() - 4.0).abs() < 1e-3);
        // Passed less than twice, never the same, at rest.
        assert_eq!(found(&lines, &rows(7.0)), None);
        assert_eq!(found(&|t: f64| (t * t).sin(), &t_s), None);
        assert_eq!(found(&|_| 1.0, &t_s), None);
        assert_eq!(found(&sine, &[]), None);
    }

    #[test]
    fn what_repeats_goes_and_what_does_not_stays() {
        let t_s = rows(16.0);
        let power =
            |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64;
        let mut repeated: Vec<f64> = t_s.iter().map(|t| lines(*t)).collect();
        without_what_repeats(&mut repeated, &t_s, 4.0, 0.01);
        assert!(power(&repeated) < 1e-3, "{}", power(&repeated));
        // Of a wave that has another phase in every period nothing goes: 7.3 Hz is 29.2 turns in 4 s, and the sum of four turns of 0.2
        // leaves (1 - 1/16 |sum|²) of it: |1 + e^0.4πi + e^0.8πi + e^1.2πi|² = 1.
        let mut other: Vec<f64> = t_s.iter().map(|t| (TAU * 7.3 * t).sin()).collect();
        without_what_repeats(&mut other, &t_s, 4.0, 0.01);
        assert!((power(&other) / 0.5 - 15.0 / 16.0).abs() < 0.01, "{}", power(&other));
    }
}
