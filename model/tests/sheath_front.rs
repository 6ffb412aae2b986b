//! The front after a reversal against the continuous solution, and how the mesh approaches it.

#[path = "common/near.rs"]
mod near;

use bowden_model::sheath::{End, SlipLimits, Tendon, TendonMesh};
use near::near;

const STIFFNESS_N_PER_M: f64 = 72_900.0;
const PRETENSION_N: f64 = 60.0;

/// Friction angle of the whole sheath.
const A: f64 = 0.8;

/// Simpson's rule with 200 intervals.
fn integral(f: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    let h = (to - from) / 200.0;
    let inner: f64 = (1..200).map(|i| f(from + h * f64::from(i)) * f64::from(2 + 2 * (i % 2))).sum();
    (f(from) + inner + f(to)) * h / 3.0
}

/// A tendon pulled through its sheath at the input until that end carries `t0`, then turned: with the friction angle φ
/// from the input, the old tension is t0 e^{-φ}, the new one `T_in` e^{φ} up to the front `φ_f`, where both meet.
///
/// Returns (`T_in`, length that the input end gave back in m) for a front at `front`.
fn after_reversal(t0: f64, front: f64) -> (f64, f64) {
    let input_n = t0 * (-2.0 * front).exp();
    let lost = integral(|phi| t0 * (-phi).exp() - input_n * phi.exp(), 0.0, front);
    (input_n, lost / A / STIFFNESS_N_PER_M)
}

/// Front and input tension of the mesh after the same history; the output end stands.
fn mesh_after_reversal(n: usize, back_m: f64) -> (f64, f64, f64) {
    let mesh = TendonMesh::uniform(n, STIFFNESS_N_PER_M).unwrap();
    let limits = SlipLimits::new(&mesh, A, 0.0);
    let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
    tendon.move_end(&mesh, &limits, End::Input, 6e-4, false);
    assert_eq!(tendon.front(End::Input), n);
    let t0 = tendon.end_tension_n(&mesh, End::Input);
    tendon.move_end(&mesh, &limits, End::Input, -back_m, false);
    let input_n = tendon.end_tension_n(&mesh, End::Input);
    (t0, A * tendon.front(End::Input) as f64 / n as f64, input_n)
}

/// 64 contacts find the front to one contact and the tension at the moved end to 0.2 % of the full-slip change.
#[test]
fn front_after_reversal_is_the_analytic_one() {
    for quarter in [0.1, 0.25, 0.5, 0.75, 0.95] {
        let (t0, _, _) = mesh_after_reversal(64, 1e-9);
        let (want_n, back_m) = after_reversal(t0, quarter * A);
        let (_, front, input_n) = mesh_after_reversal(64, back_m);
        near(&format!("front at {quarter}"), front, quarter * A, 1.001 * A / 64.0);
        near(
            &format!("input tension at {quarter}"),
            (input_n - want_n) / (t0 * (1.0 - (-2.0 * A).exp())),
            0.0,
            2e-3,
        );
    }
}

/// The tension at the moved end, while the front travels, converges with the second power of 1/n: 0.1 N of 60 with 16
/// contacts, 0.01 N with 64. The mean over many
/// depths is taken, since the error depends on where between two contacts the front stands.
#[test]
fn mesh_converges_with_second_order() {
    let errors = [4, 8, 16, 32, 64].map(|n| {
        let (t0, _, _) = mesh_after_reversal(n, 1e-9);
        let depths = 200;
        let sum: f64 = (0..depths)
            .map(|i| {
                let (want_n, back_m) =
                    after_reversal(t0, A * (0.3 + 0.65 * f64::from(i) / f64::from(depths)));
                (mesh_after_reversal(n, back_m).2 - want_n).powi(2)
            })
            .sum();
        (sum / f64::from(depths)).sqrt()
    });
    assert!(errors[2] < 0.1 && errors[4] < 0.01, "{errors:?} N");
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((1.8..2.2).contains(&order), "errors {errors:?} N, order {order}");
    }
}

/// When the front reaches the far end the tendon slips as a whole, after the travel between the two full-slip profiles
/// over the same output tension, here by integration of both.
#[test]
fn travel_through_the_sheath() {
    let (t0, _, _) = mesh_after_reversal(64, 1e-9);
    let (input_n, back_m) = after_reversal(t0, A);
    let (_, before, _) = mesh_after_reversal(64, 0.985 * back_m);
    let (_, after, got_n) = mesh_after_reversal(64, 1.015 * back_m);
    assert!(before < A, "whole sheath slips {} early", A - before);
    near("front", after, A, 0.0);
    // Beyond, the input tension falls as in full slip, -(a/(e^a - 1)) (EA/L): 1.5 % more travel.
    let further_n = 0.015 * back_m * STIFFNESS_N_PER_M * A / A.exp_m1();
    near("input tension", got_n, input_n - further_n, 2e-3 * t0);
}

