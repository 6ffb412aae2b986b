//! What the functions of the paper refuse, and why.

use core::fmt;

/// Why a parameter or an input was refused. Carries what came, what is allowed and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PaperError {
    /// A number is outside its range, or not finite.
    OutOfRange {
        /// Name of the parameter, with its unit.
        parameter: &'static str,
        /// The value that came.
        got: f64,
        /// The range it has to lie in.
        allowed: &'static str,
    },
    /// A curvature profile has fewer samples than an integral needs, or positions and curvatures differ in number.
    SampleCount {
        /// Number of positions.
        positions: usize,
        /// Number of curvatures.
        curvatures: usize,
    },
    /// The positions of a curvature profile do not increase.
    NotIncreasing {
        /// Index of the offending position, counted from 0.
        index: usize,
        /// The position before it, m.
        previous_m: f64,
        /// The position itself, m.
        got_m: f64,
    },
    /// The curvature profile and the tendon disagree on the length.
    LengthMismatch {
        /// Length of the profile, m.
        path_m: f64,
        /// Length of the tendon, m.
        tendon_m: f64,
    },
}

impl fmt::Display for PaperError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange { parameter, got, allowed } => {
                write!(f, "{parameter} is {got}, allowed: {allowed}; correct it at its source")
            }
            Self::SampleCount { positions, curvatures } => write!(
                f,
                "curvature profile has {positions} positions and {curvatures} curvatures, needed: the same number of both, \
                 2 or more; add the missing samples"
            ),
            Self::NotIncreasing { index, previous_m, got_m } => write!(
                f,
                "curvature profile: position {index} is {got_m} m after {previous_m} m, needed: strictly increasing and \
                 finite; sort the samples by position and drop repeats"
            ),
            Self::LengthMismatch { path_m, tendon_m } => write!(
                f,
                "curvature profile is {path_m} m long, the tendon {tendon_m} m, needed: equal within 1e-6 of the length; \
                 give the profile over the whole tendon"
            ),
        }
    }
}

impl core::error::Error for PaperError {}

/// `value` if it is finite and within `low..=high`, else [`PaperError::OutOfRange`].
pub(crate) fn within(
    parameter: &'static str,
    value: f64,
    low: f64,
    high: f64,
    allowed: &'static str,
) -> Result<f64, PaperError> {
    if value.is_finite() && value >= low && value <= high {
        Ok(value)
    } else {
        Err(PaperError::OutOfRange { parameter, got: value, allowed })
    }
}

/// `value` if it is finite and above zero.
pub(crate) fn positive(parameter: &'static str, value: f64) -> Result<f64, PaperError> {
    within(parameter, value, f64::MIN_POSITIVE, f64::MAX, "finite and above 0")
}

/// `value` if it is finite and not negative.
pub(crate) fn not_negative(parameter: &'static str, value: f64) -> Result<f64, PaperError> {
    within(parameter, value, 0.0, f64::MAX, "finite and at least 0")
}

/// `value` if it is finite.
pub(crate) fn finite(parameter: &'static str, value: f64) -> Result<f64, PaperError> {
    within(parameter, value, f64::MIN, f64::MAX, "finite")
}
