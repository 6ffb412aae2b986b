//! Angle by which the input pulley leads for the corrections: it moves to its target at `compensator.rate_limit` at most, and
//! its speed is part of the speed that the input pulley is asked for.
//!
//! A target that jumps at a reversal would otherwise be followed with the lag of the position loop.

use crate::parameters::Parameters;
use crate::scale::{Angle, Gain, Quantity, Speed};

/// Rate of the lead: configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeadConfig {
    step: Angle,
    /// Ticks a second.
    rate: Gain<Angle, Speed>,
}

impl LeadConfig {
    /// The rate of these parameters; `None` if a value is beyond what fixed point holds.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Option<Self> {
        let rate_hz = parameters.tick_rate_hz();
        let step = Angle::from_f32(parameters.compensator.rate_limit / rate_hz);
        Some(Self { step: step.max(Angle::from_bits(1)), rate: Gain::new(rate_hz)? })
    }
}

/// Present lead: state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lead(Angle);

impl Lead {
    /// Moves towards `target` for a tick; angle and speed of the lead.
    #[inline]
    pub fn follow(&mut self, config: &LeadConfig, target: Angle) -> (Angle, Speed) {
        let step = target.minus(self.0).limited(config.step);
        self.0 = self.0.plus(step);
        (self.0, config.rate.apply(step))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lead_takes_its_time_and_tells_its_speed() {
        // 1 rad/s at 10 kHz: 0.1 mrad a tick; 12.05 mrad take 120 of them and a half.
        let config = LeadConfig::new(&Parameters::default()).unwrap();
        let mut lead = Lead::default();
        for tick in 1..=120 {
            let (angle, speed) = lead.follow(&config, Angle::from_f32(0.012_05));
            // A tick's step is 104.86 steps of 2⁻²⁰ rad, rounded.
            assert!((angle.to_f32() - 1e-4 * tick as f32).abs() < 2e-7 * tick as f32, "{tick}");
            assert!((speed.to_f32() - 1.0).abs() < 2e-3, "{tick}");
        }
        let (angle, speed) = lead.follow(&config, Angle::from_f32(0.012_05));
        assert!((angle.to_f32() - 0.012_05).abs() < 1e-6 && speed.to_f32() < 0.5);
        assert_eq!(lead.follow(&config, Angle::from_f32(0.012_05)), (Angle::from_f32(0.012_05), Speed::ZERO));
    }
}
