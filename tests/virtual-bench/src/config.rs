//! True parameters of a bench, their nominal values, and what the user believes of them.

use std::f64::consts::PI;

use crate::draw::Draw;
use crate::error::BenchError;

/// One bend of the sheath: a circular arc between two straight parts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    /// Where the arc begins, as a fraction of the sheath's length from the motor end, \[1\].
    pub from: f64,
    /// Where the arc ends, as a fraction of the sheath's length, \[1\], above `from`.
    pub to: f64,
    /// Part of the wrap angle K that this bend holds, \[1\]; the shares of all bends add up to 1.
    pub share: f64,
}

/// Gains of the lab's position controller, a PI-D on the drive's own rotor encoder (see the crate's documentation).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerGains {
    /// Duty per position error, \[1/rad\].
    pub proportional_per_rad: f64,
    /// Duty per integrated position error, \[1/(rad s)\].
    pub integral_per_rad_s: f64,
    /// Duty per velocity, \[s/rad\]; the velocity is a backward difference behind a 5 ms low-pass.
    pub derivative_s_per_rad: f64,
}

/// All true parameters of a bench, SI units.
///
/// The first block is what a rig file names; the second is reality's own and no user knows it.
/// `Default` is the nominal bench.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchConfig {
    /// Supply voltage of the bridge \[V\].
    pub supply_v: f64,
    /// Winding resistance when cold \[Ω\].
    pub resistance_ohm: f64,
    /// Winding inductance \[H\].
    pub inductance_h: f64,
    /// Torque constant at the rotor \[Nm/A\], also the back-emf constant \[V s/rad\].
    pub torque_constant_nm_per_a: f64,
    /// Gear ratio, rotor turns a turn of the input pulley \[1\].
    pub gear_ratio: f64,
    /// Rotor inertia \[kg m²\], rotor side.
    pub rotor_inertia_kg_m2: f64,
    /// Viscous friction at the input pulley's shaft \[Nm s/rad\].
    pub motor_viscous_nm_s_per_rad: f64,
    /// Radius of the input pulley \[m\].
    pub input_radius_m: f64,
    /// Radius of the output pulley \[m\].
    pub output_radius_m: f64,
    /// Length of each tendon in its sheath \[m\].
    pub tendon_length_m: f64,
    /// Axial stiffness E·A of a tendon \[N\].
    pub axial_stiffness_n: f64,
    /// Pretension F0 of both tendons at rest \[N\].
    pub pretension_n: f64,
    /// Total bend angle K of each sheath \[rad\].
    pub wrap_angle_rad: f64,
    /// Coulomb friction coefficient mu between tendon and sheath \[1\].
    pub friction_coefficient: f64,
    /// Mass at the end of the arm \[kg\].
    pub mass_kg: f64,
    /// Distance of that mass from the joint \[m\].
    pub arm_m: f64,
    /// Inertia of the arm beyond m·l² \[kg m²\].
    pub load_inertia_kg_m2: f64,
    /// Viscous friction of the joint \[Nm s/rad\].
    pub joint_viscous_nm_s_per_rad: f64,
    /// Bits of both encoders for one turn.
    pub encoder_bits: u32,
    /// Full scale of a tension channel \[N\].
    pub tension_full_scale_n: f64,
    /// Bits of the converter behind a tension channel.
    pub adc_bits: u32,
    /// White noise of a tension channel, standard deviation \[N\].
    pub tension_noise_n: f64,
    /// White noise of the current channel, standard deviation \[A\].
    pub current_noise_a: f64,

    /// Gravity \[m/s²\].
    pub gravity_m_per_s2: f64,
    /// Inertia of the input shaft that carries the encoder \[kg m²\].
    pub input_shaft_inertia_kg_m2: f64,
    /// Inertia of the input drum that carries the tendons \[kg m²\].
    pub input_drum_inertia_kg_m2: f64,
    /// Inertia of the output pulley \[kg m²\].
    pub output_pulley_inertia_kg_m2: f64,
    /// Torsional stiffness of the gear, seen at its output \[Nm/rad\].
    pub gear_stiffness_nm_per_rad: f64,
    /// Torsional stiffness of shaft to drum, and of output pulley to arm \[Nm/rad\].
    pub hub_stiffness_nm_per_rad: f64,
    /// Tendon mass a length \[kg/m\].
    pub tendon_mass_kg_per_m: f64,
    /// Structural damping of the tendon: damping over stiffness of an element \[s\].
    pub tendon_damping_s: f64,
    /// Bristle stiffness over normal force, sigma0 \[1/m\]; mu/sigma0 is the presliding distance.
    pub bristle_stiffness_per_m: f64,
    /// Bristle damping over normal force, sigma1 \[s/m\].
    pub bristle_damping_s_per_m: f64,
    /// Viscous contact term over normal force, sigma2 \[s/m\].
    pub contact_viscosity_s_per_m: f64,
    /// Bends of the sheath from the motor end to the joint end.
    pub bends: Vec<Bend>,
    /// Point masses a tendon.
    pub nodes: usize,
    /// Integration step \[s\].
    pub step_s: f64,
    /// Sample and control rate \[Hz\]; its period is a whole number of steps.
    pub sample_rate_hz: f64,
    /// Resolution of the PWM duty \[1\].
    pub duty_lsb: f64,
    /// Resolution of the logged current \[A\].
    pub current_lsb_a: f64,
    /// The lab's controller.
    pub controller: ControllerGains,
}

