//! Dry friction of a shaft against Dahl's law, integrated by other means.

use bowden_model::dry_friction::{BuildUp, DryFriction};

const LINEAR: DryFriction =
    DryFriction { level_nm: 0.08, sliding: 1.0, travel_rad: 2e-3, build_up: BuildUp::Linear };
const EXPONENTIAL: DryFriction = DryFriction { build_up: BuildUp::Exponential, ..LINEAR };
/// At a speed at which two fifths of the level are left.
const SLIDING: [DryFriction; 2] =
    [DryFriction { sliding: 0.4, ..LINEAR }, DryFriction { sliding: 0.4, ..EXPONENTIAL }];

/// Friction as at standstill, at a speed that leaves a share `s` of it: a spring gives the rest up at once, what gives way ever more slowly
/// over the turn, by hand `s + (1 - s) e^{-x/s}` after `x` turns; and what is behind that share comes up to it, `s - (s + 1) e^{-x/s}`.
#[test]
fn friction_follows_a_level_that_fell_over_the_turn() {
    let [spring, lagging] = SLIDING;
    assert_eq!([1e-9, 1e-3, 1.0].map(|turn_rad| spring.acting(1.0, turn_rad)), [0.4; 3]);
    for (from, step, within) in
        [(1.0, 0.04, 0.03), (1.0, 0.004, 0.003), (-1.0, 0.04, 0.04), (-1.0, 0.004, 0.004)]
    {
        let mut acting = from;
        for k in 1..=(4.0 / step) as usize {
            acting = lagging.acting(acting, step * lagging.travel_rad);
            let expected = 0.4 + (from - 0.4) * (-(k as f64) * step / 0.4).exp();
            assert!((acting - expected).abs() < within, "from {from} after {k} steps: {acting}, {expected}");
        }
    }
}

/// From friction fully the other way: by hand `-1 + x` and `1 - 2 e^{-x}` after `x` turns. In steps of a tenth of a turn the exponential stays
/// within 0.04, in steps of a hundredth within 0.004.
#[test]
fn after_a_reversal_it_builds_up_as_dahls_law_says() {
    for (friction, step, within) in
        [(LINEAR, 0.1, 1e-12), (EXPONENTIAL, 0.1, 0.04), (EXPONENTIAL, 0.01, 0.004)]
    {
        let mut acting = -1.0;
        for k in 1..=(6.0 / step) as usize {
            acting = friction.acting(acting, step * friction.travel_rad);
            let turns = k as f64 * step;
            let expected = match friction.build_up {
                BuildUp::Linear => (turns - 1.0).min(1.0),
                BuildUp::Exponential => 1.0 - 2.0 * (-turns).exp(),
            };
            assert!((acting - expected).abs() < within, "{friction:?} after {turns}: {acting}, {expected}");
        }
    }
}

/// However long the step and whichever way: no more than the level, and a turn back undoes nothing beyond it.
#[test]
fn no_turn_takes_it_beyond_its_level() {
    for friction in [LINEAR, EXPONENTIAL].into_iter().chain(SLIDING) {
        for before in [-1.0, -0.3, 0.0, 1.0] {
            for turn_rad in [-1e3, -2e-3, 0.0, 1e-9, 5e-2] {
                let acting = friction.acting(before, turn_rad);
                let most = f64::max(f64::abs(before), friction.sliding);
                assert!(acting.abs() <= most, "{friction:?} {before} {turn_rad}: {acting}");
                let is_above = before * turn_rad > 0.0 && f64::abs(before) > friction.sliding;
                let grows = (acting - before) * turn_rad >= 0.0;
                assert!(grows || is_above, "{friction:?} {before} {turn_rad}: {acting}");
            }
        }
    }
}

/// The speed after a step is the one that the torque of its end leaves: `ω' = ω - z(ω' dt) τ r`, put in again; and friction never turns a motion
/// round that it did not turn round as it stood.
#[test]
fn the_speed_after_a_step_is_that_of_the_friction_at_its_end() {
    let (rad_s_per_nm, dt_s) = (2.0, 1e-3);
    for friction in [LINEAR, EXPONENTIAL].into_iter().chain(SLIDING) {
        for before in [-1.0, -0.4, 0.0, 0.7, 1.0] {
            for omega_rad_s in [-30.0, -0.2, -1e-3, 0.0, 1e-6, 0.05, 0.16, 4.0] {
                let mut acting = before;
                let after_rad_s = friction.after_rad_s(&mut acting, omega_rad_s, rad_s_per_nm, dt_s);
                let there = friction.acting(before, after_rad_s * dt_s);
                let left_rad_s = omega_rad_s - there * friction.level_nm * rad_s_per_nm;
                let scale = 1e-9 * (1.0 + omega_rad_s.abs());
                assert!(
                    (acting - there).abs() < 1e-9,
                    "{friction:?} {before} {omega_rad_s}: {acting}, {there}"
                );
                assert!((after_rad_s - left_rad_s).abs() < scale, "{friction:?} {before} {omega_rad_s}");
            }
        }
    }
}

/// Slope of the torque over a further turn, by differences of 1e-9 rad. (A spring that was turned beyond its level counts as tight on its way
/// back, so that a step falls short.)
#[test]
fn its_stiffness_is_the_slope_of_its_torque() {
    for friction in [LINEAR, EXPONENTIAL, SLIDING[1]] {
        for before in [-0.9, 0.0, 0.6] {
            for turned_rad in [-1e-4, 0.0, 2e-4, 6e-4] {
                for way in [-1.0, 1.0] {
                    let torque_nm = |turn_rad: f64| friction.level_nm * friction.acting(before, turn_rad);
                    let further = 1e-9 * way;
                    let expected = (torque_nm(turned_rad + further) - torque_nm(turned_rad)) / further;
                    let stiffness = friction.stiffness_nm_per_rad(before, turned_rad, way);
                    let within = 1e-4 * friction.level_nm / friction.travel_rad;
                    assert!(
                        (stiffness - expected).abs() < within,
                        "{friction:?} {before} {turned_rad} {way}"
                    );
                }
            }
        }
    }
}
