//! Friction of the gear teeth, which grows with the torque they carry.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::bristle::ShaftBristle;

/// Low-pass of the carried torque \[s\].
const MESH_S: f64 = 2e-3;

/// Gear friction proportional to the torque carried: `share · |torque carried| · sign(omega)`.
///
/// The carried torque passes a 2 ms low-pass, the time a tooth takes to come fully into mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct GearLoadFriction {
    /// Friction over torque carried \[1\].
    pub share: f64,
    /// Wind-up before the teeth slide \[rad\].
    pub breakaway_rad: f64,
}

impl Describe for GearLoadFriction {
    const COMPONENT: Component = Component::Motor;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { share: 0.12 * strength * draw.uniform(0.85, 1.2), breakaway_rad: draw.uniform(1e-3, 3e-3) }
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("share", self.share.into()), ("breakaway_rad", self.breakaway_rad.into())]
    }
}

impl GearLoadFriction {
    /// Torque against the motion \[Nm\]; `carried_nm` is the filter's state.
    pub(crate) fn torque_nm(
        &self,
        bristle: &mut ShaftBristle,
        carried_nm: &mut f64,
        gear_nm: f64,
        omega_rad_per_s: f64,
        dt: f64,
    ) -> f64 {
        *carried_nm += dt / MESH_S * (gear_nm.abs() - *carried_nm);
        *carried_nm * bristle.friction(omega_rad_per_s, self.share, self.breakaway_rad, dt)
    }
}
