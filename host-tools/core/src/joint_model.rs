//! What is simulated: parameters, effects, boundaries and the law that drives them.

use bowden_model::channel::Channel;
use bowden_model::drive::{pulley_inertia_kg_m2, pulley_stall_torque_nm};
use bowden_model::effect::ActiveEffect;
use bowden_model::effect_set::EffectSet;
use bowden_model::load::inertia_kg_m2;
use bowden_model::paper::capstan::Direction;
use bowden_model::paper::displacement_transmission::dead_zone_input_rad;
use bowden_model::paper::pair::TendonPair;
use bowden_model::paper::torque::LoopTorque;
use bowden_model::parameters::JointParameters;
use bowden_model::plant::{InputBoundary, OutputBoundary, PlantConfig};

use crate::outcome::Failure;
use crate::recording::Recording;
use crate::rig::{ProportionalLaw, Rig, RigParameter};

/// Shortest simulation step, s: a second of a joint that needs shorter ones takes more than a minute.
const SHORTEST_STEP_S: f64 = 1e-7;

/// A parameter with a value of its own on one bench of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnParameter {
    /// Index of the bench.
    pub bench: usize,
    /// The parameter.
    pub parameter: RigParameter,
    /// Value on this bench; `None` before a fit has moved it: the bench's rig file decides, or the effect as it was found.
    pub value: Option<f64>,
}

/// The parameter that only tensions tell.
pub(crate) const PRETENSION: &str = "tendon.pretension_n";

/// All parameters with values of their own on single benches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OwnParameters {
    /// One entry a bench and parameter.
    pub values: Vec<OwnParameter>,
    /// Those that every bench has for itself: the shared value means nothing.
    pub everywhere: Vec<RigParameter>,
    /// Those of which the recordings that are fitted to tell nothing that another parameter does not take up: they stay as stated.
    pub untold: Vec<RigParameter>,
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
    /// How many of these steps the pass that finds the torque which guides a motor may take at a time, at least 1.
    pub guide_stride: usize,
    /// Servo, where the duty follows from the reference.
    pub servo: Option<ProportionalLaw>,
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
    /// Parameters with a value of their own on single benches of a study; empty for one bench.
    pub own: OwnParameters,
    /// What guides a joint without tendons whose motor drives it; `None` where it runs freely, as a rig file has it.
    pub guided_by: Option<GuidedBy>,
}

/// What guides a joint without tendons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidedBy {
    /// Recorded angle to which a torque guides it.
    pub angle: Channel,
    /// Torque by the recorded duty, root mean square, N·m: the size of the torques at this joint. Of a source of torque the stall torque says
    /// nothing.
    pub driven_nm: f64,
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
        if self.guided_by.is_some() {
            return Ok(Drive::GuidedMotor);
        }
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
        let plant = PlantConfig::new(self.parameters, self.elements, effects, input, output)
            .map_err(Failure::bad_input)?;
        let step_s = plant.stable_step_s();
        if step_s < SHORTEST_STEP_S {
            return Err(Failure::bad_input(format!(
                "the simulation needs steps of {step_s:.1e} s, shorter than {SHORTEST_STEP_S:.0e} s: an inertia is too small for \
                 the stiffness of the tendons; check mass_kg, arm_m and inertia_kg_m2 of [load], rotor_inertia_kg_m2 of \
                 [motor] and axial_stiffness_n of [tendon]"
            )));
        }
        Ok(plant)
    }
}

impl JointModel {
    /// Value of a parameter; `None` where the joint lacks the part or the effect. Of several instances of an effect the first counts.
    #[must_use]
    pub fn value(&self, parameter: &RigParameter) -> Option<f64> {
        parameter.value_in(&self.parameters, &self.effects, self.servo.as_ref())
    }

    /// Replaces the value of a parameter; does nothing where [`Self::value`] finds none.
    pub fn set_value(&mut self, parameter: &RigParameter, value: f64) {
        parameter.replace_in(&mut self.parameters, &mut self.effects, self.servo.as_mut(), value);
    }
}

