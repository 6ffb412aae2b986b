//! Laws: physics that no catalogue names, as a closed form of one variable at one port of the joint.
//!
//! A law is an [`Effect`] like any other, but for its name: a rig file states it as `[[law]]` with port, variable, formula and
//! coefficients. `x` is the variable in its SI unit, `y` what the law adds at its port:
//!
//! | form | y |
//! |---|---|
//! | power | `a sign(x) abs(x)^p` |
//! | wave | `a sin(n x + phase)`; over time `a sin(2 pi f t + phase)` |
//! | bump | `a exp(-((x - at) / width)^2)` |
//! | ramp | `a x` |
//! | square | `a x^2`, or `a x abs(x)` |
//! | decay | `a (1 - exp(-t / time_constant))` |
//! | hysteresis | `-a z`, with `dz = (1 - z sign(dx)) dx / width`, `-1 <= z <= 1`: Dahl's |
//!
//! A new law is one entry of [`LAWS`]; a new form or port is one arm of [`Form::value`] or of a hook.

use core::f64::consts::PI;

use libm::{cos, exp, pow, sin};

use crate::channel::Channel;
use crate::effect::{
    ActiveEffect, Component, Descriptor, Effect, EffectState, JointPort, MAX_PARAMETERS, MotorPort,
    ParameterSpec, SensorPort, TransmissionPort,
};

/// Where a law acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// Torque on the rotor at the input pulley, N·m; positive accelerates it.
    MotorTorque,
    /// Dry friction of motor and gear at the input pulley, N·m; it opposes motion.
    MotorFriction,
    /// Friction coefficient of both sheaths, relative: `mu (1 + y)`.
    SheathFriction,
    /// Radius of the input pulley, relative: `r1 (1 + y)`.
    InputRadius,
    /// Radius of the output pulley, relative: `r2 (1 + y)`.
    OutputRadius,
    /// Length of both tendons, relative to what the pretension stretches them by; a longer tendon is less tight.
    TendonLength,
    /// Torque on the joint, N·m; positive accelerates it.
    JointTorque,
    /// Friction of the joint, N·m; it opposes motion.
    JointFriction,
    /// What a sensor shows beyond the true value, in the unit of its channel.
    Reading,
}

impl Port {
    /// Name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::MotorTorque => "motor_torque_nm",
            Self::MotorFriction => "motor_friction_nm",
            Self::SheathFriction => "sheath_friction",
            Self::InputRadius => "input_radius",
            Self::OutputRadius => "output_radius",
            Self::TendonLength => "tendon_length",
            Self::JointTorque => "joint_torque_nm",
            Self::JointFriction => "joint_friction_nm",
            Self::Reading => "reading",
        }
    }

    /// What acts there, for a sentence.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::MotorTorque => "torque on the motor, at the input pulley",
            Self::MotorFriction => "friction of motor and gear, at the input pulley",
            Self::SheathFriction => "friction coefficient of the sheaths, relative change",
            Self::InputRadius => "radius of the input pulley, relative change",
            Self::OutputRadius => "radius of the output pulley, relative change",
            Self::TendonLength => "length of both tendons, over what the pretension stretches them by",
            Self::JointTorque => "torque on the joint",
            Self::JointFriction => "friction of the joint, against its motion",
            Self::Reading => "reading of the sensor, shown minus true",
        }
    }
}

/// On what a law depends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variable {
    /// Angle of the input pulley (of the rotor, for a motor's law), rad.
    InputAngle,
    /// Speed of the rotor, in input-pulley rad/s.
    InputSpeed,
    /// Torque of the motor's current at the input pulley, N·m.
    MotorTorque,
    /// Angle of the joint, rad.
    JointAngle,
    /// Speed of the joint, rad/s.
    JointSpeed,
    /// Mean tension of a tendon over the pretension.
    RelativeTension,
    /// Time since the start of the recording, s.
    Time,
    /// True value of the sensor's channel, in its unit.
    Value,
}

