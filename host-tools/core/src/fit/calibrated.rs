//! Which nominal parameters a recalibration moves, what is believed of them before any recording, and from which change on the
//! rig file is said to be wrong.
//!
//! Of each product that a replay cannot tell apart one factor is moved: `μ` stands for `μ K`, `EA` for `EA / L`, the output radius
//! for the ratio of both radii, the weight for `m l`. An arm of its own would let weight and inertia go different ways, and a spring
//! at the joint would be taken for weight; where no tendon carries them, the torque of the motor tells both. The gear ratio is counted when a
//! bench is built.

use bowden_model::parameters::NominalParameter;

/// A nominal parameter that a recalibration moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibrated {
    /// Section of the rig file.
    pub section: &'static str,
    /// Key in it.
    pub name: &'static str,
    /// Standard deviation of the logarithm of what a user believes, by where the value usually comes from. Data that say anything
    /// outweigh it; a parameter that they do not touch stays where it was.
    pub spread: f64,
    /// Relative change from which on the rig file is wrong about it, and not just by what benches usually are.
    pub wrong_from: f64,
    /// On which joints it is moved.
    pub of: Of,
}

/// Joints on which a parameter is moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// All that have it.
    Every,
    /// Those of which no input is the angle of the motor.
    FreeRunning,
    /// Those without tendons whose motor drives them: inertia and drag show in the torque that their motion takes.
    Direct,
}

impl Calibrated {
    const fn new(section: &'static str, name: &'static str, spread: f64, wrong_from: f64) -> Self {
        Self { section, name, spread, wrong_from, of: Of::Every }
    }

    const fn of(self, of: Of) -> Self {
        Self { of, ..self }
    }
}

/// All of them.
pub const CALIBRATED: [Calibrated; 12] = [
    // From a table of materials; lubrication halves it.
    Calibrated::new("sheath", "friction_coefficient", 0.5, 0.15),
    // From a data sheet of the rope, without its terminations. Contact along the sheath gives way beside it: short recordings of a
    // bench that hides nothing came out 15 % below.
    Calibrated::new("tendon", "axial_stiffness_n", 0.4, 0.2),
    // Set with a gauge when the tendons are mounted.
    Calibrated::new("tendon", "pretension_n", 0.2, 0.15),
    // From the motor's data sheet; the resistance with leads and bridge.
    Calibrated::new("motor", "resistance_ohm", 0.2, 0.1),
    Calibrated::new("motor", "torque_constant_nm_per_a", 0.2, 0.1),
    // Without what the gear adds, which data sheets leave out. A motor that is guided along its recorded angle shows little of it,
    // and stick and slip imitate that little.
    Calibrated::new("motor", "rotor_inertia_kg_m2", 0.7, 0.3).of(Of::FreeRunning),
    // From a drawing or a caliper, without half the rope's thickness.
    Calibrated::new("pulleys", "output_radius_m", 0.02, 0.02),
    // Weighed, but not the arm that carries it.
    Calibrated::new("load", "mass_kg", 0.3, 0.1),
    // To the centre of gravity, which a drawing of the arm alone does not show.
    Calibrated::new("load", "arm_m", 0.1, 0.05).of(Of::Direct),
    // From a drawing, without what is mounted on it.
    Calibrated::new("load", "inertia_kg_m2", 0.3, 0.1).of(Of::Direct),
    // From an earlier run of the bench: grease and temperature double it.
    Calibrated::new("load", "viscous_nm_s_per_rad", 1.0, 0.3).of(Of::Direct),
    Calibrated::new("motor", "viscous_nm_s_per_rad", 1.0, 0.3).of(Of::Direct),
];

/// Standard deviation of what is believed of a nominal parameter that [`CALIBRATED`] does not list, where a bench has it for itself.
const UNLISTED_SPREAD: f64 = 0.5;

/// Relative change from which on such a parameter is wrong.
const UNLISTED_WRONG_FROM: f64 = 0.15;

/// The entry of a parameter.
#[must_use]
pub fn calibrated(section: &str, name: &str) -> Option<&'static Calibrated> {
    CALIBRATED.iter().find(|listed| listed.section == section && listed.name == name)
}

/// Standard deviation of the logarithm of what is believed of a nominal parameter.
#[must_use]
pub fn spread(parameter: &NominalParameter) -> f64 {
    calibrated(parameter.section, parameter.spec.name).map_or(UNLISTED_SPREAD, |listed| listed.spread)
}

/// Relative change from which on the rig file is wrong about the parameter `section.name`.
#[must_use]
pub fn wrong_from(path: &str) -> f64 {
    let listed = path.split_once('.').and_then(|(section, name)| calibrated(section, name));
    listed.map_or(UNLISTED_WRONG_FROM, |listed| listed.wrong_from)
}
