//! Effects that reality can hide from the user: one file each, the id is the file's name.
//!
//! Each effect is a plain struct of physical parameters. [`ConcealedEffect::drawn`] makes one of a given strength
//! (0 changes nothing, 1 is a clear fault) whose secondary parameters come from a seed.

use serde_json::{Map, Value};

use crate::config::BenchConfig;
use crate::draw::Draw;
use crate::error::BenchError;
use crate::size::Size;

/// Part of the bench that an effect sits in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Component {
    /// Drive, winding, rotor and gear.
    Motor,
    /// Tendons, sheaths and their terminals.
    Transmission,
    /// Output bearing, arm and weight.
    Joint,
    /// Encoders, tension channels and current channel.
    Sensors,
}

impl Component {
    /// Name as in a diagnosis.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Motor => "motor",
            Self::Transmission => "transmission",
            Self::Joint => "joint",
            Self::Sensors => "sensors",
        }
    }
}

/// A measured channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Encoder of the input pulley.
    ThetaIn,
    /// Encoder of the joint.
    ThetaOut,
    /// Tension of cable a at the motor.
    F1,
    /// Tension of cable a at the joint.
    F2,
    /// Tension of cable b at the motor.
    F3,
    /// Tension of cable b at the joint.
    F4,
    /// Motor current.
    Current,
}

impl Channel {
    /// Number of channels.
    pub(crate) const COUNT: usize = 7;
    /// The tension channels.
    pub(crate) const TENSIONS: [Self; 4] = [Self::F1, Self::F2, Self::F3, Self::F4];

    /// Column of the recording.
    pub fn column(self) -> &'static str {
        match self {
            Self::ThetaIn => "theta_in_rad",
            Self::ThetaOut => "theta_out_rad",
            Self::F1 => "f1_n",
            Self::F2 => "f2_n",
            Self::F3 => "f3_n",
            Self::F4 => "f4_n",
            Self::Current => "i_motor_a",
        }
    }
}

/// What every effect states about itself.
pub(crate) trait Describe: Sized {
    /// Where it sits.
    const COMPONENT: Component;
    /// True for physics that the catalogue of diagnoses has no name for.
    const OUTSIDE_CATALOGUE: bool = false;

    /// An instance of `strength`, secondary parameters from `draw`.
    fn drawn(strength: f64, draw: &mut Draw) -> Self;

    /// Makes an effect that is drawn for the nominal bench one that matters as much on a bench of another size.
    fn resize(&mut self, _size: &Size) {}