impl Default for BenchConfig {
    fn default() -> Self {
        Self {
            supply_v: 24.0,
            resistance_ohm: 2.0,
            inductance_h: 0.8e-3,
            torque_constant_nm_per_a: 0.03,
            gear_ratio: 30.0,
            rotor_inertia_kg_m2: 5.0e-6,
            motor_viscous_nm_s_per_rad: 0.02,
            input_radius_m: 0.015,
            output_radius_m: 0.015,
            tendon_length_m: 1.0,
            axial_stiffness_n: 72_900.0,
            pretension_n: 30.0,
            wrap_angle_rad: PI,
            friction_coefficient: 0.12,
            mass_kg: 2.5,
            arm_m: 0.03,
            load_inertia_kg_m2: 0.0,
            joint_viscous_nm_s_per_rad: 0.004,
            encoder_bits: 12,
            tension_full_scale_n: 98.0665,
            adc_bits: 12,
            tension_noise_n: 0.1,
            current_noise_a: 0.01,
            gravity_m_per_s2: 9.81,
            input_shaft_inertia_kg_m2: 8.0e-6,
            input_drum_inertia_kg_m2: 1.2e-5,
            output_pulley_inertia_kg_m2: 1.2e-5,
            gear_stiffness_nm_per_rad: 2_000.0,
            hub_stiffness_nm_per_rad: 10_000.0,
            tendon_mass_kg_per_m: 0.005,
            tendon_damping_s: 8.0e-6,
            bristle_stiffness_per_m: 16_000.0,
            bristle_damping_s_per_m: 0.3,
            contact_viscosity_s_per_m: 0.01,
            bends: vec![
                Bend { from: 0.14, to: 0.44, share: 0.55 },
                Bend { from: 0.58, to: 0.86, share: 0.45 },
            ],
            nodes: 10,
            step_s: 1.0e-5,
            sample_rate_hz: 1_000.0,
            duty_lsb: 5.0e-4,
            current_lsb_a: 4.0e-3,
            controller: ControllerGains {
                proportional_per_rad: 10.0,
                integral_per_rad_s: 24.0,
                derivative_s_per_rad: 0.11,
            },
        }
    }
}

/// Largest product of step and fastest natural frequency that the explicit scheme is trusted with.
///
/// Semi-implicit Euler with damping ratio zeta is stable below `2·(sqrt(1 + zeta²) − zeta)`: 1.35 at zeta = 0.4. The
/// nominal tendon has zeta = 0.34 at its fastest mode (half of the damping time times that mode's frequency).
pub(crate) const STEP_FREQUENCY_LIMIT: f64 = 1.3;

