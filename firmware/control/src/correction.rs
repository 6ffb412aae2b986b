//! What a diagnosis finds beyond the nominal joint, made up for: fixed-point terms with a limit and a switch each.
//!
//! | term | equation | where it acts |
//! |---|---|---|
//! | [`motor_friction`] | `s (τ_c + τ_e f(ω))` | torque of the motor |
//! | [`gear_friction`] | `s c \|T_in\|` | torque of the motor |
//! | [`cogging`] | `-Σ A sin(n θ + φ)` | torque of the motor |
//! | [`ripple_table`] | `-s p(θ)`, in place of [`cogging`] | torque of the motor |
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
pub mod ripple_table;
pub mod shape;
pub mod sheath;

use crate::parameters::Parameters;
use crate::scale::{Angle, Quantity, Share, Speed, Torque};
use cogging::Cogging;
use gear_friction::GearFriction;
use motor_friction::MotorFriction;
use ripple_table::RippleTable;
use shape::SmoothSign;

/// Torques of motor and gear: friction and ripple.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorCorrection {
    /// Smooth sign of the desired speed of the input pulley.
    pub direction: SmoothSign<Speed>,
    friction: MotorFriction,
    gear: GearFriction,
    cogging: Cogging,
    /// Largest torque of the table; 0 while it is switched off.
    table_limit: Torque,
    /// One of the frictions is switched on.
    acts: bool,
}

impl MotorCorrection {
    /// The torques of these parameters; `None` if a value is beyond what fixed point holds.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Option<Self> {
        let own = &parameters.correction;
        let switches = [own.motor_friction.enable, own.gear_friction.enable];
        Some(Self {
            direction: SmoothSign::new(own.reversal_speed)?,
            friction: MotorFriction::new(parameters)?,
            gear: GearFriction::new(parameters)?,
            cogging: Cogging::new(parameters),
            table_limit: Torque::from_f32(own.ripple_table.enable * own.ripple_table.limit),
            acts: switches.iter().any(|switch| *switch != 0.0),
        })
    }

    /// Torque that cancels the ripple at an observed angle of the input pulley: by the table, where there is one and it is
    /// switched on, else by harmonics.
    #[must_use]
    #[inline]
    pub fn ripple(&self, table: Option<&RippleTable>, angle: Angle) -> Torque {
        match table {
            Some(table) if self.table_limit != Torque::ZERO => {
                table.torque(angle).negated().limited(self.table_limit)
            }
            _ => self.cogging.torque(angle),
        }
    }

    /// Torque to add at the input pulley for friction: for its direction and speed, and the torque of the tendons.
    #[must_use]
    #[inline]
    pub fn torque(&self, direction: Share, speed: Speed, carried: Torque) -> Torque {
        if !self.acts {
            return Torque::ZERO;
        }
        self.friction.torque(direction, speed).plus(self.gear.torque(direction, carried))
    }

    /// The same in the direction of a speed.
    #[must_use]
    #[inline]
    pub fn torque_along(&self, speed: Speed, carried: Torque) -> Torque {
        if !self.acts {
            return Torque::ZERO;
        }
        self.torque(self.direction.of(speed), speed, carried)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table that is 0.4 N·m everywhere, and a harmonic that is 0.25 N·m at zero.
    fn ripple(enable: f32, limit: f32, table: bool, cogging: f32) -> f32 {
        let mut parameters = Parameters::default();
        let own = &mut parameters.correction;
        (own.ripple_table.enable, own.ripple_table.limit) = (enable, limit);
        (own.cogging.enable, own.cogging.amplitude_1) = (cogging, 0.25);
        own.cogging.phase_1 = core::f32::consts::FRAC_PI_2;
        let flat = RippleTable::new(1.0, 0.8, &[16_384; 256]).unwrap();
        let motor = MotorCorrection::new(&parameters).unwrap();
        motor.ripple(table.then_some(&flat), Angle::ZERO).to_f32()
    }

    #[test]
    fn the_table_stands_in_the_place_of_the_harmonics_while_it_is_on_and_there() {
        let near = |got: f32, expected: f32| assert!((got - expected).abs() < 2e-6, "{got} for {expected}");
        near(ripple(1.0, 0.5, true, 1.0), -0.4);
        near(ripple(1.0, 0.3, true, 1.0), -0.3);
        near(ripple(1.0, 0.5, true, 0.0), -0.4);
        // Off, without a limit to act in, or without a table.
        near(ripple(0.0, 0.5, true, 1.0), -0.25);
        near(ripple(1.0, 0.0, true, 1.0), -0.25);
        near(ripple(1.0, 0.5, false, 1.0), -0.25);
        near(ripple(0.0, 0.5, true, 0.0), 0.0);
    }
}
