//! A bridge that does nothing for small duties.

use serde_json::Value;

use super::{Component, Describe};
use crate::draw::Draw;
use crate::size::Size;

/// Dead zone of the drive with a soft knee.
///
/// With `a = |duty|`: `effective = sign(duty) · (p(a) − p(0))`, `p(a) = ((a − w) + sqrt((a − w)² + (w/5)²))/2`, w the width;
/// far outside it is `a − w` to 1 % of w.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveDeadZone {
    /// Duty at the middle of the knee, w \[1\].
    pub width: f64,
}

impl Describe for DriveDeadZone {
    const COMPONENT: Component = Component::Motor;

    fn drawn(strength: f64, draw: &mut Draw) -> Self {
        Self { width: 0.018 * strength * draw.uniform(0.85, 1.2) }
    }

    fn resize(&mut self, size: &Size) {
        self.width *= size.duty;
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("width", self.width.into())]
    }
}

impl DriveDeadZone {
    /// Duty that reaches the winding.
    pub(crate) fn effective_duty(&self, duty: f64) -> f64 {
        let knee = 0.2 * self.width;
        let past = |amount: f64| 0.5 * (amount - self.width + (amount - self.width).hypot(knee));
        duty.signum() * (past(duty.abs()) - past(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_duties_vanish_and_large_ones_lose_the_width() {
        let zone = DriveDeadZone { width: 0.02 };
        assert_eq!(zone.effective_duty(0.0), 0.0);
        assert!(zone.effective_duty(0.01).abs() < 0.05 * 0.01);
        assert!((zone.effective_duty(-0.3) + 0.28).abs() < 0.01 * 0.02);
        assert_eq!(DriveDeadZone { width: 0.0 }.effective_duty(0.1), 0.1);
    }
}
