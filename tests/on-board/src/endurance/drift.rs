//! Error of the joint's angle over a long run, span by span, and whether it drifts.
//!
//! A span is many periods of the reference, each a part. Parts differ by noise and by where the encoders' steps fall; what the RMS and
//! the mean of a whole span may differ by follows from how much the parts of the first span do.

use crate::endurance::check::Check;
use crate::endurance::joint::COUNTS_PER_TURN;

/// Standard errors of the difference of two spans that are chance: four, 1 of 16 000.
const STANDARD_ERRORS: f64 = 4.0;
/// What is no drift in any case: a two-hundredth of an encoder's step, 7.7 urad \[rad\].
const LEAST_RAD: f64 = std::f64::consts::TAU / COUNTS_PER_TURN / 200.0;
/// Parts of a span that say too little of how much parts differ; what is no drift then: a twentieth of a step \[rad\].
const FEW_PARTS: usize = 8;
const FEW_PARTS_RAD: f64 = 10.0 * LEAST_RAD;

/// Error of one span.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Span {
    /// Root of the mean square \[rad\].
    pub rms_rad: f64,
    /// Mean \[rad\].
    pub mean_rad: f64,
    /// Largest \[rad\].
    pub largest_rad: f64,
    /// Parts.
    pub parts: usize,
    /// Standard deviation of the parts' RMS \[rad\].
    pub rms_spread_rad: f64,
    /// Standard deviation of the parts' means \[rad\].
    pub mean_spread_rad: f64,
}

/// Sums of errors.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: u64,
    sum: f64,
    squares: f64,
    largest: f64,
}

impl Sums {
    fn add(&mut self, error_rad: f64) {
        self.count += 1;
        self.sum += error_rad;
        self.squares += error_rad * error_rad;
        self.largest = self.largest.max(error_rad.abs());
    }

    fn include(&mut self, other: Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.squares += other.squares;
        self.largest = self.largest.max(other.largest);
    }

    fn mean(self) -> f64 {
        self.sum / self.count.max(1) as f64
    }

    fn rms(self) -> f64 {
        (self.squares / self.count.max(1) as f64).sqrt()
    }
}

/// Sums of a number over parts, for its standard deviation.
#[derive(Debug, Clone, Copy, Default)]
struct Spread {
    count: usize,
    mean: f64,
    squares: f64,
}

impl Spread {
    /// Takes the next value (Welford).
    fn add(&mut self, value: f64) {
        self.count += 1;
        let off = value - self.mean;
        self.mean += off / self.count as f64;
        self.squares += off * (value - self.mean);
    }

    /// Standard deviation; 0 of fewer than two values.
    fn deviation(self) -> f64 {
        if self.count < 2 { 0.0 } else { (self.squares / (self.count - 1) as f64).sqrt() }
    }
}

/// Gathers errors into parts and parts into spans; takes the same memory however long the run is, but for one [`Span`] a span.
#[derive(Debug, Clone, Default)]
pub struct Drift {
    part: Sums,
    span: Sums,
    rms: Spread,
    mean: Spread,
    spans: Vec<Span>,
}

impl Drift {
    /// Takes an error \[rad\].
    pub fn add(&mut self, error_rad: f64) {
        self.part.add(error_rad);
    }

    /// Ends a part, one period of the reference.
    pub fn end_part(&mut self) {
        let part = std::mem::take(&mut self.part);
        self.rms.add(part.rms());
        self.mean.add(part.mean());
        self.span.include(part);
    }

    /// Ends a span with the part that was ended last.
    pub fn end_span(&mut self) {
        let span = std::mem::take(&mut self.span);
        let (rms, mean) = (std::mem::take(&mut self.rms), std::mem::take(&mut self.mean));
        self.spans.push(Span {
            rms_rad: span.rms(),
            mean_rad: span.mean(),
            largest_rad: span.largest,
            parts: rms.count,
            rms_spread_rad: rms.deviation(),
            mean_spread_rad: mean.deviation(),
        });
    }

    /// The spans that have ended.
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }
}

/// Difference of two spans that is chance \[rad\], by the standard deviation of the first one's parts.
fn allowed_rad(spread_rad: f64, parts: usize) -> f64 {
    if parts < FEW_PARTS {
        return FEW_PARTS_RAD;
    }
    (STANDARD_ERRORS * spread_rad * (2.0 / parts as f64).sqrt()).max(LEAST_RAD)
}

/// Whether any span differs from the first one.
pub fn checks(spans: &[Span]) -> Vec<Check> {
    let Some(first) = spans.first() else {
        return vec![Check::new("error of the angle", "no span ended", "one at least", false)];
    };
    let farthest = |of: fn(&Span) -> f64| {
        let off = |span: &Span| of(span) - of(first);
        spans.iter().map(off).fold(0.0, |far: f64, off| if off.abs() > far.abs() { off } else { far })
    };
    let check = |what: &str, value_rad: f64, off_rad: f64, allowed_rad: f64| {
        Check::new(
            what,
            format!("{:.4} mrad, {:+.4} at most since", 1e3 * value_rad, 1e3 * off_rad),
            format!("{:.4} mrad up or down", 1e3 * allowed_rad),
            off_rad.abs() <= allowed_rad,
        )
    };
    vec![
        check(
            "RMS error of the first span, change",
            first.rms_rad,
            farthest(|span| span.rms_rad),
            allowed_rad(first.rms_spread_rad, first.parts),
        ),
        check(
            "mean error of the first span, change",
            first.mean_rad,
            farthest(|span| span.mean_rad),
            allowed_rad(first.mean_spread_rad, first.parts),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spans(offset_rad: f64) -> Vec<Span> {
        let mut drift = Drift::default();
        for span in 0..3 {
            for part in 0..100 {
                for error_rad in [1e-3, -1e-3] {
                    // Parts differ by 0.1 mrad.
                    drift.add(error_rad + f64::from(part % 2) * 1e-4 + f64::from(span) * offset_rad);
                }
                drift.end_part();
            }
            drift.end_span();
        }
        drift.spans().to_vec()
    }

    #[test]
    fn what_moves_away_is_drift_and_what_repeats_is_not() {
        let steady = spans(0.0);
        assert_eq!((steady.len(), steady[0].parts), (3, 100));
        assert!((steady[0].mean_rad - 0.05e-3).abs() < 1e-9 && (steady[0].rms_rad - 1.0025e-3).abs() < 1e-6);
        // 0.05 mrad either way of the mean, one of 100 values less.
        assert!((steady[0].mean_spread_rad - 0.050_25e-3).abs() < 1e-8);
        assert!(checks(&steady).iter().all(|check| check.holds));
        // 4 · 50 urad · sqrt(2 / 100) is 28 urad; two spans on it are 26, or 30.
        assert!(checks(&spans(0.013e-3)).iter().all(|check| check.holds));
        assert!(checks(&spans(0.015e-3)).iter().any(|check| !check.holds));
        assert!(!checks(&[])[0].holds);
    }
}
