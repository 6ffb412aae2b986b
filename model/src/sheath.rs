//! A tendon in a bent sheath with friction along its length: the distributed capstan law.
//!
//! The tendon is cut into `n + 1` elastic segments by `n` contacts. Segment `j` carries the tension `T_j`; contact `i`
//! between segments `i` and `i + 1` covers the share `w_i` of the wrap angle `K` and sticks as long as
//!
//! ```text
//! e^{-μ K w_i} T_i - o_i  ≤  T_{i+1}  ≤  e^{+μ K w_i} (T_i + o_i),    o_i = q (1 - e^{-μ K w_i}) / μ
//! ```
//!
//! with friction coefficient μ and a part `q` (N/rad) that does not scale with tension; the nominal model has `q = 0`.
//! This is `dT/dφ = ±(μ T + q)` over the contact's wrap, the same seen from either end.
//! Inertia of the tendon is neglected. When an end moves, contacts slip one after the other from that end inwards: the
//! *front*. Behind the front every contact is at its limit, so the slipping tensions follow from the end tension
//! `T_j = P_j T_0 + G_j`, and `T_0` from the elongation of the slipping part, which is known because the first sticking
//! contact has not moved. One pass over the contacts finds the front, exactly and without iteration. Both ends are
//! treated in turn; for two ends that move at once this splitting is exact in full slip and of first order in the step
//! while two fronts meet (test `val_halving_the_step`).
//!
//! The state is the tension profile alone. The first and last segment have half the length of the others, so that in
//! full slip the end tensions obey Eq. (2)–(3) exactly for every `n`, and the elongation of Eq. (8)–(9) up to the
//! trapezoidal error `(μK)² / 12 n²`.
//!
//! Sources: Kaneko et al. 1991 (distributed friction, partial slip); Agrawal et al., IEEE Trans. Robot. 26 (2010) 914
//! (travelling front). The discrete front is derived in `docs/derivation.md`.

pub mod presliding;

use libm::{exp, expm1};

/// Largest number of contacts of one tendon.
pub const MAX_ELEMENTS: usize = 64;

/// End of a tendon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// At the input pulley.
    Input,
    /// At the output pulley.
    Output,
}

/// Why a tendon cannot be set up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SheathError {
    /// Number of contacts outside 1 to [`MAX_ELEMENTS`].
    Elements {
        /// Number that was asked for.
        got: usize,
    },
    /// A length, stiffness or share of curvature that is not positive and finite.
    NotPositive {
        /// Name of the quantity.
        name: &'static str,
        /// Value that was given.
        got: f64,
    },
}

impl core::fmt::Display for SheathError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Elements { got } => {
                write!(
                    f,
                    "slip elements: got {got}, expected 1 to {MAX_ELEMENTS}; use 16 unless the sheath is long"
                )
            }
            Self::NotPositive { name, got } => {
                write!(f, "{name}: got {got}, expected a positive finite number")
            }
        }
    }
}

impl core::error::Error for SheathError {}

/// Mesh of a tendon: how length and wrap angle are shared out. Configuration only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TendonMesh {
    elements: usize,
    compliance_m_per_n: [f64; MAX_ELEMENTS + 1],
    wrap_share: [f64; MAX_ELEMENTS],
    total_compliance_m_per_n: f64,
}

impl TendonMesh {
    /// Mesh of a tendon of end-to-end stiffness `EA/L` \[N/m\] with `elements` contacts and constant curvature.
    ///
    /// # Errors
    /// [`SheathError`] when a number is out of range.
    pub fn uniform(elements: usize, stiffness_n_per_m: f64) -> Result<Self, SheathError> {
        Self::with_curvature(elements, stiffness_n_per_m, |_| 1.0)
    }

