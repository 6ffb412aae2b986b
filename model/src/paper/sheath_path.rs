//! Integrals of the capstan solution along one sheath: `psi_p` and `psi_r` of Eq. (8)-(9).
//!
//! With k(s) the wrap angle between the input end and s, a slipping tendon has the tension `T(s) = F_in exp(∓ mu k(s))`.
//! Its stretch is the integral of that. The paper writes the integrals for curvature spread evenly; for any other
//! profile the end tensions keep their ratio, but stretch and with it (10)-(20) change. Both are offered.

use super::capstan::{friction_exponent, q_p, q_r};
use super::curvature::{Piece, Pieces, ProfilePieces, SampledPieces};
use super::error::{PaperError, not_negative, positive};

/// Wrap angle, friction and stretch integrals of one sheath; the same for both tendons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheathPath {
    length_m: f64,
    friction_coefficient: f64,
    wrap_angle_rad: f64,
    from_input: StretchLengths,
    from_output: StretchLengths,
    torque_gain: f64,
    loss_exponent: f64,
}

/// The two stretch integrals seen from one end, and their difference without cancellation.
///
/// A tendon with tension F at that end stretches like one of length `falling_m` with even tension F if its tension
/// falls away from that end, of length `rising_m` if it rises.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StretchLengths {
    /// `∫ exp(-mu k) ds`, m, 0 < `falling_m` ≤ L. Seen from the input: `psi_p`.
    pub falling_m: f64,
    /// `∫ exp(+mu k) ds`, m, ≥ L. Seen from the input: `psi_r`.
    pub rising_m: f64,
    /// `∫ 2 sinh(mu k) ds = rising_m - falling_m`, m, ≥ 0; relative error 1e-12 also where mu K is 1e-9.
    pub difference_m: f64,
}

impl StretchLengths {
    /// Start of a sum.
    const ZERO: Self = Self { falling_m: 0.0, rising_m: 0.0, difference_m: 0.0 };

    /// Adds one interval by Simpson's rule; `exponents`: mu k at its start, middle and end.
    fn add(&mut self, piece: &Piece, exponents: [f64; 3]) {
        for (exponent, weight) in exponents.into_iter().zip([1.0, 4.0, 1.0]) {
            let weight_m = piece.width_m * weight / 6.0;
            self.falling_m += weight_m * libm::exp(-exponent);
            self.rising_m += weight_m * libm::exp(exponent);
            self.difference_m += weight_m * 2.0 * libm::sinh(exponent);
        }
    }

    /// `rising_m + falling_m`, m.
    pub fn sum_m(&self) -> f64 {
        self.rising_m + self.falling_m
    }

    /// `rising_m falling_m / (rising_m + falling_m)`, m: the two tendons as springs side by side.
    pub fn parallel_m(&self) -> f64 {
        self.rising_m * self.falling_m / self.sum_m()
    }
}

impl SheathPath {
    /// Sheath with its curvature spread evenly, as in the paper.
    ///
    /// `psi_p = (L / mu K)(1 - exp(-mu K))`, `psi_r = (L / mu K)(exp(+mu K) - 1)`: both positive and equal to L at
    /// mu K = 0, where the quotient is replaced by its limit. (The paper prints `psi_r` with the opposite sign.)
    /// `length_m` L > 0; `friction_coefficient` mu ≥ 0; `wrap_angle_rad` K ≥ 0; mu K ≤ 20.
    ///
    /// # Errors
    /// [`PaperError::OutOfRange`] naming the parameter.
    pub fn uniform(
        length_m: f64,
        friction_coefficient: f64,
        wrap_angle_rad: f64,
    ) -> Result<Self, PaperError> {
        positive("length_m", length_m)?;
        let a = friction_exponent(friction_coefficient, wrap_angle_rad)?;
        let half = sinh_over_argument(0.5 * a);
        let lengths = StretchLengths {
            falling_m: length_m * expm1_over_argument(-a),
            rising_m: length_m * expm1_over_argument(a),
            difference_m: length_m * a * half * half,
        };
        Ok(Self {
            length_m,
            friction_coefficient,
            wrap_angle_rad,
            from_input: lengths,
            from_output: lengths,
            torque_gain: 1.0,
            loss_exponent: a,
        })
    }

