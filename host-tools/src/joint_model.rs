//! What is simulated: parameters, effects, boundaries and the law that drives them.

use bowden_model::channel::Channel;
use bowden_model::effect::ActiveEffect;
use bowden_model::effect_set::EffectSet;
use bowden_model::parameters::JointParameters;
use bowden_model::plant::{InputBoundary, OutputBoundary, PlantConfig};

use crate::outcome::Failure;
use crate::recording::Recording;
use crate::rig::{Controller, Rig};

/// Law of a servo that turns the error of its angle into a duty, `d = clamp(k (θ_ref - θ), ±d_max)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoLaw {
    /// Proportional gain k, duty per rad.
    pub gain_duty_per_rad: f64,
    /// Largest duty.
    pub duty_limit: f64,
    /// Time between the measurement and the duty that follows from it, s.
    pub delay_s: f64,
}

/// A joint as it is to be simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct JointModel {
    /// Nominal parameters.
    pub parameters: JointParameters,
    /// Physics beyond them.
    pub effects: Vec<ActiveEffect>,
    /// Contacts of each tendon.
    pub elements: usize,
    /// Longest simulation step, s.
    pub step_s: f64,
    /// Servo, where the duty follows from the reference.
    pub servo: Option<ServoLaw>,
    /// Channels that drive a replay.
    pub inputs: Vec<Channel>,
    /// Channels that a replay predicts.
    pub outputs: Vec<Channel>,
    /// Outputs whose zero is arbitrary in every recording; a comparison removes their mean difference.
    pub free_offsets: Vec<Channel>,
    /// Inputs whose zero is arbitrary in every recording; a replay counts them from their first sample.
    pub relative_inputs: Vec<Channel>,
    /// Inputs that a replay averages without phase, and over which time, s.
    pub smoothing_s: Vec<(Channel, f64)>,
}

/// How a replay drives the input side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// The motor drives; its angle is kept at the recorded one by a small torque that is reported.
    GuidedMotor,
    /// The recorded angle is prescribed.
    Angle,
    /// The motor drives by the recorded duty alone.
    Duty,
    /// The motor drives by the servo's law from the recorded reference.
    Servo,
}

impl JointModel {
    /// How a replay of this joint is driven.
    ///
    /// # Errors
    /// When the inputs cannot drive the joint.
    pub fn drive(&self) -> Result<Drive, Failure> {
        let has = |channel| self.inputs.contains(&channel);
        let motor = self.parameters.motor.is_some();
        match (has(Channel::ThetaIn), motor && has(Channel::Duty)) {
            (true, true) if self.parameters.tendon.is_some() => Ok(Drive::GuidedMotor),
            (true, _) => Ok(Drive::Angle),
            (false, true) => Ok(Drive::Duty),
            (false, false) if motor && has(Channel::ThetaRef) && self.servo.is_some() => Ok(Drive::Servo),
            _ => Err(Failure::bad_input(
                "replay.inputs: nothing drives the joint; name theta_in_rad, or duty with [motor], or theta_ref_rad \
                 with [motor] and [controller]",
            )),
        }
    }

    /// What holds the output in a replay.
    #[must_use]
    pub fn output_boundary(&self) -> OutputBoundary {
        let inertia = self.parameters.load.map_or(0.0, |l| l.mass_kg * l.arm_m * l.arm_m + l.inertia_kg_m2);
        if inertia > 0.0 { OutputBoundary::Arm } else { OutputBoundary::Torque }
    }

    /// Plant for a replay.
    ///
    /// # Errors
    /// When the rig lacks a part that the inputs need.
    pub fn plant(&self) -> Result<PlantConfig, Failure> {
        let input = match self.drive()? {
            Drive::Angle => InputBoundary::Angle,
            Drive::GuidedMotor | Drive::Duty | Drive::Servo => InputBoundary::Motor,
        };
        self.plant_between(input, self.output_boundary())
    }

    /// Plant between given boundaries.
    ///
    /// # Errors
    /// When the rig lacks a part that the boundaries need.
    pub fn plant_between(
        &self,
        input: InputBoundary,
        output: OutputBoundary,
    ) -> Result<PlantConfig, Failure> {
        let effects = EffectSet::from_slice(&self.effects).map_err(Failure::bad_input)?;
        PlantConfig::new(self.parameters, self.elements, effects, input, output).map_err(Failure::bad_input)
    }
}

impl JointModel {
    /// The joint that a rig file describes, for replays of recordings with the channels of `recording`.
    ///
    /// # Errors
    /// When the recording lacks what drives the joint.
    pub fn from_rig(rig: &Rig, recording: &Recording) -> Result<Self, Failure> {
        let roles = rig.roles(recording)?;
        let servo =
            rig.controller.map(|Controller::Proportional { gain_duty_per_rad, duty_limit, delay_s }| {
                ServoLaw { gain_duty_per_rad, duty_limit, delay_s }
            });
        Ok(Self {
            parameters: rig.joint,
            effects: rig.effects.clone(),
            elements: rig.elements,
            step_s: rig.step_s,
            servo,
            inputs: roles.inputs,
            outputs: roles.outputs,
            free_offsets: rig.free_offsets.clone(),
            relative_inputs: rig.relative_inputs.clone(),
            smoothing_s: rig.smoothing_s.clone(),
        })
    }
}