impl JointModel {
    /// The joint that a rig file describes, for replays of recordings with the channels of `recording`.
    ///
    /// # Errors
    /// When the recording lacks what drives the joint.
    pub fn from_rig(rig: &Rig, recording: &Recording) -> Result<Self, Failure> {
        let roles = rig.roles(recording)?;
        Ok(Self {
            parameters: rig.joint,
            effects: rig.effects.clone(),
            elements: rig.elements,
            step_s: rig.step_s,
            guide_stride: 1,
            servo: rig.controller,
            inputs: roles.inputs,
            outputs: roles.outputs,
            free_offsets: rig.free_offsets.clone(),
            relative_inputs: rig.relative_inputs.clone(),
            smoothing_s: rig.smoothing_s.clone(),
            own: OwnParameters::default(),
            guided_by: None,
        })
    }

    /// The same joint as a comparison with recordings takes it. A motor without tendons, driven by its duty alone, integrates every torque that
    /// the model lacks twice, and after seconds the angle says little of where it was lacking; where the angle is recorded, a torque guides
    /// the joint along it, and that torque is what is compared. `recording` tells the size of the torques.
    #[must_use]
    pub fn guided(mut self, recording: &Recording) -> Self {
        let angles = [Channel::ThetaOut, Channel::ThetaIn];
        if self.parameters.tendon.is_none() && self.drive() == Ok(Drive::Duty) {
            let angle = angles.into_iter().find(|angle| self.outputs.contains(angle));
            self.guided_by = angle.map(|angle| GuidedBy { angle, driven_nm: self.driven_nm(recording) });
        }
        self
    }

    /// Torque at the input pulley by the recorded duty, root mean square, N·m; 0 without a motor or a duty.
    #[must_use]
    pub fn driven_nm(&self, recording: &Recording) -> f64 {
        let (Some(motor), Some(duty)) = (&self.parameters.motor, recording.channel(Channel::Duty)) else {
            return 0.0;
        };
        let bus_v = recording.channel(Channel::BusVoltage);
        let volts =
            duty.iter().enumerate().map(|(k, duty)| duty * bus_v.map_or(motor.supply_v, |bus_v| bus_v[k]));
        let mean_square = volts.map(|volt| volt * volt).sum::<f64>() / duty.len().max(1) as f64;
        pulley_stall_torque_nm(motor) / motor.supply_v * mean_square.sqrt()
    }

    /// What the drive can do at the input pulley, N·m: its stall torque, and of a guided joint without tendons ten times what its recording asks
    /// for, as much as a joint of the paper's size has. `None` without a motor.
    #[must_use]
    pub fn strength_nm(&self) -> Option<f64> {
        /// Stall torque over the torque that a motion asks for.
        const ASKED_FOR: f64 = 10.0;
        let asked_for = self.guided_by.map(|guided| ASKED_FOR * guided.driven_nm).filter(|nm| *nm > 0.0);
        asked_for.or_else(|| self.parameters.motor.as_ref().map(pulley_stall_torque_nm))
    }

    /// Whether no recording that it is fitted to holds a tension of its tendons.
    #[must_use]
    pub fn tensions_unseen(&self) -> bool {
        self.own.untold.iter().any(|parameter| parameter.to_string() == PRETENSION)
    }

    /// Inertia of rotor and load about the spindle of a joint without tendons, kg·m².
    #[must_use]
    pub fn direct_inertia_kg_m2(&self) -> f64 {
        let load = self.parameters.load.map_or(0.0, |load| inertia_kg_m2(&load, load.mass_kg));
        self.parameters.motor.as_ref().map_or(0.0, pulley_inertia_kg_m2) + load
    }

