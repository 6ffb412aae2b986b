//! All laws that a search tries and a rig file may state.

use super::{Form, Law, Port, Variable};
use crate::channel::Channel;
use crate::effect::{Descriptor, ParameterSpec};

const TENSIONS_AND_CURRENT: &[Channel] = &[
    Channel::F1,
    Channel::F2,
    Channel::F3,
    Channel::F4,
    Channel::MotorCurrent,
    Channel::TorqueIn,
    Channel::TorqueOut,
];
const SENSORS: &[Channel] = &[
    Channel::ThetaIn,
    Channel::ThetaOut,
    Channel::F1,
    Channel::F2,
    Channel::F3,
    Channel::F4,
    Channel::MotorCurrent,
    Channel::TorqueIn,
    Channel::TorqueOut,
];
const ANGLES: &[Channel] = &[Channel::ThetaIn, Channel::ThetaOut];

const EXPONENT: ParameterSpec = ParameterSpec::linear("exponent", "1", [0.2, 5.0], 2.0, "exponent");
const ASYMMETRY: ParameterSpec = ParameterSpec::linear(
    "asymmetry",
    "1",
    [-1.0, 1.0],
    0.5,
    "part by which more acts in positive direction",
);
const ANY_EXPONENT: ParameterSpec = ParameterSpec::linear("exponent", "1", [-3.0, 5.0], 1.0, "exponent");
const CYCLES: ParameterSpec =
    ParameterSpec::log("cycles_per_turn", "1", [0.3, 300.0], 4.0, "periods per turn");
const FREQUENCY: ParameterSpec = ParameterSpec::log("frequency_hz", "Hz", [0.05, 500.0], 5.0, "frequency");
const PHASE: ParameterSpec = ParameterSpec::linear("phase_rad", "rad", [-3.15, 3.15], 0.0, "phase at zero");
const AT: ParameterSpec = ParameterSpec::linear("at_rad", "rad", [-100.0, 100.0], 0.0, "place");
const WIDTH: ParameterSpec = ParameterSpec::log("width_rad", "rad", [0.005, 20.0], 0.15, "half width");
const STEEPNESS: ParameterSpec =
    ParameterSpec::log("steepness", "1", [1.0, 12.0], 2.0, "steepness of its edges");
const TIME_CONSTANT: ParameterSpec =
    ParameterSpec::log("time_constant_s", "s", [0.5, 1000.0], 10.0, "time constant");

/// Size of a torque where a file does not say and where a search starts, in a joint of the paper's size.
const TORQUE: ParameterSpec =
    ParameterSpec::linear("amplitude_nm", "N·m", [-100.0, 100.0], 0.05, "amplitude");
const LOST: ParameterSpec =
    ParameterSpec::linear("amplitude", "1/(N·m)", [-10.0, 10.0], -0.02, "amplitude at 1 N·m");
const FORWARDS: ParameterSpec = ParameterSpec::linear(
    "amplitude_nm",
    "N·m",
    [-100.0, 100.0],
    0.05,
    "half of what more acts in positive direction",
);
/// The same of a friction at 1 rad/s, which does not drive.
const DRAG: ParameterSpec =
    ParameterSpec::linear("amplitude_nm", "N·m", [0.0, 100.0], 0.05, "amplitude at 1 rad/s");
const STIFFENING: ParameterSpec =
    ParameterSpec::linear("amplitude_nm", "N·m", [-100.0, 100.0], 0.05, "amplitude at 1 rad");
const RUB: ParameterSpec = ParameterSpec::linear("amplitude_nm", "N·m", [0.0, 100.0], 0.05, "amplitude");
const RELATIVE: ParameterSpec = ParameterSpec::linear("amplitude", "1", [-5.0, 5.0], 0.2, "amplitude");
const TIGHTENING: ParameterSpec =
    ParameterSpec::linear("curvature", "1/rad^2", [-20.0, 20.0], -0.5, "curvature");
const RELATIVE_RADIUS: ParameterSpec =
    ParameterSpec::linear("amplitude", "1", [-0.4, 0.4], 0.03, "amplitude");
const PER_RADIAN: ParameterSpec = ParameterSpec::linear("slope_per_rad", "1/rad", [-0.4, 0.4], 0.02, "slope");
const SHOWN: ParameterSpec =
    ParameterSpec::linear("amplitude", "unit of the channel", [-1e4, 1e4], 0.2, "amplitude");
const SHOWN_RAD: ParameterSpec =
    ParameterSpec::linear("amplitude_rad", "rad", [-0.3, 0.3], 0.01, "amplitude");
const LAG_OF_SENSOR: ParameterSpec =
    ParameterSpec::linear("amplitude", "unit of the channel", [0.0, 1e4], 1.0, "half width of the loop");
const BRANCH: ParameterSpec =
    ParameterSpec::log("width", "unit of the channel", [1e-3, 1e4], 5.0, "travel of a branch");
