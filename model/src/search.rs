//! What a search for missing physics has to know of an effect: where it starts from, when there is hardly any of it, what is left
//! when the recordings are over, how much of it every bench has.

use crate::channel::Channel;

/// Strength, as a part of the usual one, below which an effect is not worth a name.
pub const NAMED_STRENGTH: f64 = 0.1;

/// Where a search starts from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Starts {
    /// From the usual strength, from less and from more; where friction falls with speed, at several speeds; what happens at a moment,
    /// at the moments that tell most of it.
    Usual,
    /// From strengths a third of an octave apart, up to two octaves from the usual one.
    ThirdsOfOctaves,
    /// From the usual strength at each of these values of a parameter.
    At(&'static str, &'static [f64]),
    /// From the usual strength, from less and from more at each of these values of a parameter.
    StrengthsAt(&'static str, &'static [f64]),
    /// From the pattern that is left along an angle.
    LockedTo(Channel),
    /// From what the power of the recordings, kept up, would heat the winding by.
    HeatByPower,
    /// From the mean difference of the channel.
    MeanDifference,
    /// From the largest value that the channel shows.
    LargestShown,
    /// From both ends of the joint's travel.
    EndsOfTravel,
}

/// How much of an effect every bench has, of which nobody would say that it has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ordinary {
    /// What the strengths are counted in.
    pub unit: OrdinaryUnit,
    /// Usual strength.
    pub usual: f64,
    /// Largest strength that is not worth a name.
    pub largest: f64,
    /// How many of its parameters a fit adapts, the strength first.
    pub parameters: usize,
}

/// What an ordinary strength is counted in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OrdinaryUnit {
    /// The effect's own unit, on benches with a tendon in a sheath.
    OfSheath,
    /// The same, where the friction is spread along the sheath.
    OfBends,
    /// The motor's stall torque at the input pulley.
    StallTorque,
}

/// What an effect leaves when the recordings are over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aftermath {
    /// Whether it goes on.
    pub goes_on: bool,
    /// Factor of the sheath's friction coefficient.
    pub friction_factor: f64,
    /// What the reading of its channel stays off by, SI unit of the channel.
    pub offset: f64,
}

impl Aftermath {
    /// It goes on, and nothing else.
    pub const NONE: Self = Self { goes_on: true, friction_factor: 1.0, offset: 0.0 };

    /// It has passed.
    pub const GONE: Self = Self { goes_on: false, ..Self::NONE };
}

/// Whether a strength is nearer to `neutral`, at which the effect vanishes, than [`NAMED_STRENGTH`] of the usual one.
#[must_use]
pub fn is_weak(strength: f64, neutral: f64, usual: f64) -> bool {
    (strength - neutral).abs() < NAMED_STRENGTH * (usual - neutral).abs()
}