/// One contact has the same end points and a straight line between, where the front gives a root: at a quarter of the
/// travel it misses (1 + a/2)/4 of the whole change of the input tension, to first order in a.
#[test]
fn one_contact_misses_a_quarter_of_the_change_on_the_way() {
    for (a, want, tolerance) in [(0.02_f64, 0.25, 0.01), (0.377, 0.25 * (1.0 + 0.5 * 0.377), 0.01)] {
        // Share of the change from limit to limit that is done after this share of the travel between them.
        let done = |n: usize, share: f64| {
            let mesh = TendonMesh::uniform(n, STIFFNESS_N_PER_M).unwrap();
            let limits = SlipLimits::new(&mesh, a, 0.0);
            let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
            tendon.move_end(&mesh, &limits, End::Input, 6e-4, false);
            assert_eq!(tendon.front(End::Input), n);
            let (t0, held_n) =
                (tendon.end_tension_n(&mesh, End::Input), tendon.end_tension_n(&mesh, End::Output));
            // Stretch at standing output tension: held_n psi'/EA, psi' = (L/a)(e^a - 1) and (L/a)(1 - e^{-a}), times c.
            let h = a / n as f64;
            let c = 0.5 * h / (0.5 * h).tanh();
            let travel_m = c * held_n * 2.0 * (a.cosh() - 1.0) / a / STIFFNESS_N_PER_M;
            tendon.move_end(&mesh, &limits, End::Input, -share * travel_m, false);
            (t0 - tendon.end_tension_n(&mesh, End::Input)) / (2.0 * held_n * a.sinh())
        };
        near("one contact, whole travel", done(1, 1.0), 1.0, 1e-9);
        near("64 contacts, whole travel", done(64, 1.0), 1.0, 0.01);
        near("one contact, a quarter", done(1, 0.25), 0.25, 1e-9);
        near(&format!("missed at a = {a}"), done(64, 0.25) - done(1, 0.25), want, tolerance);
    }
}

/// A linear tendon may push. Where it does, it has no friction: the tension evens out over the part that slipped.
#[test]
fn pushing_tendon_has_no_friction() {
    for n in [1, 16] {
        let mesh = TendonMesh::uniform(n, STIFFNESS_N_PER_M).unwrap();
        let limits = SlipLimits::new(&mesh, A, 0.0);
        let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
        tendon.move_end(&mesh, &limits, End::Input, -1.2e-3, false);
        // 60 N less 1.2 mm of 72.9 N/mm over the whole length.
        for j in 0..=n {
            near(&format!("n {n}, segment {j}"), tendon.tension_n(&mesh, j), 60.0 - 87.48, 1e-9);
        }
        tendon.move_end(&mesh, &limits, End::Input, 1.2e-3, false);
        let mean_n = tendon.elongation_m(&mesh) * STIFFNESS_N_PER_M;
        near("back where it was", mean_n, PRETENSION_N, 1e-9);
        assert!(tendon.end_tension_n(&mesh, End::Input) > tendon.end_tension_n(&mesh, End::Output));
    }
}

/// A slack tendon carries nothing until all its slack is taken up, at whichever end, or shortened away.
#[test]
fn slack_is_taken_up_before_tension_returns() {
    for (slacken, tighten) in [
        (End::Input, End::Input),
        (End::Input, End::Output),
        (End::Output, End::Input),
        (End::Output, End::Output),
    ] {
        for n in [1, 16] {
            let name = format!("n {n}, slack at {slacken:?}, pulled at {tighten:?}");
            let mesh = TendonMesh::uniform(n, STIFFNESS_N_PER_M).unwrap();
            let limits = SlipLimits::new(&mesh, A, 0.0);
            let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
            // 60 N is 0.823 mm: 2 mm leave 1.177 mm of slack.
            let slack_m = 2e-3 - PRETENSION_N / STIFFNESS_N_PER_M;
            for _ in 0..4 {
                tendon.move_end(&mesh, &limits, slacken, -0.5e-3, true);
            }
            for j in 0..=n {
                near(&name, tendon.tension_n(&mesh, j), 0.0, 1e-12);
            }
            tendon.move_end(&mesh, &limits, tighten, slack_m - 1e-5, true);
            near(&name, tendon.end_tension_n(&mesh, tighten), 0.0, 1e-9);
            tendon.move_end(&mesh, &limits, tighten, 1e-5 + 4e-4, true);
            // From zero tension any pull slips all through: T_end = u (EA/L) a/(1 - e^{-a}), and the mesh's h²/12.
            let want_n = 4e-4 * STIFFNESS_N_PER_M * A / -(-A).exp_m1();
            let h = A / n as f64;
            near(&name, tendon.end_tension_n(&mesh, tighten) / want_n, 1.0, 1.02 * h * h / 12.0);
            // Lengthened by more than it is stretched, then shortened again: slack in between, the same at the end.
            tendon.add_length(&mesh, 1e-3);
            tendon.move_end(&mesh, &limits, tighten, 0.0, true);
            assert!(tendon.end_tension_n(&mesh, tighten) >= 0.0, "{name}");
            tendon.add_length(&mesh, -1e-3);
            tendon.move_end(&mesh, &limits, tighten, 0.0, true);
            near(&name, tendon.elongation_m(&mesh), 4e-4, 1e-12);
            let mean_n: f64 = (0..=n)
                .map(|j| tendon.tension_n(&mesh, j) / n as f64 * if j == 0 || j == n { 0.5 } else { 1.0 })
                .sum();
            near(
                &format!("{name}, mean tension after re-tightening"),
                mean_n,
                4e-4 * STIFFNESS_N_PER_M,
                1e-9,
            );
        }
    }
}
