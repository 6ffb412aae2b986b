//! Zero-phase reconstruction of a motion from a quantised encoder.
//!
//! State: angle and speed, driven by white acceleration noise of spectral density `S` \[rad²/s³\]; a Kalman filter forwards
//! and the Rauch–Tung–Striebel pass backwards (Rauch, Tung, Striebel, AIAA J. 3 (1965) 1445) give the estimate and its
//! standard deviation at every sample. `S` is the one of a grid under which the innovations are most likely.
//!
//! An encoder without noise is not a sensor with white noise of a twelfth of a count squared: between two changes of the
//! count nothing new is learnt, and at a change the angle is known far better than to a count. So a run of `n` equal
//! readings counts as one reading (each with `n` times the variance), and a change of one count is a reading of its
//! own, halfway between the two values.

use super::quantum::quantum_of;

/// Angle, speed and their uncertainty at every sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Angle, rad.
    pub theta_rad: Vec<f64>,
    /// Speed, rad/s.
    pub omega_rad_s: Vec<f64>,
    /// Standard deviation of the angle, rad.
    pub std_rad: Vec<f64>,
    /// Half a count of the encoder, rad; zero for an angle that is not quantised.
    pub half_count_rad: f64,
}

impl Motion {
    /// Lowest and highest angle, rad.
    #[must_use]
    pub fn range_rad(&self) -> [f64; 2] {
        let wider = |[low, high]: [f64; 2], rad: &f64| [low.min(*rad), high.max(*rad)];
        self.theta_rad.iter().fold([f64::INFINITY, f64::NEG_INFINITY], wider)
    }

    /// Reconstructs a recorded angle; one that is not quantised is taken as it is.
    #[must_use]
    pub fn from_encoder(t_s: &[f64], theta_rad: &[f64]) -> Self {
        if let Some(quantum_rad) = quantum_of(theta_rad) {
            return smooth(t_s, theta_rad, quantum_rad);
        }
        let n = theta_rad.len();
        let omega_rad_s = (0..n)
            .map(|k| {
                let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
                if a == b { 0.0 } else { (theta_rad[b] - theta_rad[a]) / (t_s[b] - t_s[a]) }
            })
            .collect();
        Self { theta_rad: theta_rad.to_vec(), omega_rad_s, std_rad: vec![0.0; n], half_count_rad: 0.0 }
    }
}

/// Spectral densities of the acceleration noise that are tried, rad²/s³: from a slow robot arm to a shaker.
const DENSITIES: [f64; 8] = [1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4];

/// Reconstructs the motion behind an encoder of resolution `quantum_rad`.
///
/// `t_s` is strictly increasing; both slices have the same length. An empty input gives an empty motion.
#[must_use]
pub fn smooth(t_s: &[f64], reading_rad: &[f64], quantum_rad: f64) -> Motion {
    let readings = weigh(t_s, reading_rad, quantum_rad);
    let mut best = (f64::NEG_INFINITY, DENSITIES[0]);
    for density in DENSITIES {
        let likelihood = Filter::run(t_s, &readings, density).log_likelihood;
        if likelihood > best.0 {
            best = (likelihood, density);
        }
    }
    Filter::run(t_s, &readings, best.1).backwards(t_s, 0.5 * quantum_rad)
}

/// One reading: value and variance.
#[derive(Clone, Copy)]
struct Reading {
    value_rad: f64,
    variance: f64,
}

fn weigh(t_s: &[f64], reading_rad: &[f64], quantum_rad: f64) -> Vec<Reading> {
    /// Standard deviation of the angle at a change of count, in counts, beyond the motion within the sample.
    const EDGE_COUNTS: f64 = 0.05;
    let n = reading_rad.len();
    let count_variance = quantum_rad * quantum_rad / 12.0;
    let mut readings = Vec::with_capacity(n);
    let mut start = 0;
    while start < n {
        let mut end = start + 1;
        while end < n && (reading_rad[end] - reading_rad[start]).abs() < 0.5 * quantum_rad {
            end += 1;
        }
        let length = (end - start) as f64;
        for &value_rad in &reading_rad[start..end] {
            readings.push(Reading { value_rad, variance: count_variance * length });
        }
        start = end;
    }
    // Samples right after a change by one count are replaced by the edge itself. The edge lies within the last sampling
    // interval, so on average half an interval back.
    let mut run_before = 1_usize;
    for k in 1..n {
        let step = reading_rad[k] - reading_rad[k - 1];
        if step.abs() < 0.5 * quantum_rad {
            run_before += 1;
            continue;
        }
        if step.abs() < 1.5 * quantum_rad && run_before > 1 {
            let speed = quantum_rad / (t_s[k] - t_s[k - run_before]).max(1e-9);
            let dt_s = t_s[k] - t_s[k - 1];
            let edge_rad = reading_rad[k - 1] + 0.5 * step;
            let within = speed * dt_s;
            readings[k] = Reading {
                value_rad: edge_rad + 0.5 * within * step.signum(),
                variance: (EDGE_COUNTS * quantum_rad).powi(2) + within * within / 12.0,
            };
        }
        run_before = 1;
    }
    readings
}