    /// Mesh for a sheath whose curvature at the relative arc length `s` in `[0, 1]` (0 = input) is proportional to
    /// `curvature(s)` ≥ 0; its scale cancels, only the wrap angle sets the amount.
    ///
    /// # Errors
    /// [`SheathError`] when a number is out of range or the curvature vanishes everywhere.
    pub fn with_curvature(
        elements: usize,
        stiffness_n_per_m: f64,
        curvature: impl Fn(f64) -> f64,
    ) -> Result<Self, SheathError> {
        /// Midpoint samples of curvature per contact.
        const SAMPLES: usize = 8;
        if elements == 0 || elements > MAX_ELEMENTS {
            return Err(SheathError::Elements { got: elements });
        }
        if !(stiffness_n_per_m > 0.0 && stiffness_n_per_m.is_finite()) {
            return Err(SheathError::NotPositive { name: "tendon stiffness", got: stiffness_n_per_m });
        }
        let count = elements as f64;
        let mut wrap_share = [0.0; MAX_ELEMENTS];
        let mut sum = 0.0;
        for (contact, share) in wrap_share.iter_mut().take(elements).enumerate() {
            for sample in 0..SAMPLES {
                let s = (contact as f64 + (sample as f64 + 0.5) / SAMPLES as f64) / count;
                *share += curvature(s).max(0.0);
            }
            sum += *share;
        }
        if !(sum > 0.0 && sum.is_finite()) {
            return Err(SheathError::NotPositive { name: "integral of the curvature", got: sum });
        }
        for share in &mut wrap_share {
            *share /= sum;
        }
        let total_compliance_m_per_n = 1.0 / stiffness_n_per_m;
        let mut compliance_m_per_n = [0.0; MAX_ELEMENTS + 1];
        for value in compliance_m_per_n.iter_mut().take(elements + 1) {
            *value = total_compliance_m_per_n / count;
        }
        compliance_m_per_n[0] *= 0.5;
        compliance_m_per_n[elements] *= 0.5;
        Ok(Self { elements, compliance_m_per_n, wrap_share, total_compliance_m_per_n })
    }

    /// Mesh of a tendon of end-to-end stiffness `EA/L` \[N/m\] in a sheath that is bent evenly between two places, counted in its length
    /// from the input pulley, and straight beside both pulleys. A contact has the part of the wrap angle that lies in its part of the
    /// length, so that what is simulated follows the places without steps.
    ///
    /// # Errors
    /// [`SheathError`] when a number is out of range; the places are in order, in `[0, 1]`.
    pub fn bent_between(
        elements: usize,
        stiffness_n_per_m: f64,
        [first, last]: [f64; 2],
    ) -> Result<Self, SheathError> {
        let bent = last - first;
        if !(first >= 0.0 && last <= 1.0 && bent > 0.0) {
            return Err(SheathError::NotPositive { name: "bent share of the sheath", got: bent });
        }
        let mut mesh = Self::with_curvature(elements, stiffness_n_per_m, |_| 1.0)?;
        for (contact, wrap_share) in mesh.wrap_share.iter_mut().take(elements).enumerate() {
            let [from, to] = [contact, contact + 1].map(|border| border as f64 / elements as f64);
            *wrap_share = (to.min(last) - from.max(first)).max(0.0) / bent;
        }
        Ok(mesh)
    }

    /// Number of contacts.
    #[must_use]
    pub const fn elements(&self) -> usize {
        self.elements
    }

    /// Whether contact `i` has the wrap angle of the one before it.
    #[inline]
    fn is_as_the_contact_before(&self, i: usize) -> bool {
        i > 0 && self.wrap_share[i] == self.wrap_share[i - 1]
    }

    /// Elongation per tension of the whole tendon, L/EA, m/N.
    #[must_use]
    pub const fn total_compliance_m_per_n(&self) -> f64 {
        self.total_compliance_m_per_n
    }
}

/// Friction limits of all contacts for slip that starts at one end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipLimits {
    wrap_friction: f64,
    offset_n: f64,
    ratio: [f64; MAX_ELEMENTS],
    inverse_ratio: [f64; MAX_ELEMENTS],
    offset_share: [f64; MAX_ELEMENTS],
}