const BRANCH_RAD: ParameterSpec =
    ParameterSpec::log("width_rad", "rad", [0.002, 5.0], 0.1, "turn of a branch");
const CURVATURE: ParameterSpec =
    ParameterSpec::linear("curvature", "1/unit of the channel", [-10.0, 10.0], 0.002, "curvature");

const fn channels_of(port: Port, form: Form) -> &'static [Channel] {
    match (port, form) {
        (Port::Reading, Form::Wave) => ANGLES,
        (Port::Reading, Form::Square | Form::Hysteresis) => TENSIONS_AND_CURRENT,
        (Port::Reading, _) => SENSORS,
        _ => &[],
    }
}

macro_rules! law {
    ($id:literal, $port:ident, $variable:ident, $form:ident, $formula:literal, [$($parameter:ident),+]) => {
        Law {
            port: Port::$port,
            variable: Variable::$variable,
            form: Form::$form,
            formula: $formula,
            descriptor: &Descriptor {
                id: $id,
                component: Port::$port.component(),
                summary: Port::$port.meaning(),
                parameters: &[$($parameter),+],
                neutral: Some(0.0),
                channels: channels_of(Port::$port, Form::$form),
            },
        }
    };
}

/// All laws, input to output.
pub static LAWS: [Law; 34] = [
    law!(
        "law_motor_friction_by_speed",
        MotorFriction,
        InputSpeed,
        EvenPower,
        "amplitude_nm * abs(omega_in_rad_s)^exponent",
        [DRAG, EXPONENT]
    ),
    law!(
        "law_motor_friction_by_direction",
        MotorFriction,
        InputSpeed,
        DirectedPower,
        "amplitude_nm * (1 + asymmetry * sign(omega_in_rad_s)) * abs(omega_in_rad_s)^exponent",
        [DRAG, EXPONENT, ASYMMETRY]
    ),
    law!(
        "law_motor_friction_by_sign",
        MotorFriction,
        InputSpeed,
        Sign,
        "amplitude_nm * sign(omega_in_rad_s)",
        [FORWARDS]
    ),
    law!(
        "law_motor_friction_at_a_place",
        MotorFriction,
        InputAngle,
        Bump,
        "amplitude_nm * exp(-abs((theta_in_rad - at_rad) / width_rad)^steepness)",
        [RUB, AT, WIDTH, STEEPNESS]
    ),
    law!(
        "law_motor_torque_at_a_place",
        MotorTorque,
        InputAngle,
        Bump,
        "amplitude_nm * exp(-abs((theta_in_rad - at_rad) / width_rad)^steepness)",
        [TORQUE, AT, WIDTH, STEEPNESS]
    ),
    law!(
        "law_motor_torque_by_angle",
        MotorTorque,
        InputAngle,
        Power,
        "amplitude_nm * sign(theta_in_rad) * abs(theta_in_rad)^exponent",
        [STIFFENING, EXPONENT]
    ),
    law!(
        "law_motor_torque_is_curved",
        MotorTorque,
        MotorTorque,
        SignedSquare,
        "amplitude * motor_torque_nm * abs(motor_torque_nm)",
        [LOST]
    ),
    law!(
        "law_motor_torque_hysteresis",
        MotorTorque,
        InputAngle,
        Hysteresis,
        "-amplitude_nm * dahl(theta_in_rad / width_rad)",
        [RUB, BRANCH_RAD]
    ),
    law!(
        "law_motor_torque_over_time",
        MotorTorque,
        Time,
        Oscillation,
        "amplitude_nm * sin(2 * pi * frequency_hz * t_s + phase_rad)",
        [TORQUE, FREQUENCY, PHASE]
    ),
    law!(
        "law_sheath_friction_at_a_place",
        SheathFriction,
        InputAngle,
        Bump,
        "amplitude * exp(-abs((theta_in_rad - at_rad) / width_rad)^steepness)",
        [RELATIVE, AT, WIDTH, STEEPNESS]
    ),
    law!(
        "law_sheath_friction_along_the_angle",
        SheathFriction,
        InputAngle,
        Wave,
        "amplitude * sin(cycles_per_turn * theta_in_rad + phase_rad)",
        [RELATIVE, CYCLES, PHASE]
    ),
    law!(
        "law_sheath_friction_by_tension",
        SheathFriction,
        RelativeTension,
        PowerFromOne,
        "amplitude * (abs(relative_tension)^exponent - 1)",
        [RELATIVE, ANY_EXPONENT]
    ),
    law!(
        "law_sheath_friction_sets_in",
        SheathFriction,
        Time,
        Decay,
        "amplitude * (1 - exp(-t_s / time_constant_s))",
        [RELATIVE, TIME_CONSTANT]
    ),
    law!(
        "law_sheath_friction_over_time",
        SheathFriction,
        Time,
        Oscillation,
        "amplitude * sin(2 * pi * frequency_hz * t_s + phase_rad)",
        [RELATIVE, FREQUENCY, PHASE]
    ),
    law!(
        "law_input_radius_along_the_angle",
        InputRadius,
        InputAngle,
        Wave,
        "amplitude * sin(cycles_per_turn * theta_in_rad + phase_rad)",
        [RELATIVE_RADIUS, CYCLES, PHASE]
    ),
    law!(
        "law_input_radius_grows",
        InputRadius,
        InputAngle,
        Ramp,
        "slope_per_rad * theta_in_rad",
        [PER_RADIAN]
    ),
    law!(
        "law_output_radius_along_the_angle",
        OutputRadius,
        JointAngle,
        Wave,
        "amplitude * sin(cycles_per_turn * theta_out_rad + phase_rad)",
        [RELATIVE_RADIUS, CYCLES, PHASE]
    ),
    law!(
        "law_output_radius_grows",
        OutputRadius,
        JointAngle,
        Ramp,
        "slope_per_rad * theta_out_rad",
        [PER_RADIAN]
    ),
    law!(
        "law_tendon_length_by_joint_angle",
        TendonLength,
        JointAngle,
        Square,
        "curvature * theta_out_rad^2",
        [TIGHTENING]
    ),
    law!(
        "law_tendon_length_over_time",
        TendonLength,
        Time,
        Oscillation,
        "amplitude * sin(2 * pi * frequency_hz * t_s + phase_rad)",
        [RELATIVE, FREQUENCY, PHASE]
    ),
    law!(
        "law_joint_friction_by_speed",
        JointFriction,
        JointSpeed,
        EvenPower,
        "amplitude_nm * abs(omega_out_rad_s)^exponent",
        [DRAG, EXPONENT]
    ),
    law!(
        "law_joint_friction_by_direction",
        JointFriction,
        JointSpeed,
        DirectedPower,
        "amplitude_nm * (1 + asymmetry * sign(omega_out_rad_s)) * abs(omega_out_rad_s)^exponent",
        [DRAG, EXPONENT, ASYMMETRY]
    ),
    law!(
        "law_joint_friction_by_sign",
        JointFriction,
        JointSpeed,
        Sign,
        "amplitude_nm * sign(omega_out_rad_s)",
        [FORWARDS]
    ),
    law!(
        "law_joint_friction_at_a_place",
        JointFriction,
        JointAngle,
        Bump,
        "amplitude_nm * exp(-abs((theta_out_rad - at_rad) / width_rad)^steepness)",
        [RUB, AT, WIDTH, STEEPNESS]
    ),
    law!(
        "law_joint_torque_at_a_place",
        JointTorque,
        JointAngle,
        Bump,
        "amplitude_nm * exp(-abs((theta_out_rad - at_rad) / width_rad)^steepness)",
        [TORQUE, AT, WIDTH, STEEPNESS]
    ),
    law!(
        "law_joint_torque_along_the_angle",
        JointTorque,
        JointAngle,
        Wave,
        "amplitude_nm * sin(cycles_per_turn * theta_out_rad + phase_rad)",
        [TORQUE, CYCLES, PHASE]
    ),
    law!(
        "law_joint_torque_by_angle",
        JointTorque,
        JointAngle,
        Power,
        "amplitude_nm * sign(theta_out_rad) * abs(theta_out_rad)^exponent",
        [STIFFENING, EXPONENT]
    ),
    law!(
        "law_joint_torque_hysteresis",
        JointTorque,
        JointAngle,
        Hysteresis,
        "-amplitude_nm * dahl(theta_out_rad / width_rad)",
        [RUB, BRANCH_RAD]
    ),
    law!(
        "law_joint_torque_over_time",
        JointTorque,
        Time,
        Oscillation,
        "amplitude_nm * sin(2 * pi * frequency_hz * t_s + phase_rad)",
        [TORQUE, FREQUENCY, PHASE]
    ),
    law!(
        "law_reading_over_time",
        Reading,
        Time,
        Oscillation,
        "amplitude * sin(2 * pi * frequency_hz * t_s + phase_rad)",
        [SHOWN, FREQUENCY, PHASE]
    ),
    law!(
        "law_reading_sets_in",
        Reading,
        Time,
        Decay,
        "amplitude * (1 - exp(-t_s / time_constant_s))",
        [SHOWN, TIME_CONSTANT]
    ),
    law!(
        "law_reading_along_the_angle",
        Reading,
        Value,
        Wave,
        "amplitude_rad * sin(cycles_per_turn * value + phase_rad)",
        [SHOWN_RAD, CYCLES, PHASE]
    ),
    law!(
        "law_reading_hysteresis",
        Reading,
        Value,
        Hysteresis,
        "-amplitude * dahl(value / width)",
        [LAG_OF_SENSOR, BRANCH]
    ),
    law!("law_reading_is_curved", Reading, Value, Square, "curvature * value^2", [CURVATURE]),
];
