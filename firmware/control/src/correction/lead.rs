//! Angle by which the input pulley leads for the corrections: it moves to its target at `compensator.rate_limit` at most, and
//! its speed is part of the speed that the input pulley is asked for.
//!
//! A target that jumps at a reversal would otherwise be followed with the lag of the position loop.

use super::backlash::Backlash;
use super::sheath::SheathCorrection;
use crate::parameters::Parameters;
use crate::scale::{Angle, Gain, Quantity, Speed, Torque};

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

/// Leads for play and for sheath friction beyond `mu K`, together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leads {
    backlash: Backlash,
    /// None where the friction is followed while the joint moves: it would count twice.
    sheath: Option<SheathCorrection>,
    /// `m g l`: torque that the weight takes at a small angle. Measured torque is zero within a play.
    weight: Gain<Angle, Torque>,
    /// One of them is switched on.
    acts: bool,
}

/// Desired motion of the joint, and the friction on its way.
#[derive(Clone, Copy, Debug)]
pub struct Led {
    /// Desired speed of the joint.
    pub speed: Speed,
    /// Desired angle of the joint.
    pub theta: Angle,
    /// Friction torque of the sheaths at the joint.
    pub friction: Torque,
}

impl Leads {
    /// The leads of these parameters; `None` if a value is beyond what fixed point holds.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Option<Self> {
        /// Gravity, m/s².
        const GRAVITY_M_PER_S2: f32 = 9.806_65;
        let sheath = SheathCorrection::new(parameters)?;
        let followed = parameters.sheath.adapts == 1.0;
        let load = &parameters.load;
        let own = &parameters.correction;
        Some(Self {
            acts: own.backlash.enable != 0.0 || (!followed && own.sheath.enable != 0.0),
            backlash: Backlash::new(parameters)?,
            sheath: (!followed).then_some(sheath),
            weight: Gain::new(load.mass * GRAVITY_M_PER_S2 * load.arm)?,
        })
    }

    /// Angle by which the input pulley leads.
    #[inline]
    #[must_use]
    pub fn lead(&self, led: &Led) -> Angle {
        if !self.acts {
            return Angle::ZERO;
        }
        let Led { speed, theta, friction } = *led;
        let torque_out = self.weight.apply(theta);
        let signed = if speed < Speed::ZERO { friction.negated() } else { friction };
        let torque_in = torque_out.plus(signed);
        let lead = self.backlash.lead(torque_in, torque_out);
        match &self.sheath {
            Some(sheath) => lead.plus(sheath.lead(speed, theta, torque_in, torque_out)),
            None => lead,
        }
    }
}

/// Present lead: state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lead(Angle);

impl Lead {
    /// Moves towards `target` for a tick; angle and speed of the lead.
    #[inline]
    pub fn follow(&mut self, config: &LeadConfig, target: Angle) -> (Angle, Speed) {
        // Nearly always.
        if target == Angle::ZERO && self.0 == Angle::ZERO {
            return (Angle::ZERO, Speed::ZERO);
        }
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