impl BenchConfig {
    /// A bench a few per cent off this one, as real ones are off their data sheet.
    ///
    /// `percent` is the standard deviation of E·A and F0; mu gets 2 times that, R 0.6, kt 0.6 and m 0.25 times, all
    /// normal and cut at 2.5 standard deviations. Every other parameter stays. Deterministic for a seed.
    #[must_use]
    pub fn perturbed(&self, seed: u64, percent: f64) -> Self {
        let mut draw = Draw::new(seed, "perturbed");
        let mut off = |weight: f64| 1.0 + 0.01 * percent * weight * draw.normal().clamp(-2.5, 2.5);
        let mut bench = self.clone();
        bench.friction_coefficient *= off(2.0);
        bench.axial_stiffness_n *= off(1.0);
        bench.pretension_n *= off(1.0);
        bench.resistance_ohm *= off(0.6);
        bench.torque_constant_nm_per_a *= off(0.6);
        bench.mass_kg *= off(0.25);
        bench
    }

    /// Steps a sample period.
    pub(crate) fn steps_per_sample(&self) -> usize {
        (1.0 / (self.sample_rate_hz * self.step_s)).round() as usize
    }

    /// Length of one tendon element \[m\].
    pub(crate) fn element_m(&self) -> f64 {
        self.tendon_length_m / (self.nodes as f64 + 1.0)
    }

