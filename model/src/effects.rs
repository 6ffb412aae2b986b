//! The catalogue: every effect the simulation knows, one file each.
//!
//! A new effect is a new file and one line in each of the lists below.

mod asymmetric_friction;
mod bending_friction;
mod distributed_friction;
mod drive_dead_zone;
mod encoder_eccentricity;
mod end_stop_contact;
mod friction_drift;
mod gear_backlash;
mod gear_load_friction;
mod joint_backlash;
mod joint_coulomb_friction;
mod joint_spring;
mod joint_torque_ripple;
mod joint_viscous_friction;
mod motor_cogging;
mod motor_coulomb_friction;
mod motor_stribeck_friction;
mod motor_viscous_friction;
mod payload_change;
mod presliding_compliance;
mod pretension_loss;
mod sensor_gain_error;
mod sensor_lag;
mod sensor_offset;
mod sensor_saturation;
mod sheath_stribeck_friction;
mod sheath_viscous_friction;
mod straight_ends;
mod tendon_creep;
mod tendon_slack;
mod tendon_stiffening;
mod transmission_backlash;
mod winding_heating;
mod wrap_angle_disturbed;
mod wrap_angle_varies_with_pose;

use crate::effect::Effect;
use asymmetric_friction::AsymmetricFriction;
use bending_friction::BendingFriction;
use distributed_friction::DistributedFriction;
use drive_dead_zone::DriveDeadZone;
use encoder_eccentricity::EncoderEccentricity;
use end_stop_contact::EndStopContact;
use friction_drift::FrictionDrift;
use gear_backlash::GearBacklash;
use gear_load_friction::GearLoadFriction;
use joint_backlash::JointBacklash;
use joint_coulomb_friction::JointCoulombFriction;
use joint_spring::JointSpring;
use joint_torque_ripple::JointTorqueRipple;
use joint_viscous_friction::JointViscousFriction;
use motor_cogging::MotorCogging;
use motor_coulomb_friction::MotorCoulombFriction;
use motor_stribeck_friction::MotorStribeckFriction;
use motor_viscous_friction::MotorViscousFriction;
use payload_change::PayloadChange;
use presliding_compliance::PreslidingCompliance;
use pretension_loss::PretensionLoss;
use sensor_gain_error::SensorGainError;
use sensor_lag::SensorLag;
use sensor_offset::SensorOffset;
use sensor_saturation::SensorSaturation;
use sheath_stribeck_friction::SheathStribeckFriction;
use sheath_viscous_friction::SheathViscousFriction;
use straight_ends::StraightEnds;
use tendon_creep::TendonCreep;
use tendon_slack::TendonSlack;
use tendon_stiffening::TendonStiffening;
use transmission_backlash::TransmissionBacklash;
use winding_heating::WindingHeating;
use wrap_angle_disturbed::WrapAngleDisturbed;
use wrap_angle_varies_with_pose::WrapAngleVariesWithPose;

/// All effects, input to output.
pub static CATALOGUE: [&dyn Effect; 35] = [
    &MotorCoulombFriction,
    &MotorViscousFriction,
    &MotorStribeckFriction,
    &GearLoadFriction,
    &GearBacklash,
    &MotorCogging,
    &DriveDeadZone,
    &WindingHeating,
    &DistributedFriction,
    &SheathViscousFriction,
    &SheathStribeckFriction,
    &PreslidingCompliance,
    &BendingFriction,
    &AsymmetricFriction,
    &FrictionDrift,
    &WrapAngleVariesWithPose,
    &WrapAngleDisturbed,
    &TendonSlack,
    &TendonStiffening,
    &TendonCreep,
    &PretensionLoss,
    &TransmissionBacklash,
    &StraightEnds,
    &JointCoulombFriction,
    &JointViscousFriction,
    &JointBacklash,
    &JointSpring,
    &JointTorqueRipple,
    &EndStopContact,
    &PayloadChange,
    &EncoderEccentricity,
    &SensorGainError,
    &SensorOffset,
    &SensorLag,
    &SensorSaturation,
];

/// The effect with this identifier.
#[must_use]
pub fn find(id: &str) -> Option<&'static dyn Effect> {
    CATALOGUE.into_iter().find(|effect| effect.descriptor().id == id)
}
