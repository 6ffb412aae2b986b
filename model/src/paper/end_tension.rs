//! The four end tensions from a torque, both tendons slipping: Eq. (10)-(14).
//!
//! Two conditions fix the loop: the tension integrals of both tendons add up to 2 F0 L (Hooke with `dL_a` = -`dL_b`), and
//! the tensions at one end differ by that end's torque over its radius. With `psi_p`, `psi_r` > 0, in + motion:
//!
//! `F1 psi_p + F3 psi_r = 2 F0 L`, `F1 - F3 = T_in / r1`. In - motion `psi_p` and `psi_r` change places.

use super::capstan::{Direction, input_tension_n, output_tension_n};
use super::pair::TendonPair;
use super::torque::{LoopTorque, input_torque_nm, output_torque_nm};

/// Tensions at the four tendon ends, N. Negative means that the linear model has left its range: the tendon is slack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndTensions {
    /// Cable a at the input.
    pub f1_n: f64,
    /// Cable a at the output.
    pub f2_n: f64,
    /// Cable b at the input.
    pub f3_n: f64,
    /// Cable b at the output.
    pub f4_n: f64,
}

impl EndTensions {
    /// `T_in`, N·m, Eq. (4).
    pub fn input_torque_nm(&self, pair: &TendonPair) -> f64 {
        input_torque_nm(self.f1_n, self.f3_n, pair.input_radius_m())
    }

    /// `T_out`, N·m, Eq. (5).
    pub fn output_torque_nm(&self, pair: &TendonPair) -> f64 {
        output_torque_nm(self.f2_n, self.f4_n, pair.output_radius_m())
    }

    /// Smallest of the four, N.
    pub fn min_n(&self) -> f64 {
        self.f1_n.min(self.f2_n).min(self.f3_n).min(self.f4_n)
    }

    /// Whether both tendons are taut at both ends, so that the linear equations hold.
    pub fn is_taut(&self) -> bool {
        self.min_n() >= 0.0
    }
}

/// `F1 = (2 F0 L - F3 psi_r) / psi_p`, N, Eq. (10), in + motion; in - motion with `psi_p` and `psi_r` exchanged.
pub fn f1_from_f3_n(pair: &TendonPair, direction: Direction, f3_n: f64) -> f64 {
    let lengths = pair.path().from_input();
    let (psi_a_m, psi_b_m) = match direction {
        Direction::Positive => (lengths.falling_m, lengths.rising_m),
        Direction::Negative => (lengths.rising_m, lengths.falling_m),
    };
    (pair.tension_integral_nm() - f3_n * psi_b_m) / psi_a_m
}

/// All four end tensions of a pair that slips in `direction`, N: Eq. (11)-(14).
///
/// From `T_in` in + motion: `F1 = (psi_r T_in/r1 + 2 F0 L) / (psi_r + psi_p)`, `F3 = (2 F0 L - psi_p T_in/r1) / (psi_r +
/// psi_p)`, `F2 = F1 Q_p = F1 (1 - mu K psi_p / L)`, `F4 = F3 Q_r = F3 (1 + mu K psi_r / L)`; the middle forms of `F2` and
/// `F4` hold for even curvature only. From `T_out` the same with the stretch lengths counted from the output end.
/// In - motion cable a takes the place of cable b and the torque the opposite sign. Linear for either sign of the
/// tensions: [`EndTensions::is_taut`] tells whether the result is physical. For even curvature
/// within 1e-10 N of the integrated ODE at tensions of 100 N.
pub fn end_tensions(pair: &TendonPair, direction: Direction, torque: LoopTorque) -> EndTensions {
    let path = pair.path();
    let exponent = path.friction_exponent();
    // The hauling cable is a in + motion, b in - motion; it slips towards the input.
    let (hauling, paying_out) =
        (Direction::Positive.slip_of_cable_a(), Direction::Positive.slip_of_cable_b());
    let integral_nm = pair.tension_integral_nm();
    let (haul_in_n, haul_out_n, pay_in_n, pay_out_n) = match torque {
        LoopTorque::Input(t_in_nm) => {
            let lengths = path.from_input();
            let difference_n = direction.sign() * t_in_nm / pair.input_radius_m();
            let haul_n = (lengths.rising_m * difference_n + integral_nm) / lengths.sum_m();
            let pay_n = (integral_nm - lengths.falling_m * difference_n) / lengths.sum_m();
            (
                haul_n,
                output_tension_n(haul_n, exponent, hauling),
                pay_n,
                output_tension_n(pay_n, exponent, paying_out),
            )
        }
        LoopTorque::Output(t_out_nm) => {
            // Seen from the output the hauling cable's tension rises away from that end.
            let lengths = path.from_output();
            let difference_n = direction.sign() * t_out_nm / pair.output_radius_m();
            let haul_n = (lengths.falling_m * difference_n + integral_nm) / lengths.sum_m();
            let pay_n = (integral_nm - lengths.rising_m * difference_n) / lengths.sum_m();
            (
                input_tension_n(haul_n, exponent, hauling),
                haul_n,
                input_tension_n(pay_n, exponent, paying_out),
                pay_n,
            )
        }
    };
    match direction {
        Direction::Positive => {
            EndTensions { f1_n: haul_in_n, f2_n: haul_out_n, f3_n: pay_in_n, f4_n: pay_out_n }
        }
        Direction::Negative => {
            EndTensions { f1_n: pay_in_n, f2_n: pay_out_n, f3_n: haul_in_n, f4_n: haul_out_n }
        }
    }
}
