//! Friction of the rotor and gear bearings that falls with speed.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;
use crate::bristle::ShaftBristle;

/// Dry friction at the input shaft that is higher near standstill.
///
/// Level `coulomb + (static − coulomb)/(1 + (omega/stribeck)²)`: a rational curve, not the usual exponential.
#[derive(Debug, Clone, PartialEq)]
pub struct MotorStribeckFriction {
    /// Torque at speed, seen at the input pulley \[Nm\].
    pub coulomb_nm: f64,
    /// Torque at standstill \[Nm\].
    pub static_nm: f64,
    /// Speed at which half of the excess is gone \[rad/s\].
    pub stribeck_rad_per_s: f64,
    /// Wind-up before it turns freely \[rad\].
    pub breakaway_rad: f64,
}

impl Describe for MotorStribeckFriction {
    const COMPONENT: Component = Component::Motor;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        let coulomb_nm = 0.05 * strength * draw.uniform(0.85, 1.2);
        Self {
            coulomb_nm,
            static_nm: coulomb_nm * draw.uniform(1.8, 2.4),
            stribeck_rad_per_s: draw.uniform(0.05, 0.15),
            breakaway_rad: draw.uniform(1e-3, 3e-3),
        }
    }

    fn resize(&mut self, size: &Size) {
        self.coulomb_nm *= size.torque;
        self.static_nm *= size.torque;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("coulomb_nm", self.coulomb_nm.into()), ("static_nm", self.static_nm.into()), ("stribeck_rad_per_s", self.stribeck_rad_per_s.into()), ("breakaway_rad", self.breakaway_rad.into())]
    }
}

impl MotorStribeckFriction {
    /// Torque against the motion \[Nm\].
    pub(crate) fn torque_nm(&self, bristle: &mut ShaftBristle, omega_rad_per_s: f64, dt: f64) -> f64 {
        let ratio = omega_rad_per_s / self.stribeck_rad_per_s;
        let level = self.coulomb_nm + (self.static_nm - self.coulomb_nm) / (1.0 + ratio * ratio);
        bristle.friction_at(omega_rad_per_s, level, self.static_nm / self.breakaway_rad, dt)
    }
}
