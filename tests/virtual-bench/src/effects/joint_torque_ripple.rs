//! Outside the catalogue: a bearing of the joint whose balls have dented the race at rest.

use std::f64::consts::PI;

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;

/// Torque on the arm that is locked to its angle: `peak · sin(n·theta_out + phase)`.
#[derive(Debug, Clone, PartialEq)]
pub struct JointTorqueRipple {
    /// Largest torque \[Nm\].
    pub peak_nm: f64,
    /// Periods a turn of the joint, n \[1\].
    pub cycles_per_turn: f64,
    /// Phase at theta = 0 \[rad\].
    pub phase_rad: f64,
}

impl Describe for JointTorqueRipple {
    const COMPONENT: Component = Component::Joint;
    const OUTSIDE_CATALOGUE: bool = true;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self {
            peak_nm: 0.12 * strength * draw.uniform(0.85, 1.2),
            cycles_per_turn: draw.one_of(&[16.0, 20.0, 27.0, 36.0]),
            phase_rad: draw.uniform(-PI, PI),
        }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("peak_nm", self.peak_nm.into()),
            ("cycles_per_turn", self.cycles_per_turn.into()),
            ("phase_rad", self.phase_rad.into()),
        ]
    }
}

impl JointTorqueRipple {
    /// Torque on the arm \[Nm\].
    pub(crate) fn torque_nm(&self, theta_rad: f64) -> f64 {
        self.peak_nm * (self.cycles_per_turn * theta_rad + self.phase_rad).sin()
    }
}
