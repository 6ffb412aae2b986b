//! Which channels drive a replay and which it predicts.

use bowden_model::channel::Channel;

use super::Rig;
use crate::outcome::Failure;
use crate::recording::Recording;

/// Inputs and outputs of a replay of one recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReplayRoles {
    /// Recorded channels that drive the simulation.
    pub inputs: Vec<Channel>,
    /// Channels that the simulation predicts.
    pub outputs: Vec<Channel>,
}

/// Channels that can drive a simulation; end tensions follow from the others.
pub(super) fn can_drive(channel: Channel) -> bool {
    !Channel::TENSIONS.contains(&channel)
}

impl Rig {
    /// Channels that a replay takes as inputs where they are recorded: those that the file names, or `theta_in_rad`
    /// and, with a motor, `duty`, `bus_v` and `drive_enable`.
    pub fn possible_inputs(&self) -> Vec<Channel> {
        const OF_A_MOTOR: [Channel; 4] =
            [Channel::ThetaIn, Channel::Duty, Channel::BusVoltage, Channel::DriveEnable];
        match (&self.replay_inputs, &self.joint.motor) {
            (Some(inputs), _) => inputs.clone(),
            (None, Some(_)) => OF_A_MOTOR.to_vec(),
            (None, None) => vec![Channel::ThetaIn],
        }
    }

    /// Inputs and outputs for a recording. Outputs that the file does not name are all roles of the rig's parts that
    /// follow from the inputs: with a motor `theta_motor_rad` and `i_motor_a`, with tendons the four tensions and
    /// both torques, and the angles.
    ///
    /// # Errors
    /// Names the input that was not recorded.
    pub fn roles(&self, recording: &Recording) -> Result<ReplayRoles, Failure> {
        let possible = self.possible_inputs();
        let recorded = |channel: &Channel| recording.channel(*channel).is_some();
        if self.replay_inputs.is_some()
            && let Some(missing) = possible.iter().find(|channel| !recorded(channel))
        {
            let role = missing.role();
            return Err(Failure::bad_input(format!(
                "{}: no column `{role}`, which the rig's replay.inputs names; record it or change replay.inputs",
                recording.source()
            )));
        }
        let inputs: Vec<Channel> = possible.iter().copied().filter(recorded).collect();
        let moves = |channel: &Channel| !matches!(channel, Channel::BusVoltage | Channel::DriveEnable);
        if !inputs.iter().any(moves) {
            let names: Vec<&str> =
                possible.iter().filter(|channel| moves(channel)).map(|c| c.role()).collect();
            return Err(Failure::bad_input(format!(
                "{}: no column that could drive a replay, expected {}; record one, map it under \
                 [recording.columns] of the rig, or name another in replay.inputs",
                recording.source(),
                names.join(" or ")
            )));
        }
        let outputs = match &self.replay_outputs {
            Some(outputs) => outputs.clone(),
            None => self.predicted(&inputs),
        };
        Ok(ReplayRoles { inputs, outputs })
    }

    /// All roles that follow from the inputs, in the order in which columns are written.
    fn predicted(&self, inputs: &[Channel]) -> Vec<Channel> {
        let (motor, tendon) = (self.joint.motor.is_some(), self.joint.tendon.is_some());
        let duty_is_known = inputs.contains(&Channel::Duty) || self.controller.is_some();
        Channel::ALL
            .into_iter()
            .filter(|channel| !inputs.contains(channel))
            .filter(|channel| match channel {
                Channel::ThetaRef | Channel::BusVoltage | Channel::DriveEnable => false,
                Channel::Duty => motor && self.controller.is_some(),
                Channel::MotorCurrent => motor && duty_is_known,
                Channel::ThetaMotor => motor,
                Channel::ThetaIn | Channel::ThetaOut => true,
                Channel::F1
                | Channel::F2
                | Channel::F3
                | Channel::F4
                | Channel::TorqueIn
                | Channel::TorqueOut => tendon,
            })
            .collect()
    }
}
