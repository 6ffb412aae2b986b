//! Position loop of a forward run: the rig's own law where it is known, else a PI-D sized from the rig.
//!
//! The PI-D acts on the drive's own encoder, on the rotor, with the resolution of the recorded ones; it is not recorded.
//! `d = kp e + ki ∫e dt - kd dθ/dt`, limited to ±1, with `e = θ_ref - θ`. For a rigid joint the duty moves the input
//! pulley by `θ / d = A / (s (s + p))`, `A = k_t N V / (R J)`, `p = ((k_t N)² / R + b) / J`, where inertia J and
//! friction b contain those of the load, referred to the input pulley. With `ω = 2π f` and `D = max(p, 3 ω)` the gains
//!
//! `kp = ω D / A`, `kd = (D - p) / A`, `ki = kp ω / 10`
//!
//! give a second-order loop `ω D / (s² + D s + ω D)` and a slow integral against weight and friction. Its amplitude
//! falls to `1/√2` between f and 1.5 f (test `the_loop_follows_up_to_its_bandwidth`).

use std::f64::consts::TAU;

use bowden_model::drive::{pulley_inertia_kg_m2, pulley_torque_constant_nm_per_a};
use bowden_model::plant::{Plant, PlantConfig};

use crate::outcome::Failure;
use crate::rig::{ProportionalLaw, Rig};
use crate::simulation::DelayLine;

/// Bandwidth f of the loop unless the tendons are too soft for it, Hz.
pub const BANDWIDTH_HZ: f64 = 6.0;

/// Smallest ratio of the frequency at which the load swings on its tendons to the bandwidth.
const RESONANCE_OVER_BANDWIDTH: f64 = 2.5;

/// Ratio of the integral's corner to the bandwidth.
const INTEGRAL_SHARE: f64 = 0.1;

/// Ratio of the corner of the speed's low-pass to the bandwidth.
const SPEED_FILTER_RATIO: f64 = 10.0;

/// A position loop and its memory.
#[derive(Clone, Debug)]
pub struct PositionLoop {
    law: Law,
}

#[derive(Clone, Debug)]
enum Law {
    PiD(PiD),
    Proportional { gain_duty_per_rad: f64, duty_limit: f64, delay: DelayLine },
}

impl PositionLoop {
    /// The law in the rig's `[controller]`, or a PI-D for its motor and load, for a joint that stood at `start_rad`.
    ///
    /// # Errors
    /// When the rig has no motor.
    pub fn new(rig: &Rig, config: &PlantConfig, start_rad: f64) -> Result<Self, Failure> {
        let law = match rig.controller {
            Some(ProportionalLaw { gain_duty_per_rad, duty_limit, delay_s }) => {
                Law::Proportional { gain_duty_per_rad, duty_limit, delay: DelayLine::new(delay_s, start_rad) }
            }
            None => Law::PiD(PiD::sized(config).ok_or_else(|| {
                Failure::bad_input(format!("rig `{}`: a position loop needs [motor]; add it", rig.name))
            })?),
        };
        Ok(Self { law })
    }

    /// Duty from now on, for `period_s`.
    pub fn duty(&mut self, reference_rad: f64, plant: &Plant, t_s: f64, period_s: f64) -> f64 {
        match &mut self.law {
            Law::PiD(law) => law.duty(reference_rad, plant.theta_motor_rad(), period_s),
            Law::Proportional { gain_duty_per_rad, duty_limit, delay } => {
                let error = reference_rad - delay.at(t_s, plant.theta_in_rad());
                (*gain_duty_per_rad * error).clamp(-*duty_limit, *duty_limit)
            }
        }
    }
}

#[derive(Clone, Debug)]
struct PiD {
    proportional_per_rad: f64,
    integral_per_rad_s: f64,
    derivative_s_per_rad: f64,
    speed_filter_s: f64,
    rad_per_count: f64,
    integral_rad_s: f64,
    last_rad: Option<f64>,
    speed_rad_s: f64,
}

