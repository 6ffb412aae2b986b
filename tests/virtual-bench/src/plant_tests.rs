//! The whole plant, against statics, the motor's steady state and energy.

use super::*;

fn still(config: &BenchConfig) -> Plant {
    Plant::new(config, ActiveEffects::default(), 0.0)
}

impl Plant {
    /// All stored energy \[J\] of a bench without effects.
    fn energy_j(&self) -> f64 {
        let c = &self.config;
        let spin = |shaft: Shaft, inertia: f64| 0.5 * inertia * shaft.omega_rad_per_s.powi(2);
        let twist = |coupling: &Coupling, a: Shaft, b: Shaft| {
            0.5 * coupling.stiffness_nm_per_rad * (a.angle_rad - b.angle_rad).powi(2)
        };
        let material = Material { pretension_n: c.pretension_n, creep_m: 0.0, stiffening: None, slack: None };
        let contact = Contact {
            friction_coefficient: c.friction_coefficient,
            bristle_stiffness_per_m: c.bristle_stiffness_per_m,
            stribeck: None,
            viscous: None,
            preload_n: &[],
            spot: None,
        };
        0.5 * c.inductance_h * self.current_a.powi(2)
            + spin(self.rotor, self.rotor_inertia_kg_m2())
            + spin(self.input, c.input_shaft_inertia_kg_m2)
            + spin(self.drum, c.input_drum_inertia_kg_m2)
            + spin(self.output, c.output_pulley_inertia_kg_m2)
            + spin(self.arm, c.arm_inertia_kg_m2())
            + twist(&self.gear, self.rotor, self.input)
            + twist(&self.drum_hub, self.input, self.drum)
            + twist(&self.arm_hub, self.output, self.arm)
            + c.mass_kg * c.gravity_m_per_s2 * c.arm_m * (1.0 - self.arm.angle_rad.cos())
            + self.tendons.iter().map(|tendon| tendon.energy_j(&material, &contact)).sum::<f64>()
    }
}

#[test]
fn energy_does_not_grow_without_input() {
    // Shorted motor, arm pushed at 6 rad/s. 0.5·2.25e-3·36 = 40.5 mJ swing and die out. The scheme's energy error
    // oscillates with dt·omega/2 of the energy in the fastest excited mode; 1 % of the first energy covers it.
    for friction_coefficient in [0.0, 0.12] {
        let config = BenchConfig { friction_coefficient, ..BenchConfig::default() };
        let mut plant = still(&config);
        plant.arm.omega_rad_per_s = 6.0;
        let first = plant.energy_j();
        assert!((first - 0.0405).abs() < 1e-4, "kinetic energy of the arm: {first}");
        let mut lowest = first;
        for _ in 0..300 {
            for _ in 0..100 {
                plant.step(0.0);
            }
            let now = plant.energy_j();
            assert!(
                now < lowest + 0.01 * first,
                "energy rose from {lowest} to {now} J (mu {friction_coefficient})"
            );
            lowest = lowest.min(now);
        }
        assert!(lowest < 0.1 * first, "still {lowest} J of {first} J after 0.3 s");
    }
}

#[test]
fn held_arm_balances_gravity() {
    // Constant duty turns the motor until its torque carries the weight: without sheath friction and at rest
    // kt N i = (f1 − f3) r = (f2 − f4) r = m g l sin(theta).
    let config = BenchConfig { friction_coefficient: 0.0, ..BenchConfig::default() };
    let mut plant = still(&config);
    let duty = 0.03;
    // 12 s are 20 time constants of motor against weight, ((kt N)²/R + b)/(m g l) = 0.58 s.
    for _ in 0..1_200_000 {
        plant.step(duty);
    }
    let [f1, f2, f3, f4] = plant.tensions_n();
    let weight_nm = 2.5 * 9.81 * 0.03 * plant.arm.angle_rad.sin();
    assert!((plant.current_a - duty * 24.0 / 2.0).abs() < 1e-6, "stalled current {}", plant.current_a);
    assert!(
        (0.9 * plant.current_a - weight_nm).abs() < 1e-5,
        "motor {} weight {weight_nm}",
        0.9 * plant.current_a
    );
    assert!(((f1 - f3) * 0.015 - weight_nm).abs() < 1e-5);
    assert!(((f2 - f4) * 0.015 - weight_nm).abs() < 1e-5);
    // Each tendon takes half: F0 ± weight/(2 r); the arm hangs back by the stretch weight·L/(2 EA r²), and by the
    // two hubs.
    assert!((f2 - 30.0 - weight_nm / 0.03).abs() < 1e-3, "f2 {f2}");
    let back = weight_nm / (2.0 * 72_900.0 * 0.015 * 0.015) + 2.0 * weight_nm / 10_000.0;
    assert!((plant.input.angle_rad - plant.arm.angle_rad - back).abs() < 1e-5);
}

#[test]
fn free_motor_runs_at_the_speed_where_back_emf_and_friction_take_the_voltage() {
    // Tendons as soft as air (EA = 1 mN): omega = kt N V/(R b + (kt N)²) = 0.9·2.4/(2·0.02 + 0.81) = 2.5412 rad/s
    // at a duty of 0.1, against V/(kt N) = 2.667 rad/s without friction.
    let config = BenchConfig { axial_stiffness_n: 1e-3, pretension_n: 0.0, ..BenchConfig::default() };
    let mut plant = still(&config);
    for _ in 0..100_000 {
        plant.step(0.1);
    }
    assert!((plant.input.omega_rad_per_s - 2.541_18).abs() < 1e-3, "{}", plant.input.omega_rad_per_s);
}

#[test]
fn play_lets_the_output_float_and_a_flank_only_pushes() {
    let coupling = Coupling::new(1_000.0, 1e-5, 0.02);
    let at = |angle_rad: f64, omega_rad_per_s: f64| Shaft { angle_rad, omega_rad_per_s };
    assert_eq!(coupling.torque_nm(at(0.009, 50.0), at(0.0, 0.0)), 0.0);
    assert_eq!(coupling.torque_nm(at(0.011, -1e3), at(0.0, 0.0)), 0.0, "a leaving flank must not pull");
    assert!((coupling.torque_nm(at(0.011, 0.0), at(0.0, 0.0)) - 1.0).abs() < 1e-9);
    assert!((coupling.torque_nm(at(-0.012, 0.0), at(0.0, 0.0)) + 2.0).abs() < 1e-9);
}
