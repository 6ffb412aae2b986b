//! States, faults and limits. The numbers are part of the protocol and of stored records: never reused.

use core::fmt;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// What the board does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum State {
    /// Bridge off, nothing checked.
    #[default]
    Off = 0,
    /// Bridge off; sensors, supply and parameters are being checked.
    SelfTest = 1,
    /// Bridge off; tensions at rest are compared with the pretension.
    PretensionCheck = 2,
    /// Bridge off; all checks passed.
    Ready = 3,
    /// Bridge on; the joint moves slowly to angle zero.
    Homing = 4,
    /// Bridge on; the joint follows its reference.
    Run = 5,
    /// Bridge off; a fault is recorded and waits to be cleared.
    Fault = 6,
}

impl State {
    /// The state with this number.
    #[must_use]
    pub const fn from_number(number: u8) -> Option<Self> {
        Some(match number {
            0 => Self::Off,
            1 => Self::SelfTest,
            2 => Self::PretensionCheck,
            3 => Self::Ready,
            4 => Self::Homing,
            5 => Self::Run,
            6 => Self::Fault,
            _ => return None,
        })
    }

    /// Whether the bridge may drive the motor.
    #[must_use]
    pub const fn drives(self) -> bool {
        matches!(self, Self::Homing | Self::Run)
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Off => "off",
            Self::SelfTest => "self test",
            Self::PretensionCheck => "pretension check",
            Self::Ready => "ready",
            Self::Homing => "homing",
            Self::Run => "run",
            Self::Fault => "fault",
        })
    }
}

macro_rules! faults {
    ($($number:literal $name:ident $unit:literal $title:literal $next:literal;)+) => {
        /// Why the board switched the motor off.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, Schema)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[repr(u8)]
        pub enum Fault {
            $(#[doc = concat!($title, "; unit of got and limit: `", $unit, "`.")] $name = $number,)+
        }

        impl Fault {
            /// Every fault.
            pub const ALL: &[Self] = &[$(Self::$name,)+];

            /// The fault with this number.
            #[must_use]
            pub const fn from_number(number: u8) -> Option<Self> {
                match number {
                    $($number => Some(Self::$name),)+
                    _ => None,
                }
            }

            /// Unit of `got` and `limit` in a [`FaultRecord`]; empty for a bare number.
            #[must_use]
            pub const fn unit(self) -> &'static str {
                match self { $(Self::$name => $unit,)+ }
            }

            /// What happened, in words.
            #[must_use]
            pub const fn title(self) -> &'static str {
                match self { $(Self::$name => $title,)+ }
            }

            /// What to do about it.
            #[must_use]
            pub const fn next_step(self) -> &'static str {
                match self { $(Self::$name => $next,)+ }
            }
        }
    };
}

