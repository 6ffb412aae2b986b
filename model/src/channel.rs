//! The signals of a joint: what a recording may hold and a sensor may distort.

/// One column role of a recording; its unit is the suffix of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    /// Reference of the position loop, `theta_ref_rad`.
    ThetaRef,
    /// Rotor angle behind the gear, in input-pulley radians, `theta_motor_rad`.
    ThetaMotor,
    /// Input pulley, `theta_in_rad`.
    ThetaIn,
    /// Joint, `theta_out_rad`; 0 is the arm hanging straight down.
    ThetaOut,
    /// Tension of cable a at the input end, `f1_n`.
    F1,
    /// Tension of cable a at the output end, `f2_n`.
    F2,
    /// Tension of cable b at the input end, `f3_n`.
    F3,
    /// Tension of cable b at the output end, `f4_n`.
    F4,
    /// Torque of the input pulley on the cables, `(f1 - f3) r1`, `torque_in_nm`.
    TorqueIn,
    /// Torque of the cables on the joint, `(f2 - f4) r2`, `torque_out_nm`.
    TorqueOut,
    /// Bridge duty, -1 to 1, `duty`.
    Duty,
    /// Supply voltage of the bridge, `bus_v`.
    BusVoltage,
    /// Motor current, `i_motor_a`.
    MotorCurrent,
    /// Drive switched on (1) or open circuit (0), `drive_enable`.
    DriveEnable,
}

impl Channel {
    /// Every channel, in the order in which columns are written.
    pub const ALL: [Self; 14] = [
        Self::ThetaRef,
        Self::ThetaMotor,
        Self::ThetaIn,
        Self::ThetaOut,
        Self::F1,
        Self::F2,
        Self::F3,
        Self::F4,
        Self::TorqueIn,
        Self::TorqueOut,
        Self::Duty,
        Self::BusVoltage,
        Self::MotorCurrent,
        Self::DriveEnable,
    ];

    /// The four end tensions, cable a first, input end first.
    pub const TENSIONS: [Self; 4] = [Self::F1, Self::F2, Self::F3, Self::F4];

    /// What a sensor shows, and its faults distort: all but what is commanded and the supply.
    pub const SENSED: [Self; 10] = [
        Self::F1,
        Self::F2,
        Self::F3,
        Self::F4,
        Self::ThetaIn,
        Self::ThetaOut,
        Self::ThetaMotor,
        Self::TorqueIn,
        Self::TorqueOut,
        Self::MotorCurrent,
    ];

    /// Column role as files write it.
    #[must_use]
    pub const fn role(self) -> &'static str {
        match self {
            Self::ThetaRef => "theta_ref_rad",
            Self::ThetaMotor => "theta_motor_rad",
            Self::ThetaIn => "theta_in_rad",
            Self::ThetaOut => "theta_out_rad",
            Self::F1 => "f1_n",
            Self::F2 => "f2_n",
            Self::F3 => "f3_n",
            Self::F4 => "f4_n",
            Self::TorqueIn => "torque_in_nm",
            Self::TorqueOut => "torque_out_nm",
            Self::Duty => "duty",
            Self::BusVoltage => "bus_v",
            Self::MotorCurrent => "i_motor_a",
            Self::DriveEnable => "drive_enable",
        }
    }

    /// The channel of a column role, if it is one.
    #[must_use]
    pub fn from_role(role: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|channel| channel.role() == role)
    }

    /// Whether it is an angle, which an encoder counts.
    #[must_use]
    pub const fn is_angle(self) -> bool {
        matches!(self, Self::ThetaRef | Self::ThetaMotor | Self::ThetaIn | Self::ThetaOut)
    }

    /// Whether it is an angle, a tension or a torque that a sensor reads: masses and cables keep it from jumping there and back.
    #[must_use]
    pub const fn is_mechanical(self) -> bool {
        !matches!(
            self,
            Self::ThetaRef | Self::Duty | Self::DriveEnable | Self::BusVoltage | Self::MotorCurrent
        )
    }

    /// SI unit, as it stands in reports.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::ThetaRef | Self::ThetaMotor | Self::ThetaIn | Self::ThetaOut => "rad",
            Self::F1 | Self::F2 | Self::F3 | Self::F4 => "N",
            Self::TorqueIn | Self::TorqueOut => "N m",
            Self::Duty | Self::DriveEnable => "1",
            Self::BusVoltage => "V",
            Self::MotorCurrent => "A",
        }
    }
}
