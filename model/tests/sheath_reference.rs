//! The one-pass front against a solver that knows nothing of fronts (`common/rope.rs`).

#[path = "common/near.rs"]
mod near;
#[path = "common/random.rs"]
mod random;
#[path = "common/rope.rs"]
mod rope;

use bowden_model::sheath::{End, SlipLimits, Tendon, TendonMesh};
use near::near;
use random::Random;
use rope::Rope;

const STIFFNESS_N_PER_M: f64 = 72_900.0;
const PRETENSION_N: f64 = 60.0;

/// A sheath: contacts, μK, qK in N, curvature over the relative arc length and its integral up to there.
struct Sheath {
    contacts: usize,
    wrap_friction: f64,
    offset_n: f64,
    curvature: fn(f64) -> f64,
    wrapped: fn(f64) -> f64,
}

const SHEATHS: [Sheath; 4] = [
    Sheath { contacts: 8, wrap_friction: 0.6, offset_n: 0.0, curvature: |_| 1.0, wrapped: |s| s },
    Sheath { contacts: 6, wrap_friction: 0.6, offset_n: 3.0, curvature: |_| 1.0, wrapped: |s| s },
    Sheath {
        contacts: 7,
        wrap_friction: 0.9,
        offset_n: 0.0,
        curvature: |s| 0.2 + s,
        wrapped: |s| (0.2 * s + 0.5 * s * s) / 0.7,
    },
    Sheath { contacts: 1, wrap_friction: 0.6, offset_n: 1.0, curvature: |_| 1.0, wrapped: |s| s },
];

impl Sheath {
    fn mesh(&self) -> TendonMesh {
        let straight = (self.curvature)(0.0) == (self.curvature)(1.0);
        if straight {
            TendonMesh::uniform(self.contacts, STIFFNESS_N_PER_M).unwrap()
        } else {
            TendonMesh::with_curvature(self.contacts, STIFFNESS_N_PER_M, self.curvature).unwrap()
        }
    }

    /// The same tendon for the reference, from the law `dT/dφ = -(μ T + q)` integrated over every contact's wrap.
    fn rope(&self) -> Rope {
        let n = self.contacts;
        let cell = 1.0 / (STIFFNESS_N_PER_M * n as f64);
        let mut compliance = vec![cell; n + 1];
        compliance[0] = 0.5 * cell;
        compliance[n] = 0.5 * cell;
        let share =
            |i: usize| (self.wrapped)((i + 1) as f64 / n as f64) - (self.wrapped)(i as f64 / n as f64);
        let angle: Vec<f64> = (0..n).map(|i| self.wrap_friction * share(i)).collect();
        let loss_n_per_angle = self.offset_n / self.wrap_friction;
        let offset = angle.iter().map(|a| loss_n_per_angle * (1.0 - (-a).exp())).collect();
        Rope { compliance, angle, offset, tension: vec![PRETENSION_N; n + 1] }
    }
}

/// Largest difference of any segment tension, N.
fn apart(tendon: &Tendon, mesh: &TendonMesh, rope: &Rope) -> f64 {
    let profile = rope.tension.iter().enumerate();
    profile.map(|(j, want)| (tendon.tension_n(mesh, j) - want).abs()).fold(0.0, f64::max)
}

/// While one end moves at a time the front is exact for moves of any size: 120 random turns, each up to full slip. The
/// reference settles to 1e-11 N a sweep; 1e-8 N leaves room for its slow last modes.
#[test]
fn one_end_at_a_time_is_exact() {
    for (index, sheath) in SHEATHS.iter().enumerate() {
        let mesh = sheath.mesh();
        let limits = SlipLimits::new(&mesh, sheath.wrap_friction, sheath.offset_n);
        let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
        let mut rope = sheath.rope();
        let mut random = Random::new(7);
        let mut fronts = [0; 3];
        let mut at_m = [0.0; 2];
        for turn in 0..120 {
            let end = if random.signed() > 0.0 { End::Input } else { End::Output };
            // Towards a random place within 0.45 mm: the tension stays above zero.
            let to_m = 0.45e-3 * random.signed() * random.signed();
            let pull_m = to_m - at_m[end as usize];
            at_m[end as usize] = to_m;
            tendon.move_end(&mesh, &limits, end, pull_m, false);
            match end {
                End::Input => rope.pull(pull_m, 0.0),
                End::Output => rope.pull(0.0, pull_m),
            }
            let front = tendon.front(end);
            fronts[usize::from(front > 0) + usize::from(front == sheath.contacts)] += 1;
            near(&format!("sheath {index}, turn {turn}"), apart(&tendon, &mesh, &rope), 0.0, 1e-8);
        }
        assert!(fronts[2] >= 20, "sheath {index}: full slip in {} turns only", fronts[2]);
        assert!(
            fronts[1] >= 20 || sheath.contacts == 1,
            "sheath {index}: fronts in {} turns only",
            fronts[1]
        );
    }
}

