//! Closed forms: how a law depends on its variable.

use core::f64::consts::PI;

use libm::{cos, exp, pow, sin};

use crate::effect::{EffectState, MAX_PARAMETERS};

/// How a law depends on its variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// `a sign(x) abs(x)^p`, parameters `a`, `p`.
    Power,
    /// `a abs(x)^p`, parameters `a`, `p`.
    EvenPower,
    /// `a (1 + s sign(x)) abs(x)^p`: not the same in both directions, parameters `a`, `p`, `s`.
    DirectedPower,
    /// `a sign(x)`, parameter `a`.
    Sign,
    /// `a (abs(x)^p - 1)`: zero at `x = 1`, parameters `a`, `p`.
    PowerFromOne,
    /// `a sin(n x + phase)`, parameters `a`, `n`, `phase`.
    Wave,
    /// `a sin(2 pi f x + phase)`, parameters `a`, `f`, `phase`.
    Oscillation,
    /// `a exp(-abs((x - at) / width)^s)`, parameters `a`, `at`, `width`, `s`: round with `s = 2`, flat with steep edges with more. A law
    /// without `s` has 2.
    Bump,
    /// `a x`, parameter `a`.
    Ramp,
    /// `a x^2`, parameter `a`.
    Square,
    /// `a x abs(x)`, parameter `a`.
    SignedSquare,
    /// `a (1 - exp(-x / time_constant))`, parameters `a`, `time_constant`.
    Decay,
    /// `-a z` with `dz = (1 - z sign(dx)) dx / width`, parameters `a`, `width`; it remembers the way to `x`.
    ///
    /// Source: Dahl, AIAA J. 14 (1976) 1675, with exponent 1.
    Hysteresis,
}

impl Form {
    /// The formula at `x`; 0 for one that remembers the way there, see [`Form::remembered`].
    #[must_use]
    pub fn value(self, p: &[f64; MAX_PARAMETERS], x: f64) -> f64 {
        match self {
            Self::Power => p[0] * pow(x.abs(), p[1]).copysign(x),
            Self::EvenPower => p[0] * pow(x.abs(), p[1]),
            Self::DirectedPower => p[0] * (1.0 + p[2] * direction(x)) * pow(x.abs(), p[1]),
            Self::Sign => p[0] * direction(x),
            Self::PowerFromOne => p[0] * (pow(x.abs(), p[1]) - 1.0),
            Self::Wave => p[0] * sin(p[1] * x + p[2]),
            Self::Oscillation => p[0] * sin(2.0 * PI * p[1] * x + p[2]),
            Self::Bump => {
                let place = (x - p[1]) / p[2];
                p[0] * exp(-pow(place.abs(), if p[3] == 0.0 { 2.0 } else { p[3] }))
            }
            Self::Ramp => p[0] * x,
            Self::Square => p[0] * x * x,
            Self::SignedSquare => p[0] * x * x.abs(),
            Self::Decay => p[0] * (1.0 - exp(-x.max(0.0) / p[1])),
            Self::Hysteresis => 0.0,
        }
    }

    /// The formula at `x`, which it has reached by the way that `memory` tells; the way begins where it is first asked.
    pub fn remembered(self, p: &[f64; MAX_PARAMETERS], memory: &mut EffectState, x: f64) -> f64 {
        if self != Self::Hysteresis {
            return self.value(p, x);
        }
        let [z, last, begun, ..] = memory;
        let dx = if *begun == 0.0 { 0.0 } else { x - *last };
        (*last, *begun) = (x, 1.0);
        // Exact for any turn that goes one way: 1 - z sign(dx) falls by exp(-|dx| / width).
        let way = dx.signum();
        *z = way - (way - *z) * exp(-dx.abs() / p[1]);
        -p[0] * *z
    }

    /// Integral of the formula from 0 to `x`, for the forms that a radius may have; 0 for the others.
    #[must_use]
    pub fn integral(self, p: &[f64; MAX_PARAMETERS], x: f64) -> f64 {
        match self {
            Self::Wave => p[0] / p[1] * (cos(p[2]) - cos(p[1] * x + p[2])),
            Self::Ramp => 0.5 * p[0] * x * x,
            _ => 0.0,
        }
    }

    /// How what depends on it behaves, for a sentence.
    #[must_use]
    pub const fn behaviour(self) -> &'static str {
        match self {
            Self::Power | Self::EvenPower => "grows with a power of",
            Self::DirectedPower | Self::Sign => "is not the same for both signs of",
            Self::PowerFromOne => "changes with a power of",
            Self::Wave => "repeats along",
            Self::Oscillation => "oscillates over",
            Self::Bump => "is confined to one place of",
            Self::Ramp => "grows in proportion to",
            Self::Square | Self::SignedSquare => "grows with the square of",
            Self::Decay => "sets in exponentially over",
            Self::Hysteresis => "remembers the last reversal of",
        }
    }
}

/// Sign of `x`, 0 at 0.
fn direction(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}
