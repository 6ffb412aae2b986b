//! One tendon in full slip and over long histories: end ratio, elongation, stiffness.

#[path = "common/near.rs"]
mod near;
#[path = "common/random.rs"]
mod random;

use bowden_model::sheath::{End, SheathError, SlipLimits, Tendon, TendonMesh};
use near::near;
use random::Random;

/// End-to-end stiffness of the bench's tendon, EA/L, N/m.
const STIFFNESS_N_PER_M: f64 = 72_900.0;
const PRETENSION_N: f64 = 30.0;

/// Even curvature, one that doubles along the sheath with a straight piece in the middle, and straight ends.
fn meshes(n: usize) -> [TendonMesh; 3] {
    let bends = |s: f64| if (s - 0.5).abs() < 0.1 { 0.0 } else { 1.0 + s };
    [
        TendonMesh::uniform(n, STIFFNESS_N_PER_M).unwrap(),
        TendonMesh::with_curvature(n, STIFFNESS_N_PER_M, bends).unwrap(),
        TendonMesh::bent_between(n, STIFFNESS_N_PER_M, [0.14, 0.86]).unwrap(),
    ]
}

/// Capstan equation: in full slip the moved end and the other one differ by e^{μK}, whatever the mesh and the curvature.
/// 1e-12 is some thousand roundings, more than 64 contacts and 20 steps make.
#[test]
fn full_slip_ends_differ_by_the_capstan_ratio() {
    for n in [1, 4, 16, 64] {
        for mesh in meshes(n) {
            for wrap_friction in [0.1_f64, 0.377, 2.0] {
                for (end, pull_m, want) in [
                    (End::Input, 2e-3, (-wrap_friction).exp()),
                    (End::Input, -3e-4, wrap_friction.exp()),
                    (End::Output, 2e-3, wrap_friction.exp()),
                    (End::Output, -3e-4, (-wrap_friction).exp()),
                ] {
                    let limits = SlipLimits::new(&mesh, wrap_friction, 0.0);
                    let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
                    for _ in 0..20 {
                        tendon.move_end(&mesh, &limits, end, pull_m / 20.0, false);
                    }
                    assert_eq!(tendon.front(end), n, "n {n}, μK {wrap_friction}, {end:?} by {pull_m}");
                    let ratio =
                        tendon.end_tension_n(&mesh, End::Output) / tendon.end_tension_n(&mesh, End::Input);
                    near(
                        &format!("n {n}, μK {wrap_friction}, {end:?} by {pull_m}"),
                        ratio / want,
                        1.0,
                        1e-12,
                    );
                }
            }
        }
    }
}

/// Eq. (8): in full slip towards the input the elongation is F1 (L/EA) (1 - e^{-a})/a. Half end segments make the mesh a
/// trapezoidal rule, whose relative error for an exponential is (h/2) coth(h/2) - 1 = h²/12 + O(h⁴), h = a/n.
#[test]
fn full_slip_elongation_is_off_by_the_trapezoidal_error_alone() {
    let a: f64 = 1.2;
    for n in [1, 4, 16, 64] {
        let mesh = TendonMesh::uniform(n, STIFFNESS_N_PER_M).unwrap();
        let limits = SlipLimits::new(&mesh, a, 0.0);
        let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
        tendon.move_end(&mesh, &limits, End::Input, 3e-3, false);
        let exact_m = tendon.end_tension_n(&mesh, End::Input) / STIFFNESS_N_PER_M * (1.0 - (-a).exp()) / a;
        let elongation_m = PRETENSION_N / STIFFNESS_N_PER_M + 3e-3;
        let h = a / n as f64;
        // The next term of the series is h⁴/720: below 2 % of the first at h = 1.2.
        near(&format!("n {n}"), (elongation_m / exact_m - 1.0) / (h * h / 12.0), 1.0, 0.03);
    }
}

/// Whatever slips, the tensions carry the length that went in at the ends. 1e-12 m is 1e-9 of the travel; 4000 moves
/// round some 1e-16 of 1e-3 m each.
#[test]
fn elongation_is_what_the_ends_were_pulled() {
    for (seed, unilateral) in [(1, false), (2, false), (3, true), (4, true)] {
        for mesh in meshes(16) {
            let mut random = Random::new(seed);
            let mut limits = SlipLimits::new(&mesh, 0.377, 0.0);
            let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
            let mut elongation_m = PRETENSION_N / STIFFNESS_N_PER_M;
            // Calm histories stay taut, wild ones push and hang slack.
            let stride_m = if seed % 2 == 1 { 2e-6 } else { 2e-4 };
            let mut direction = [1.0, 1.0];
            for step in 0..4000 {
                if step % 37 == 0 {
                    direction = [random.signed(), random.signed()];
                }
                if step % 501 == 0 {
                    limits.set(&mesh, [0.4 + 0.4 * random.signed(), 2.0 + 2.0 * random.signed()]);
                }
                for (end, share) in [(End::Input, direction[0]), (End::Output, direction[1])] {
                    let pull_m = stride_m * (share + 0.3 * random.signed());
                    tendon.move_end(&mesh, &limits, end, pull_m, unilateral);
                    elongation_m += pull_m;
                }
                if step % 1000 == 999 {
                    tendon.add_length(&mesh, 1e-5);
                    elongation_m -= 1e-5;
                }
                near(&format!("seed {seed} step {step}"), tendon.elongation_m(&mesh), elongation_m, 1e-12);
            }
        }
    }
}

