//! Elongation of the tendons, from the angles and from the tensions: Eq. (6)-(9).
//!
//! An elongation is counted from the state at `theta_in` = `theta_out` = 0, where the mean tension of each tendon is F0.

use super::capstan::SlipToward;
use super::pair::TendonPair;

/// `dL_a = r1 theta_in - r2 theta_out`, m, Eq. (6): elongation of cable a from the pulley angles, rad.
pub fn cable_a_from_angles_m(pair: &TendonPair, theta_in_rad: f64, theta_out_rad: f64) -> f64 {
    pair.input_radius_m() * theta_in_rad - pair.output_radius_m() * theta_out_rad
}

/// `dL_b = r2 theta_out - r1 theta_in = -dL_a`, m, Eq. (7): elongation of cable b from the pulley angles, rad.
pub fn cable_b_from_angles_m(pair: &TendonPair, theta_in_rad: f64, theta_out_rad: f64) -> f64 {
    -cable_a_from_angles_m(pair, theta_in_rad, theta_out_rad)
}

/// `dL = (F psi - F0 L) / EA`, m, Eq. (8)-(9): elongation of a tendon that slips all along its sheath.
///
/// `input_tension_n`: F1 or F3, N; psi is `psi_p` for slip towards the input, `psi_r` towards the output. Eq. (8) is
/// cable a and Eq. (9) cable b in + motion; in - motion the two change places. Linear: a negative tension gives the
/// elongation of a rod, not of a slack tendon.
pub fn from_input_tension_m(pair: &TendonPair, input_tension_n: f64, slip: SlipToward) -> f64 {
    let lengths = pair.path().from_input();
    let psi_m = match slip {
        SlipToward::Input => lengths.falling_m,
        SlipToward::Output => lengths.rising_m,
    };
    (input_tension_n * psi_m - pair.pretension_n() * pair.path().length_m()) / pair.axial_stiffness_n()
}