impl SlipLimits {
    /// Limits for `μK` and `qK` \[N\].
    #[must_use]
    pub fn new(mesh: &TendonMesh, wrap_friction: f64, offset_n: f64) -> Self {
        let mut limits = Self {
            wrap_friction: f64::NAN,
            offset_n: 0.0,
            ratio: [1.0; MAX_ELEMENTS],
            inverse_ratio: [1.0; MAX_ELEMENTS],
            offset_share: [0.0; MAX_ELEMENTS],
        };
        limits.set(mesh, [wrap_friction, offset_n]);
        limits
    }

    /// Replaces the limits by those for `μK` and `qK` \[N\]; costs nothing when nothing changed.
    pub fn set(&mut self, mesh: &TendonMesh, [wrap_friction, offset_n]: [f64; 2]) {
        if wrap_friction == self.wrap_friction && offset_n == self.offset_n {
            return;
        }
        let turned = wrap_friction != self.wrap_friction;
        // Mostly there is none, and was none.
        let has_offset = offset_n != 0.0 || self.offset_n != 0.0;
        for i in 0..mesh.elements {
            // Contacts of the same wrap have the same limits; an exponential takes longer than all the rest.
            if mesh.is_as_the_contact_before(i) {
                self.ratio[i] = self.ratio[i - 1];
                self.inverse_ratio[i] = self.inverse_ratio[i - 1];
                self.offset_share[i] = self.offset_share[i - 1];
                continue;
            }
            let wrap_share = mesh.wrap_share[i];
            if turned {
                self.ratio[i] = exp(-wrap_friction * wrap_share);
                self.inverse_ratio[i] = 1.0 / self.ratio[i];
            }
            if has_offset {
                self.offset_share[i] = contact_offset_n(wrap_friction, offset_n, wrap_share);
            }
        }
        (self.wrap_friction, self.offset_n) = (wrap_friction, offset_n);
    }

    /// Takes the limits of another end or tendon in the same mesh, if they are for this friction; otherwise they are set anew. Limits that
    /// change at every step are mostly the same for both tendons.
    pub(crate) fn set_beside(&mut self, mesh: &TendonMesh, friction: [f64; 2], other: &Self) {
        let n = mesh.elements;
        if friction == [other.wrap_friction, other.offset_n]
            && friction != [self.wrap_friction, self.offset_n]
        {
            self.ratio[..n].copy_from_slice(&other.ratio[..n]);
            self.inverse_ratio[..n].copy_from_slice(&other.inverse_ratio[..n]);
            self.offset_share[..n].copy_from_slice(&other.offset_share[..n]);
            [self.wrap_friction, self.offset_n] = friction;
        } else {
            self.set(mesh, friction);
        }
    }
}

/// `o = q K w (1 - e^{-x}) / x`, `x = μ K w`: what a contact holds at zero tension behind it, N.
fn contact_offset_n(wrap_friction: f64, offset_n: f64, share: f64) -> f64 {
    let x = wrap_friction * share;
    if offset_n == 0.0 || x < 1e-12 { offset_n * share } else { -offset_n * share * expm1(-x) / x }
}

/// A tendon whose contacts all slip the same way: the profile is known from one end.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FullSlip {
    towards_input: bool,
    wrap_friction: f64,
    offset_n: f64,
    /// Elongation of the whole tendon per input tension, m/N.
    compliance_m_per_n: f64,
    /// Output tension per input tension, slope.
    ratio: f64,
    /// Slope of the tension of each end over a move of it, N/m.
    stiffness_n_per_m: [f64; 2],
}

impl FullSlip {
    fn new(towards_input: bool, limits: &SlipLimits, [compliance_m_per_n, ratio]: [f64; 2]) -> Self {
        Self {
            towards_input,
            wrap_friction: limits.wrap_friction,
            offset_n: limits.offset_n,
            compliance_m_per_n,
            ratio,
            stiffness_n_per_m: [1.0 / compliance_m_per_n, ratio / compliance_m_per_n],
        }
    }
}

