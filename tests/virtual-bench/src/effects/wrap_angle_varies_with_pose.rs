//! A sheath that bends more when the joint turns.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// Joint angle beyond which the sheath hardly follows \[rad\].
const SATURATION_RAD: f64 = 1.5;

/// Bend angle of both sheaths at the joint changes with the joint: `slope · theta/sqrt(1 + (theta/1.5)²)`.
///
/// Only the last bend takes part, and no bend angle falls below 0.
#[derive(Debug, Clone, PartialEq)]
pub struct WrapAngleVariesWithPose {
    /// Change of K over joint angle at theta = 0 \[rad/rad\].
    pub slope: f64,
}

impl Describe for WrapAngleVariesWithPose {
    const COMPONENT: Component = Component::Transmission;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { slope: 1.3 * strength * draw.uniform(0.85, 1.2) * draw.sign() }
    }

    fn resize(&mut self, size: &Size) {
        self.slope *= size.wrap_angle;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("slope", self.slope.into())]
    }
}

impl WrapAngleVariesWithPose {
    /// Change of K at joint angle `theta_rad` \[rad\].
    pub(crate) fn change_rad(&self, theta_rad: f64) -> f64 {
        self.slope * theta_rad / (theta_rad / SATURATION_RAD).hypot(1.0)
    }
}
