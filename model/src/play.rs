//! A play between two bodies: how far the driving one leads the driven one.

/// State of a play. Its width may change from step to step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Play {
    /// How far the driving body leads, rad, within ± half the width.
    pub lead_rad: f64,
}

impl Play {
    /// In the middle.
    pub const CENTRED: Self = Self { lead_rad: 0.0 };

    /// Turns the driving body by `delta_rad`; returns by how much it takes the driven one along, which waits inside the play.
    #[inline]
    pub fn turn(&mut self, delta_rad: f64, width_rad: f64) -> f64 {
        let half = 0.5 * width_rad;
        let lead_rad = self.lead_rad + delta_rad;
        self.lead_rad = lead_rad.clamp(-half, half);
        lead_rad - self.lead_rad
    }

    /// Whether neither body drives the other.
    #[inline]
    pub fn is_open(self, width_rad: f64) -> bool {
        self.lead_rad.abs() < 0.5 * width_rad
    }

    /// Whether there is a play, or the rest of one that has closed.
    #[inline]
    pub fn is_there(self, width_rad: f64) -> bool {
        width_rad > 0.0 || self.lead_rad != 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::Play;

    #[test]
    fn a_body_inside_the_play_waits_and_one_at_its_end_is_taken_along() {
        let mut play = Play::CENTRED;
        assert_eq!((play.turn(0.4, 1.0), play.is_open(1.0)), (0.0, true));
        assert_eq!((play.turn(0.35, 1.0), play.is_open(1.0)), (0.25, false));
        assert_eq!((play.turn(-1.25, 1.0), play.lead_rad), (-0.25, -0.5));
        assert!(play.is_there(0.0) && !Play::CENTRED.is_there(0.0));
        assert_eq!((play.turn(0.0, 0.0), play.lead_rad), (-0.5, 0.0));
    }
}
