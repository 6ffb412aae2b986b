//! Benches of other sizes and proportions than the nominal one, and what an effect of the same weight is there.

use crate::config::{BenchConfig, Bend, ControllerGains};
use crate::draw::Draw;

/// How large a bench is against the nominal one, so that an effect can be drawn that matters as much there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// Pretension \[1\].
    pub force: f64,
    /// Radius of the input pulley \[1\].
    pub radius: f64,
    /// Pretension times radius of the input pulley \[1\].
    pub torque: f64,
    /// Mass at the arm \[1\].
    pub mass: f64,
    /// Wrap angle \[1\].
    pub wrap_angle: f64,
    /// Current that makes this torque \[1\].
    pub current: f64,
    /// Duty that makes it at standstill \[1\].
    pub duty: f64,
    /// Electrical power that makes it \[1\].
    pub power: f64,
}

impl Size {
    /// Of a bench.
    pub fn of(bench: &BenchConfig) -> Self {
        let nominal = BenchConfig::default();
        let torque_nm = |bench: &BenchConfig| bench.pretension_n * bench.input_radius_m;
        let current_a =
            |bench: &BenchConfig| torque_nm(bench) / (bench.gear_ratio * bench.torque_constant_nm_per_a);
        let volts = |bench: &BenchConfig| bench.resistance_ohm * current_a(bench);
        let current = current_a(bench) / current_a(&nominal);
        Self {
            force: bench.pretension_n / nominal.pretension_n,
            radius: bench.input_radius_m / nominal.input_radius_m,
            torque: torque_nm(bench) / torque_nm(&nominal),
            mass: bench.mass_kg / nominal.mass_kg,
            wrap_angle: bench.wrap_angle_rad / nominal.wrap_angle_rad,
            current,
            duty: volts(bench) / bench.supply_v / (volts(&nominal) / nominal.supply_v),
            power: current * volts(bench) / volts(&nominal),
        }
    }
}

