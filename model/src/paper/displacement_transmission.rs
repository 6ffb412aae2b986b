//! Displacement transmission with its dead zone: Eq. (18)-(24).
//!
//! `phi` is an angle at the output pulley. Written with `T_in` (the paper) it holds in slip only and, at one `T_in`, is
//! larger in - than in + motion; written with `T_out` it is larger in + motion, and the difference is the dead zone.

use super::capstan::Direction;
use super::error::{PaperError, finite};
use super::pair::TendonPair;
use super::phase::Regime;
use super::torque::LoopTorque;

/// Lag angle `phi = (r1/r2) theta_in - theta_out` of a pair that slips in `direction`, rad at the output: Eq. (20).
///
/// With `psi_p`, `psi_r` > 0, sum S and difference D of the two, upper sign (`phi_s`) in + and lower sign (`phi_n`) in - motion:
/// from `T_in`: `phi = (T_in psi_r psi_p ∓ F0 L r1 D) / (EA r1 r2 S)`;
/// from `T_out`: `phi = (T_out psi_r psi_p ± F0 L r2 D) / (EA r2² S)`, stretch lengths counted from the output end.
/// Even curvature: `phi = (L tanh(mu K/2) / (EA r2)) (T_out / (mu K r2) ± F0)`. Holds for either sign of the tensions;
/// for
/// even curvature and `T_in` within 1e-12 rad of the integrated stretch, mu K = 0 included.
pub fn lag_angle_rad(pair: &TendonPair, direction: Direction, torque: LoopTorque) -> f64 {
    let pretension_nm = pair.pretension_n() * pair.path().length_m();
    let stretch_nm = match torque {
        LoopTorque::Input(t_in_nm) => {
            let lengths = pair.path().from_input();
            t_in_nm / pair.input_radius_m() * lengths.parallel_m()
                - direction.sign() * pretension_nm * lengths.difference_m / lengths.sum_m()
        }
        LoopTorque::Output(t_out_nm) => {
            let lengths = pair.path().from_output();
            t_out_nm / pair.output_radius_m() * lengths.parallel_m()
                + direction.sign() * pretension_nm * lengths.difference_m / lengths.sum_m()
        }
    };
    stretch_nm / (pair.axial_stiffness_n() * pair.output_radius_m())
}

/// `theta_out = (r1/r2) theta_in - phi`, rad, of a pair that slips: Eq. (18) in + motion, Eq. (19) in - motion, and (22).
pub fn slip_output_angle_rad(
    pair: &TendonPair,
    direction: Direction,
    theta_in_rad: f64,
    torque: LoopTorque,
) -> f64 {
    pair.input_radius_m() / pair.output_radius_m() * theta_in_rad - lag_angle_rad(pair, direction, torque)
}

/// Lag angle read from two encoders: `phi = (r1/r2) theta_in - theta_out`, rad at the output, Eq. (22) solved for phi.
/// Holds at standstill too.
pub fn measured_lag_angle_rad(pair: &TendonPair, theta_in_rad: f64, theta_out_rad: f64) -> f64 {
    pair.input_radius_m() / pair.output_radius_m() * theta_in_rad - theta_out_rad
}

/// Input travel that a turn into `direction` costs before the output follows, rad at the input: Eq. (23).
///
/// `(r2/r1)(phi_s(t) - phi_n(t0))` into + motion, ≥ 0 for an unchanged load; `(r2/r1)(phi_n(t) - phi_s(t0))` into -
/// motion, ≤ 0. The factor r2/r1 is missing in print. `torque_before`: at the turn t0, in the old direction;
/// `torque_after`: when slip begins, in the new one. With the same output torque `T_out` at both, even curvature:
/// `± (r2/r1) 2 F0 L tanh(mu K/2) / (EA r2)`. Exact between two states of full slip; at `T_out` ≠ 0 the less tensioned
/// tendon turns first, so the output begins to creep before the travel is complete.
pub fn dead_zone_input_rad(
    pair: &TendonPair,
    direction: Direction,
    torque_before: LoopTorque,
    torque_after: LoopTorque,
) -> f64 {
    pair.output_radius_m() / pair.input_radius_m()
        * (lag_angle_rad(pair, direction, torque_after)
            - lag_angle_rad(pair, direction.reversed(), torque_before))
}

