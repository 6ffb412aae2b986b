//! Damping of a load that rings on its tendons in position mode, from the tensions at the motor.
//!
//! Less than a count of the joint's encoder rings with 0.02 N·m at 4 Hz: the encoder does not show it, tensions do. While
//! the cables slip the input torque changes as the output torque does, `T_in = T_out ± M`, Eq. (15). The input pulley yields:
//!
//! `theta_c -= c (d_T/T_r) y`, `y = T_s s/((1 + T_s s)(1 + T_r s)) T_in`, `c = L/(2 EA r1²)`, `d_T` = `controller.tension_damping`.
//!
//! `c T_in` is the stretch of the tendons. The band-pass has its middle at 4.1 Hz, where it has no lag; the position loop, a
//! quarter of a period late there with a bandwidth of 6 Hz, makes the yielding a damping of loads that ring between 2.2
//! and 11 Hz. Derivation and damping ratio: `docs/sheath-observer.md`.

use crate::parameters::Parameters;
use crate::scale::{Angle, Gain, Sum, Torque, Weight};

/// Damping: configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RingConfig {
    /// `c d_T/T_r`.
    yielding: Gain<Torque, Angle>,
    /// `T_s`: what is slower is not yielded to.
    slow_filter: Weight<Torque, Torque>,
    /// `T_r`.
    filter: Weight<Torque, Torque>,
}

impl RingConfig {
    /// The damping of these parameters; `None` if a value is beyond what fixed point holds.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Option<Self> {
        /// Time constants of the band-pass, s.
        const SLOW_S: f32 = 0.05;
        const FILTER_S: f32 = 0.03;
        let period_s = 1.0 / parameters.tick_rate_hz();
        let (tendon, radius_m) = (&parameters.tendon, parameters.pulley.input_radius);
        let stretch_rad_per_nm = tendon.length / (2.0 * tendon.axial_stiffness * radius_m * radius_m);
        Some(Self {
            yielding: Gain::new(stretch_rad_per_nm * parameters.controller.tension_damping / FILTER_S)?,
            slow_filter: Weight::low_pass(SLOW_S, period_s),
            filter: Weight::low_pass(FILTER_S, period_s),
        })
    }
}

/// Damping: state.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ring {
    slow: Option<Sum<Torque>>,
    ringing: Sum<Torque>,
}

impl Ring {
    /// Angle by which the input pulley yields to this input torque \[N·m\].
    #[inline]
    pub fn yields(&mut self, config: &RingConfig, torque_in: Torque) -> Angle {
        let slow =
            self.slow.get_or_insert_with(|| Sum::at(torque_in)).approach(config.slow_filter, torque_in);
        config.yielding.apply(self.ringing.approach(config.filter, torque_in.minus(slow)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scale::Quantity;

    /// At 4.109 Hz, `1/(TAU sqrt(T_s T_r))`, the band-pass has the gain `T_s/(T_s + T_r)` and no lag: with the default
    /// damping `L/(2 EA r1²)·0.625` of the torque, 1/(2·72900·0.015²)·0.625 = 0.01905 rad/(N·m).
    #[test]
    fn a_ringing_torque_is_yielded_to_in_phase_and_a_steady_one_is_not() {
        let config = RingConfig::new(&Parameters::default()).unwrap();
        let omega = 1.0 / libm::sqrt(0.05 * 0.03);
        let mut ring = Ring::default();
        let (mut in_phase, mut across) = (0.0, 0.0);
        // 0.5 N·m steady and 0.1 N·m of ringing; ten periods after ten others.
        let period = core::f64::consts::TAU / omega;
        let ticks = (20.0 * period * 1e4) as usize;
        for tick in 0..ticks {
            let phase = omega * tick as f64 * 1e-4;
            let torque_nm = 0.5 + 0.1 * libm::sin(phase);
            let angle = f64::from(ring.yields(&config, Torque::from_f32(torque_nm as f32)).to_f32());
            if tick >= ticks / 2 {
                in_phase += angle * libm::sin(phase) / (ticks as f64 / 4.0);
                across += angle * libm::cos(phase) / (ticks as f64 / 4.0);
            }
        }
        assert!((in_phase / 0.001_905 - 1.0).abs() < 0.01, "{in_phase} rad");
        assert!(across.abs() < 0.01 * 0.001_905, "{across} rad");
    }

    #[test]
    fn nothing_is_yielded_to_at_the_start() {
        let config = RingConfig::new(&Parameters::default()).unwrap();
        let mut ring = Ring::default();
        for _ in 0..1000 {
            assert_eq!(ring.yields(&config, Torque::from_f32(0.7)), Angle::from_f32(0.0));
        }
    }
}