/// Tension profile of one tendon: state only.
///
/// While all contacts slip the same way only the end tensions are kept up to date, so that a step costs the same for
/// any number of contacts; the inner profile is filled in when the motion turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tendon {
    tension_n: [f64; MAX_ELEMENTS + 1],
    full_slip: Option<FullSlip>,
    inner_is_stale: bool,
    slack_m: [f64; 2],
    /// Contacts that slipped at the last move of the input and of the output end.
    front: [usize; 2],
    /// Slope dT/du of the end tensions at their last move, N/m.
    stiffness_n_per_m: [f64; 2],
    /// `μK` and `qK` \[N\] at the last move of contacts that give way.
    friction_before: [f64; 2],
}

impl Tendon {
    /// Tendon with the same tension everywhere, as after a relaxed assembly.
    #[must_use]
    pub fn at_rest(mesh: &TendonMesh, tension_n: f64) -> Self {
        let mut profile = [0.0; MAX_ELEMENTS + 1];
        profile[..=mesh.elements].fill(tension_n);
        let end_stiffness = 1.0 / mesh.compliance_m_per_n[0];
        Self {
            tension_n: profile,
            full_slip: None,
            inner_is_stale: false,
            slack_m: [0.0; 2],
            front: [0; 2],
            stiffness_n_per_m: [end_stiffness; 2],
            friction_before: [-1.0; 2],
        }
    }

    /// Tension at an end, N.
    #[must_use]
    pub fn end_tension_n(&self, mesh: &TendonMesh, end: End) -> f64 {
        match end {
            End::Input => self.tension_n[0],
            End::Output => self.tension_n[mesh.elements],
        }
    }

    /// Tension of segment `j` from the input, N, for `j` from 0 to the number of contacts.
    #[must_use]
    pub fn tension_n(&self, mesh: &TendonMesh, j: usize) -> f64 {
        let mut filled = *self;
        filled.fill_in(mesh);
        filled.tension_n[j.min(mesh.elements)]
    }

    /// Contacts that slipped when this end last moved; all of them in full slip.
    #[must_use]
    pub const fn front(&self, end: End) -> usize {
        self.front[end as usize]
    }

    /// Slope of the end tension over a move of that end, N/m, from its last move.
    #[must_use]
    pub const fn end_stiffness_n_per_m(&self, end: End) -> f64 {
        self.stiffness_n_per_m[end as usize]
    }

    /// Elongation against the unloaded tendon, m: `Σ T_j c_j`, less what hangs slack.
    #[must_use]
    pub fn elongation_m(&self, mesh: &TendonMesh) -> f64 {
        let mut filled = *self;
        filled.fill_in(mesh);
        let stretched: f64 = filled.tension_n[..=mesh.elements]
            .iter()
            .zip(&mesh.compliance_m_per_n)
            .map(|(tension, compliance)| tension * compliance)
            .sum();
        stretched - self.slack_m[0] - self.slack_m[1]
    }

    /// Makes the unloaded tendon longer by `length_m` at fixed ends, evenly along its length; shortening takes up slack
    /// first.
    pub fn add_length(&mut self, mesh: &TendonMesh, mut length_m: f64) {
        for slack_m in &mut self.slack_m {
            let taken = slack_m.min(-length_m).max(0.0);
            *slack_m -= taken;
            length_m += taken;
        }
        self.fill_in(mesh);
        self.full_slip = None;
        let drop_n = length_m / mesh.total_compliance_m_per_n;
        for tension in &mut self.tension_n[..=mesh.elements] {
            *tension -= drop_n;
        }
    }

    /// Moves one end by `pull_m` (positive stretches the tendon) and lets contacts slip where they must.
    ///
    /// With `unilateral` the end tension stops at zero and the tendon goes slack instead of pushing; without it the
    /// tension may become negative, and a part that pushes carries no friction.
    pub fn move_end(
        &mut self,
        mesh: &TendonMesh,
        limits: &SlipLimits,
        end: End,
        pull_m: f64,
        unilateral: bool,
    ) {
        if self.slide(mesh, limits, end, pull_m) {
            return;
        }
        self.fill_in(mesh);
        match end {
            End::Input => self.sweep::<false>(mesh, limits, pull_m, unilateral),
            End::Output => self.sweep::<true>(mesh, limits, pull_m, unilateral),
        }
    }

