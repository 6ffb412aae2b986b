//! Capstan ratios of the two tendons: Eq. (2)-(3), for both directions of motion.
//!
//! With s from the input (0) to the output end (L) and slip everywhere, `dT/ds = -mu kappa T` where the tendon slips
//! towards the input and `dT/ds = +mu kappa T` where it slips towards the output. The ratio of the end tensions depends
//! on mu K alone, not on where along the sheath the bends are.

use super::error::{PaperError, not_negative, within};

/// Largest `mu K` that is accepted: beyond it one tendon end carries 5e8 times the other.
pub const FRICTION_EXPONENT_MAX: f64 = 20.0;

/// Direction in which both pulleys turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Towards +theta, the paper's clockwise: cable a hauls.
    Positive,
    /// Towards -theta: cable b hauls.
    Negative,
}

impl Direction {
    /// Direction of a speed, rad/s; none at 0 and for a speed that is not a number.
    pub fn of_speed(speed_rad_s: f64) -> Option<Self> {
        if speed_rad_s > 0.0 {
            Some(Self::Positive)
        } else if speed_rad_s < 0.0 {
            Some(Self::Negative)
        } else {
            None
        }
    }

    /// +1 or -1.
    pub fn sign(self) -> f64 {
        match self {
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }

    /// The other direction.
    #[must_use]
    pub fn reversed(self) -> Self {
        match self {
            Self::Positive => Self::Negative,
            Self::Negative => Self::Positive,
        }
    }

    /// Where cable a slips when the pulleys turn this way: it is wound on at the input for +theta.
    pub fn slip_of_cable_a(self) -> SlipToward {
        match self {
            Self::Positive => SlipToward::Input,
            Self::Negative => SlipToward::Output,
        }
    }

    /// Where cable b slips when the pulleys turn this way: always opposite to cable a.
    pub fn slip_of_cable_b(self) -> SlipToward {
        self.reversed().slip_of_cable_a()
    }
}

/// End of the sheath towards which a tendon slips through it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlipToward {
    /// Slips towards the input: tension falls from input to output.
    Input,
    /// Slips towards the output: tension rises from input to output.
    Output,
}

/// `mu K`, exponent of the capstan ratio, 1.
///
/// `friction_coefficient` mu ≥ 0; `wrap_angle_rad` K ≥ 0, rad; product at most [`FRICTION_EXPONENT_MAX`].
///
/// # Errors
/// [`PaperError::OutOfRange`] naming the parameter.
pub fn friction_exponent(friction_coefficient: f64, wrap_angle_rad: f64) -> Result<f64, PaperError> {
    let exponent = not_negative("friction_coefficient", friction_coefficient)?
        * not_negative("wrap_angle_rad", wrap_angle_rad)?;
    within("friction_coefficient * wrap_angle_rad", exponent, 0.0, FRICTION_EXPONENT_MAX, "0 to 20")
}

/// `Q_p = exp(-mu K)`: output over input tension of a tendon that slips towards the input, 0 < `Q_p` ≤ 1. Eq. (2), with
/// K for the printed Theta.
pub fn q_p(friction_exponent: f64) -> f64 {
    libm::exp(-friction_exponent)
}

/// `Q_r = exp(+mu K)`: output over input tension of a tendon that slips towards the output, `Q_r` ≥ 1. Eq. (3), with K
/// for the printed Theta.
pub fn q_r(friction_exponent: f64) -> f64 {
    libm::exp(friction_exponent)
}

/// Tension at the output end, N, from that at the input end, N: Eq. (2) for slip towards the input, Eq. (3) towards the
/// output.
pub fn output_tension_n(input_tension_n: f64, friction_exponent: f64, slip: SlipToward) -> f64 {
    input_tension_n
        * match slip {
            SlipToward::Input => q_p(friction_exponent),
            SlipToward::Output => q_r(friction_exponent),
        }
}

/// Tension at the input end, N, from that at the output end, N: Eq. (2)-(3) solved for `F1` or `F3`.
pub fn input_tension_n(output_tension_n: f64, friction_exponent: f64, slip: SlipToward) -> f64 {
    output_tension_n
        * match slip {
            SlipToward::Input => q_r(friction_exponent),
            SlipToward::Output => q_p(friction_exponent),
        }
}
