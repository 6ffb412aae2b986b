//! Somebody leans on the sheath for a while.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;
use super::smooth_step;

/// Length of a flank \[s\].
const FLANK_S: f64 = 0.3;

/// K of both sheaths is larger by `change_rad` from `onset_s` on for `length_s`, with smooth flanks of 0.3 s, at the first bend.
#[derive(Debug, Clone, PartialEq)]
pub struct WrapAngleDisturbed {
    /// Change of K meanwhile \[rad\].
    pub change_rad: f64,
    /// When it begins \[s\].
    pub onset_s: f64,
    /// How long it lasts \[s\].
    pub length_s: f64,
}

impl Describe for WrapAngleDisturbed {
    const COMPONENT: Component = Component::Transmission;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self {
            change_rad: 1.3 * strength * draw.uniform(0.85, 1.2),
            onset_s: draw.uniform(8.0, 22.0),
            length_s: draw.uniform(5.0, 10.0),
        }
    }

    fn resize(&mut self, size: &Size) {
        self.change_rad *= size.wrap_angle;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("change_rad", self.change_rad.into()), ("onset_s", self.onset_s.into()), ("length_s", self.length_s.into())]
    }
}

impl WrapAngleDisturbed {
    /// Change of K at `clock_s` \[rad\].
    pub(crate) fn change_rad(&self, clock_s: f64) -> f64 {
        let on = smooth_step((clock_s - self.onset_s) / FLANK_S);
        let off = smooth_step((clock_s - self.onset_s - self.length_s) / FLANK_S);
        self.change_rad * (on - off)
    }
}
