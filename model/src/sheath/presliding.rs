//! Contacts that give way elastically before they slip: Dahl's law at every contact of a tendon.
//!
//! A contact keeps its share of friction as tension changes and loses the distance to the limit with its own travel:
//!
//! ```text
//! g_i = T_{i+1} - (e^{-μ K w_i} T_i - o_i),   dg_i = -g_i dx_i / δ   (end i pulled; released: with the other limit)
//! ```
//!
//! `x_i` is what the tendon moved at the contact, `δ` the presliding displacement: after a travel of δ, 63 % of the way to
//! the limit is done. δ → 0 is the rigid contact of [`super`]. Seen from the end that moves the tendon is a ladder; its
//! compliance `X_j = c_j + r_j X_{j+1} / (1 + κ_j X_{j+1})` follows from the far end inwards with positive terms only,
//! and the tensions from a second pass outwards. Both passes carry numerator and denominator, `X_j = p_j / q_j`, so that
//! no division waits for another. First order in `step / δ` and in `μK / n`, stable for any step.
//!
//! Dahl's law has no memory of turning points: a small loop inside a large one does not close exactly, and under a steady
//! pull a small vibration creeps. Source: P. R. Dahl, Aerospace report TOR-158(3107-18), 1968.

use super::{End, FullSlip, MAX_ELEMENTS, SlipLimits, Tendon, TendonMesh};

/// Largest part of a ladder's own compliance by which a contact beyond its limit may raise it: such a contact, as after
/// a drop of friction, comes back within a travel of δ.
const LARGEST_RETURN: f64 = 0.5;

/// Part of the friction between the two limits within which a contact counts as slipping. After a travel of 12 δ all of
/// them do, and a tendon whose contacts all slip moves on at the cost of its ends.
const SLIPS: f64 = 1e-5;

/// Segments of a tendon whose passes need little room.
const SMALL: usize = 9;

impl Tendon {
    /// Moves one end by `pull_m` (positive stretches the tendon) with contacts that give way over `presliding_m` > 0.
    ///
    /// `unilateral` as for [`Tendon::move_end`]; a part that pushes carries no further friction.
    pub fn move_end_presliding(
        &mut self,
        mesh: &TendonMesh,
        limits: &SlipLimits,
        end: End,
        mut pull_m: f64,
        unilateral: bool,
        presliding_m: f64,
    ) {
        let index = end as usize;
        if pull_m > 0.0 {
            let taken = pull_m.min(self.slack_m[index]);
            self.slack_m[index] -= taken;
            pull_m -= taken;
        }
        if pull_m == 0.0 || self.slide(mesh, limits, end, pull_m) {
            return;
        }
        self.fill_in(mesh);
        self.full_slip = None;
        let n = mesh.elements;
        if n < SMALL {
            self.climb::<SMALL>(mesh, limits, end, pull_m, unilateral, presliding_m);
        } else {
            self.climb::<{ MAX_ELEMENTS + 1 }>(mesh, limits, end, pull_m, unilateral, presliding_m);
        }
        let from_output = end == End::Output;
        let far = if from_output { End::Input } else { End::Output };
        let loose_m = self.slack_m[far as usize];
        if unilateral && loose_m > 0.0 && self.end_tension_n(mesh, far) > 0.0 {
            // The far end hangs loose: let it slide in until it is tight or carries nothing.
            self.slack_m[far as usize] = 0.0;
            self.move_end_presliding(mesh, limits, far, -loose_m, unilateral, presliding_m);
        }
    }

