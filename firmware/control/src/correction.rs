//! What a diagnosis finds beyond the nominal joint, made up for: fixed-point terms with a limit and a switch each.
//!
//! | term | equation | where it acts |
//! |---|---|---|
//! | [`motor_friction`] | `s (τ_c + τ_e f(ω))` | torque of the motor |
//! | [`gear_friction`] | `s c \|T_in\|` | torque of the motor |
//! | [`cogging`] | `-Σ A sin(n θ + φ)` | torque of the motor |
//! | [`dead_zone`] | `d + d_0 s(d)` | duty |
//! | [`joint`] | `s τ_c + k (θ - θ_0)` | torque asked of the joint, stretch of the tendons |
//! | [`sheath`] | friction beyond `mu K` | for the compensator |
//! | [`backlash`] | half a gap towards the torque | for the compensator |
//! | [`eccentricity`] | `-A (sin(y + φ) - sin φ)` | angle of an encoder |
//!
//! All are off by default and change no bit then. `s`, the smooth sign, and `f`, the fade with speed, are in [`shape`].
//!
//! The direction of motion is that of the reference in position mode, which knows a reversal ahead of the encoder and cannot
//! feed back. In torque mode it is that of the input pulley, and while this stands, that of the torque's rate.

pub mod backlash;
pub mod cogging;
pub mod dead_zone;
pub mod eccentricity;
pub mod gear_friction;
pub mod joint;
pub mod lead;
pub mod motor_friction;
pub mod shape;
pub mod sheath;

use crate::parameters::Parameters;
use crate::scale::{Angle, Share, Speed, Torque};
use cogging::Cogging;
use gear_friction::GearFriction;
use motor_friction::MotorFriction;
use shape::SmoothSign;

/// Torques of motor and gear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorCorrection {
    /// Smooth sign of the desired speed of the input pulley.
    pub direction: SmoothSign<Speed>,
    friction: MotorFriction,
    gear: GearFriction,
    cogging: Cogging,
    /// One of them is switched on.
    acts: bool,
}

impl MotorCorrection {
    /// The torques of these parameters; `None` if a value is beyond what fixed point holds.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Option<Self> {
        let own = &parameters.correction;
        let switches = [own.motor_friction.enable, own.gear_friction.enable, own.cogging.enable];
        Some(Self {
            direction: SmoothSign::new(own.reversal_speed)?,
            friction: MotorFriction::new(parameters)?,
            gear: GearFriction::new(parameters)?,
            cogging: Cogging::new(parameters),
            acts: switches.iter().any(|switch| *switch != 0.0),
        })
    }

    /// Torque to add at the input pulley: for its direction and speed, its observed angle, and the torque of the tendons.
    #[must_use]
    #[inline]
    pub fn torque(&self, direction: Share, speed: Speed, angle: Angle, carried: Torque) -> Torque {
        if !self.acts {
            return Torque::ZERO;
        }
        self.friction
            .torque(direction, speed)
            .plus(self.gear.torque(direction, carried))
            .plus(self.cogging.torque(angle))
    }

    /// The same in the direction of a speed.
    #[must_use]
    #[inline]
    pub fn torque_along(&self, speed: Speed, angle: Angle, carried: Torque) -> Torque {
        if !self.acts {
            return Torque::ZERO;
        }
        self.torque(self.direction.of(speed), speed, angle, carried)
    }
}