faults! {
    1 EncoderCheck "bad frames" "check bits of an encoder frame are wrong" "shield the line, look for a cut wire or a missing supply";
    2 EncoderParity "bad frames" "parity of an encoder frame is wrong" "shield the line or slow the clock";
    3 EncoderStatus "bad frames" "the encoder says that its angle does not hold" "centre the magnet and check its distance";
    4 EncoderMissing "ticks" "no new encoder frame came" "check the encoder's wiring and the bus";
    5 EncoderStuck "rad" "an encoder stands while the other one moves" "check the encoder's coupling and the tendons";
    6 EncoderJump "rad/s" "an encoder jumped faster than the joint can move" "check the encoder's coupling and supply";
    7 JointSpeed "rad/s" "the joint turns faster than it may" "look for a load that drives it, or raise supervisor.joint_speed";
    8 JointRange "rad" "the joint is beyond its range" "bring it back with homing, or look for what pushes it";
    9 TrackingError "rad" "the joint does not follow its reference" "look for a blocked or disconnected joint, or raise supervisor.tracking_error";
    10 TensionRail "V" "a tension channel is at a rail" "look for a broken wire between amplifier and load cell";
    11 Slack "N" "a tendon is slack" "restore the pretension";
    12 OverTension "N" "a tendon is pulled beyond its limit" "look for a blocked joint, or lower the reference";
    13 TensionInconsistent "N" "tensions at the two ends of a sheath do not fit its friction" "check gain and zero of the tension channels, and the sheath parameters";
    14 StretchInconsistent "N" "the tensions of a cable do not fit its stretch, which both encoders tell" "check gain, zero and order of the tension channels, the encoders' zeros, and the pretension";
    15 TensionStuck "N" "a tension channel stands while another one moves" "look for an amplifier that hangs, or a channel without noise";
    16 TensionSwapped "N" "tensions change as those of exchanged channels do, against friction or load" "check which channel is plugged in where (bowden calibrate), then encoder.input.direction";
    17 TensionRestless "codes" "a tension channel jumps about while the joint is driven" "look for a loose contact and shield the line, or raise supervisor.tension_noise";
    20 OverCurrent "A" "motor current is beyond its limit" "look for a short circuit or a blocked motor";
    21 BusUnderVoltage "V" "bus voltage is too low" "check the supply";
    22 BusOverVoltage "V" "bus voltage is too high" "check the supply; braking may feed energy back";
    23 BridgeFault "" "the bridge reports a fault and switched itself off" "look for over-temperature or a short circuit of the bridge";
    24 WindingHot "A" "the motor's winding is too hot, as its current tells" "let it cool; hold less weight, or correct motor.continuous_current and motor.winding_time";
    25 MotorOpen "A" "no current flows through the motor, though its voltage should make one" "look for a broken or unplugged lead of the motor, then for a dead current sensor";
    26 MotorCurrent "A" "more current flows than the motor's voltage makes" "look for a leg of the bridge that stays at a rail and a short of the motor, then check motor.resistance and the current channel";
    27 DriverWarning "ms" "the gate driver pulled its fault line low and let go of it" "let the driver cool and check its supply: that is how it warns; else look for what disturbs the line";
    30 TickOverrun "ticks" "control ticks came too late or were missed" "lower the control rate";
    31 HostSilent "s" "the host fell silent while the joint was moving" "check the cable and the program that sends references";
    32 ParameterStoreCorrupt "" "the stored parameters cannot be read" "store the parameters again; defaults are in use";
    33 Watchdog "" "the watchdog reset the board" "report this with the log";
    34 Panic "" "the firmware stopped itself" "report this with the panic text";
    35 HardFault "" "the processor met an instruction or address that it cannot use" "report this with the fault record";
    36 RippleTableCorrupt "" "the stored ripple table cannot be read" "write the table anew or clear it, then store: bowden params table";
    37 ClockFailed "" "the crystal of the processor stopped" "check the crystal; until it runs again, times are good to 1 % only";
    38 FlashDamaged "" "a word of the flash is damaged" "flash the image again; if it comes back, replace the board";
    39 ProcessorSupply "" "the supply of the processor fell below 2.9 V" "check the 3.3 V and 5 V supplies, and what shares them";
    40 SelfTestTimeout "s" "the self test did not end in time" "see which sensor is not steady at rest";
    41 PretensionOff "N" "tension at rest is not the pretension" "set the pretension, or correct the parameter tendon.pretension";
    42 HomingTimeout "s" "the joint did not reach angle zero in time" "look for a blocked joint or a wrong encoder direction";
    50 FlashBanks "banks" "the flash is set up as one bank, so that nothing can be stored" "set the option bit DBANK and flash the image again";
    51 RestartLoop "resets" "the board restarted again and again before a host was there" "read the panic text, then reset the board; report this if it comes back";
    52 StackOverflow "" "the firmware's stack ran over its end" "report this with the panic text";
}

/// A fault with its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FaultRecord {
    /// What happened.
    pub fault: Fault,
    /// Which one: encoder 0 input, 1 joint; tension channel 0 to 3 for f1 to f4; 0 where there is one only.
    pub channel: u8,
    /// Control tick of the detection, counted from boot.
    pub tick: u32,
    /// What was measured, in [`Fault::unit`].
    pub got: f32,
    /// What is allowed, in [`Fault::unit`].
    pub limit: f32,
}

impl FaultRecord {
    /// Name of the channel, empty where there is one only.
    #[must_use]
    pub const fn channel_name(&self) -> &'static str {
        match (self.fault as u8, self.channel) {
            (1..=6, 0) => "input encoder",
            (1..=6, _) => "joint encoder",
            (10..=12 | 15 | 17 | 41, 0) => "f1",
            (10..=12 | 15 | 17 | 41, 1) => "f2",
            (10..=12 | 15 | 17 | 41, 2) => "f3",
            (10..=12 | 15 | 17 | 41, _) => "f4",
            (13 | 14, 0) => "cable a",
            (13 | 14, _) => "cable b",
            (16, 0) => "f1 and f3",
            (16, 1) => "f2 and f4",
            (16, 2) => "f1 and f2",
            (16, _) => "f3 and f4",
            _ => "",
        }
    }
}