impl Variable {
    /// Name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::InputAngle => "theta_in_rad",
            Self::InputSpeed => "omega_in_rad_s",
            Self::MotorTorque => "motor_torque_nm",
            Self::JointAngle => "theta_out_rad",
            Self::JointSpeed => "omega_out_rad_s",
            Self::RelativeTension => "relative_tension",
            Self::Time => "t_s",
            Self::Value => "value",
        }
    }
}

/// How a law depends on its variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// `a sign(x) abs(x)^p`, parameters `a`, `p`.
    Power,
    /// `a abs(x)^p`, parameters `a`, `p`.
    EvenPower,
    /// `a (abs(x)^p - 1)`: zero at `x = 1`, parameters `a`, `p`.
    PowerFromOne,
    /// `a sin(n x + phase)`, parameters `a`, `n`, `phase`.
    Wave,
    /// `a sin(2 pi f x + phase)`, parameters `a`, `f`, `phase`.
    Oscillation,
    /// `a exp(-((x - at) / width)^2)`, parameters `a`, `at`, `width`.
    Bump,
    /// `a x`, parameter `a`.
    Ramp,
    /// `a x^2`, parameter `a`.
    Square,
    /// `a x abs(x)`, parameter `a`.
    SignedSquare,
    /// `a (1 - exp(-x / time_constant))`, parameters `a`, `time_constant`.
    Decay,
    /// `-a z` with `dz = (1 - z sign(dx)) dx / width`, parameters `a`, `width`; it remembers the way to `x`.
    ///
    /// Source: Dahl, AIAA J. 14 (1976) 1675, with exponent 1.
    Hysteresis,
}

impl Form {
    /// The formula at `x`; 0 for one that remembers the way there, see [`Form::remembered`].
    #[must_use]
    pub fn value(self, p: &[f64; MAX_PARAMETERS], x: f64) -> f64 {
        match self {
            Self::Power => p[0] * pow(x.abs(), p[1]).copysign(x),
            Self::EvenPower => p[0] * pow(x.abs(), p[1]),
            Self::PowerFromOne => p[0] * (pow(x.abs(), p[1]) - 1.0),
            Self::Wave => p[0] * sin(p[1] * x + p[2]),
            Self::Oscillation => p[0] * sin(2.0 * PI * p[1] * x + p[2]),
            Self::Bump => {
                let place = (x - p[1]) / p[2];
                p[0] * exp(-place * place)
            }
            Self::Ramp => p[0] * x,
            Self::Square => p[0] * x * x,
            Self::SignedSquare => p[0] * x * x.abs(),
            Self::Decay => p[0] * (1.0 - exp(-x.max(0.0) / p[1])),
            Self::Hysteresis => 0.0,
        }
    }

    /// The formula at `x`, which it has reached by the way that `memory` tells; the way begins where it is first asked.
    #[must_use]
    pub fn remembered(self, p: &[f64; MAX_PARAMETERS], memory: &mut EffectState, x: f64) -> f64 {
        if self != Self::Hysteresis {
            return self.value(p, x);
        }
        let [z, last, begun, ..] = memory;
        let dx = if *begun == 0.0 { 0.0 } else { x - *last };
        (*last, *begun) = (x, 1.0);
        // Exact for any turn that goes one way: 1 - z sign(dx) falls by exp(-|dx| / width).
        let way = dx.signum();
        *z = way - (way - *z) * exp(-dx.abs() / p[1]);
        -p[0] * *z
    }

    /// Integral of the formula from 0 to `x`, for the forms that a radius may have; 0 for the others.
    #[must_use]
    pub fn integral(self, p: &[f64; MAX_PARAMETERS], x: f64) -> f64 {
        match self {
            Self::Wave => p[0] / p[1] * (cos(p[2]) - cos(p[1] * x + p[2])),
            Self::Ramp => 0.5 * p[0] * x * x,
            _ => 0.0,
        }
    }