impl BenchConfig {
    /// A bench of another size and other proportions, by seed: pulleys of 6 to 30 mm and not alike, a pretension of 8 to 80 N, a sheath of 0.4
    /// to 2 m that is bent by 1 to 5 rad, tendons that a pretension stretches by 1 to 4 degrees of the pulley, a weight of 0.5 to 2 times
    /// what the pretension holds, a motor with 6 to 25 times that torque and a no-load speed of 10 to 40 rad/s. Friction of motor and bearings,
    /// noise and resolution keep their part of pretension and torque; the controller keeps its bandwidth.
    #[must_use]
    pub fn drawn(seed: u64) -> Self {
        let nominal = Self::default();
        let mut draw = Draw::new(seed, "another bench");
        let mut spread = |low: f64, high: f64| draw.uniform(low.ln(), high.ln()).exp();
        let input_radius_m = spread(0.006, 0.030);
        let output_radius_m = input_radius_m * spread(0.7, 1.4);
        let pretension_n = spread(8.0, 80.0);
        let tendon_length_m = spread(0.4, 2.0);
        let wrap_angle_rad = spread(1.0, 5.0);
        let friction_coefficient = spread(0.06, 0.2).min(0.9 / wrap_angle_rad);
        let stretch_rad = spread(1.0, 4.0).to_radians();
        let axial_stiffness_n = pretension_n * tendon_length_m / (stretch_rad * input_radius_m);
        let held_nm = pretension_n * input_radius_m;
        let arm_m = output_radius_m * spread(1.5, 6.0);
        let weight = spread(0.5, 2.0);
        let mass_kg = weight * held_nm / (nominal.gravity_m_per_s2 * arm_m);
        let arm_kg_m2 = mass_kg * arm_m * arm_m;
        let supply_v = spread(12.0, 36.0).round();
        let gear_ratio = spread(10.0, 60.0).round();
        let torque_constant_nm_per_a = supply_v / (spread(10.0, 40.0) * gear_ratio);
        let stall_nm = spread(6.0, 25.0) * held_nm;
        let resistance_ohm = supply_v * torque_constant_nm_per_a * gear_ratio / stall_nm;
        // A loop of the nominal bandwidth is stiff enough to carry the weight only on enough inertia.
        let [held_per_s2, held_per_rad] = [1.6e4, 100.0];
        let reflected_kg_m2 =
            (spread(0.5, 4.0) * arm_kg_m2).max(held_per_rad / held_per_s2 * held_nm - arm_kg_m2);
        let nominal_held_nm = nominal.pretension_n * nominal.input_radius_m;
        let torque = held_nm / nominal_held_nm;
        let inertia = arm_kg_m2 / (nominal.mass_kg * nominal.arm_m * nominal.arm_m);
        let force = pretension_n / nominal.pretension_n;
        let current_a = held_nm / (gear_ratio * torque_constant_nm_per_a);
        let current = current_a * nominal.gear_ratio * nominal.torque_constant_nm_per_a / nominal_held_nm;
        let stiffness_nm_per_rad = held_per_s2 * (arm_kg_m2 + reflected_kg_m2);
        let proportional_per_rad = stiffness_nm_per_rad / stall_nm;
        let gains = nominal.controller;
        let scaled = |gain: f64| gain / gains.proportional_per_rad * proportional_per_rad;
        // What holds half the weight beside the pretension, behind all friction, and a third more.
        let largest_n = pretension_n * (1.0 + 0.5 * weight) * (friction_coefficient * wrap_angle_rad).exp();
        let tension_full_scale_n = (1.3 * largest_n).ceil();
        let first_bend = spread(0.3, 0.7);
        let [first_from, second_from] = [spread(0.08, 0.2), spread(0.52, 0.62)];
        let mut bench = Self {
            supply_v,
            resistance_ohm,
            inductance_h: nominal.inductance_h / nominal.resistance_ohm * resistance_ohm,
            torque_constant_nm_per_a,
            gear_ratio,
            rotor_inertia_kg_m2: reflected_kg_m2 / gear_ratio.powi(2),
            motor_viscous_nm_s_per_rad: nominal.motor_viscous_nm_s_per_rad * torque * spread(0.5, 2.0),
            input_radius_m,
            output_radius_m,
            tendon_length_m,
            axial_stiffness_n,
            pretension_n,
            wrap_angle_rad,
            friction_coefficient,
            mass_kg,
            arm_m,
            joint_viscous_nm_s_per_rad: nominal.joint_viscous_nm_s_per_rad * torque * spread(0.5, 2.0),
            tension_full_scale_n,
            tension_noise_n: nominal.tension_noise_n * force,
            current_noise_a: nominal.current_noise_a * current,
            input_shaft_inertia_kg_m2: nominal.input_shaft_inertia_kg_m2 * inertia,
            input_drum_inertia_kg_m2: nominal.input_drum_inertia_kg_m2 * inertia,
            output_pulley_inertia_kg_m2: nominal.output_pulley_inertia_kg_m2 * inertia,
            gear_stiffness_nm_per_rad: nominal.gear_stiffness_nm_per_rad * torque,
            hub_stiffness_nm_per_rad: nominal.hub_stiffness_nm_per_rad * torque,
            tendon_mass_kg_per_m: nominal.tendon_mass_kg_per_m * axial_stiffness_n
                / nominal.axial_stiffness_n,
            // The mesh is as well damped as the nominal one, whose step the scheme is trusted with.
            tendon_damping_s: nominal.tendon_damping_s * tendon_length_m / nominal.tendon_length_m,
            bends: vec![
                Bend { from: first_from, to: 0.44, share: first_bend },
                Bend { from: second_from, to: 0.86, share: 1.0 - first_bend },
            ],
            current_lsb_a: nominal.current_lsb_a * current,
            controller: ControllerGains {
                proportional_per_rad,
                integral_per_rad_s: scaled(gains.integral_per_rad_s),
                derivative_s_per_rad: scaled(gains.derivative_s_per_rad),
            },
            ..nominal
        };
        // A fraction of the sample period that the mesh is stable with.
        while bench.validate().is_err() && bench.step_s > 1e-7 {
            bench.step_s /= 2.0;
        }
        bench
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn the_nominal_bench_is_of_size_one() {
        let size = Size::of(&BenchConfig::default());
        for ratio in
            [size.force, size.radius, size.torque, size.mass, size.wrap_angle, size.current, size.power]
        {
            assert!((ratio - 1.0).abs() < 1e-12, "{size:?}");
        }
        assert!(
            (size.duty - 1.0).abs() < 1e-12 && (BenchConfig::default().wrap_angle_rad - PI).abs() < 1e-12
        );
    }

    /// Twice the pretension at three times the radius: by hand, six times the torque and current, in a winding of a quarter of the resistance
    /// one and a half times the voltage, and nine times the power.
    #[test]
    fn sizes_follow_from_pretension_pulley_and_winding() {
        let nominal = BenchConfig::default();
        let bench = BenchConfig {
            pretension_n: 2.0 * nominal.pretension_n,
            input_radius_m: 3.0 * nominal.input_radius_m,
            resistance_ohm: nominal.resistance_ohm / 4.0,
            ..nominal
        };
        let size = Size::of(&bench);
        for (found, want) in [(size.torque, 6.0), (size.current, 6.0), (size.duty, 1.5), (size.power, 9.0)] {
            assert!((found - want).abs() < 1e-12, "{size:?}");
        }
    }

    #[test]
    fn drawn_benches_can_be_simulated_and_differ() {
        let benches: Vec<BenchConfig> = (0..50).map(BenchConfig::drawn).collect();
        for (seed, bench) in benches.iter().enumerate() {
            assert_eq!(bench.validate(), Ok(()), "seed {seed}");
            assert_eq!(*bench, BenchConfig::drawn(seed as u64));
        }
        let radii = benches.iter().map(|bench| bench.input_radius_m);
        let (smallest, largest) =
            radii.fold((f64::MAX, 0.0_f64), |(low, high), radius| (low.min(radius), high.max(radius)));
        assert!(smallest < 0.008 && largest > 0.024, "{smallest} to {largest}");
    }
}
