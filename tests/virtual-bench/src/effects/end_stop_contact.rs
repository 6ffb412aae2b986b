//! The arm touches a stop within the range of motion.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// Rubber stop (Hunt-Crossley): `torque = −k·d^1.5·(1 + damping·dd/dt)`, d the depth, never pulling.
///
/// It stands at `side · angle_rad`.
#[derive(Debug, Clone, PartialEq)]
pub struct EndStopContact {
    /// Where the contact begins, above 0 \[rad\].
    pub angle_rad: f64,
    /// +1 or −1.
    pub side: f64,
    /// k \[Nm/rad^1.5\].
    pub stiffness_nm_per_rad_1_5: f64,
    /// Relative damping \[s/rad\].
    pub damping_s_per_rad: f64,
}

impl Describe for EndStopContact {
    const COMPONENT: Component = Component::Joint;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self {
            angle_rad: draw.uniform(0.35, 0.5),
            side: draw.sign(),
            stiffness_nm_per_rad_1_5: 10.0 * strength * draw.uniform(0.85, 1.2),
            damping_s_per_rad: draw.uniform(0.1, 0.4),
        }
    }

    fn resize(&mut self, size: &Size) {
        self.stiffness_nm_per_rad_1_5 *= size.torque;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("angle_rad", self.angle_rad.into()), ("side", self.side.into()), ("stiffness_nm_per_rad_1_5", self.stiffness_nm_per_rad_1_5.into()), ("damping_s_per_rad", self.damping_s_per_rad.into())]
    }
}

impl EndStopContact {
    /// Torque on the arm \[Nm\].
    pub(crate) fn torque_nm(&self, theta_rad: f64, omega_rad_per_s: f64) -> f64 {
        let depth = self.side * theta_rad - self.angle_rad;
        if depth <= 0.0 {
            return 0.0;
        }
        let rate = self.side * omega_rad_per_s;
        let push = self.stiffness_nm_per_rad_1_5 * depth * depth.sqrt() * (1.0 + self.damping_s_per_rad * rate);
        -self.side * push.max(0.0)
    }
}