    /// Sheath whose curvature, 1/m, is a function of the position from the input end, m; only its magnitude counts.
    ///
    /// Simpson's rule on `intervals` equal intervals (1 to 1 000 000), called six times an interval; error of fourth
    /// order for smooth profiles (test: below 1e-8 relative at 200 intervals). Jumps: see
    /// [`super::curvature::wrap_angle_of_profile_rad`].
    ///
    /// # Errors
    /// [`PaperError::OutOfRange`] naming the parameter.
    pub fn from_profile<P: Fn(f64) -> f64>(
        length_m: f64,
        friction_coefficient: f64,
        intervals: usize,
        curvature_per_m: P,
    ) -> Result<Self, PaperError> {
        Self::from_pieces(friction_coefficient, &ProfilePieces::new(length_m, intervals, &curvature_per_m)?)
    }

    /// Sheath whose curvature, 1/m, is sampled at strictly increasing positions, m, from the input to the output end.
    /// |kappa| is linear between samples; the length is last minus first position.
    ///
    /// # Errors
    /// [`PaperError::SampleCount`], [`PaperError::NotIncreasing`] or [`PaperError::OutOfRange`].
    pub fn from_samples(
        position_m: &[f64],
        curvature_per_m: &[f64],
        friction_coefficient: f64,
    ) -> Result<Self, PaperError> {
        Self::from_pieces(friction_coefficient, &SampledPieces::new(position_m, curvature_per_m)?)
    }

    fn from_pieces(friction_coefficient: f64, pieces: &impl Pieces) -> Result<Self, PaperError> {
        let mu = not_negative("friction_coefficient", friction_coefficient)?;
        let mut wrap_angle_rad = 0.0;
        for index in 0..pieces.len() {
            wrap_angle_rad += pieces.piece(index)?.wrap_rad();
        }
        let a = friction_exponent(mu, wrap_angle_rad)?;

        let mut from_input = StretchLengths::ZERO;
        let mut from_output = StretchLengths::ZERO;
        let mut passed_rad = 0.0;
        for index in 0..pieces.len() {
            let piece = pieces.piece(index)?;
            let nodes = [passed_rad, passed_rad + piece.wrap_to_middle_rad(), passed_rad + piece.wrap_rad()];
            from_input.add(&piece, nodes.map(|k| mu * k));
            from_output.add(&piece, nodes.map(|k| mu * (wrap_angle_rad - k).max(0.0)));
            passed_rad = nodes[2];
        }
        let sum_m = from_input.sum_m();
        Ok(Self {
            length_m: pieces.length_m(),
            friction_coefficient: mu,
            wrap_angle_rad,
            from_input,
            from_output,
            torque_gain: from_output.sum_m() / sum_m,
            loss_exponent: pieces.length_m() * 2.0 * libm::sinh(a) / sum_m,
        })
    }

    /// Length L, m.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Friction coefficient mu.
    pub fn friction_coefficient(&self) -> f64 {
        self.friction_coefficient
    }

    /// Wrap angle K, rad.
    pub fn wrap_angle_rad(&self) -> f64 {
        self.wrap_angle_rad
    }

    /// `mu K`.
    pub fn friction_exponent(&self) -> f64 {
        self.friction_coefficient * self.wrap_angle_rad
    }

    /// `exp(-mu K)`.
    pub fn q_p(&self) -> f64 {
        q_p(self.friction_exponent())
    }

    /// `exp(+mu K)`.
    pub fn q_r(&self) -> f64 {
        q_r(self.friction_exponent())
    }

    /// `psi_p` (falling) and `psi_r` (rising): stretch integrals that multiply a tension at the input end.
    pub fn from_input(&self) -> &StretchLengths {
        &self.from_input
    }

    /// The same integrals counted from the output end, multiplying a tension there. Equal to those from the input
    /// where the curvature is symmetric about the middle of the sheath.
    pub fn from_output(&self) -> &StretchLengths {
        &self.from_output
    }

    /// Factor g of `T_out = (r2/r1) g T_in ∓ M`, 1. Exactly 1 for the paper's even curvature and for any curvature
    /// symmetric about the middle; `cosh(mu K)` with all bends at the output end, `1 / cosh(mu K)` at the input end.
    pub fn torque_gain(&self) -> f64 {
        self.torque_gain
    }

    /// Factor x of the friction torque `M = 2 F0 r2 x`, 1. `mu K` for even curvature; `sinh(mu K)` with all bends at the
    /// output end, `tanh(mu K)` at the input end.
    pub fn loss_exponent(&self) -> f64 {
        self.loss_exponent
    }
}

/// `(e^x - 1) / x`, with its limit 1 at 0.
fn expm1_over_argument(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { libm::expm1(x) / x }
}

/// `sinh(x) / x`, with its limit 1 at 0.
fn sinh_over_argument(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { libm::sinh(x) / x }
}