    /// Whether this bench can be simulated.
    ///
    /// # Errors
    /// [`BenchError::Parameter`] names the first parameter that is not finite, out of its range, or makes the
    /// integration step too long for the mesh, with the value found and the range.
    pub fn validate(&self) -> Result<(), BenchError> {
        let positive = [
            ("supply_v", self.supply_v),
            ("resistance_ohm", self.resistance_ohm),
            ("inductance_h", self.inductance_h),
            ("torque_constant_nm_per_a", self.torque_constant_nm_per_a),
            ("gear_ratio", self.gear_ratio),
            ("rotor_inertia_kg_m2", self.rotor_inertia_kg_m2),
            ("input_radius_m", self.input_radius_m),
            ("output_radius_m", self.output_radius_m),
            ("tendon_length_m", self.tendon_length_m),
            ("axial_stiffness_n", self.axial_stiffness_n),
            ("tension_full_scale_n", self.tension_full_scale_n),
            ("input_shaft_inertia_kg_m2", self.input_shaft_inertia_kg_m2),
            ("input_drum_inertia_kg_m2", self.input_drum_inertia_kg_m2),
            ("output_pulley_inertia_kg_m2", self.output_pulley_inertia_kg_m2),
            ("gear_stiffness_nm_per_rad", self.gear_stiffness_nm_per_rad),
            ("hub_stiffness_nm_per_rad", self.hub_stiffness_nm_per_rad),
            ("tendon_mass_kg_per_m", self.tendon_mass_kg_per_m),
            ("bristle_stiffness_per_m", self.bristle_stiffness_per_m),
            ("step_s", self.step_s),
            ("sample_rate_hz", self.sample_rate_hz),
            ("duty_lsb", self.duty_lsb),
            ("current_lsb_a", self.current_lsb_a),
        ];
        for (name, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(BenchError::parameter(name, value, "a number above 0"));
            }
        }
        let not_negative = [
            ("motor_viscous_nm_s_per_rad", self.motor_viscous_nm_s_per_rad),
            ("pretension_n", self.pretension_n),
            ("wrap_angle_rad", self.wrap_angle_rad),
            ("friction_coefficient", self.friction_coefficient),
            ("mass_kg", self.mass_kg),
            ("arm_m", self.arm_m),
            ("load_inertia_kg_m2", self.load_inertia_kg_m2),
            ("joint_viscous_nm_s_per_rad", self.joint_viscous_nm_s_per_rad),
            ("tension_noise_n", self.tension_noise_n),
            ("current_noise_a", self.current_noise_a),
            ("gravity_m_per_s2", self.gravity_m_per_s2),
            ("tendon_damping_s", self.tendon_damping_s),
            ("bristle_damping_s_per_m", self.bristle_damping_s_per_m),
            ("contact_viscosity_s_per_m", self.contact_viscosity_s_per_m),
        ];
        for (name, value) in not_negative {
            if !(value.is_finite() && value >= 0.0) {
                return Err(BenchError::parameter(name, value, "a number of 0 or more"));
            }
        }
        if self.arm_inertia_kg_m2() <= 0.0 {
            let got = self.arm_inertia_kg_m2();
            return Err(BenchError::parameter("m l^2 + load_inertia_kg_m2", got, "a number above 0"));
        }
        for (name, bits) in [("encoder_bits", self.encoder_bits), ("adc_bits", self.adc_bits)] {
            if !(1..=24).contains(&bits) {
                return Err(BenchError::parameter(name, f64::from(bits), "1 to 24 bits"));
            }
        }
        if !(2..=200).contains(&self.nodes) {
            return Err(BenchError::parameter("nodes", self.nodes as f64, "2 to 200 masses a tendon"));
        }
        let mut edge = 0.0;
        for bend in &self.bends {
            if !(bend.from >= edge && bend.to > bend.from && bend.to <= 1.0 && bend.share >= 0.0) {
                return Err(BenchError::parameter("bends.from", bend.from, "arcs in order, inside 0 to 1"));
            }
            edge = bend.to;
        }
        let total_share: f64 = self.bends.iter().map(|bend| bend.share).sum();
        if (total_share - 1.0).abs() > 1e-9 {
            return Err(BenchError::parameter("bends.share (sum)", total_share, "shares that add up to 1"));
        }
        let steps = 1.0 / (self.sample_rate_hz * self.step_s);
        if steps < 0.5 || (steps - steps.round()).abs() > 1e-6 * steps {
            return Err(BenchError::parameter(
                "step_s",
                self.step_s,
                "a whole fraction of the sample period",
            ));
        }
        let product = self.step_s * self.fastest_mode_rad_per_s();
        if product > STEP_FREQUENCY_LIMIT {
            return Err(BenchError::Step {
                step_s: self.step_s,
                longest_s: self.step_s * STEP_FREQUENCY_LIMIT / product,
                nodes: self.nodes,
            });
        }
        Ok(())
    }

    /// Inertia of the arm with its weight \[kg m²\].
    pub(crate) fn arm_inertia_kg_m2(&self) -> f64 {
        self.mass_kg * self.arm_m * self.arm_m + self.load_inertia_kg_m2
    }

    /// Largest wrap angle for which the integration step is short enough \[rad\]; infinite without bends.
    pub(crate) fn largest_wrap_angle_rad(&self) -> f64 {
        let element_m = self.element_m();
        let node_kg = self.tendon_mass_kg_per_m * element_m;
        let limit_n_per_m = node_kg * (STEP_FREQUENCY_LIMIT / self.step_s).powi(2);
        let bristle_n_per_m = limit_n_per_m - 4.0 * self.axial_stiffness_n / element_m;
        bristle_n_per_m
            / (self.bristle_stiffness_per_m * self.tension_full_scale_n * self.widest_bend_share())
    }

    fn widest_bend_share(&self) -> f64 {
        crate::sheath::node_bends(self.nodes, &self.bends).iter().fold(0.0_f64, |a, b| a.max(*b))
    }

    /// Upper bound of the fastest natural frequency: tendon mesh with stuck bristles, or a pulley on its hubs \[rad/s\].
    fn fastest_mode_rad_per_s(&self) -> f64 {
        let element_m = self.element_m();
        let node_kg = self.tendon_mass_kg_per_m * element_m;
        let element_n_per_m = self.axial_stiffness_n / element_m;
        let widest_bend_rad = self.widest_bend_share() * self.wrap_angle_rad;
        let bristle_n_per_m = self.bristle_stiffness_per_m * self.tension_full_scale_n * widest_bend_rad;
        let tendon = ((4.0 * element_n_per_m + bristle_n_per_m) / node_kg).sqrt();
        let rope_nm_per_rad = 2.0 * element_n_per_m * self.input_radius_m.max(self.output_radius_m).powi(2);
        let shaft = ((self.gear_stiffness_nm_per_rad + self.hub_stiffness_nm_per_rad)
            / self.input_shaft_inertia_kg_m2
            + self.hub_stiffness_nm_per_rad / self.input_drum_inertia_kg_m2)
            .sqrt();
        let output =
            ((rope_nm_per_rad + self.hub_stiffness_nm_per_rad) / self.output_pulley_inertia_kg_m2).sqrt();
        let electrical = self.resistance_ohm / self.inductance_h;
        tendon.max(shaft).max(output).max(electrical)
    }

    /// Rig file of schema `bowden-rig/1` that claims this bench's parameters.
    ///
    /// Only what a user can know is written; inertias of the pulleys, bristles and mesh stay reality's own.
    pub fn rig_toml(&self, name: &str) -> String {
        // Escapes of a TOML basic string; control characters have no place in a name.
        let quoted = name.replace('\\', "\\\\").replace('"', "\\\"").replace(char::is_control, " ");
        format!(
            "schema = \"bowden-rig/1\"\nname = \"{quoted}\"\n\n\
             [motor]\nsupply_v = {:?}\nresistance_ohm = {:?}\ninductance_h = {:?}\n\
             torque_constant_nm_per_a = {:?}\ngear_ratio = {:?}\nrotor_inertia_kg_m2 = {:?}\n\
             viscous_nm_s_per_rad = {:?}\n\n\
             [pulleys]\ninput_radius_m = {:?}\noutput_radius_m = {:?}\n\n\
             [tendon]\nlength_m = {:?}\naxial_stiffness_n = {:?}\npretension_n = {:?}\n\n\
             [sheath]\nwrap_angle_rad = {:?}\nfriction_coefficient = {:?}\n\n\
             [load]\nmass_kg = {:?}\narm_m = {:?}\ninertia_kg_m2 = {:?}\nviscous_nm_s_per_rad = {:?}\n\n\
             [sensors]\nencoder_bits = {}\ntension_full_scale_n = {:?}\nadc_bits = {}\n\
             tension_noise_n = {:?}\ncurrent_noise_a = {:?}\n\n\
             [simulation]\nfriction = \"distributed\"\neffects = []\n",
            self.supply_v,
            self.resistance_ohm,
            self.inductance_h,
            self.torque_constant_nm_per_a,
            self.gear_ratio,
            self.rotor_inertia_kg_m2,
            self.motor_viscous_nm_s_per_rad,
            self.input_radius_m,
            self.output_radius_m,
            self.tendon_length_m,
            self.axial_stiffness_n,
            self.pretension_n,
            self.wrap_angle_rad,
            self.friction_coefficient,
            self.mass_kg,
            self.arm_m,
            self.load_inertia_kg_m2,
            self.joint_viscous_nm_s_per_rad,
            self.encoder_bits,
            self.tension_full_scale_n,
            self.adc_bits,
            self.tension_noise_n,
            self.current_noise_a,
        )
    }
}

