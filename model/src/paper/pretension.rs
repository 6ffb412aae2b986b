//! Least pretension that keeps both tendons taut. The paper asks for it (4.2.1 and conclusion) and gives no equation.
//!
//! A tendon with friction is taut everywhere or slack everywhere, since |dT/ds| ≤ mu kappa T. The one that goes slack
//! first pays out, with `T_in` or `T_out` carried by the other alone; see `docs/derivation.md`.

use super::error::{PaperError, not_negative, positive};
use super::pair::TendonPair;
use super::sheath_path::SheathPath;

/// Which input torques can occur.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputTorqueUse {
    /// The input torque always has the sign of the motion: the motor drives, the load never does.
    Driving,
    /// Either sign in either direction: the load may drive the motor.
    AnySign,
}

/// Least `F0`, N, for output torques up to `peak_output_torque_nm` in magnitude, either sign, both directions of motion.
///
/// `F0 = (|T_out|/r2) psi_r/(2 L) + margin Q_r (psi_r + psi_p)/(2 L)`, stretch lengths from the output end; even
/// curvature: `F0 = (|T_out|/r2)(e^a - 1)/(2 a) + margin e^a sinh(a)/a` with `a = mu K`; `|T_out|/(2 r2) + margin`
/// without friction. `margin_n` ≥ 0: tension, N, that the slackest of the four ends keeps in slip. With margin 0 the
/// result also covers every state of partial sticking. A range of `T_out` on one side of 0 needs no less.
///
/// # Errors
/// [`PaperError::OutOfRange`] naming the parameter.
pub fn minimum_pretension_for_output_torque_n(
    path: &SheathPath,
    output_radius_m: f64,
    peak_output_torque_nm: f64,
    margin_n: f64,
) -> Result<f64, PaperError> {
    let radius_m = positive("output_radius_m", output_radius_m)?;
    let peak_n = not_negative("peak_output_torque_nm", peak_output_torque_nm)? / radius_m;
    let margin_n = not_negative("margin_n", margin_n)?;
    let lengths = path.from_output();
    Ok((peak_n * lengths.rising_m + margin_n * path.q_r() * lengths.sum_m()) / (2.0 * path.length_m()))
}

/// Least `F0`, N, for input torques up to `peak_input_torque_nm` in magnitude.
///
/// [`InputTorqueUse::Driving`], torques from 0 to the peak: the larger of `(|T_in|/r1) psi_p/(2 L) + margin S/(2 L)`, where
/// the cable paying out is slackest at its input end, and `margin Q_r S/(2 L)`, where at `T_in` = 0 the hauling cable is
/// at its output end; `S = psi_r + psi_p`. Even curvature, no margin: `(|T_in|/r1)(1 - e^-a)/(2 a)`.
/// [`InputTorqueUse::AnySign`]: `(|T_in|/r1) psi_r/(2 L) + margin Q_r S/(2 L)`; even curvature: `(|T_in|/r1)(e^a - 1)/(2 a) +
/// margin e^a sinh(a)/a`. Stretch lengths from the input end; `margin_n` as in
/// [`minimum_pretension_for_output_torque_n`].
///
/// # Errors
/// [`PaperError::OutOfRange`] naming the parameter.
pub fn minimum_pretension_for_input_torque_n(
    path: &SheathPath,
    input_radius_m: f64,
    peak_input_torque_nm: f64,
    torque_use: InputTorqueUse,
    margin_n: f64,
) -> Result<f64, PaperError> {
    let radius_m = positive("input_radius_m", input_radius_m)?;
    let peak_n = not_negative("peak_input_torque_nm", peak_input_torque_nm)? / radius_m;
    let margin_n = not_negative("margin_n", margin_n)?;
    let lengths = path.from_input();
    let margin_integral_nm = margin_n * lengths.sum_m();
    let tension_integral_nm = match torque_use {
        InputTorqueUse::Driving => {
            (peak_n * lengths.falling_m + margin_integral_nm).max(path.q_r() * margin_integral_nm)
        }
        InputTorqueUse::AnySign => peak_n * lengths.rising_m + path.q_r() * margin_integral_nm,
    };
    Ok(tension_integral_nm / (2.0 * path.length_m()))
}

/// Largest `|T_out|`, N·m, at which both tendons stay taut in both directions: `2 F0 L r2 / psi_r`, even curvature
/// `2 F0 r2 a / (e^a - 1)` with `a = mu K`.
pub fn taut_output_torque_nm(pair: &TendonPair) -> f64 {
    pair.tension_integral_nm() * pair.output_radius_m() / pair.path().from_output().rising_m
}
