//! What a plant is made of: parts, effects and boundaries, checked against each other.

use libm::sqrt;

use crate::drive::pulley_inertia_kg_m2;
use crate::effect_set::EffectSet;
use crate::load::inertia_kg_m2;
use crate::parameters::JointParameters;
use crate::sheath::SheathError;
use crate::transmission::TransmissionConfig;

/// What moves the input pulley.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputBoundary {
    /// The motor.
    Motor,
    /// A prescribed angle; the motor follows and only its current is of interest.
    Angle,
}

/// What holds the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputBoundary {
    /// The arm, free to move.
    Arm,
    /// A prescribed torque on a joint without weight.
    Torque,
    /// A prescribed angle.
    Angle,
}

/// A set of parameters from which no joint can be built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlantError {
    /// A tendon without pulleys.
    PulleysMissing,
    /// Neither a motor nor a tendon.
    NothingToSimulate,
    /// Motor-driven without a motor.
    MotorMissing,
    /// A part that moves freely has no inertia.
    InertiaMissing,
    /// The mesh of the tendons.
    Sheath(SheathError),
}

impl core::fmt::Display for PlantError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::PulleysMissing => write!(f, "the rig has [tendon] but no [pulleys]; add both radii"),
            Self::NothingToSimulate => {
                write!(f, "the rig has neither [motor] nor [tendon]; add the part that is to be simulated")
            }
            Self::MotorMissing => {
                write!(f, "a run from the reference needs [motor]; add it or replay a recording")
            }
            Self::InertiaMissing => {
                write!(f, "the load has no inertia; give load.mass_kg and load.arm_m, or load.inertia_kg_m2")
            }
            Self::Sheath(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for PlantError {}

impl From<SheathError> for PlantError {
    fn from(error: SheathError) -> Self {
        Self::Sheath(error)
    }
}

/// Joint, effects and boundaries: configuration only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantConfig {
    pub(super) parameters: JointParameters,
    pub(super) transmission: Option<TransmissionConfig>,
    pub(super) effects: EffectSet,
    pub(super) input: InputBoundary,
    pub(super) output: OutputBoundary,
}

impl PlantConfig {
    /// Checks the parts against each other and prepares the mesh.
    ///
    /// # Errors
    /// [`PlantError`] when parts are missing for these boundaries.
    pub fn new(
        parameters: JointParameters,
        elements: usize,
        effects: EffectSet,
        input: InputBoundary,
        output: OutputBoundary,
    ) -> Result<Self, PlantError> {
        let transmission = match (parameters.tendon, parameters.pulleys) {
            (Some(tendon), Some(pulleys)) => Some(
                TransmissionConfig::new(
                    pulleys,
                    tendon,
                    parameters.sheath,
                    effects.friction_law(parameters.friction),
                    elements,
                )?
                .bent_between(effects.bent_between())?,
            ),
            (Some(_), None) => return Err(PlantError::PulleysMissing),
            (None, _) => None,
        };
        if transmission.is_none() && parameters.motor.is_none() {
            return Err(PlantError::NothingToSimulate);
        }
        if input == InputBoundary::Motor && parameters.motor.is_none() {
            return Err(PlantError::MotorMissing);
        }
        let config = Self { parameters, transmission, effects, input, output };
        let load_inertia = config.load_inertia_kg_m2();
        let needs_load_inertia = output == OutputBoundary::Arm && transmission.is_some();
        let needs_any_inertia = input == InputBoundary::Motor;
        let motor_inertia = parameters.motor.as_ref().map_or(0.0, pulley_inertia_kg_m2);
        if (needs_load_inertia && load_inertia <= 0.0)
            || (needs_any_inertia && motor_inertia + load_inertia <= 0.0)
        {
            return Err(PlantError::InertiaMissing);
        }
        Ok(config)
    }

    /// Nominal parameters.
    #[must_use]
    pub const fn parameters(&self) -> &JointParameters {
        &self.parameters
    }

    /// Tendons and pulleys, if any.
    #[must_use]
    pub const fn transmission(&self) -> Option<&TransmissionConfig> {
        self.transmission.as_ref()
    }

    /// Effects.
    #[must_use]
    pub const fn effects(&self) -> &EffectSet {
        &self.effects
    }

    /// What moves the input.
    #[must_use]
    pub const fn input(&self) -> InputBoundary {
        self.input
    }

    /// What holds the output.
    #[must_use]
    pub const fn output(&self) -> OutputBoundary {
        self.output
    }

    fn load_inertia_kg_m2(&self) -> f64 {
        self.parameters.load.map_or(0.0, |load| inertia_kg_m2(&load, load.mass_kg))
    }

    /// Longest step that keeps the stiffest oscillation of the joint well inside stability (product with its
    /// frequency 0.7, limit 2), s; infinite when nothing elastic moves freely.
    #[must_use]
    pub fn stable_step_s(&self) -> f64 {
        /// Product of step and highest frequency that is allowed.
        const STEP_FREQUENCY: f64 = 0.7;
        let Some(transmission) = &self.transmission else { return f64::INFINITY };
        // A contact that sticks next to the pulley leaves half an element of each tendon as the spring.
        let end_stiffness = 2.0 * 2.0 * transmission.mesh().elements() as f64
            / transmission.mesh().total_compliance_m_per_n();
        let pulleys = transmission.pulleys();
        let mut step = f64::INFINITY;
        if self.output == OutputBoundary::Arm && self.load_inertia_kg_m2() > 0.0 {
            let stiffness = end_stiffness * pulleys.output_radius_m * pulleys.output_radius_m;
            step = step.min(STEP_FREQUENCY / sqrt(stiffness / self.load_inertia_kg_m2()));
        }
        if self.input == InputBoundary::Motor
            && let Some(motor) = &self.parameters.motor
        {
            let stiffness = end_stiffness * pulleys.input_radius_m * pulleys.input_radius_m;
            step = step.min(STEP_FREQUENCY / sqrt(stiffness / pulley_inertia_kg_m2(motor)));
        }
        step
    }
}