/// Rig file of the nominal bench: what the user of any bench made from it believes.
pub fn nominal_rig_toml(name: &str) -> String {
    BenchConfig::default().rig_toml(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_with_quotes_stays_one_toml_string() {
        let rig = nominal_rig_toml("a \"b\" \\ é\n[motor]");
        assert_eq!(rig.lines().nth(1), Some(r#"name = "a \"b\" \\ é [motor]""#));
    }

    #[test]
    fn parameters_out_of_range_are_named() {
        for (bench, name) in [
            (BenchConfig { mass_kg: f64::NAN, ..BenchConfig::default() }, "mass_kg"),
            (BenchConfig { resistance_ohm: 0.0, ..BenchConfig::default() }, "resistance_ohm"),
            (BenchConfig { friction_coefficient: -0.1, ..BenchConfig::default() }, "friction_coefficient"),
            (BenchConfig { adc_bits: 40, ..BenchConfig::default() }, "adc_bits"),
            (BenchConfig { step_s: 3e-4, ..BenchConfig::default() }, "step_s"),
            (BenchConfig { bends: Vec::new(), ..BenchConfig::default() }, "bends.share"),
        ] {
            let refused = bench.validate().map_err(|error| error.to_string());
            assert!(refused.as_ref().is_err_and(|text| text.contains(name)), "{name}: {refused:?}");
        }
        assert_eq!(BenchConfig::default().validate(), Ok(()));
    }
}
