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
//! no division waits for another. Each result of a pass waits for the one before it, which takes far longer than its own
//! operations: both tendons of a pair are moved side by side, as the two lanes of [`f64x2`]. First order in `step / δ` and in `μK / n`, stable for any step.
//!
//! Dahl's law has no memory of turning points: a small loop inside a large one does not close exactly, and under a steady
//! pull a small vibration creeps. Source: P. R. Dahl, Aerospace report TOR-158(3107-18), 1968.

use wide::{CmpGe, CmpGt, CmpLe, f64x2};

use super::{End, FullSlip, MAX_ELEMENTS, SlipLimits, Tendon, TendonMesh};

/// Largest part of a ladder's own compliance by which a contact beyond its limit may raise it: such a contact, as after
/// a drop of friction, comes back within a travel of δ.
const LARGEST_RETURN: f64 = 0.5;

/// Part of the friction between the two limits within which a contact counts as slipping. After a travel of 12 δ all of
/// them do, and a tendon whose contacts all slip moves on at the cost of its ends.
const SLIPS: f64 = 1e-5;

/// Segments of a tendon of four contacts, as a search simulates most, of eight and of sixteen: their passes need little room.
const SMALL: [usize; 3] = [5, 9, 17];

/// How one end of a tendon moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pull<'a> {
    /// Friction limits for slip from that end.
    pub limits: &'a SlipLimits,
    /// Positive stretches the tendon, m.
    pub stretch_m: f64,
    /// As for [`Tendon::move_end`].
    pub unilateral: bool,
    /// Travel over which contacts give way, m, greater than 0.
    pub presliding_m: f64,
}

impl Tendon {
    /// Moves one end by `pull_m` (positive stretches the tendon) with contacts that give way over `presliding_m` > 0.
    ///
    /// `unilateral` as for [`Tendon::move_end`]; a part that pushes carries no further friction.
    pub fn move_end_presliding(
        &mut self,
        mesh: &TendonMesh,
        limits: &SlipLimits,
        end: End,
        pull_m: f64,
        unilateral: bool,
        presliding_m: f64,
    ) {
        let mut pull = Pull { limits, stretch_m: pull_m, unilateral, presliding_m };
        if self.slide_or_wait(mesh, end, &mut pull) {
            climb(&mut [(self, pull)], mesh, end);
        }
    }

