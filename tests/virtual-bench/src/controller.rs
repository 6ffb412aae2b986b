//! Position controller of the lab: PI-D, as a first-year student would write it.
//!
//! It runs on the drive's own encoder on the rotor. That one is not recorded; it has as many counts a turn as the
//! recorded ones and turns N times faster, so duty does not carry the steps of a 12-bit angle.

use std::f64::consts::TAU;

use crate::config::{BenchConfig, ControllerGains};

/// Low-pass of the encoder velocity \[s\].
const VELOCITY_FILTER_S: f64 = 5e-3;

/// Controller and its memory.
#[derive(Debug, Clone)]
pub(crate) struct Controller {
    rad_per_count: f64,
    gains: ControllerGains,
    period_s: f64,
    duty_lsb: f64,
    integral_rad_s: f64,
    last_rad: f64,
    velocity_rad_per_s: f64,
}

impl Controller {
    pub(crate) fn new(config: &BenchConfig) -> Self {
        let counts = config.gear_ratio * f64::from(1_u32 << config.encoder_bits);
        Self {
            rad_per_count: TAU / counts,
            gains: config.controller,
            period_s: 1.0 / config.sample_rate_hz,
            duty_lsb: config.duty_lsb,
            integral_rad_s: 0.0,
            last_rad: 0.0,
            velocity_rad_per_s: 0.0,
        }
    }

    /// Duty for the coming period, −1 to 1, on the grid of the PWM; `rotor_rad` is counted at the input pulley.
    pub(crate) fn duty(&mut self, reference_rad: f64, rotor_rad: f64) -> f64 {
        let measured_rad = (rotor_rad / self.rad_per_count).round() * self.rad_per_count;
        let error = reference_rad - measured_rad;
        let raw_velocity = (measured_rad - self.last_rad) / self.period_s;
        self.last_rad = measured_rad;
        self.velocity_rad_per_s +=
            self.period_s / (VELOCITY_FILTER_S + self.period_s) * (raw_velocity - self.velocity_rad_per_s);
        let integral = self.integral_rad_s + error * self.period_s;
        let asked = self.gains.proportional_per_rad * error + self.gains.integral_per_rad_s * integral
            - self.gains.derivative_s_per_rad * self.velocity_rad_per_s;
        // The integral rests while the output is clipped (conditional integration).
        if asked.abs() <= 1.0 {
            self.integral_rad_s = integral;
        }
        (asked.clamp(-1.0, 1.0) / self.duty_lsb).round() * self.duty_lsb
    }
}
