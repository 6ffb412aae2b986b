//! The rig file that goes with a recording of the board: what its parameters say about the bench.

use std::fmt::Write as _;
use std::path::Path;

use bowden_core::outcome::Failure;
use bowden_core::output;
use bowden_core::rig::{Rig, SCHEMA};

use super::error::LinkError;
use super::parameters::ParameterSet;

/// Counts a turn of both encoder parts, bits.
const ENCODER_BITS: u32 = 12;

/// Bits of the converters.
const ADC_BITS: u32 = 12;

/// White noise of the channels on a quiet bench, standard deviation; the board does not measure it.
const TENSION_NOISE_N: f64 = 0.1;
const CURRENT_NOISE_A: f64 = 0.02;

/// A weight on the arm, as an argument `MASS,ARM`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weight {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Distance from the axis, m.
    pub arm_m: f64,
}

impl std::str::FromStr for Weight {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number =
            |part: &str| part.trim().parse::<f64>().ok().filter(|value| (0.0..=1000.0).contains(value));
        let parts = text.split_once(',').and_then(|(mass, arm)| Some((number(mass)?, number(arm)?)));
        let (mass_kg, arm_m) = parts.ok_or("expected KG,M such as 2.5,0.03")?;
        Ok(Self { mass_kg, arm_m })
    }
}

/// A rig file but for the voltage of the supply, which is measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draft {
    before: String,
    behind: String,
}

impl Draft {
    /// What the board's parameters and the weight say.
    ///
    /// # Errors
    /// [`LinkError::NoParameter`]
    pub fn new(name: &str, parameters: &ParameterSet, weight: Option<Weight>) -> Result<Self, LinkError> {
        let before = format!(
            "# Written by bowden from the parameters of the board and the measured supply.\n\
             schema = \"{SCHEMA}\"\nname = {}\n\n[motor]\nsupply_v = ",
            toml::Value::from(name)
        );
        Ok(Self { before, behind: behind_the_supply(parameters, weight)? })
    }

    /// The text of the file, with the supply as it was measured, V.
    #[must_use]
    pub fn text(&self, bus_v: f64) -> String {
        format!("{}{:?}\n{}", self.before, (bus_v * 100.0).round() / 100.0, self.behind)
    }
}

fn behind_the_supply(parameters: &ParameterSet, weight: Option<Weight>) -> Result<String, LinkError> {
    let value = |name: &str| parameters.value(name);
    let full_scale_n = {
        let gains = ["f1", "f2", "f3", "f4"].map(|channel| value(&format!("tension.{channel}.gain")));
        let gains = gains.into_iter().collect::<Result<Vec<f64>, _>>()?;
        gains.iter().sum::<f64>() / gains.len() as f64 * f64::from(ADC_BITS).exp2()
    };
    let sections = [
        (
            None,
            vec![
                ("resistance_ohm", value("motor.resistance")?),
                ("inductance_h", 0.0),
                ("torque_constant_nm_per_a", value("motor.torque_constant")?),
                ("gear_ratio", value("motor.gear_ratio")?),
                ("rotor_inertia_kg_m2", value("motor.rotor_inertia")?),
                ("viscous_nm_s_per_rad", value("motor.viscous")?),
            ],
        ),
        (
            Some("pulleys"),
            vec![
                ("input_radius_m", value("pulley.input_radius")?),
                ("output_radius_m", value("pulley.output_radius")?),
            ],
        ),
        (
            Some("tendon"),
            vec![
                ("length_m", value("tendon.length")?),
                ("axial_stiffness_n", value("tendon.axial_stiffness")?),
                ("pretension_n", value("tendon.pretension")?),
            ],
        ),
        (
            Some("sheath"),
            vec![
                ("wrap_angle_rad", value("sheath.wrap_angle")?),
                ("friction_coefficient", value("sheath.friction_coefficient")?),
            ],
        ),
    ];
    let mut text = String::new();
    for (section, keys) in sections {
        if let Some(section) = section {
            let _ = writeln!(text, "\n[{section}]");
        }
        for (key, value) in keys {
            let remark = if key == "inductance_h" { "  # not a parameter of the board" } else { "" };
            let _ = writeln!(text, "{key} = {value:?}{remark}");
        }
    }
    let _ = match weight {
        Some(Weight { mass_kg, arm_m }) => write!(
            text,
            "\n[load]\nmass_kg = {mass_kg:?}\narm_m = {arm_m:?}\ninertia_kg_m2 = 0.0\nviscous_nm_s_per_rad = 0.0\n"
        ),
        None => write!(
            text,
            "\n# The board does not know its load. If there is a weight on the arm:\n# [load]\n# mass_kg = 2.5\n\
             # arm_m = 0.03\n# inertia_kg_m2 = 0.0\n# viscous_nm_s_per_rad = 0.0\n"
        ),
    };
    let _ = write!(
        text,
        "\n[sensors]\nencoder_bits = {ENCODER_BITS}\ntension_full_scale_n = {full_scale_n:?}\nadc_bits = {ADC_BITS}\n\
         tension_noise_n = {TENSION_NOISE_N:?}  # of a quiet bench; not a parameter of the board\n\
         current_noise_a = {CURRENT_NOISE_A:?}\n\n[simulation]\nfriction = \"distributed\"\neffects = []\n"
    );
    Ok(text)
}

/// Writes a rig file, after a check that it is one.
///
/// # Errors
/// A parameter of the board that no rig can have, or the reason why the medium refuses.
pub fn save(path: &Path, text: &str) -> Result<(), Failure> {
    use std::io::Write;
    Rig::parse(text, &path.display().to_string()).map_err(|failure| {
        Failure::failed(format!("the board's parameters make no rig: {failure} of `bowden params set`"))
    })?;
    output::write_file(path, |file| file.write_all(text.as_bytes()))
}
