//! Torques of the two pulleys: Eq. (4)-(5).

/// A torque of the tendons, with the pulley it is taken at.
///
/// In slip one determines the other ([`super::torque_transmission`]); at standstill they are independent within a band.
/// The type keeps them from being mixed up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoopTorque {
    /// `T_in`, N·m, at the input pulley: what the motor side delivers.
    Input(f64),
    /// `T_out`, N·m, at the output pulley: what the joint receives.
    Output(f64),
}

/// `T_in = (F1 - F3) r1`, N·m, Eq. (4). `f1_n`, `f3_n`: tension of cable a and b at the input, N; `input_radius_m` r1, m.
/// Positive drives towards +theta.
pub fn input_torque_nm(f1_n: f64, f3_n: f64, input_radius_m: f64) -> f64 {
    (f1_n - f3_n) * input_radius_m
}

/// `T_out = (F2 - F4) r2`, N·m, Eq. (5). `f2_n`, `f4_n`: tension of cable a and b at the output, N; `output_radius_m` r2,
/// m. Positive drives the joint towards +theta.
pub fn output_torque_nm(f2_n: f64, f4_n: f64, output_radius_m: f64) -> f64 {
    (f2_n - f4_n) * output_radius_m
}