    /// Moves the same end of both tendons of a pair, at the cost of one.
    pub(crate) fn move_ends_presliding(
        [a, b]: &mut [Self; 2],
        mesh: &TendonMesh,
        end: End,
        [mut pull_a, mut pull_b]: [Pull<'_>; 2],
    ) {
        let climbs = [a.slide_or_wait(mesh, end, &mut pull_a), b.slide_or_wait(mesh, end, &mut pull_b)];
        match climbs {
            [false, false] => {}
            [true, true] => climb(&mut [(a, pull_a), (b, pull_b)], mesh, end),
            [true, false] => climb(&mut [(a, pull_a)], mesh, end),
            [false, true] => climb(&mut [(b, pull_b)], mesh, end),
        }
    }

    /// Takes slack off the pull and moves on what slips as a whole; whether contacts have to be looked at for the rest.
    fn slide_or_wait(&mut self, mesh: &TendonMesh, end: End, pull: &mut Pull<'_>) -> bool {
        if pull.stretch_m > 0.0 {
            let slack_m = &mut self.slack_m[end as usize];
            let taken = pull.stretch_m.min(*slack_m);
            *slack_m -= taken;
            pull.stretch_m -= taken;
        }
        if pull.stretch_m == 0.0 || self.slide(mesh, pull.limits, end, pull.stretch_m) {
            return false;
        }
        self.fill_in(mesh);
        self.full_slip = None;
        true
    }

    /// Takes over what a lane of the climb has found.
    fn take_over<const SEGMENTS: usize>(
        &mut self,
        mesh: &TendonMesh,
        end: End,
        pull: &Pull<'_>,
        (climbed, lane): (&Climbed<SEGMENTS>, usize),
    ) {
        let index = end as usize;
        let n = mesh.elements;
        let from_output = end == End::Output;
        for (j, tension) in climbed.tension_n.iter().enumerate().take(n + 1) {
            self.tension_n[if from_output { n - j } else { j }] = tension.as_array_ref()[lane];
        }
        self.front[index] = n;
        self.stiffness_n_per_m[index] = climbed.stiffness_n_per_m[lane];
        self.slack_m[index] += climbed.slack_m[lane];
        let limits = pull.limits;
        let friction = [limits.wrap_friction, limits.offset_n];
        // Limits that change from step to step would end it at once.
        let steady = core::mem::replace(&mut self.friction_before, friction) == friction;
        if climbed.all_slip[lane] && steady && self.slack_m == [0.0; 2] {
            self.begin_full_slip(mesh, limits, (pull.stretch_m > 0.0) != from_output);
        }
    }

    /// Lets a far end that hangs loose slide in until it is tight or carries nothing.
    #[inline]
    fn take_in_far_end(&mut self, mesh: &TendonMesh, end: End, pull: &Pull<'_>) {
        let far = if end == End::Output { End::Input } else { End::Output };
        let loose_m = self.slack_m[far as usize];
        if pull.unilateral && loose_m > 0.0 && self.end_tension_n(mesh, far) > 0.0 {
            self.slack_m[far as usize] = 0.0;
            self.move_end_presliding(mesh, pull.limits, far, -loose_m, true, pull.presliding_m);
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
        self.full_slip = Some(FullSlip::new(towards_input, limits, [compliance_m_per_n, ratio]));
        self.inner_is_stale = true;
        self.fill_in(mesh);
        self.tension_n[0] += (length_m - self.elongation_m(mesh)) / compliance_m_per_n;
        self.inner_is_stale = true;
        self.fill_in(mesh);
    }
}

/// One or two tendons after a climb along their ladders.
struct Climbed<const SEGMENTS: usize> {
    /// Tension from the end that moved.
    tension_n: [f64x2; SEGMENTS],
    /// Slope of the tension over the move.
    stiffness_n_per_m: [f64; 2],
    /// Slack that the end has more.
    slack_m: [f64; 2],
    /// Whether all contacts are on their limit.
    all_slip: [bool; 2],
}

/// Moves the same end of one or two tendons along their ladders.
fn climb(moved: &mut [(&mut Tendon, Pull<'_>)], mesh: &TendonMesh, end: End) {
    match mesh.elements {
        n if n + 1 == SMALL[0] => climb_within::<{ SMALL[0] }, true>(moved, mesh, end),
        n if n + 1 == SMALL[1] => climb_within::<{ SMALL[1] }, true>(moved, mesh, end),
        n if n + 1 == SMALL[2] => climb_within::<{ SMALL[2] }, true>(moved, mesh, end),
        n if n < SMALL[1] => climb_within::<{ SMALL[1] }, false>(moved, mesh, end),
        n if n < SMALL[2] => climb_within::<{ SMALL[2] }, false>(moved, mesh, end),
        _ => climb_within::<{ MAX_ELEMENTS + 1 }, false>(moved, mesh, end),
    }
}

/// The same for ladders of at most `SEGMENTS` segments, with no more room than they need; where `ALL` of them are there, the passes are
/// compiled without counting.
#[inline(never)]
fn climb_within<const SEGMENTS: usize, const ALL: bool>(
    moved: &mut [(&mut Tendon, Pull<'_>)],
    mesh: &TendonMesh,
    end: End,
) {
    let (Some((a, pull_a)), Some((b, pull_b))) = (moved.first(), moved.last()) else { return };
    let climbed = passes::<SEGMENTS, ALL>([a, b], mesh, end, [pull_a, pull_b]);
    for (lane, (tendon, pull)) in moved.iter_mut().enumerate() {
        tendon.take_over(mesh, end, pull, (&climbed, lane));
        tendon.take_in_far_end(mesh, end, pull);
    }
}

/// The passes along two ladders, side by side.
fn passes<const SEGMENTS: usize, const ALL: bool>(
    tendons: [&Tendon; 2],
    mesh: &TendonMesh,
    end: End,
    pulls: [&Pull<'_>; 2],
) -> Climbed<SEGMENTS> {
    let n = if ALL { SEGMENTS - 1 } else { mesh.elements.min(SEGMENTS - 1) };
    let from_output = end == End::Output;
    let segment = |j: usize| if from_output { n - j } else { j };
    let contact = |i: usize| if from_output { n - 1 - i } else { i };
    // Lane by lane: `map` over an array is not compiled in place everywhere, and then takes as long as the passes.
    let [a, b] = pulls;
    let pull_m = f64x2::new([a.stretch_m, b.stretch_m]);
    let pulled = pull_m.cmp_gt(f64x2::ZERO);
    // No contact travels farther than the end: the chord of the exponential up to there never passes the limit.
    let decay_of =
        |pull: &Pull<'_>| mobilised(pull.stretch_m.abs() / pull.presliding_m) / pull.stretch_m.abs();
    let decay_per_m = f64x2::new([decay_of(a), decay_of(b)]);
    let [limits_a, limits_b] = [a.limits, b.limits];
    let limit = |of: [&[f64; MAX_ELEMENTS]; 2], i: usize| f64x2::new([of[0][contact(i)], of[1][contact(i)]]);

    let mut tension_n = [f64x2::ZERO; SEGMENTS];
    for (j, tension) in tension_n.iter_mut().enumerate().take(n + 1) {
        *tension = f64x2::new([tendons[0].tension_n[segment(j)], tendons[1].tension_n[segment(j)]]);
    }

    // Per contact: dT_{j+1} = slope dT_j - grip x, turned into x = share X_{j+1} dT_j, share = slope / (1 + grip X).
    let mut slopes = [f64x2::ONE; SEGMENTS];
    let mut grips = [f64x2::ZERO; SEGMENTS];
    let mut all_slip = f64x2::ZERO.cmp_ge(f64x2::ZERO);
    for i in 0..n {
        let (near, far) = (tension_n[i], tension_n[i + 1]);
        let down = limit([&limits_a.ratio, &limits_b.ratio], i);
        let up = limit([&limits_a.inverse_ratio, &limits_b.inverse_ratio], i);
        let offset = limit([&limits_a.offset_share, &limits_b.offset_share], i);
        let width = up - down;
        let range = width * near + (up + f64x2::ONE) * offset;
        let above = far - (down * near - offset);
        let gap = pulled.blend(above, range - above);
        let holds = range.cmp_gt(f64x2::ZERO) & near.cmp_gt(f64x2::ZERO);
        let place = (above / range).fast_max(f64x2::ZERO).fast_min(f64x2::ONE);
        all_slip &= holds & gap.fast_max(f64x2::ZERO - gap).cmp_le(range * both_lanes(SLIPS));
        slopes[i] = holds.blend(down + place * width, f64x2::ONE);
        grips[i] = holds.blend(gap * decay_per_m, f64x2::ZERO);
    }

    let compliance = |j: usize| both_lanes(mesh.compliance_m_per_n[segment(j)]);
    let mut denominators = [f64x2::ONE; SEGMENTS];
    let mut denominator = f64x2::ONE;
    let mut numerator = compliance(n);
    for i in (0..n).rev() {
        let (slope, grip, own) = (slopes[i], grips[i], compliance(i));
        let (behind, held) = (denominator, grip * numerator);
        // Without waiting for the new denominator: own (behind + held) + slope numerator.
        denominator = behind + held;
        let without_waiting = own * behind + (own * grip + slope) * numerator;
        let returns = behind * both_lanes(-LARGEST_RETURN);
        numerator = if returns.cmp_gt(held).any() {
            denominator = behind + held.fast_max(returns);
            own * denominator + slope * numerator
        } else {
            without_waiting
        };
        denominators[i] = denominator;
    }

    let stiffness_n_per_m = denominator / numerator;
    let mut rise_n = (pull_m * stiffness_n_per_m).to_array();
    let stiffness_n_per_m = stiffness_n_per_m.to_array();
    let mut slack_m = [0.0; 2];
    for (lane, pull) in pulls.into_iter().enumerate() {
        let tension = tension_n[0].as_array_ref()[lane];
        if pull.unilateral && tension + rise_n[lane] < 0.0 {
            slack_m[lane] = -(tension + rise_n[lane]) / stiffness_n_per_m[lane];
            rise_n[lane] = -tension;
        }
    }
    let mut scaled_rise_n = f64x2::new(rise_n) / denominator;
    if pulls.iter().any(|pull| pull.unilateral) {
        let floor_of = |pull: &Pull<'_>| if pull.unilateral { 0.0 } else { f64::NEG_INFINITY };
        let floor = f64x2::new([floor_of(a), floor_of(b)]);
        let mut slack = f64x2::new(slack_m);
        for j in 0..=n {
            let tension = tension_n[j] + scaled_rise_n * denominators[j];
            tension_n[j] = tension.fast_max(floor);
            // What a segment would push is slack instead.
            slack += (floor - tension).fast_max(f64x2::ZERO) * compliance(j);
            scaled_rise_n *= slopes[j];
        }
        slack_m = slack.to_array();
    } else {
        for j in 0..=n {
            tension_n[j] += scaled_rise_n * denominators[j];
            scaled_rise_n *= slopes[j];
        }
    }
    let all_slip = all_slip.move_mask();
    Climbed { tension_n, stiffness_n_per_m, slack_m, all_slip: [all_slip & 1 != 0, all_slip & 2 != 0] }
}

/// The same number in both lanes. Where assertions are on, [`f64x2::splat`], `from`, `abs` and products with a number go through memory,
/// as two stores that the vector's load has to wait for, which took most of the time of this file's passes. `new` stays in registers.
#[inline]
const fn both_lanes(number: f64) -> f64x2 {
    f64x2::new([number; 2])
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
    use super::{Pull, mobilised};
    use crate::sheath::{End, SlipLimits, Tendon, TendonMesh};

    /// Two tendons of different friction, pretension and slack, pulled and released until they slide, turn, hang loose and are
    /// tightened again: each does, bit for bit, what it does alone.
    #[test]
    fn a_pair_moves_as_each_of_its_tendons_alone() {
        for elements in [4, 8, 9, 16, 17, 64] {
            let mesh = TendonMesh::uniform(elements, 72_900.0).unwrap();
            let limits = [SlipLimits::new(&mesh, 0.4, 0.0), SlipLimits::new(&mesh, 0.9, 0.3)];
            let mut pair = [30.0, 12.0].map(|tension_n| Tendon::at_rest(&mesh, tension_n));
            let mut alone = pair;
            let (mut climbs, mut slack_steps) = ([0; 4], 0);
            for step in 0..4000 {
                let end = if step % 2 == 0 { End::Input } else { End::Output };
                // Drawn to and fro through their sheaths, at unequal times; b is let out at first and taken in again.
                let drawn = |period: i32| if step / period % 2 == 0 { 2e-6 } else { -2e-6 };
                let towards_input = if end == End::Input { 1.0 } else { -1.0 };
                let let_out_m = if step < 2000 { -4e-7 } else { 5e-7 };
                let stretch_m = [towards_input * drawn(500), towards_input * drawn(800) + let_out_m];
                let pulls = [0, 1].map(|lane| Pull {
                    limits: &limits[lane],
                    stretch_m: stretch_m[lane],
                    unilateral: lane == 1,
                    presliding_m: 1e-5 * (1.0 + lane as f64),
                });
                let slid = alone.map(|tendon| tendon.full_slip.is_some());
                climbs[usize::from(slid[0]) + 2 * usize::from(slid[1])] += 1;
                Tendon::move_ends_presliding(&mut pair, &mesh, end, pulls);
                for (tendon, pull) in alone.iter_mut().zip(pulls) {
                    let Pull { limits, stretch_m, unilateral, presliding_m } = pull;
                    tendon.move_end_presliding(&mesh, limits, end, stretch_m, unilateral, presliding_m);
                }
                assert_eq!(pair, alone, "{elements} contacts, step {step}");
                slack_steps += i32::from(pair[1].slack_m != [0.0; 2]);
            }
            assert!(climbs.iter().all(|steps| *steps > 0), "{elements} contacts: {climbs:?}");
            assert!(slack_steps > 100, "{elements} contacts: {slack_steps}");
        }
    }

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