    /// How what depends on it behaves, for a sentence.
    #[must_use]
    pub const fn behaviour(self) -> &'static str {
        match self {
            Self::Power | Self::EvenPower => "grows with a power of",
            Self::PowerFromOne => "changes with a power of",
            Self::Wave => "repeats along",
            Self::Oscillation => "oscillates over",
            Self::Bump => "is confined to one place of",
            Self::Ramp => "grows in proportion to",
            Self::Square | Self::SignedSquare => "grows with the square of",
            Self::Decay => "sets in exponentially over",
            Self::Hysteresis => "remembers the last reversal of",
        }
    }
}

/// Port, variable and form of a law, with its coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    port: Port,
    variable: Variable,
    form: Form,
    formula: &'static str,
    descriptor: &'static Descriptor,
}

impl Law {
    /// Where it acts.
    #[must_use]
    pub const fn port(&self) -> Port {
        self.port
    }

    /// On what it depends.
    #[must_use]
    pub const fn variable(&self) -> Variable {
        self.variable
    }

    /// How.
    #[must_use]
    pub const fn form(&self) -> Form {
        self.form
    }

    /// The formula as files write it.
    #[must_use]
    pub const fn formula(&self) -> &'static str {
        self.formula
    }
}

impl Effect for Law {
    fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    fn motor(&self, p: &[f64; MAX_PARAMETERS], state: &mut EffectState, port: &mut MotorPort) {
        let x = match self.variable {
            Variable::InputSpeed => port.omega_rad_s,
            Variable::MotorTorque => port.motor_torque_nm,
            Variable::Time => port.t_s,
            _ => port.theta_rad,
        };
        let y = self.form.remembered(p, state, x);
        match self.port {
            Port::MotorFriction => port.coulomb_nm = (port.coulomb_nm + y).max(0.0),
            _ => port.torque_nm += y,
        }
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        match self.port {
            Port::InputRadius | Port::OutputRadius => {
                let end = usize::from(self.port == Port::OutputRadius);
                let theta_rad = [port.theta_in_rad, port.theta_out_rad][end];
                port.radius_excess[end] += self.form.value(p, theta_rad);
                port.wound_excess_rad[end] += self.form.integral(p, theta_rad);
            }
            Port::TendonLength => {
                let x = match self.variable {
                    Variable::Time => port.t_s,
                    Variable::JointAngle => port.theta_out_rad,
                    _ => port.theta_in_rad,
                };
                let stretched_m = port.pretension_n / port.stiffness_n_per_m;
                let longer_m = stretched_m * self.form.value(p, x);
                for tendon in &mut port.tendons {
                    tendon.added_length_m += longer_m;
                }
            }
            _ => {
                let pretension_n = port.pretension_n;
                let (t_s, theta_in_rad) = (port.t_s, port.theta_in_rad);
                for tendon in &mut port.tendons {
                    let x = match self.variable {
                        Variable::RelativeTension => tendon.mean_tension_n.max(0.0) / pretension_n,
                        Variable::Time => t_s,
                        _ => theta_in_rad,
                    };
                    let factor = (1.0 + self.form.value(p, x)).max(0.0);
                    for slip in &mut tendon.slip {
                        slip.friction_coefficient *= factor;
                    }
                }
            }
        }
    }

    fn joint(&self, p: &[f64; MAX_PARAMETERS], state: &mut EffectState, port: &mut JointPort) {
        let x = match self.variable {
            Variable::JointSpeed => port.omega_rad_s,
            Variable::Time => port.t_s,
            _ => port.theta_rad,
        };
        let y = self.form.remembered(p, state, x);
        match self.port {
            Port::JointFriction => port.coulomb_nm = (port.coulomb_nm + y).max(0.0),
            _ => port.torque_nm += y,
        }
    }

    fn measure(&self, p: &[f64; MAX_PARAMETERS], state: &mut EffectState, port: &mut SensorPort) {
        let x = if self.variable == Variable::Time { port.t_s } else { port.value };
        port.value += self.form.remembered(p, state, x);
    }
}

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
const ANY_EXPONENT: ParameterSpec = ParameterSpec::linear("exponent", "1", [-3.0, 5.0], 1.0, "exponent");
const CYCLES: ParameterSpec =
    ParameterSpec::log("cycles_per_turn", "1", [0.3, 300.0], 4.0, "periods per turn");
