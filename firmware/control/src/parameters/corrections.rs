//! The parameter groups of the corrections, SI units; what they mean: [`crate::correction`].

/// What a diagnosis found beyond the nominal joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corrections {
    /// Speed of the input pulley within which friction changes its sign, rad/s.
    pub reversal_speed: f32,
    /// Dry friction of motor and gear.
    pub motor_friction: MotorFrictionParameters,
    /// Friction of the gear that grows with the torque.
    pub gear_friction: GearFrictionParameters,
    /// Torque ripple of the motor.
    pub cogging: CoggingParameters,
    /// The same by a table.
    pub ripple_table: RippleTableParameters,
    /// Dead zone of the bridge.
    pub dead_zone: DeadZoneParameters,
    /// Dry friction of the joint.
    pub joint_friction: JointFrictionParameters,
    /// Spring at the joint.
    pub joint_spring: JointSpringParameters,
    /// Sheath friction beyond `mu K`.
    pub sheath: SheathFrictionParameters,
    /// Play of transmission and joint.
    pub backlash: BacklashParameters,
    /// Eccentricity of the encoder at the input pulley.
    pub input_encoder: EccentricityParameters,
    /// Eccentricity of the encoder at the joint.
    pub joint_encoder: EccentricityParameters,
}

/// Dry friction of motor and gear, at the input pulley.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorFrictionParameters {
    /// 1: on.
    pub enable: f32,
    /// Friction at speed, N·m.
    pub coulomb: f32,
    /// Friction at standstill above it, N·m.
    pub excess: f32,
    /// Speed at which the excess has fallen to 37 %, rad/s.
    pub speed: f32,
    /// Largest torque of this term, N·m.
    pub limit: f32,
}

/// Friction of the gear that grows with the torque, at the input pulley.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GearFrictionParameters {
    /// 1: on.
    pub enable: f32,
    /// Friction torque a torque carried.
    pub coefficient: f32,
    /// Largest torque of this term, N·m.
    pub limit: f32,
}

/// Torque ripple of the motor, at the input pulley.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CoggingParameters {
    /// 1: on.
    pub enable: f32,
    /// Amplitude of the first harmonic, N·m.
    pub amplitude_1: f32,
    /// Its periods a turn.
    pub periods_1: f32,
    /// Its phase at angle zero, rad.
    pub phase_1: f32,
    /// Amplitude of the second harmonic, N·m.
    pub amplitude_2: f32,
    /// Its periods a turn.
    pub periods_2: f32,
    /// Its phase at angle zero, rad.
    pub phase_2: f32,
    /// Largest torque of this term, N·m.
    pub limit: f32,
}

/// Torque ripple of the motor by a table, at the input pulley.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RippleTableParameters {
    /// 1: on, in place of the harmonics.
    pub enable: f32,
    /// Largest torque of this term, N·m.
    pub limit: f32,
}

/// Dead zone of the bridge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeadZoneParameters {
    /// 1: on.
    pub enable: f32,
    /// Duty below which nothing happens.
    pub duty: f32,
    /// Duty at which all of it is added.
    pub width: f32,
    /// Largest duty of this term.
    pub limit: f32,
}

/// Dry friction of the joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointFrictionParameters {
    /// 1: on.
    pub enable: f32,
    /// Friction, N·m.
    pub coulomb: f32,
    /// Largest torque of this term, N·m.
    pub limit: f32,
}

/// Spring at the joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointSpringParameters {
    /// 1: on.
    pub enable: f32,
    /// Stiffness, N·m/rad.
    pub stiffness: f32,
    /// Angle without torque, rad.
    pub rest: f32,
    /// Largest torque of this term, N·m.
    pub limit: f32,
}

/// Sheath friction beyond `mu K`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SheathFrictionParameters {
    /// 1: on.
    pub enable: f32,
    /// Friction of a tendon that grows with speed, N·s/m.
    pub viscous: f32,
    /// Friction at standstill above that at speed, relative.
    pub excess: f32,
    /// Speed of the tendon at which the excess has fallen to 37 %, m/s.
    pub speed: f32,
    /// Shape of the fall.
    pub exponent: f32,
    /// Friction that does not scale with tension, N/rad.
    pub bending: f32,
    /// Half the relative difference of the sheaths; positive when cable a rubs more.
    pub asymmetry: f32,
    /// Change of the wrap angle a joint angle.
    pub pose_slope: f32,
    /// Largest torque of this term, N·m.
    pub limit: f32,
}

/// Play of transmission and joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BacklashParameters {
    /// 1: on.
    pub enable: f32,
    /// Whole play between input pulley and tendons, rad at the input pulley.
    pub transmission_gap: f32,
    /// Whole play between output pulley and arm, rad.
    pub joint_gap: f32,
    /// Torque at which the gap counts as crossed, N·m.
    pub torque_width: f32,
    /// Largest half of a gap, rad at the input pulley.
    pub limit: f32,
}

/// Eccentricity of an encoder.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EccentricityParameters {
    /// 1: on.
    pub enable: f32,
    /// Amplitude of the error, rad.
    pub amplitude: f32,
    /// Its phase at angle zero, rad.
    pub phase: f32,
    /// Largest amplitude of this term, rad.
    pub limit: f32,
}