    /// Travel of the input, rad, in which friction turns round along the whole sheath while the load stays: Eq. (23) of the paper, without a load. 0
    /// without tendons or sheaths.
    #[must_use]
    pub fn dead_zone_rad(&self) -> f64 {
        let JointParameters { pulleys, tendon, sheath, .. } = &self.parameters;
        let (Some(pulleys), Some(tendon), Some(sheath)) = (pulleys, tendon, sheath) else { return 0.0 };
        let unloaded = LoopTorque::Output(0.0);
        TendonPair::uniform(pulleys, tendon, sheath)
            .map_or(0.0, |pair| dead_zone_input_rad(&pair, Direction::Positive, unloaded, unloaded))
    }

    /// Channel of the angle that guides the motor or is prescribed.
    #[must_use]
    pub fn guiding_channel(&self) -> Channel {
        self.guided_by.map_or(Channel::ThetaIn, |guided| guided.angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bench;

    #[test]
    fn a_dead_zone_is_as_wide_as_friction_and_stretch_make_it() {
        let model = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(10)).unwrap();
        // 2 · 30 N · 1 m · tanh(0.12 π / 2) / (72 900 N · 0.015 m).
        assert!((model.dead_zone_rad() / 0.010_222 - 1.0).abs() < 1e-4, "{}", model.dead_zone_rad());
        let direct = JointModel::from_rig(&test_bench::direct_rig(), &test_bench::turned(10, &[])).unwrap();
        assert_eq!(direct.dead_zone_rad(), 0.0);
    }

    #[test]
    fn a_joint_that_no_simulation_can_follow_is_refused() {
        let model = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(10)).unwrap();
        assert!(model.plant().is_ok());
        for (parameter, value) in [("load.mass_kg", 1e-300), ("tendon.axial_stiffness_n", 1e300)] {
            let mut stiff = model.clone();
            stiff.set_value(&RigParameter::parse(parameter).unwrap(), value);
            let refused = stiff.plant().unwrap_err();
            assert!(refused.message().contains("needs steps of"), "{parameter}: {}", refused.message());
        }
    }

    #[test]
    fn a_motor_without_tendons_is_guided_by_the_angle_that_is_recorded() {
        let turned = test_bench::turned(100, &[]);
        let direct = JointModel::from_rig(&test_bench::direct_rig(), &turned).unwrap();
        assert_eq!(direct.drive().unwrap(), Drive::Duty);
        assert_eq!(direct.strength_nm(), Some(20.0));
        let guided = direct.clone().guided(&turned);
        assert_eq!(guided.drive().unwrap(), Drive::GuidedMotor);
        assert_eq!(guided.guided_by.map(|guided| guided.angle), Some(Channel::ThetaOut));
        let long = direct.clone().guided(&test_bench::turned(8000, &[]));
        // 20 N·m sqrt(0.03² + 0.015²) / sqrt 2, times ten.
        assert!((long.strength_nm().unwrap() / 4.743 - 1.0).abs() < 0.02);
        let blind = JointModel { outputs: vec![Channel::MotorCurrent], ..direct.clone() };
        assert_eq!(blind.clone().guided(&turned), blind);
        let mut recording = test_bench::swung(100);
        recording.set(Channel::Duty, vec![0.0; 100]);
        let with_tendons = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        assert_eq!(with_tendons.clone().guided(&recording), with_tendons);
    }

    #[test]
    fn values_are_found_and_replaced_by_their_names() {
        let mut model = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(10)).unwrap();
        let of = |name: &str| RigParameter::parse(name).unwrap();
        model.set_value(&of("load.mass_kg"), 1.25);
        assert_eq!(model.parameters.load.unwrap().mass_kg, 1.25);
        assert_eq!(model.value(&of("load.mass_kg")), Some(1.25));
        // Neither effect nor position loop is there.
        for absent in ["effects.joint_backlash.gap_rad", "controller.delay_s"] {
            let before = model.clone();
            model.set_value(&of(absent), 0.01);
            assert_eq!((model.value(&of(absent)), &model), (None, &before));
        }
    }
}