/// Both ends in full slip the same way, thousands of small steps of changing size: the shortcut that keeps only the end
/// tensions against the reference, which takes them in one.
#[test]
fn full_slip_shortcut_keeps_the_profile() {
    for (index, sheath) in SHEATHS.iter().enumerate() {
        let mesh = sheath.mesh();
        let limits = SlipLimits::new(&mesh, sheath.wrap_friction, sheath.offset_n);
        for towards_input in [1.0, -1.0] {
            let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
            let mut rope = sheath.rope();
            let mut random = Random::new(3);
            // Through the sheath first, with the tension kept by the other end.
            for _ in 0..10 {
                tendon.move_end(&mesh, &limits, End::Input, 1e-4 * towards_input, false);
                tendon.move_end(&mesh, &limits, End::Output, -1e-4 * towards_input, false);
                rope.pull(1e-4 * towards_input, -1e-4 * towards_input);
            }
            for block in 0..20 {
                let mut sums_m = [0.0; 2];
                for _ in 0..100 {
                    for (end, sign) in [(End::Input, towards_input), (End::Output, -towards_input)] {
                        let pull_m = 1e-6 * sign * (1.0 + random.signed());
                        tendon.move_end(&mesh, &limits, end, pull_m, false);
                        sums_m[end as usize] += pull_m;
                    }
                }
                rope.pull(sums_m[0], sums_m[1]);
                near(&format!("sheath {index}, block {block}"), apart(&tendon, &mesh, &rope), 0.0, 1e-8);
            }
        }
    }
}

/// Farthest that an end goes in one leg of the motion below, m.
const LARGEST_TRAVEL_M: f64 = 0.8e-3;

/// Largest difference along a random motion of both ends at once, with `steps` moves of each end a leg.
fn largest_error_n(sheath: &Sheath, seed: u64, steps: usize) -> f64 {
    const LEGS: usize = 25;
    /// Load steps of the reference in a leg.
    const FINEST: usize = 64;
    let mesh = sheath.mesh();
    let limits = SlipLimits::new(&mesh, sheath.wrap_friction, sheath.offset_n);
    let mut tendon = Tendon::at_rest(&mesh, PRETENSION_N);
    let mut rope = sheath.rope();
    let mut random = Random::new(seed);
    let mut at_m = [0.0; 2];
    let mut largest: f64 = 0.0;
    for _ in 0..LEGS {
        let to_m = [0.5 * LARGEST_TRAVEL_M * random.signed(), 0.5 * LARGEST_TRAVEL_M * random.signed()];
        let travel_m = [to_m[0] - at_m[0], to_m[1] - at_m[1]];
        at_m = to_m;
        for step in 0..FINEST {
            rope.pull(travel_m[0] / FINEST as f64, travel_m[1] / FINEST as f64);
            if (step + 1) % (FINEST / steps) == 0 {
                tendon.move_end(&mesh, &limits, End::Input, travel_m[0] / steps as f64, false);
                tendon.move_end(&mesh, &limits, End::Output, travel_m[1] / steps as f64, false);
                largest = largest.max(apart(&tendon, &mesh, &rope));
            }
        }
    }
    largest
}

/// Two ends that move at once are taken in turn: while two fronts meet, the error is of first order in the step, at most
/// the tension that a step's travel makes in the whole tendon, and halves with the step. The reference itself takes 64
/// load steps a leg, both ends together.
#[test]
fn val_halving_the_step() {
    for (index, sheath) in SHEATHS.iter().enumerate() {
        for seed in [11, 12] {
            let steps = [4, 8, 16, 32];
            let errors = steps.map(|steps| largest_error_n(sheath, seed, steps));
            for (error_n, steps) in errors.iter().zip(steps) {
                let step_n = LARGEST_TRAVEL_M / steps as f64 * STIFFNESS_N_PER_M;
                assert!(*error_n <= step_n, "sheath {index}, seed {seed}: {errors:?}, step {step_n} N");
            }
            // Eight times the steps: an eighth of the error, within a third for the luck of where fronts meet.
            let (gain, last) = (errors[0] / errors[3], errors[2] / errors[3]);
            assert!((5.0..12.0).contains(&gain), "sheath {index}, seed {seed}: {errors:?}");
            assert!((1.7..2.3).contains(&last), "sheath {index}, seed {seed}: {errors:?}");
        }
    }
}
