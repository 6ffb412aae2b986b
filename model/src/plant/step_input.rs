//! What acts on the joint during one step, and what every stage of the step sees.

use super::config::PlantConfig;
use crate::drive::BridgeInput;
use crate::transmission::Outside;

/// What acts from outside during one step; entries that the boundaries do not use are ignored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepInput {
    /// Bridge of the motor.
    pub bridge: BridgeInput,
    /// Input pulley at the end of the step, rad.
    pub theta_in_rad: f64,
    /// Output pulley at the end of the step, rad.
    pub theta_out_rad: f64,
    /// Torque from outside on the rotor, N·m at the input pulley; positive accelerates it.
    pub input_torque_nm: f64,
    /// What turns the input pulley inside a play of the gear, where the rotor does not touch it.
    pub loose_pulley: Outside,
    /// Torque from outside on the joint, N·m; positive accelerates it.
    pub external_torque_nm: f64,
}

/// One step, as every stage sees it.
#[derive(Clone, Copy)]
pub(super) struct Step<'s> {
    /// Parts, effects and boundaries.
    pub config: &'s PlantConfig,
    /// What acts from outside.
    pub input: &'s StepInput,
    /// Time at the start of the step, s.
    pub t_s: f64,
    /// Length of the step, s, over which the speeds change the angles.
    pub dt_s: f64,
    /// Time over which torques change the speeds, s: from the middle of the previous step to the middle of this one; half a step at the start.
    pub kick_s: f64,
}

impl Step<'_> {
    /// Part of `kick_s` that lies in this step: half of it, without a division, unless the lengths of the steps differ.
    #[inline]
    pub fn share_of_kick(&self) -> f64 {
        if self.kick_s == self.dt_s { 0.5 } else { 0.5 * self.dt_s / self.kick_s }
    }
}