/// Without friction a tendon is a spring of EA/L with one tension, from either end.
#[test]
fn frictionless_tendon_is_one_spring() {
    for n in [1, 16, 64] {
        for mesh in meshes(n) {
            let limits = SlipLimits::new(&mesh, 0.0, 0.0);
            for end in [End::Input, End::Output] {
                let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
                for pull_m in [1e-4, -5e-5, 2e-4, -3e-4] {
                    tendon.move_end(&mesh, &limits, end, pull_m, false);
                    near("stiffness", tendon.end_stiffness_n_per_m(end) / STIFFNESS_N_PER_M, 1.0, 1e-12);
                }
                for j in 0..=n {
                    near(
                        "tension",
                        tendon.tension_n(&mesh, j),
                        PRETENSION_N - 5e-5 * STIFFNESS_N_PER_M,
                        1e-10,
                    );
                }
            }
        }
    }
}

/// The reported slope of the end tension is the one that a small further move meets, stuck or slipping.
#[test]
fn end_stiffness_is_the_slope_of_the_next_move() {
    let mesh = TendonMesh::uniform(16, STIFFNESS_N_PER_M).unwrap();
    let limits = SlipLimits::new(&mesh, 0.6, 0.0);
    for end in [End::Input, End::Output] {
        let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
        for pull_m in [3e-4, -1e-5, -4e-5, -2e-4, 1e-5, 6e-5] {
            tendon.move_end(&mesh, &limits, end, pull_m, false);
            let before = tendon.end_tension_n(&mesh, end);
            let slope = tendon.end_stiffness_n_per_m(end);
            let tiny_m = 1e-9_f64.copysign(pull_m);
            let mut moved = tendon;
            moved.move_end(&mesh, &limits, end, tiny_m, false);
            // Rounding of 30 N over 1e-9 m is 4e-6 N/m; a contact that starts to slip in between would show as 5 %.
            let met = (moved.end_tension_n(&mesh, end) - before) / tiny_m;
            near(&format!("{end:?} by {pull_m}"), met / slope, 1.0, 1e-6);
        }
    }
}

/// A mesh that cannot exist is refused, with the number.
#[test]
fn impossible_meshes_are_refused() {
    assert_eq!(TendonMesh::uniform(0, 1.0), Err(SheathError::Elements { got: 0 }));
    assert_eq!(TendonMesh::uniform(65, 1.0), Err(SheathError::Elements { got: 65 }));
    for stiffness in [0.0, -1.0, f64::INFINITY] {
        let refused = SheathError::NotPositive { name: "tendon stiffness", got: stiffness };
        assert_eq!(TendonMesh::uniform(4, stiffness), Err(refused));
    }
    assert!(TendonMesh::uniform(4, f64::NAN).is_err());
    let straight = SheathError::NotPositive { name: "integral of the curvature", got: 0.0 };
    assert_eq!(TendonMesh::with_curvature(4, 1.0, |_| 0.0), Err(straight));
}

/// A tendon that is pulled by little is as stiff as the length up to the first contact that holds it: a straight quarter and half
/// of an element of sixteen, 16/4.5 times the stiffness from end to end.
#[test]
fn a_straight_end_is_stretched_before_any_contact_slips() {
    let mesh = TendonMesh::bent_between(16, STIFFNESS_N_PER_M, [0.25, 0.75]).unwrap();
    let limits = SlipLimits::new(&mesh, 0.377, 0.0);
    for end in [End::Input, End::Output] {
        let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
        tendon.move_end(&mesh, &limits, end, 1e-7, false);
        let rise_n = tendon.end_tension_n(&mesh, end) - PRETENSION_N;
        near("rise", rise_n, 1e-7 * STIFFNESS_N_PER_M * 16.0 / 4.5, 1e-9);
    }
    for places in [[-0.1, 1.0], [0.5, 0.5], [0.0, 1.1], [f64::NAN, 1.0]] {
        assert!(TendonMesh::bent_between(16, STIFFNESS_N_PER_M, places).is_err());
    }
}
