//! Waves at two phases a quarter of a turn apart: `a sin(x) + b cos(x) = hypot(a, b) sin(x + atan2(b, a))`.
//!
//! Either phase alone may promise next to nothing, and less than that at the strength it asks for, where the wave lies between both.

use bowden_model::effect::ActiveEffect;

use super::{Background, Judged, NEARLY, STRONGEST};

/// Parameter that says where a wave begins.
const PHASE: &str = "phase_rad";

/// Starts in their order, both phases of a wave together.
pub(super) fn grouped(starts: &[ActiveEffect]) -> impl Iterator<Item = &[ActiveEffect]> {
    starts.chunk_by(are_phases)
}

/// Whether `second` is the same wave as `first`, a quarter of a turn ahead.
fn are_phases(first: &ActiveEffect, second: &ActiveEffect) -> bool {
    first.descriptor().index_of(PHASE).is_some_and(|place| {
        first.with(PHASE, first.parameters[place] + std::f64::consts::FRAC_PI_2) == *second
    })
}

impl Background<'_> {
    /// The best of both phases and of the wave that their linear estimates make up together.
    pub(super) fn judge_wave(&self, phases: &[ActiveEffect], promising: f64) -> Option<Judged> {
        let rows: Vec<_> = phases.iter().map(|phase| self.rows_of(*phase)).collect();
        let between = match &rows[..] {
            [Some(first), Some(second)] => {
                let [first, second] = [first, second].map(|rows| self.basis.without(rows) - &self.now);
                let products = [first.norm_squared(), first.dot(&second), second.norm_squared()];
                let steps = steps(products, [-self.now.dot(&first), -self.now.dot(&second)]);
                steps.and_then(|[a, b]| {
                    let gain = self.gain_of((&self.now + first * a + second * b).norm_squared());
                    (gain > NEARLY * promising).then(|| between(&phases[0], [a, b]))
                })
            }
            _ => None,
        };
        let single =
            phases.iter().zip(rows).filter_map(|(phase, rows)| Some(self.judge_rows(*phase, &rows?)));
        let between = between.and_then(|start| self.judge(start));
        single.chain(between).max_by(|a, b| a.best().gain.total_cmp(&b.best().gain))
    }
}

/// Steps along two directions of these products, `[a·a, a·b, b·b]`, that lead as far as possible along what has these products with them; no
/// farther than linear estimates are followed. `None` where the directions are one.
fn steps([aa, ab, bb]: [f64; 3], [a, b]: [f64; 2]) -> Option<[f64; 2]> {
    /// Squared sine of the angle between two directions from which on they are one.
    const ONE: f64 = 1e-6;
    let determinant = aa * bb - ab * ab;
    if determinant <= ONE * aa * bb {
        return None;
    }
    let steps = [(bb * a - ab * b) / determinant, (aa * b - ab * a) / determinant];
    let scale = (STRONGEST / f64::hypot(steps[0], steps[1])).min(1.0);
    Some(steps.map(|step| scale * step))
}

/// The wave that `first` and its other phase make up in these shares.
fn between(first: &ActiveEffect, [a, b]: [f64; 2]) -> ActiveEffect {
    let mut wave = *first;
    wave.parameters[0] *= f64::hypot(a, b);
    let phase_rad = first.descriptor().index_of(PHASE).map_or(0.0, |place| first.parameters[place]);
    wave.with(PHASE, phase_rad + b.atan2(a))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use bowden_model::law;

    use super::*;

    fn wave(amplitude_nm: f64, frequency_hz: f64, phase_rad: f64) -> ActiveEffect {
        let law = law::find("law_motor_torque_over_time").expect("a law of this name");
        let base = ActiveEffect::with_defaults(law).with("amplitude_nm", amplitude_nm);
        base.with("frequency_hz", frequency_hz).with(PHASE, phase_rad)
    }

    #[test]
    fn both_phases_of_a_wave_are_judged_together() {
        let starts = [
            wave(0.1, 3.0, 0.0),
            wave(0.1, 3.0, FRAC_PI_2),
            wave(0.1, 5.0, 0.0),
            wave(0.1, 5.0, FRAC_PI_2),
            wave(0.2, 5.0, FRAC_PI_2),
        ];
        let counts: Vec<usize> = grouped(&starts).map(<[ActiveEffect]>::len).collect();
        assert_eq!(counts, [2, 2, 1]);
    }

    /// By the sum of both phases at an instant.
    #[test]
    fn a_wave_between_two_phases_is_their_sum() {
        for [a, b] in [[0.5, -1.2], [-2.0, 0.3], [-0.4, -0.4]] {
            let parameters = between(&wave(0.1, 3.0, 0.0), [a, b]).parameters;
            for x in [0.0_f64, 0.7, 2.0] {
                let sum = 0.1 * (a * x.sin() + b * (x + FRAC_PI_2).sin());
                let one = parameters[0] * (x + parameters[2]).sin();
                assert!((one - sum).abs() < 1e-12, "{a} and {b} at {x}: {one}, not {sum}");
            }
        }
    }

    /// By hand: along (1, 0) and (1, 1) the way to (2, 3) is -1 and 3.
    #[test]
    fn steps_along_two_directions_lead_where_they_can() {
        let [a, b] = steps([1.0, 1.0, 2.0], [2.0 / 3.0, 5.0 / 3.0]).unwrap();
        assert!((a + 1.0 / 3.0).abs() < 1e-12 && (b - 1.0).abs() < 1e-12, "{a} {b}");
        let [a, b] = steps([1.0, 1.0, 2.0], [2.0, 5.0]).unwrap();
        assert!((f64::hypot(a, b) - STRONGEST).abs() < 1e-12 && (b / a + 3.0).abs() < 1e-12, "{a} {b}");
        assert_eq!(steps([1.0, 2.0, 4.0], [1.0, 2.0]), None);
    }
}