impl PiD {
    fn sized(config: &PlantConfig) -> Option<Self> {
        let joint = config.parameters();
        let motor = joint.motor?;
        let ratio = super::pulley_ratio(config);
        let (load_inertia, load_viscous) = joint.load.map_or((0.0, 0.0), |load| {
            (load.mass_kg * load.arm_m * load.arm_m + load.inertia_kg_m2, load.viscous_nm_s_per_rad)
        });
        let inertia = pulley_inertia_kg_m2(&motor) + load_inertia * ratio * ratio;
        let torque_constant = pulley_torque_constant_nm_per_a(&motor);
        let viscous = motor.viscous_nm_s_per_rad + load_viscous * ratio * ratio;
        let per_duty = torque_constant * motor.supply_v / (motor.resistance_ohm * inertia);
        let decay = (torque_constant * torque_constant / motor.resistance_ohm + viscous) / inertia;

        let mut omega = TAU * BANDWIDTH_HZ;
        if let Some(parts) = config.transmission()
            && load_inertia > 0.0
        {
            let radius_m = parts.pulleys().output_radius_m;
            let stiffness = 2.0 * radius_m * radius_m / parts.mesh().total_compliance_m_per_n();
            omega = omega.min((stiffness / load_inertia).sqrt() / RESONANCE_OVER_BANDWIDTH);
        }
        let damping = decay.max(3.0 * omega);
        let proportional_per_rad = omega * damping / per_duty;
        Some(Self {
            proportional_per_rad,
            integral_per_rad_s: proportional_per_rad * omega * INTEGRAL_SHARE,
            derivative_s_per_rad: (damping - decay) / per_duty,
            speed_filter_s: 1.0 / (SPEED_FILTER_RATIO * omega),
            rad_per_count: TAU / f64::from(joint.sensors.encoder_bits).exp2() / motor.gear_ratio,
            integral_rad_s: 0.0,
            last_rad: None,
            speed_rad_s: 0.0,
        })
    }

    fn duty(&mut self, reference_rad: f64, rotor_rad: f64, period_s: f64) -> f64 {
        let measured_rad = (rotor_rad / self.rad_per_count).round() * self.rad_per_count;
        let moved_rad = measured_rad - self.last_rad.replace(measured_rad).unwrap_or(measured_rad);
        self.speed_rad_s +=
            period_s / (self.speed_filter_s + period_s) * (moved_rad / period_s - self.speed_rad_s);
        let error = reference_rad - measured_rad;
        let integral = self.integral_rad_s + error * period_s;
        let wanted = self.proportional_per_rad * error + self.integral_per_rad_s * integral
            - self.derivative_s_per_rad * self.speed_rad_s;
        // The integral waits while the bridge is at its limit, and while the count does not tell an error.
        if wanted.abs() <= 1.0 && error.abs() > self.rad_per_count {
            self.integral_rad_s = integral;
        }
        wanted.clamp(-1.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Recording;
    use crate::simulate::{Reference, RunOptions, run};
    use bowden_model::channel::Channel;

    /// A motor with a balanced load: linear but for its encoder.
    const RIG: &str = r#"schema = "bowden-rig/1"
name = "balanced"
[motor]
supply_v = 24.0
resistance_ohm = 2.0
inductance_h = 0.0
torque_constant_nm_per_a = 0.03
gear_ratio = 30.0
rotor_inertia_kg_m2 = 5e-6
viscous_nm_s_per_rad = 0.02
[load]
mass_kg = 0.0
arm_m = 0.0
inertia_kg_m2 = INERTIA
viscous_nm_s_per_rad = 0.0
"#;

    /// Amplitude of the joint over that of a sine reference, by correlation over the last half of the run.
    fn gain(inertia: &str, frequency_hz: f64) -> f64 {
        let rig = Rig::parse(&RIG.replace("INERTIA", inertia), "rig.toml").unwrap();
        let t_s: Vec<f64> = (0..8000).map(|k| f64::from(k) * 1e-3).collect();
        let theta: Vec<f64> = t_s.iter().map(|t| 0.1 * (TAU * frequency_hz * t).sin()).collect();
        let reference = Recording::new("sine", t_s).with(Channel::ThetaRef, theta);
        let reference = Reference::of_recording(&reference).unwrap();
        let run = run(&rig, &reference, RunOptions { seconds: 8.0, rate_hz: 1000.0, seed: 1 }).unwrap();
        let theta = run.channel(Channel::ThetaOut).unwrap();
        let (mut sin, mut cos) = (0.0, 0.0);
        for (t_s, theta) in run.t_s().iter().zip(theta).skip(4000) {
            let (s, c) = (TAU * frequency_hz * t_s).sin_cos();
            sin += theta * s / 2000.0;
            cos += theta * c / 2000.0;
        }
        f64::hypot(sin, cos) / 0.1
    }

    #[test]
    fn the_loop_follows_up_to_its_bandwidth() {
        // Light load: the back-EMF alone damps more than 3 ω. Heavy load: the speed term does.
        for inertia in ["1e-3", "5e-2"] {
            let (inside, at, beyond) = (gain(inertia, 1.0), gain(inertia, 6.0), gain(inertia, 9.0));
            assert!((inside - 1.0).abs() < 0.1, "inertia {inertia}: {inside} at 1 Hz");
            assert!(at > 0.707, "inertia {inertia}: {at} at 6 Hz");
            assert!(beyond < 0.707, "inertia {inertia}: {beyond} at 9 Hz");
        }
    }
}