    /// Names (with unit) and values for the truth record.
    fn parameters(&self) -> Vec<(&'static str, Value)>;

    /// What the effect needs of the bench to be visible; changes the nominal and so the true bench.
    fn prepare(&self, _nominal: &mut BenchConfig) {}
}

/// Rises from 0 to 1 within `0..1` with zero slope at both ends.
pub(crate) fn smooth_step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

pub use unlisted_joint::JointLaw;
pub use unlisted_motor::MotorLaw;
pub use unlisted_sensor::SensorLaw;
pub use unlisted_transmission::TransmissionLaw;

macro_rules! effects {
    ($($id:ident: $name:ident,)+) => {
        $(mod $id; pub use $id::$name;)+

        /// One effect with its parameters.
        #[derive(Debug, Clone, PartialEq)]
        #[non_exhaustive]
        pub enum ConcealedEffect {
            $(#[doc = concat!("`", stringify!($id), "`")] $name($name),)+
        }

        /// Effects of a run, one slot each, so that the loop asks a flag and not a table.
        #[derive(Debug, Clone, Default, PartialEq)]
        pub(crate) struct ActiveEffects {
            $(pub(crate) $id: Option<$name>,)+
        }

        impl ActiveEffects {
            /// Sorts `effects` into slots.
            pub(crate) fn new(effects: &[ConcealedEffect]) -> Result<Self, BenchError> {
                let mut active = Self::default();
                for effect in effects {
                    match effect {
                        $(ConcealedEffect::$name(effect) => {
                            if active.$id.replace(effect.clone()).is_some() {
                                return Err(BenchError::DuplicateEffect { id: stringify!($id) });
                            }
                        })+
                    }
                }
                Ok(active)
            }
        }

        impl ConcealedEffect {
            /// Ids of all effects, those outside the catalogue last.
            pub const IDS: &'static [&'static str] = &[$(stringify!($id),)+];

            /// The effect `id` at `strength` (0 changes nothing, 1 is a clear fault, 5 the most), other parameters
            /// drawn from `seed`.
            ///
            /// # Errors
            /// [`BenchError::UnknownEffect`] or [`BenchError::Strength`].
            pub fn drawn(id: &str, strength: f64, seed: u64) -> Result<Self, BenchError> {
                if !(0.0..=5.0).contains(&strength) {
                    return Err(BenchError::Strength { id: id.to_owned(), got: strength });
                }
                let mut draw = Draw::new(seed, id);
                match id {
                    $(stringify!($id) => Ok(Self::$name($name::drawn(strength, &mut draw))),)+
                    _ => Err(BenchError::UnknownEffect { got: id.to_owned() }),
                }
            }

            /// Ids that the catalogue of diagnoses has.
            pub fn listed() -> impl Iterator<Item = &'static str> {
                let is_listed =
                    |id: &&str| Self::drawn(id, 1.0, 0).is_ok_and(|effect| !effect.is_outside_catalogue());
                Self::IDS.iter().copied().filter(is_listed)
            }

            /// The same for a bench of another size than the nominal one.
            #[must_use]
            pub fn sized(mut self, size: &Size) -> Self {
                match &mut self { $(Self::$name(effect) => effect.resize(size),)+ }
                self
            }

            /// Id as in the catalogue.
            pub fn id(&self) -> &'static str {
                match self { $(Self::$name(_) => stringify!($id),)+ }
            }

            /// Where the effect sits.
            pub fn component(&self) -> Component {
                match self { $(Self::$name(_) => $name::COMPONENT,)+ }
            }

            /// Whether no id of the catalogue names this physics, so that a diagnosis has to abstain.
            pub fn is_outside_catalogue(&self) -> bool {
                match self { $(Self::$name(_) => $name::OUTSIDE_CATALOGUE,)+ }
            }

            /// Parameters by name (with unit).
            pub fn parameters(&self) -> Map<String, Value> {
                let list = match self { $(Self::$name(effect) => effect.parameters(),)+ };
                list.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
            }

            /// Changes the nominal bench where the effect could not show otherwise: slack needs a low pretension.
            pub fn prepare(&self, nominal: &mut BenchConfig) {
                match self { $(Self::$name(effect) => effect.prepare(nominal),)+ }
            }
        }

        $(impl From<$name> for ConcealedEffect {
            fn from(effect: $name) -> Self { Self::$name(effect) }
        })+
    };
}

effects! {
    motor_coulomb_friction: MotorCoulombFriction,
    motor_viscous_friction: MotorViscousFriction,
    motor_stribeck_friction: MotorStribeckFriction,
    gear_load_friction: GearLoadFriction,
    gear_backlash: GearBacklash,
    motor_cogging: MotorCogging,
    drive_dead_zone: DriveDeadZone,
    winding_heating: WindingHeating,
    sheath_viscous_friction: SheathViscousFriction,
    sheath_stribeck_friction: SheathStribeckFriction,
    presliding_compliance: PreslidingCompliance,
    bending_friction: BendingFriction,
    asymmetric_friction: AsymmetricFriction,
    friction_drift: FrictionDrift,
    wrap_angle_varies_with_pose: WrapAngleVariesWithPose,
    wrap_angle_disturbed: WrapAngleDisturbed,
    tendon_slack: TendonSlack,
    tendon_stiffening: TendonStiffening,
    tendon_creep: TendonCreep,
    pretension_loss: PretensionLoss,
    transmission_backlash: TransmissionBacklash,
    joint_coulomb_friction: JointCoulombFriction,
    joint_viscous_friction: JointViscousFriction,
    joint_backlash: JointBacklash,
    joint_spring: JointSpring,
    end_stop_contact: EndStopContact,
    payload_change: PayloadChange,
    encoder_eccentricity: EncoderEccentricity,
    sensor_gain_error: SensorGainError,
    sensor_offset: SensorOffset,
    sensor_lag: SensorLag,
    sensor_saturation: SensorSaturation,
    sheath_kink_spot: KinkSpot,
    torque_constant_swing: TorqueConstantSwing,
    joint_magnetic_detent: JointMagneticDetent,
    joint_torque_ripple: JointTorqueRipple,
    sensor_hum: SensorHum,
    unlisted_motor: UnlistedMotor,
    unlisted_transmission: UnlistedTransmission,
    unlisted_joint: UnlistedJoint,
    unlisted_sensor: UnlistedSensor,
}
