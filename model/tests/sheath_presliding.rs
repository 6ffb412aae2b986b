//! Contacts that give way before they slip: Dahl's law, its rounding length and its limits.

#[path = "common/near.rs"]
mod near;

use bowden_model::sheath::{End, SlipLimits, Tendon, TendonMesh};
use near::near;

const STIFFNESS_N_PER_M: f64 = 72_900.0;
const PRETENSION_N: f64 = 30.0;

/// Draws the tendon through its sheath at both ends by `travel_m` in steps of `step_m`.
fn draw(
    tendon: &mut Tendon,
    mesh: &TendonMesh,
    limits: &SlipLimits,
    travel_m: f64,
    step_m: f64,
    delta_m: f64,
) {
    let steps = (travel_m.abs() / step_m).round();
    for _ in 0..steps as usize {
        tendon.move_end_presliding(mesh, limits, End::Input, travel_m / steps, false, delta_m);
        tendon.move_end_presliding(mesh, limits, End::Output, -travel_m / steps, false, delta_m);
    }
}

/// Tension difference along a tendon, N.
fn difference_n(tendon: &Tendon, mesh: &TendonMesh) -> f64 {
    tendon.end_tension_n(mesh, End::Input) - tendon.end_tension_n(mesh, End::Output)
}

/// A tendon drawn through the sheath as one: after a reversal the friction goes from one limit to the other as
/// 1 - 2 e^{-x/δ}, so the corner is rounded over the length δ. With μK = 0.01 tension hardly varies along the tendon and
/// stretch takes up under 0.5 % of the travel: 1 % covers both.
#[test]
fn corner_rounding_length_is_the_parameter() {
    let mesh = TendonMesh::uniform(16, STIFFNESS_N_PER_M).unwrap();
    let limits = SlipLimits::new(&mesh, 0.01, 0.0);
    for delta_m in [2e-5, 5e-5, 1e-3] {
        let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
        draw(&mut tendon, &mesh, &limits, 12.0 * delta_m, delta_m / 100.0, delta_m);
        let limit_n = difference_n(&tendon, &mesh);
        near("full slip", limit_n / (0.01 * PRETENSION_N), 1.0, 1e-3);
        let mut turned_m = 0.0;
        for travel_m in [0.3 * delta_m, 0.7 * delta_m, delta_m] {
            draw(&mut tendon, &mesh, &limits, -travel_m, delta_m / 200.0, delta_m);
            turned_m += travel_m;
            let mobilised = 1.0 - 2.0 * (-turned_m / delta_m).exp();
            near(
                &format!("δ {delta_m} at {turned_m}"),
                -difference_n(&tendon, &mesh) / limit_n,
                mobilised,
                0.02,
            );
        }
    }
}