/// Memory of Eq. (24): the output angle while it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplacementState {
    theta_out_rad: f64,
}

/// Result of one step of [`DisplacementState::step`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplacementStep {
    /// Output angle, rad.
    pub theta_out_rad: f64,
    /// Hold or slip.
    pub regime: Regime,
}

impl DisplacementState {
    /// Pair at rest with the joint at this angle, rad.
    ///
    /// # Errors
    /// [`PaperError::OutOfRange`] if the angle is not finite.
    pub fn at_rest(theta_out_rad: f64) -> Result<Self, PaperError> {
        Ok(Self { theta_out_rad: finite("theta_out_rad", theta_out_rad)? })
    }

    /// Output angle held now, rad.
    pub fn theta_out_rad(&self) -> f64 {
        self.theta_out_rad
    }

    /// One step of Eq. (21)-(24): a play operator on `(r1/r2) theta_in`.
    ///
    /// `theta_out(t) = theta_out(t⁻)` while `(r1/r2) theta_in - phi_s ≤ theta_out(t⁻) ≤ (r1/r2) theta_in - phi_n`, else the
    /// nearer limit; phi from `T_out`. The printed condition of (24) compares `phi_s`(t) with `phi_n`(t0) without the travel
    /// made since t0 and with one sign for both directions; `docs/derivation.md` shows where that fails.
    /// `theta_in_rad`: input angle, rad; `torque_out_nm`: what the load takes from the tendons, N·m.
    ///
    /// # Errors
    /// [`PaperError::OutOfRange`] if an input is not finite; the state is left as it was.
    pub fn step(
        &mut self,
        pair: &TendonPair,
        theta_in_rad: f64,
        torque_out_nm: f64,
    ) -> Result<DisplacementStep, PaperError> {
        let (low_rad, high_rad) = limits_rad(pair, theta_in_rad, torque_out_nm)?;
        let regime = if self.theta_out_rad < low_rad {
            self.theta_out_rad = low_rad;
            Regime::Slip(Direction::Positive)
        } else if self.theta_out_rad > high_rad {
            self.theta_out_rad = high_rad;
            Regime::Slip(Direction::Negative)
        } else {
            Regime::Hold
        };
        Ok(DisplacementStep { theta_out_rad: self.theta_out_rad, regime })
    }

    /// Input travel left before the output follows in `direction`, rad at the input: Eq. (23) less the travel since the
    /// turn. ≥ 0 for +, ≤ 0 for - after a [`step`](Self::step) with the same inputs; 0 in slip that way.
    ///
    /// # Errors
    /// [`PaperError::OutOfRange`] if an input is not finite.
    pub fn input_travel_left_rad(
        &self,
        pair: &TendonPair,
        direction: Direction,
        theta_in_rad: f64,
        torque_out_nm: f64,
    ) -> Result<f64, PaperError> {
        let (low_rad, high_rad) = limits_rad(pair, theta_in_rad, torque_out_nm)?;
        let limit_rad = match direction {
            Direction::Positive => low_rad,
            Direction::Negative => high_rad,
        };
        Ok((self.theta_out_rad - limit_rad) * pair.output_radius_m() / pair.input_radius_m())
    }
}

/// Output angles at which slip begins in + (low) and in - direction (high).
fn limits_rad(pair: &TendonPair, theta_in_rad: f64, torque_out_nm: f64) -> Result<(f64, f64), PaperError> {
    finite("theta_in_rad", theta_in_rad)?;
    let torque = LoopTorque::Output(finite("torque_out_nm", torque_out_nm)?);
    Ok((
        slip_output_angle_rad(pair, Direction::Positive, theta_in_rad, torque),
        slip_output_angle_rad(pair, Direction::Negative, theta_in_rad, torque),
    ))
}
