//! Nominal parameters of a joint, as a rig file states them.

use crate::effect::{ParameterSpec, Scale};
use crate::friction_law::FrictionLaw;

/// Rotor-side electrical and inertia values of a geared DC motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorParameters {
    /// Supply of the bridge, V.
    pub supply_v: f64,
    /// Winding resistance R, Ω.
    pub resistance_ohm: f64,
    /// Winding inductance, H.
    pub inductance_h: f64,
    /// Torque constant `k_t`, N·m/A; also the back-EMF constant, V·s/rad.
    pub torque_constant_nm_per_a: f64,
    /// Gear ratio N: rotor turns per turn of the input pulley.
    pub gear_ratio: f64,
    /// Inertia of the rotor, kg·m².
    pub rotor_inertia_kg_m2: f64,
    /// Viscous friction at the input pulley, N·m·s/rad.
    pub viscous_nm_s_per_rad: f64,
}

/// Radii of the two pulleys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulleyParameters {
    /// Input pulley r1, m.
    pub input_radius_m: f64,
    /// Output pulley r2, m.
    pub output_radius_m: f64,
}

/// Both tendons, equal by nominal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TendonParameters {
    /// Length L, m.
    pub length_m: f64,
    /// Axial stiffness EA, N.
    pub axial_stiffness_n: f64,
    /// Pretension F0, N.
    pub pretension_n: f64,
}

/// Both sheaths, equal by nominal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheathParameters {
    /// Wrap angle K, rad (full curvature, Eq. (1)).
    pub wrap_angle_rad: f64,
    /// Friction coefficient μ.
    pub friction_coefficient: f64,
}

/// Arm and weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadParameters {
    /// Weight m, kg.
    pub mass_kg: f64,
    /// Distance l of the weight from the axis, m.
    pub arm_m: f64,
    /// Inertia beyond m l², kg·m².
    pub inertia_kg_m2: f64,
    /// Viscous friction of the joint, N·m·s/rad.
    pub viscous_nm_s_per_rad: f64,
}

impl LoadParameters {
    /// A joint that carries nothing.
    pub const NONE: Self = Self { mass_kg: 0.0, arm_m: 0.0, inertia_kg_m2: 0.0, viscous_nm_s_per_rad: 0.0 };
}

/// What measures: resolutions and white noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorParameters {
    /// Bits of the absolute encoders.
    pub encoder_bits: u32,
    /// Full scale of the tension channels, N.
    pub tension_full_scale_n: f64,
    /// Bits of the converter behind the tension amplifiers.
    pub adc_bits: u32,
    /// White noise of a tension channel, N (standard deviation).
    pub tension_noise_n: f64,
    /// White noise of the current channel, A (standard deviation).
    pub current_noise_a: f64,
}

impl Default for SensorParameters {
    /// 12-bit encoders and a 10 kg load cell, free of noise.
    fn default() -> Self {
        Self {
            encoder_bits: 12,
            tension_full_scale_n: 98.0665,
            adc_bits: 12,
            tension_noise_n: 0.0,
            current_noise_a: 0.0,
        }
    }
}

impl SensorParameters {
    /// One step of the converter behind a tension amplifier, N: full scale over `2^adc_bits`.
    #[must_use]
    pub fn tension_step_n(&self) -> f64 {
        self.tension_full_scale_n / (1_u64 << self.adc_bits.min(63)) as f64
    }
}

/// All nominal parameters of one joint. A missing section is a missing part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointParameters {
    /// Geared motor; without it the input is moved by hand.
    pub motor: Option<MotorParameters>,
    /// Pulleys; present whenever tendons are.
    pub pulleys: Option<PulleyParameters>,
    /// Tendons; without them the motor carries the load directly.
    pub tendon: Option<TendonParameters>,
    /// Sheaths; without them the tendons run free of friction.
    pub sheath: Option<SheathParameters>,
    /// Arm; without it the output carries the torque that a recording states, or none.
    pub load: Option<LoadParameters>,
    /// Sensors.
    pub sensors: SensorParameters,
    /// Law of sheath friction.
    pub friction: FrictionLaw,
}

/// A nominal parameter that a fit may recalibrate.
#[derive(Clone, Copy)]
pub struct NominalParameter {
    /// Section of the rig file.
    pub section: &'static str,
    /// Name, unit, accepted range, a typical value.
    pub spec: ParameterSpec,
    get: fn(&JointParameters) -> Option<f64>,
    slot: fn(&mut JointParameters) -> Option<&mut f64>,
}