    /// Continues full slip in the same direction, if that is what the move does.
    fn slide(&mut self, mesh: &TendonMesh, limits: &SlipLimits, end: End, pull_m: f64) -> bool {
        let Some(full) = &self.full_slip else { return false };
        let towards_input = (end == End::Input) == (pull_m >= 0.0);
        if full.towards_input != towards_input
            || full.wrap_friction != limits.wrap_friction
            || full.offset_n != limits.offset_n
        {
            return false;
        }
        let rise_n = pull_m / full.compliance_m_per_n;
        let input_n = self.tension_n[0] + rise_n;
        let output_n = self.tension_n[mesh.elements] + full.ratio * rise_n;
        if input_n <= 0.0 || output_n <= 0.0 {
            return false;
        }
        self.stiffness_n_per_m[end as usize] = full.stiffness_n_per_m[end as usize];
        self.front[end as usize] = mesh.elements;
        self.tension_n[0] = input_n;
        self.tension_n[mesh.elements] = output_n;
        self.inner_is_stale = true;
        true
    }

    /// Writes the inner profile of a tendon in full slip, where it is stale.
    #[inline]
    fn fill_in(&mut self, mesh: &TendonMesh) {
        if self.inner_is_stale {
            self.fill_in_stale(mesh);
        }
    }

    fn fill_in_stale(&mut self, mesh: &TendonMesh) {
        let Some(full) = self.full_slip else { return };
        let sign = if full.towards_input { -1.0 } else { 1.0 };
        let (mut step, mut offset) = (1.0, 0.0);
        let mut tension = self.tension_n[0];
        for i in 0..mesh.elements {
            if !mesh.is_as_the_contact_before(i) {
                let share = mesh.wrap_share[i];
                step = exp(sign * full.wrap_friction * share);
                offset = contact_offset_n(full.wrap_friction, full.offset_n, share);
            }
            tension = if full.towards_input { step * tension - offset } else { step * (tension + offset) };
            self.tension_n[i + 1] = tension;
        }
        self.inner_is_stale = false;
    }

