//! Slipping pair by brute force: RK4 on `dT/ds = ∓ mu kappa T`, strain by the same RK4, bisection for the unknowns.

use crate::bench::Bench;

/// Steps of the integrations; fourth order, so a smooth profile is good to about 1e-12 relative.
const STEPS: usize = 1000;

/// Output tension and integral of the tension of one tendon, from its input tension.
/// `slip` = -1 towards the input (tension falls), +1 towards the output (tension rises).
pub fn integrate(
    bench: &Bench,
    curvature_per_m: &dyn Fn(f64) -> f64,
    input_tension_n: f64,
    slip: f64,
) -> (f64, f64) {
    let h = bench.length_m / STEPS as f64;
    let slope = |s: f64, t: f64| slip * bench.mu * curvature_per_m(s).abs() * t;
    let (mut t, mut integral) = (input_tension_n, 0.0);
    for i in 0..STEPS {
        let s = i as f64 * h;
        let k1 = slope(s, t);
        let k2 = slope(s + 0.5 * h, t + 0.5 * h * k1);
        let k3 = slope(s + 0.5 * h, t + 0.5 * h * k2);
        let k4 = slope(s + h, t + h * k3);
        // The integral's slope is t itself, at the four stages of the same step.
        integral += h * (t + h / 6.0 * (k1 + k2 + k3));
        t += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    }
    (t, integral)
}

/// Zero of an increasing function.
pub fn bisect(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    assert!(f(low) <= 0.0 && f(high) >= 0.0, "zero is not bracketed");
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if f(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// State of a slipping pair.
#[derive(Clone, Copy, Debug)]
pub struct Slipping {
    pub f: [f64; 4],
    pub elongation_a_m: f64,
    pub elongation_b_m: f64,
}

impl Slipping {
    pub fn torque_in_nm(&self, bench: &Bench) -> f64 {
        (self.f[0] - self.f[2]) * bench.r1_m
    }

    pub fn torque_out_nm(&self, bench: &Bench) -> f64 {
        (self.f[1] - self.f[3]) * bench.r2_m
    }

    /// Lag at the output pulley: elongation of a over r2.
    pub fn lag_rad(&self, bench: &Bench) -> f64 {
        self.elongation_a_m / bench.r2_m
    }

    pub fn min_n(&self) -> f64 {
        self.f.into_iter().fold(f64::INFINITY, f64::min)
    }
}

/// Both tendons slipping, `direction` ±1: finds the F3 for which the elongations cancel, with `F1 - F3 = T_in / r1`.
pub fn slipping(
    bench: &Bench,
    curvature_per_m: &dyn Fn(f64) -> f64,
    direction: f64,
    torque_in_nm: f64,
) -> Slipping {
    // In + motion a is wound on at the input: it slips towards the input and its tension falls along s. The ODE is
    // linear, so one integration from 1 N serves every guess.
    let (ratio_a, unit_integral_a) = integrate(bench, curvature_per_m, 1.0, -direction);
    let (ratio_b, unit_integral_b) = integrate(bench, curvature_per_m, 1.0, direction);
    let state = |f3_n: f64| {
        let f1_n = f3_n + torque_in_nm / bench.r1_m;
        let stretch = |integral: f64| (integral - bench.pretension_n * bench.length_m) / bench.stiffness_n;
        Slipping {
            f: [f1_n, f1_n * ratio_a, f3_n, f3_n * ratio_b],
            elongation_a_m: stretch(f1_n * unit_integral_a),
            elongation_b_m: stretch(f3_n * unit_integral_b),
        }
    };
    let f3_n = bisect(-1e4, 1e4, |f3_n| {
        let s = state(f3_n);
        s.elongation_a_m + s.elongation_b_m
    });
    state(f3_n)
}

/// As [`slipping`], from the output torque.
pub fn slipping_from_output(
    bench: &Bench,
    curvature_per_m: &dyn Fn(f64) -> f64,
    direction: f64,
    torque_out_nm: f64,
) -> Slipping {
    // T_out is affine in T_in (the ODE and Hooke's law are linear): two brute-force solutions give the line.
    let t_out =
        |t_in: f64| slipping(bench, curvature_per_m, direction, t_in).torque_out_nm(bench) - torque_out_nm;
    let (at_0, at_1) = (t_out(0.0), t_out(1.0));
    slipping(bench, curvature_per_m, direction, at_0 / (at_0 - at_1))
}