/// Slope of the input tension over a small release of a tendon that slipped towards the input, output end held, N/m.
///
/// The continuous law: with relative length s, displacement u and tension change y, both towards the input,
/// `u' = -y L/EA`, `y' = -a y - (2 a T/δ) u`, `T = T_in e^{-a s}`, `u(1) = 0`. Classic Runge-Kutta from the far end.
fn continuous_stiffness_n_per_m(a: f64, input_n: f64, delta_m: f64) -> f64 {
    const STEPS: usize = 400;
    let h = -1.0 / STEPS as f64;
    let slope = |s: f64, [u, y]: [f64; 2]| {
        let grip = 2.0 * a * input_n * (-a * s).exp() / delta_m;
        [-y / STIFFNESS_N_PER_M, -a * y - grip * u]
    };
    let ahead = |[u, y]: [f64; 2], [du, dy]: [f64; 2], h: f64| [u + h * du, y + h * dy];
    let mut at = [0.0, 1.0];
    for step in 0..STEPS {
        let s = 1.0 + h * step as f64;
        let k1 = slope(s, at);
        let k2 = slope(s + 0.5 * h, ahead(at, k1, 0.5 * h));
        let k3 = slope(s + 0.5 * h, ahead(at, k2, 0.5 * h));
        let k4 = slope(s + h, ahead(at, k3, h));
        for i in 0..2 {
            at[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
    at[1] / at[0]
}

/// The first stiffness after a reversal is that of the continuous tendon, a shear lag of depth 1/λ, λ² = 2aT/(δ EA/L):
/// within a/2n, since a contact takes the tension on its near side, and the (λ/n)²/12 of the ladder. Rigid contacts would
/// give 2 n EA/L.
#[test]
fn first_stiffness_after_a_reversal_is_that_of_a_shear_lag() {
    for (a, delta_m) in [(0.05, 5e-5), (0.6, 5e-5), (0.6, 5e-6)] {
        for n in [16, 32, 64] {
            let mesh = TendonMesh::uniform(n, STIFFNESS_N_PER_M).unwrap();
            let limits = SlipLimits::new(&mesh, a, 0.0);
            let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
            draw(&mut tendon, &mesh, &limits, 20.0 * delta_m, delta_m / 50.0, delta_m);
            let before_n = tendon.end_tension_n(&mesh, End::Input);
            let want = continuous_stiffness_n_per_m(a, before_n, delta_m);
            tendon.move_end_presliding(&mesh, &limits, End::Input, -1e-10, false, delta_m);
            let got = (before_n - tendon.end_tension_n(&mesh, End::Input)) / 1e-10;
            let lambda_squared = 2.0 * a * before_n / (delta_m * STIFFNESS_N_PER_M);
            let allowed = 0.5 * a / n as f64 + lambda_squared / (12.0 * (n * n) as f64);
            near(&format!("a {a}, δ {delta_m}, n {n}"), got / want, 1.0, allowed);
        }
    }
}

/// δ → 0 is the rigid contact. Behind a front the travel is `u = f ξ²/2k`, with f = 2aT the change of friction over the
/// length and k = EA/L, so the front is blurred over the length at which u = δ, and a force of up to `sqrt(f k δ / 2)` is
/// not yet mobilised: the profile approaches that of the rigid contacts with the root of δ.
#[test]
fn short_presliding_is_the_travelling_front() {
    let mesh = TendonMesh::uniform(16, STIFFNESS_N_PER_M).unwrap();
    let limits = SlipLimits::new(&mesh, 0.6, 1.0);
    let mut errors = Vec::new();
    for delta_m in [1.6e-5_f64, 4e-6, 1e-6] {
        let mut rigid = Tendon::at_rest(&mesh, PRETENSION_N);
        let mut soft = rigid;
        let mut largest: f64 = 0.0;
        for (end, travel_m) in [
            (End::Input, 4e-4),
            (End::Output, 1e-4),
            (End::Input, -1e-4),
            (End::Input, -4e-4),
            (End::Output, -1e-4),
            (End::Output, 3e-4),
        ] {
            for _ in 0..4000 {
                rigid.move_end(&mesh, &limits, end, travel_m / 4000.0, false);
                soft.move_end_presliding(&mesh, &limits, end, travel_m / 4000.0, false, delta_m);
            }
            for j in 0..=16 {
                largest = largest.max((rigid.tension_n(&mesh, j) - soft.tension_n(&mesh, j)).abs());
            }
        }
        let blurred_n = (2.0 * 0.6 * PRETENSION_N * STIFFNESS_N_PER_M * delta_m / 2.0).sqrt();
        assert!(largest <= blurred_n, "δ {delta_m}: {largest} N, expected up to {blurred_n} N");
        errors.push(largest);
    }
    for pair in errors.windows(2) {
        assert!((1.5..2.5).contains(&(pair[0] / pair[1])), "a quarter of δ, half the error: {errors:?} N");
    }
}

/// Lengths add up and no contact passes its limit, for steps far below and far above δ, slack included.
#[test]
fn length_is_kept_and_limits_hold_for_any_step() {
    let n = 16;
    let mesh = TendonMesh::uniform(n, STIFFNESS_N_PER_M).unwrap();
    let limits = SlipLimits::new(&mesh, 0.8, 0.0);
    let ratio = (0.8 / n as f64).exp();
    let pace = [1.6, 1.69, 1.7, 1.71, 1.9, 2.1];
    for (step_m, pace) in [1e-7, 1e-5, 3e-4].into_iter().flat_map(|step_m| pace.map(|pace| (step_m, pace))) {
        let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
        let mut elongation_m = PRETENSION_N / STIFFNESS_N_PER_M;
        for step in 0..3000 {
            let phase = f64::from(step) * 0.01;
            for (end, pull_m) in
                [(End::Input, step_m * phase.sin()), (End::Output, step_m * (pace * phase).cos())]
            {
                tendon.move_end_presliding(&mesh, &limits, end, pull_m, true, 5e-5);
                elongation_m += pull_m;
            }
            near("elongation", tendon.elongation_m(&mesh), elongation_m, 1e-12);
            for j in 0..n {
                let (near_n, far_n) = (tendon.tension_n(&mesh, j), tendon.tension_n(&mesh, j + 1));
                assert!(near_n >= -1e-9 && far_n >= -1e-9, "step {step}: {near_n} N, {far_n} N");
                // Explicit in the share: 2 % beyond the limit, and about slack, where the share is not defined, a
                // thirtieth of what one step pulls.
                let slack_n = 1.0 / 30.0 * step_m * STIFFNESS_N_PER_M;
                assert!(
                    far_n <= near_n * ratio * 1.02 + slack_n && near_n <= far_n * ratio * 1.02 + slack_n,
                    "step {step} of {step_m} m at {pace}, contact {j}: {near_n} N to {far_n} N"
                );
            }
        }
    }
}

/// Friction that drops leaves contacts beyond their limit. Drawn on, they come back to it within a few travels of δ, from one
/// side, at a stiffness that is never negative, for steps far below and far above δ.
#[test]
fn contacts_beyond_a_limit_that_drops_come_back_to_it() {
    let mesh = TendonMesh::uniform(8, STIFFNESS_N_PER_M).unwrap();
    let [high, low] = [1.2, 0.3].map(|wrap_friction| SlipLimits::new(&mesh, wrap_friction, 0.0));
    let delta_m = 1e-5;
    for step_m in [0.02 * delta_m, 0.3 * delta_m, 5.0 * delta_m] {
        let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
        draw(&mut tendon, &mesh, &high, 40.0 * delta_m, step_m, delta_m);
        let mut ratio = tendon.end_tension_n(&mesh, End::Input) / tendon.end_tension_n(&mesh, End::Output);
        near("slips at the high limit", ratio / 1.2_f64.exp(), 1.0, 1e-3);
        // A contact comes back by a limited part in one step.
        for _ in 0..20.max((10.0 * delta_m / step_m).ceil() as usize) {
            draw(&mut tendon, &mesh, &low, step_m, step_m, delta_m);
            let now = tendon.end_tension_n(&mesh, End::Input) / tendon.end_tension_n(&mesh, End::Output);
            let beyond = now / 0.3_f64.exp();
            assert!(now <= ratio * (1.0 + 1e-9) && beyond >= 1.0 - 1e-3, "step {step_m} m: {ratio} to {now}");
            for end in [End::Input, End::Output] {
                assert!(tendon.end_stiffness_n_per_m(end) > 0.0, "step {step_m} m");
            }
            ratio = now;
        }
        near(&format!("back at the low limit, steps of {step_m} m"), ratio / 0.3_f64.exp(), 1.0, 5e-3);
    }
}
