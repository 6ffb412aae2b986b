//! Outside the catalogue: a magnetic latch that holds the arm near one angle.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;

/// Torque of a magnet near `angle_rad`: `−peak · 2x/(1 + x²)²·c`, x = (theta − angle)/width; c makes `peak_nm` the largest.
#[derive(Debug, Clone, PartialEq)]
pub struct JointMagneticDetent {
    /// Largest torque \[Nm\].
    pub peak_nm: f64,
    /// Angle of the latch \[rad\].
    pub angle_rad: f64,
    /// Reach of the magnet \[rad\].
    pub width_rad: f64,
}

impl Describe for JointMagneticDetent {
    const COMPONENT: Component = Component::Joint;
    const OUTSIDE_CATALOGUE: bool = true;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self {
            peak_nm: 0.15 * strength * draw.uniform(0.85, 1.2),
            angle_rad: draw.uniform(0.15, 0.35) * draw.sign(),
            width_rad: draw.uniform(0.04, 0.08),
        }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("peak_nm", self.peak_nm.into()), ("angle_rad", self.angle_rad.into()), ("width_rad", self.width_rad.into())]
    }
}

impl JointMagneticDetent {
    /// Torque on the arm \[Nm\].
    pub(crate) fn torque_nm(&self, theta_rad: f64) -> f64 {
        // 2x/(1 + x²)² peaks at x = 1/sqrt(3) with the value 9/(8·sqrt(3)).
        let peak = 9.0 / (8.0 * 3.0_f64.sqrt());
        let x = (theta_rad - self.angle_rad) / self.width_rad;
        -self.peak_nm / peak * 2.0 * x / (1.0 + x * x).powi(2)
    }
}