impl NominalParameter {
    /// Present value; `None` when the joint lacks the part.
    #[must_use]
    pub fn get(&self, joint: &JointParameters) -> Option<f64> {
        (self.get)(joint)
    }

    /// Replaces the value; does nothing when the joint lacks the part.
    pub fn set(&self, joint: &mut JointParameters, value: f64) {
        if let Some(slot) = (self.slot)(joint) {
            *slot = value;
        }
    }
}

macro_rules! nominal {
    ($section:ident . $name:ident, $unit:literal, $lower:expr, $upper:expr, $typical:expr, $scale:ident, $meaning:literal) => {
        NominalParameter {
            section: stringify!($section),
            spec: ParameterSpec {
                name: stringify!($name),
                unit: $unit,
                lower: $lower,
                upper: $upper,
                default: $typical,
                scale: Scale::$scale,
                meaning: $meaning,
                searched: true,
                forms: &[],
                is_choice: false,
                believed: None,
            },
            get: |joint| joint.$section.map(|part| part.$name),
            slot: |joint| joint.$section.as_mut().map(|part| &mut part.$name),
        }
    };
}

/// Every nominal parameter with its accepted range; values outside are refused as a likely mistake of unit.
pub static NOMINAL_PARAMETERS: [NominalParameter; 18] = [
    nominal!(motor.supply_v, "V", 0.5, 1000.0, 24.0, Log, "supply of the bridge"),
    nominal!(motor.resistance_ohm, "Ω", 1e-3, 1e3, 2.0, Log, "winding resistance"),
    nominal!(motor.inductance_h, "H", 0.0, 1.0, 1e-3, Linear, "winding inductance"),
    nominal!(motor.torque_constant_nm_per_a, "N·m/A", 1e-5, 10.0, 0.03, Log, "torque constant"),
    nominal!(motor.gear_ratio, "1", 0.1, 1e4, 30.0, Log, "rotor turns per pulley turn"),
    nominal!(motor.rotor_inertia_kg_m2, "kg·m²", 1e-9, 1.0, 5e-6, Log, "inertia of the rotor"),
    nominal!(
        motor.viscous_nm_s_per_rad,
        "N·m·s/rad",
        0.0,
        100.0,
        0.02,
        Linear,
        "viscous friction at the input pulley"
    ),
    nominal!(pulleys.input_radius_m, "m", 5e-4, 1.0, 0.015, Log, "radius of the input pulley"),
    nominal!(pulleys.output_radius_m, "m", 5e-4, 1.0, 0.015, Log, "radius of the output pulley"),
    nominal!(tendon.length_m, "m", 0.01, 50.0, 1.0, Log, "length of a tendon"),
    nominal!(tendon.axial_stiffness_n, "N", 10.0, 1e8, 72_900.0, Log, "axial stiffness EA of a tendon"),
    nominal!(tendon.pretension_n, "N", 0.01, 1e4, 30.0, Log, "pretension"),
    nominal!(sheath.wrap_angle_rad, "rad", 0.0, 100.0, core::f64::consts::PI, Linear, "wrap angle"),
    nominal!(sheath.friction_coefficient, "1", 0.0, 2.0, 0.12, Linear, "friction coefficient"),
    nominal!(load.mass_kg, "kg", 0.0, 1e3, 2.5, Linear, "weight at the arm's end"),
    nominal!(load.arm_m, "m", 0.0, 10.0, 0.03, Linear, "distance of the weight from the axis"),
    nominal!(load.inertia_kg_m2, "kg·m²", 0.0, 100.0, 0.0, Linear, "inertia beyond that of the weight"),
    nominal!(
        load.viscous_nm_s_per_rad,
        "N·m·s/rad",
        0.0,
        100.0,
        0.004,
        Linear,
        "viscous friction of the joint"
    ),
];

/// Units of what a stronger joint has in proportion, where angles, speeds, duties and currents are the same: forces, torques,
/// masses, and the voltages that go with them.
pub const UNITS_OF_STRENGTH: [&str; 8] = ["V", "Ω", "H", "N·m/A", "kg·m²", "N·m·s/rad", "N", "kg"];

/// The nominal parameter at `section.name`.
#[must_use]
pub fn nominal(section: &str, name: &str) -> Option<&'static NominalParameter> {
    NOMINAL_PARAMETERS.iter().find(|parameter| parameter.section == section && parameter.spec.name == name)
}
