//! Position compensator: Eq. (25)-(26).
//!
//! To bring the output to `theta_d` the input has to stand at `theta_c = (r2/r1)(theta_d + phi)`, from Eq. (22). The paper
//! has this factor on phi (26) but not on `theta_d` (25), which is right for r1 = r2 only.

use super::capstan::Direction;
use super::displacement_transmission::{lag_angle_rad, measured_lag_angle_rad};
use super::error::{PaperError, finite, not_negative};
use super::pair::TendonPair;
use super::torque::LoopTorque;

/// Where the lag angle phi comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LagSource {
    /// Eq. (20). The output torque is the safe choice: it is continuous through a turn. With the input torque, (26) is
    /// right in slip only; just after a turn `T_in` still has its old value and phi steps the wrong way, by as much as
    /// it should step the right way.
    Torque(LoopTorque),
    /// Both encoders, rad: the way of the paper's experiment, where K is disturbed and unknown. phi is the last
    /// measured one, so `theta_c` then accumulates the output error once a step: an integrator whose gain is the step rate.
    Encoders {
        /// Input angle, rad.
        theta_in_rad: f64,
        /// Output angle, rad.
        theta_out_rad: f64,
    },
}

/// Parameters of the compensator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompensatorConfig {
    pair: TendonPair,
    speed_threshold_rad_s: f64,
}

impl CompensatorConfig {
    /// `pair`: the tendons; `speed_threshold_rad_s` ≥ 0: desired speeds up to this magnitude count as standstill, rad/s
    /// (0 in the paper; above the speed noise of a measured reference, so that the friction sign does not chatter).
    ///
    /// # Errors
    /// [`PaperError::OutOfRange`] if the threshold is negative or not finite.
    pub fn new(pair: TendonPair, speed_threshold_rad_s: f64) -> Result<Self, PaperError> {
        Ok(Self {
            pair,
            speed_threshold_rad_s: not_negative("speed_threshold_rad_s", speed_threshold_rad_s)?,
        })
    }
}

/// Memory of Eq. (26): the friction term while the reference stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompensatorState {
    theta_f_rad: f64,
}

/// Result of one step of [`CompensatorState::step`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompensatorOutput {
    /// Angle the input pulley is to take, rad.
    pub theta_c_rad: f64,
    /// Its friction and stretch part `theta_f = (r2/r1) phi`, rad at the input.
    pub theta_f_rad: f64,
}

impl CompensatorState {
    /// Compensator that has not moved yet: `theta_f` = 0.
    pub fn new() -> Self {
        Self::default()
    }

    /// One step: `theta_c = (r2/r1) theta_d + theta_f`, Eq. (25) with the pulley ratio.
    ///
    /// Eq. (26): `theta_f = (r2/r1) phi_s` for omega > threshold, `(r2/r1) phi_n` for omega < -threshold, else as before.
    /// `theta_d_rad`: desired output angle, rad; `omega_d_rad_s`: desired output speed, rad/s. The paper takes
    /// `omega_in`, which depends on `theta_c` in the same step and is itself turned by the jump of `theta_f`; the desired
    /// speed has the same sign in slip. In slip the output then stands at `theta_d`, error below 1e-11 rad for exact
    /// parameters and [`LoopTorque::Output`].
    ///
    /// # Errors
    /// [`PaperError::OutOfRange`] if an input is not finite; the state is left as it was.
    pub fn step(
        &mut self,
        config: &CompensatorConfig,
        theta_d_rad: f64,
        omega_d_rad_s: f64,
        lag: LagSource,
    ) -> Result<CompensatorOutput, PaperError> {
        let pair = &config.pair;
        let ratio = pair.output_radius_m() / pair.input_radius_m();
        finite("theta_d_rad", theta_d_rad)?;
        finite("omega_d_rad_s", omega_d_rad_s)?;
        let moving = omega_d_rad_s.abs() > config.speed_threshold_rad_s;
        let direction = Direction::of_speed(omega_d_rad_s).filter(|_| moving);
        let lag_rad = match lag {
            LagSource::Torque(torque) => {
                match torque {
                    LoopTorque::Input(t_nm) => finite("torque_in_nm", t_nm)?,
                    LoopTorque::Output(t_nm) => finite("torque_out_nm", t_nm)?,
                };
                direction.map(|direction| lag_angle_rad(pair, direction, torque))
            }
            LagSource::Encoders { theta_in_rad, theta_out_rad } => {
                finite("theta_in_rad", theta_in_rad)?;
                finite("theta_out_rad", theta_out_rad)?;
                direction.map(|_| measured_lag_angle_rad(pair, theta_in_rad, theta_out_rad))
            }
        };
        if let Some(lag_rad) = lag_rad {
            self.theta_f_rad = ratio * lag_rad;
        }
        Ok(CompensatorOutput {
            theta_c_rad: ratio * theta_d_rad + self.theta_f_rad,
            theta_f_rad: self.theta_f_rad,
        })
    }
}