impl fmt::Display for FaultRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { fault, tick, got, limit, .. } = self;
        write!(f, "fault {}", *fault as u8)?;
        let channel = self.channel_name();
        if !channel.is_empty() {
            write!(f, ", {channel}")?;
        }
        write!(f, ": {}", fault.title())?;
        let unit = fault.unit();
        if !unit.is_empty() {
            write!(f, " ({got:.4} {unit}, limit {limit:.4} {unit})")?;
        }
        write!(f, " at tick {tick}; {}", fault.next_step())
    }
}

/// Something that acts without stopping, a bit in [`Limits`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Limit {
    /// The duty is at its limit.
    Duty = 1,
    /// The duty is reduced to hold the motor current.
    Current = 1 << 1,
    /// The speed of the reference is limited.
    ReferenceSpeed = 1 << 2,
    /// The reference is clamped to its range.
    ReferenceRange = 1 << 3,
    /// The compensation angle is at its limit.
    Compensation = 1 << 4,
    /// The integrator rests.
    Integrator = 1 << 5,
    /// The stream of references ran empty; the last one is held.
    StreamEmpty = 1 << 6,
    /// An encoder frame was bad and the angle before it is used on.
    FrameRepaired = 1 << 7,
    /// The magnet of an encoder is at the edge of its range.
    MagnetMarginal = 1 << 8,
    /// The acceleration or the jerk of the reference is limited.
    ReferenceAcceleration = 1 << 9,
    /// The output torque is held at the limit of the modes that yield.
    OutputTorque = 1 << 10,
}

impl Limit {
    /// Every limit.
    pub const ALL: [Self; 11] = [
        Self::Duty,
        Self::Current,
        Self::ReferenceSpeed,
        Self::ReferenceRange,
        Self::Compensation,
        Self::Integrator,
        Self::StreamEmpty,
        Self::FrameRepaired,
        Self::MagnetMarginal,
        Self::ReferenceAcceleration,
        Self::OutputTorque,
    ];

    /// In words.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Duty => "duty at its limit",
            Self::Current => "current limited",
            Self::ReferenceSpeed => "reference speed limited",
            Self::ReferenceRange => "reference clamped to its range",
            Self::Compensation => "compensation at its limit",
            Self::Integrator => "integrator resting",
            Self::StreamEmpty => "reference stream empty, last one held",
            Self::FrameRepaired => "encoder frame repaired",
            Self::MagnetMarginal => "encoder magnet marginal",
            Self::ReferenceAcceleration => "reference acceleration limited",
            Self::OutputTorque => "output torque at its limit",
        }
    }
}

/// Set of limits that act.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits(pub u16);

impl Limits {
    /// Adds `limit`.
    pub const fn insert(&mut self, limit: Limit) {
        self.0 |= limit as u16;
    }

    /// Whether `limit` acts.
    #[must_use]
    pub const fn contains(self, limit: Limit) -> bool {
        self.0 & limit as u16 != 0
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    #[test]
    fn numbers_lead_back_to_their_codes() {
        for fault in Fault::ALL {
            assert_eq!(Fault::from_number(*fault as u8), Some(*fault));
        }
        assert_eq!(Fault::from_number(0), None);
        for number in 0..=6 {
            assert_eq!(State::from_number(number).map(|state| state as u8), Some(number));
        }
        assert_eq!(State::from_number(7), None);
    }

    #[test]
    fn a_stop_says_why_in_words() {
        let record = FaultRecord { fault: Fault::Slack, channel: 2, tick: 71_204, got: 0.31, limit: 2.0 };
        assert_eq!(
            record.to_string(),
            "fault 11, f3: a tendon is slack (0.3100 N, limit 2.0000 N) at tick 71204; restore the pretension"
        );
    }

    #[test]
    fn limits_do_not_share_bits() {
        let mut all = Limits::default();
        for limit in Limit::ALL {
            assert!(!all.contains(limit), "{limit:?}");
            all.insert(limit);
        }
        assert_eq!(all.0.count_ones() as usize, Limit::ALL.len());
    }
}
