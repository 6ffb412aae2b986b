//! Magnetic detent of the motor: torque that depends on its position.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

use std::f64::consts::PI;

/// Cogging torque seen at the input pulley: `amplitude · (sin x + h sin 2x + g sin 3x)`, `x = n·theta + phase`.
#[derive(Debug, Clone, PartialEq)]
pub struct MotorCogging {
    /// Amplitude of the fundamental \[Nm\].
    pub amplitude_nm: f64,
    /// Periods a turn of the input pulley, n \[1\].
    pub cycles_per_turn: f64,
    /// Phase at theta = 0 \[rad\].
    pub phase_rad: f64,
    /// Amplitude of the second harmonic over the first, h \[1\].
    pub second_harmonic: f64,
    /// Amplitude of the third harmonic over the first, g; 0 where the effect is drawn \[1\].
    pub third_harmonic: f64,
}

impl Describe for MotorCogging {
    const COMPONENT: Component = Component::Motor;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self {
            amplitude_nm: 0.1 * strength * draw.uniform(0.85, 1.2),
            cycles_per_turn: draw.one_of(&[24.0, 30.0, 40.0, 48.0]),
            phase_rad: draw.uniform(-PI, PI),
            second_harmonic: draw.uniform(0.0, 0.25),
            third_harmonic: 0.0,
        }
    }

    fn resize(&mut self, size: &Size) {
        self.amplitude_nm *= size.torque;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("amplitude_nm", self.amplitude_nm.into()), ("cycles_per_turn", self.cycles_per_turn.into()), ("phase_rad", self.phase_rad.into()), ("second_harmonic", self.second_harmonic.into()), ("third_harmonic", self.third_harmonic.into())]
    }
}

impl MotorCogging {
    /// Torque on the rotor, seen at the input pulley \[Nm\].
    pub(crate) fn torque_nm(&self, theta_rad: f64) -> f64 {
        let (sin, cos) = (self.cycles_per_turn * theta_rad + self.phase_rad).sin_cos();
        let third = sin * (3.0 - 4.0 * sin * sin);
        self.amplitude_nm * (sin + self.second_harmonic * 2.0 * sin * cos + self.third_harmonic * third)
    }
}