/// Mean and covariance (θθ, θω, ωω) at one sample.
#[derive(Clone, Copy)]
struct Estimate {
    mean: [f64; 2],
    covariance: [f64; 3],
}

struct Filter {
    predicted: Vec<Estimate>,
    filtered: Vec<Estimate>,
    log_likelihood: f64,
}

fn predict(from: Estimate, dt_s: f64, density: f64) -> Estimate {
    let [theta, omega] = from.mean;
    let [tt, to, oo] = from.covariance;
    Estimate {
        mean: [theta + dt_s * omega, omega],
        covariance: [
            tt + dt_s * (2.0 * to + dt_s * oo) + density * dt_s.powi(3) / 3.0,
            to + dt_s * oo + density * dt_s * dt_s / 2.0,
            oo + density * dt_s,
        ],
    }
}

impl Filter {
    fn run(t_s: &[f64], readings: &[Reading], density: f64) -> Self {
        let mut predicted = Vec::with_capacity(readings.len());
        let mut filtered: Vec<Estimate> = Vec::with_capacity(readings.len());
        let mut log_likelihood = 0.0;
        for (k, reading) in readings.iter().enumerate() {
            let ahead = match filtered.last() {
                Some(&last) => predict(last, t_s[k] - t_s[k - 1], density),
                // Before the first reading the angle is unknown by far more than a count, the speed by 10 rad/s.
                None => Estimate {
                    mean: [reading.value_rad, 0.0],
                    covariance: [100.0 * reading.variance, 0.0, 100.0],
                },
            };
            let [tt, to, oo] = ahead.covariance;
            let innovation = reading.value_rad - ahead.mean[0];
            let variance = tt + reading.variance;
            let gain = [tt / variance, to / variance];
            log_likelihood -= 0.5 * (innovation * innovation / variance + variance.ln());
            predicted.push(ahead);
            filtered.push(Estimate {
                mean: [ahead.mean[0] + gain[0] * innovation, ahead.mean[1] + gain[1] * innovation],
                covariance: [tt - gain[0] * tt, to - gain[0] * to, oo - gain[1] * to],
            });
        }
        Self { predicted, filtered, log_likelihood }
    }

    fn backwards(mut self, t_s: &[f64], half_count_rad: f64) -> Motion {
        let n = self.filtered.len();
        for k in (0..n.saturating_sub(1)).rev() {
            let dt_s = t_s[k + 1] - t_s[k];
            let here = self.filtered[k];
            let ahead = self.predicted[k + 1];
            let later = self.filtered[k + 1];
            let [tt, to, oo] = here.covariance;
            // Gain C = P Fᵀ (P⁻)⁻¹ with F = [[1, dt], [0, 1]].
            let cross = [[tt + dt_s * to, to], [to + dt_s * oo, oo]];
            let [att, ato, aoo] = ahead.covariance;
            let determinant = att * aoo - ato * ato;
            let gain =
                cross.map(|[a, b]| [(a * aoo - b * ato) / determinant, (b * att - a * ato) / determinant]);
            let change = [later.mean[0] - ahead.mean[0], later.mean[1] - ahead.mean[1]];
            let spread = [later.covariance[0] - att, later.covariance[1] - ato, later.covariance[2] - aoo];
            let quadratic = |g: [f64; 2], h: [f64; 2]| {
                g[0] * h[0] * spread[0] + (g[0] * h[1] + g[1] * h[0]) * spread[1] + g[1] * h[1] * spread[2]
            };
            self.filtered[k] = Estimate {
                mean: [
                    here.mean[0] + gain[0][0] * change[0] + gain[0][1] * change[1],
                    here.mean[1] + gain[1][0] * change[0] + gain[1][1] * change[1],
                ],
                covariance: [
                    tt + quadratic(gain[0], gain[0]),
                    to + quadratic(gain[0], gain[1]),
                    oo + quadratic(gain[1], gain[1]),
                ],
            };
        }
        Motion {
            theta_rad: self.filtered.iter().map(|e| e.mean[0]).collect(),
            omega_rad_s: self.filtered.iter().map(|e| e.mean[1]).collect(),
            std_rad: self.filtered.iter().map(|e| e.covariance[0].max(0.0).sqrt()).collect(),
            half_count_rad,
        }
    }
}