const FREQUENCY: ParameterSpec = ParameterSpec::log("frequency_hz", "Hz", [0.05, 500.0], 5.0, "frequency");
const PHASE: ParameterSpec = ParameterSpec::linear("phase_rad", "rad", [-3.15, 3.15], 0.0, "phase at zero");
const AT: ParameterSpec = ParameterSpec::linear("at_rad", "rad", [-100.0, 100.0], 0.0, "place");
const WIDTH: ParameterSpec = ParameterSpec::log("width_rad", "rad", [0.005, 20.0], 0.15, "half width");
const TIME_CONSTANT: ParameterSpec =
    ParameterSpec::log("time_constant_s", "s", [0.5, 1000.0], 10.0, "time constant");

/// Size of a torque where a file does not say and where a search starts, in a joint of the paper's size.
const TORQUE: ParameterSpec =
    ParameterSpec::linear("amplitude_nm", "N·m", [-100.0, 100.0], 0.05, "amplitude");
const LOST: ParameterSpec =
    ParameterSpec::linear("amplitude", "1/(N·m)", [-10.0, 10.0], -0.02, "amplitude at 1 N·m");
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

const fn component_of(port: Port) -> Component {
    match port {
        Port::MotorTorque | Port::MotorFriction => Component::Motor,
        Port::SheathFriction | Port::InputRadius | Port::OutputRadius | Port::TendonLength => {
            Component::Transmission
        }
        Port::JointTorque | Port::JointFriction => Component::Joint,
        Port::Reading => Component::Sensors,
    }
}

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
                component: component_of(Port::$port),
                summary: Port::$port.meaning(),
                parameters: &[$($parameter),+],
                neutral: Some(0.0),
                channels: channels_of(Port::$port, Form::$form),
            },
        }
    };
}

/// All laws, input to output.
pub static LAWS: [Law; 30] = [
    law!(
        "law_motor_friction_by_speed",
        MotorFriction,
        InputSpeed,
        EvenPower,
        "amplitude_nm * abs(omega_in_rad_s)^exponent",
        [DRAG, EXPONENT]
    ),
    law!(
        "law_motor_friction_at_a_place",
        MotorFriction,
        InputAngle,
        Bump,
        "amplitude_nm * exp(-((theta_in_rad - at_rad) / width_rad)^2)",
        [RUB, AT, WIDTH]
    ),
    law!(
        "law_motor_torque_at_a_place",
        MotorTorque,
        InputAngle,
        Bump,
        "amplitude_nm * exp(-((theta_in_rad - at_rad) / width_rad)^2)",
        [TORQUE, AT, WIDTH]
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
        "amplitude * exp(-((theta_in_rad - at_rad) / width_rad)^2)",
        [RELATIVE, AT, WIDTH]
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
        "law_joint_friction_at_a_place",
        JointFriction,
        JointAngle,
        Bump,
        "amplitude_nm * exp(-((theta_out_rad - at_rad) / width_rad)^2)",
        [RUB, AT, WIDTH]
    ),
    law!(
        "law_joint_torque_at_a_place",
        JointTorque,
        JointAngle,
        Bump,
        "amplitude_nm * exp(-((theta_out_rad - at_rad) / width_rad)^2)",
        [TORQUE, AT, WIDTH]
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

/// The law that an effect of a simulation is, for physics that has a formula in place of a name.
#[must_use]
pub fn of(active: &ActiveEffect) -> Option<&'static Law> {
    LAWS.iter().find(|law| core::ptr::eq(law.descriptor, active.descriptor()))
}

/// The law with this identifier.
#[must_use]
pub fn find(id: &str) -> Option<&'static Law> {
    LAWS.iter().find(|law| law.descriptor.id == id)
}