    /// The two passes along the ladder of at most `SEGMENTS` segments.
    fn climb<const SEGMENTS: usize>(
        &mut self,
        mesh: &TendonMesh,
        limits: &SlipLimits,
        end: End,
        pull_m: f64,
        unilateral: bool,
        presliding_m: f64,
    ) {
        let index = end as usize;
        let n = mesh.elements;
        let from_output = end == End::Output;
        let segment = |j: usize| if from_output { n - j } else { j };
        let contact = |i: usize| if from_output { n - 1 - i } else { i };
        let pulled = pull_m > 0.0;
        // No contact travels farther than the end: the chord of the exponential up to there never passes the limit.
        let decay_per_m = mobilised(pull_m.abs() / presliding_m) / pull_m.abs();

        // Per contact: dT_{j+1} = slope dT_j - grip x, turned into x = share X_{j+1} dT_j, share = slope / (1 + grip X).
        let mut slopes = [0.0; SEGMENTS];
        let mut denominators = [1.0; SEGMENTS];
        let mut numerator = mesh.compliance_m_per_n[segment(n)];
        let mut all_slip = true;
        for i in (0..n).rev() {
            let (near, far) = (self.tension_n[segment(i)], self.tension_n[segment(i + 1)]);
            let (down, up) = (limits.ratio[contact(i)], limits.inverse_ratio[contact(i)]);
            let offset = limits.offset_share[contact(i)];
            let range = (up - down) * near + (up + 1.0) * offset;
            let (slope, grip) = if range > 0.0 && near > 0.0 {
                let above = far - (down * near - offset);
                let gap = if pulled { above } else { range - above };
                all_slip &= gap.abs() <= SLIPS * range;
                (down + (above / range).clamp(0.0, 1.0) * (up - down), gap * decay_per_m)
            } else {
                all_slip = false;
                (1.0, 0.0)
            };
            let behind = denominators[i + 1];
            let denominator = behind + (grip * numerator).max(-LARGEST_RETURN * behind);
            numerator = mesh.compliance_m_per_n[segment(i)] * denominator + slope * numerator;
            slopes[i] = slope;
            denominators[i] = denominator;
        }

        let stiffness_n_per_m = denominators[0] / numerator;
        let mut rise_n = pull_m * stiffness_n_per_m;
        let tension = self.tension_n[segment(0)];
        if unilateral && tension + rise_n < 0.0 {
            self.slack_m[index] -= (tension + rise_n) / stiffness_n_per_m;
            rise_n = -tension;
        }
        self.front[index] = n;
        self.stiffness_n_per_m[index] = stiffness_n_per_m;
        let floor = if unilateral { 0.0 } else { f64::NEG_INFINITY };
        let mut scaled_rise_n = rise_n / denominators[0];
        for (j, (slope, denominator)) in slopes.iter().zip(&denominators).enumerate().take(n + 1) {
            let tension = self.tension_n[segment(j)] + scaled_rise_n * denominator;
            self.tension_n[segment(j)] = tension.max(floor);
            // What a segment would push is slack instead.
            self.slack_m[index] += (floor - tension).max(0.0) * mesh.compliance_m_per_n[segment(j)];
            scaled_rise_n *= slope;
        }
        let friction = [limits.wrap_friction, limits.offset_n];
        // Limits that change from step to step would end it at once.
        let steady = core::mem::replace(&mut self.friction_before, friction) == friction;
        if all_slip && steady && self.slack_m == [0.0; 2] {
            self.begin_full_slip(mesh, limits, pulled != from_output);
        }
    }

    /// Puts all contacts on their limit, where they are but for [`SLIPS`], without a change of length.
    fn begin_full_slip(&mut self, mesh: &TendonMesh, limits: &SlipLimits, towards_input: bool) {
        let steps = if towards_input { &limits.ratio } else { &limits.inverse_ratio };
        let (mut compliance_m_per_n, mut ratio) = (mesh.compliance_m_per_n[0], 1.0);
        for (step, compliance) in steps.iter().zip(&mesh.compliance_m_per_n[1..=mesh.elements]) {
            ratio *= step;
            compliance_m_per_n += compliance * ratio;
        }
        let length_m = self.elongation_m(mesh);
        self.full_slip = Some(FullSlip {
            towards_input,
            wrap_friction: limits.wrap_friction,
            offset_n: limits.offset_n,
            compliance_m_per_n,
            ratio,
        });
        self.inner_is_stale = true;
        self.fill_in(mesh);
        self.tension_n[0] += (length_m - self.elongation_m(mesh)) / compliance_m_per_n;
        self.inner_is_stale = true;
        self.fill_in(mesh);
    }
}

/// `1 - e^{-z}` for `z >= 0`, within 3e-4 and never above 1: `e^{z/4}` to its fourth order, taken to the fourth power.
fn mobilised(z: f64) -> f64 {
    let x = 0.25 * z;
    let beyond_one = x * (1.0 + x * (1.0 / 2.0 + x * (1.0 / 6.0 + x * (1.0 / 24.0))));
    let quarter = beyond_one / (1.0 + beyond_one);
    (quarter * (4.0 - quarter * (6.0 - quarter * (4.0 - quarter)))).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::mobilised;

    #[test]
    fn friction_is_mobilised_as_the_exponential_says_and_never_beyond_the_limit() {
        for step in 0..4000 {
            let z = 1e-12 * 1.01_f64.powi(step);
            let exact = -libm::expm1(-z);
            let got = mobilised(z);
            assert!((0.0..=1.0).contains(&got), "{z}: {got}");
            assert!(
                (got - exact).abs() < 3e-4 && (z > 0.1 || (got / exact - 1.0).abs() < 1e-6),
                "{z}: {got}, {exact}"
            );
        }
    }
}
