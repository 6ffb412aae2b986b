//! Outside the catalogue: pulleys that are not round and sheath friction that varies in ways no listed effect gives, of a kind
//! that the seed draws.

use std::f64::consts::PI;

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;

/// What varies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TransmissionLaw {
    /// Radius of the output pulley, with its angle.
    OutputLobes,
    /// Radius of the input pulley, with its angle.
    InputLobes,
    /// Friction coefficient, higher within a short range of the input angle.
    RoughRange,
    /// Friction coefficient, with a power of the tension over the pretension.
    Load,
    /// Friction coefficient, that falls to a lower value as the sheaths run in.
    RunningIn,
}

/// A variation of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct UnlistedTransmission {
    /// Kind.
    pub law: TransmissionLaw,
    /// Relative size \[1\]; the exponent for [`TransmissionLaw::Load`].
    pub size: f64,
    /// Lobes \[1\], place \[rad\] or time constant \[s\], where the kind has one.
    pub place: f64,
    /// Phase of the lobes \[rad\].
    pub phase_rad: f64,
}

impl Describe for UnlistedTransmission {
    const COMPONENT: Component = Component::Transmission;
    const OUTSIDE_CATALOGUE: bool = true;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        let law = draw.one_of(&[
            TransmissionLaw::OutputLobes,
            TransmissionLaw::InputLobes,
            TransmissionLaw::RoughRange,
            TransmissionLaw::Load,
            TransmissionLaw::RunningIn,
        ]);
        let (size, place) = match law {
            TransmissionLaw::OutputLobes | TransmissionLaw::InputLobes => {
                (0.1, draw.one_of(&[4.0, 6.0, 9.0]))
            }
            TransmissionLaw::RoughRange => (1.2, draw.sign() * draw.uniform(0.05, 0.35)),
            TransmissionLaw::Load => (-0.6, 0.0),
            TransmissionLaw::RunningIn => (-0.4, draw.uniform(4.0, 12.0)),
        };
        let phase_rad = draw.uniform(-PI, PI);
        Self { law, size: strength * size * draw.uniform(0.85, 1.2), place, phase_rad }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("law", format!("{:?}", self.law).into()),
            ("size", self.size.into()),
            ("place", self.place.into()),
            ("phase_rad", self.phase_rad.into()),
        ]
    }
}

impl UnlistedTransmission {
    /// Angle to which a round pulley would have to turn to wind as much, and its rate \[rad, rad/s\].
    pub(crate) fn wound(&self, law: TransmissionLaw, theta_rad: f64, omega_rad_per_s: f64) -> (f64, f64) {
        if self.law != law {
            return (theta_rad, omega_rad_per_s);
        }
        let excess = self.size / self.place * (self.phase_rad.cos() - (self.place * theta_rad + self.phase_rad).cos());
        (theta_rad + excess, omega_rad_per_s * self.radius_ratio(law, theta_rad))
    }

    /// Radius over that of the round pulley \[1\].
    pub(crate) fn radius_ratio(&self, law: TransmissionLaw, theta_rad: f64) -> f64 {
        if self.law == law { 1.0 + self.size * (self.place * theta_rad + self.phase_rad).sin() } else { 1.0 }
    }

    /// Friction coefficient over the nominal one \[1\].
    pub(crate) fn friction_factor(&self, theta_in_rad: f64, tension_ratio: f64, clock_s: f64) -> f64 {
        match self.law {
            TransmissionLaw::RoughRange => 1.0 + self.size / (1.0 + ((theta_in_rad - self.place) / 0.1).powi(4)),
            TransmissionLaw::Load => tension_ratio.max(0.05).powf(self.size),
            TransmissionLaw::RunningIn => 1.0 + self.size * (1.0 - (-clock_s / self.place).exp()),
            TransmissionLaw::OutputLobes | TransmissionLaw::InputLobes => 1.0,
        }
    }
}
