//! Where a law acts, and on what it may depend there.

use crate::effect::{Component, JointPort, MotorPort, SensorPort, TendonPort, TransmissionPort};

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
    /// All ports, input to output.
    pub const ALL: [Self; 9] = [
        Self::MotorTorque,
        Self::MotorFriction,
        Self::SheathFriction,
        Self::InputRadius,
        Self::OutputRadius,
        Self::TendonLength,
        Self::JointTorque,
        Self::JointFriction,
        Self::Reading,
    ];

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

    /// Unit of what is added there; for a reading that of its channel.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::MotorTorque | Self::MotorFriction | Self::JointTorque | Self::JointFriction => "N·m",
            Self::SheathFriction | Self::InputRadius | Self::OutputRadius | Self::TendonLength => "1",
            Self::Reading => "unit of the channel",
        }
    }

    /// Part of the joint that it belongs to.
    #[must_use]
    pub const fn component(self) -> Component {
        match self {
            Self::MotorTorque | Self::MotorFriction => Component::Motor,
            Self::SheathFriction | Self::InputRadius | Self::OutputRadius | Self::TendonLength => {
                Component::Transmission
            }
            Self::JointTorque | Self::JointFriction => Component::Joint,
            Self::Reading => Component::Sensors,
        }
    }

    /// Variables that a law may depend on there.
    #[must_use]
    pub const fn variables(self) -> &'static [Variable] {
        match self {
            Self::MotorTorque | Self::MotorFriction => {
                &[Variable::InputAngle, Variable::InputSpeed, Variable::MotorTorque, Variable::Time]
            }
            Self::SheathFriction => {
                &[Variable::InputAngle, Variable::JointAngle, Variable::RelativeTension, Variable::Time]
            }
            Self::TendonLength => &[Variable::InputAngle, Variable::JointAngle, Variable::Time],
            Self::InputRadius => &[Variable::InputAngle],
            Self::OutputRadius => &[Variable::JointAngle],
            Self::JointTorque | Self::JointFriction => {
                &[Variable::JointAngle, Variable::JointSpeed, Variable::Time]
            }
            Self::Reading => &[Variable::Value, Variable::Time],
        }
    }

    /// Adds `y` to the motor's torque, or to its dry friction, which never falls below zero.
    pub fn add_at_motor(self, y: f64, port: &mut MotorPort) {
        match self {
            Self::MotorFriction => port.coulomb_nm = (port.coulomb_nm + y).max(0.0),
            _ => port.torque_nm += y,
        }
    }

    /// Adds `y` to the torque on the joint, or to its dry friction, which never falls below zero.
    pub fn add_at_joint(self, y: f64, port: &mut JointPort) {
        match self {
            Self::JointFriction => port.coulomb_nm = (port.coulomb_nm + y).max(0.0),
            _ => port.torque_nm += y,
        }
    }

    /// Adds what `y` says of each tendon to its length, or to the friction of its sheath, which never falls below zero.
    pub fn add_at_tendons(
        self,
        port: &mut TransmissionPort,
        y: impl Fn(&TransmissionPort, &TendonPort) -> f64,
    ) {
        let seen = *port;
        for (tendon, as_seen) in port.tendons.iter_mut().zip(&seen.tendons) {
            let y = y(&seen, as_seen);
            if self == Self::TendonLength {
                let stretched_m = seen.pretension_n / seen.stiffness_n_per_m;
                tendon.added_length_m += stretched_m * y;
            } else {
                let factor = (1.0 + y).max(0.0);
                for slip in &mut tendon.slip {
                    slip.friction_coefficient *= factor;
                }
            }
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
    /// All variables.
    pub const ALL: [Self; 8] = [
        Self::InputAngle,
        Self::InputSpeed,
        Self::MotorTorque,
        Self::JointAngle,
        Self::JointSpeed,
        Self::RelativeTension,
        Self::Time,
        Self::Value,
    ];

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

    /// Its unit; for a value of a sensor that of its channel.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::InputAngle | Self::JointAngle => "rad",
            Self::InputSpeed | Self::JointSpeed => "rad/s",
            Self::MotorTorque => "N·m",
            Self::RelativeTension => "1",
            Self::Time => "s",
            Self::Value => "unit of the channel",
        }
    }

    /// The one that a file calls so.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|variable| variable.name() == name)
    }

    /// Its value at the motor: angle of the rotor where the motor has no such variable.
    #[must_use]
    pub const fn at_motor(self, port: &MotorPort) -> f64 {
        match self {
            Self::InputSpeed => port.omega_rad_s,
            Self::MotorTorque => port.motor_torque_nm,
            Self::Time => port.t_s,
            _ => port.theta_rad,
        }
    }

    /// Its value at a tendon: angle of the input pulley where a tendon has no such variable.
    #[must_use]
    pub fn at_tendon(self, port: &TransmissionPort, tendon: &TendonPort) -> f64 {
        match self {
            Self::RelativeTension => tendon.mean_tension_n.max(0.0) / port.pretension_n,
            Self::Time => port.t_s,
            Self::JointAngle => port.theta_out_rad,
            _ => port.theta_in_rad,
        }
    }

    /// Its value at the joint: angle of the joint where that has no such variable.
    #[must_use]
    pub const fn at_joint(self, port: &JointPort) -> f64 {
        match self {
            Self::JointSpeed => port.omega_rad_s,
            Self::Time => port.t_s,
            _ => port.theta_rad,
        }
    }

    /// Its value at a sensor: the true value where a sensor has no such variable.
    #[must_use]
    pub const fn at_sensor(self, port: &SensorPort) -> f64 {
        if matches!(self, Self::Time) { port.t_s } else { port.value }
    }
}