    fn sweep<const FROM_OUTPUT: bool>(
        &mut self,
        mesh: &TendonMesh,
        limits: &SlipLimits,
        mut pull_m: f64,
        unilateral: bool,
    ) {
        let n = mesh.elements.min(MAX_ELEMENTS);
        let end = usize::from(FROM_OUTPUT);
        let segment = |j: usize| if FROM_OUTPUT { n - j } else { j };
        let contact = |i: usize| if FROM_OUTPUT { n - 1 - i } else { i };

        self.full_slip = None;
        if unilateral && self.slack_m[end] > 0.0 && pull_m > 0.0 {
            let taken = pull_m.min(self.slack_m[end]);
            self.slack_m[end] -= taken;
            pull_m -= taken;
        }
        let pulled = pull_m >= 0.0;
        let steps = if pulled { &limits.ratio } else { &limits.inverse_ratio };
        let offset_n = |i: usize, step: f64| {
            let offset = limits.offset_share[contact(i)];
            if pulled { -offset } else { step * offset }
        };

        // Of the slipping part: elongation, and compliance sums of P_j and G_j; T_0 = (elongation - h) / s.
        let first_compliance = mesh.compliance_m_per_n[segment(0)];
        let mut elongation_m = first_compliance * self.tension_n[segment(0)] + pull_m;
        let (mut s, mut h) = (first_compliance, 0.0);
        let (mut p, mut g) = (1.0, 0.0);
        let mut front = 0;
        while front < n {
            let next = self.tension_n[segment(front + 1)];
            let step = steps[contact(front)];
            let offset = offset_n(front, step);
            // Tension behind the front, times s > 0, which saves a division per contact.
            let limit_s = step * (p * (elongation_m - h) + g * s) + offset * s;
            let sticks = if pulled { limit_s <= next * s } else { limit_s >= next * s };
            if sticks {
                break;
            }
            front += 1;
            p *= step;
            g = g * step + offset;
            let compliance = mesh.compliance_m_per_n[segment(front)];
            s += compliance * p;
            h += compliance * g;
            elongation_m += compliance * next;
        }
        self.front[end] = front;
        self.stiffness_n_per_m[end] = 1.0 / s;
        let other = usize::from(!FROM_OUTPUT);
        if front == n && unilateral && self.slack_m[other] > 0.0 {
            // The pull has reached the other end, where the tendon hangs loose: that is taken up before the end tightens.
            let other_tension_n = p * ((elongation_m - h) / s) + g;
            let taken = (other_tension_n * s / p).clamp(0.0, self.slack_m[other]);
            self.slack_m[other] -= taken;
            elongation_m -= taken;
        }
        let mut tension = (elongation_m - h) / s;
        if tension < 0.0 {
            if !unilateral {
                // A tendon that pushes has lost its contact with the inner bend: the slipping part evens out.
                let compliance: f64 = (0..=front).map(|j| mesh.compliance_m_per_n[segment(j)]).sum();
                for j in 0..=front {
                    self.tension_n[segment(j)] = elongation_m / compliance;
                }
                return;
            }
            self.slack_m[end] += h - elongation_m;
            tension = 0.0;
        } else if front == n && self.slack_m == [0.0; 2] {
            let from_input = if FROM_OUTPUT { [s / p, 1.0 / p] } else { [s, p] };
            self.full_slip = Some(FullSlip::new(pulled != FROM_OUTPUT, limits, from_input));
            self.inner_is_stale = false;
        }
        self.tension_n[segment(0)] = tension;
        for i in 0..front {
            let step = steps[contact(i)];
            tension = step * tension + offset_n(i, step);
            self.tension_n[segment(i + 1)] = tension;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{SlipLimits, TendonMesh};

    /// Every contact by its own wrap, whatever its neighbours have and whatever was set before; beside another's limits they are the same.
    #[test]
    fn limits_are_those_of_the_wrap_of_each_contact() {
        let meshes = [
            TendonMesh::uniform(4, 7e4),
            TendonMesh::bent_between(5, 7e4, [0.1, 0.7]),
            TendonMesh::with_curvature(4, 7e4, |s| s * s),
        ];
        for mesh in meshes.map(Result::unwrap) {
            let mut limits = SlipLimits::new(&mesh, 0.3, 0.0);
            let mut beside = limits;
            for friction in [[0.5, 0.0], [0.5, 2.0], [0.7, 2.0], [0.7, 0.0], [0.2, 0.0]] {
                let [wrap_friction, offset_n] = friction;
                limits.set(&mesh, friction);
                beside.set_beside(&mesh, friction, &limits);
                assert_eq!(beside, limits);
                for i in 0..mesh.elements() {
                    let x = wrap_friction * mesh.wrap_share[i];
                    let offset = if x > 0.0 { offset_n * (1.0 - libm::exp(-x)) / wrap_friction } else { 0.0 };
                    let got = [limits.ratio[i], limits.inverse_ratio[i], limits.offset_share[i]];
                    for (got, expected) in got.into_iter().zip([libm::exp(-x), libm::exp(x), offset]) {
                        assert!(
                            (got - expected).abs() < 1e-12,
                            "contact {i}, {friction:?}: {got}, {expected}"
                        );
                    }
                }
                // Of another friction nothing is taken over.
                let mut other = SlipLimits::new(&mesh, 0.9, 1.0);
                other.set_beside(&mesh, [0.1, 0.0], &limits);
                assert!((other.ratio[0] - libm::exp(-0.1 * mesh.wrap_share[0])).abs() < 1e-12);
            }
        }
    }
}
