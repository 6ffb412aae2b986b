//! Spring and damper between the joint and its reference, through the torque loop.
//!
//! `T_d = g m g₀ l sin θ + k (θ_d − θ) + d (ω_d − (r1/r2) ω_in)`, within `limits.contact_torque` (flag
//! [`Limit::OutputTorque`]); `g` is `impedance.gravity`, `k` `impedance.stiffness`, `d` `impedance.damping`.
//!
//! With the weight carried, an outer torque `T` turns the joint by `T/k`. The damper acts on the speed of the input pulley, which is
//! observed without a step of the encoder: there the damping is collocated with the motor and takes energy at every frequency.
//! The tendons are in between: the joint sees `d (1 − k/k_tendon)` of it.
//!
//! The torque loop follows `T_d` late by `(d_p/k_tendon + d_T)/(1 + k_T)` (damping of the pulley and of the tensions, gain of the
//! loop), 7 ms by default, which takes that times `k` off the damping; friction that the loop has not made up for yet, at most
//! `M/(1 + k_T)`, adds to it. `tests/paper/tests/modes.rs` measures both at the joint.

use bowden_link::{Limit, Limits};

use crate::correction::shape::Harmonic;
use crate::parameters::{Parameters, Reach};
use crate::scale::{Angle, Gain, Quantity, Speed, Torque};

/// Spring, damper and weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpedanceConfig {
    stiffness: Gain<Angle, Torque>,
    damping: Gain<Speed, Torque>,
    /// `r1/r2`.
    joint_speed: Gain<Speed, Speed>,
    /// `g m g₀ l`.
    weight: Torque,
    /// `sin θ`.
    turn: Harmonic,
    limit: Torque,
}

/// What the joint does and is to do.
#[derive(Clone, Copy, Debug)]
pub struct ImpedanceInput {
    /// Reference of the joint.
    pub theta_d: Angle,
    /// Its speed.
    pub omega_d: Speed,
    /// Angle of the joint.
    pub theta_out: Angle,
    /// Observed speed of the input pulley.
    pub omega_in: Speed,
}

impl ImpedanceConfig {
    /// Spring and damper of these parameters, lowered to what the joint can do ([`Reach`]); `None` beyond fixed point.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Option<Self> {
        let reach = Reach::yielding(parameters);
        let impedance = &parameters.impedance;
        Some(Self {
            stiffness: Gain::new(impedance.stiffness.min(reach.stiffness))?,
            damping: Gain::new(impedance.damping.min(reach.damping))?,
            joint_speed: Gain::new(parameters.pulley.input_radius / parameters.pulley.output_radius)?,
            weight: Torque::from_f32(impedance.gravity * reach.weight),
            turn: Harmonic::new(1.0, 0.0),
            limit: Torque::from_f32(reach.torque),
        })
    }

    /// Output torque that is asked for.
    #[must_use]
    #[inline]
    pub fn torque(&self, input: &ImpedanceInput, limits: &mut Limits) -> Torque {
        let &ImpedanceInput { theta_d, omega_d, theta_out, omega_in } = input;
        let slip = omega_d.minus(self.joint_speed.apply(omega_in));
        let wanted = self
            .turn
            .sine(theta_out)
            .of(self.weight)
            .plus(self.stiffness.apply(theta_d.minus(theta_out)))
            .plus(self.damping.apply(slip));
        let limited = wanted.limited(self.limit);
        if limited != wanted {
            limits.insert(Limit::OutputTorque);
        }
        limited
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(parameters: &Parameters, angles: [f32; 2], speeds: [f32; 2]) -> (f32, bool) {
        let [theta_d, theta_out] = angles.map(Angle::from_f32);
        let [omega_d, omega_in] = speeds.map(Speed::from_f32);
        let mut limits = Limits::default();
        let config = ImpedanceConfig::new(parameters).unwrap();
        let torque = config.torque(&ImpedanceInput { theta_d, omega_d, theta_out, omega_in }, &mut limits);
        (torque.to_f32(), limits.contains(Limit::OutputTorque))
    }

    #[test]
    fn torque_by_hand() {
        // 0.73575 N·m sin 0.3 + 2·0.1 + 0.05·(1 - 0.5).
        let mut parameters = Parameters::default();
        let (torque, limited) = asked(&parameters, [0.4, 0.3], [1.0, 0.5]);
        assert!((torque - 0.442_43).abs() < 1e-5 && !limited, "{torque}");
        // The joint turns half as fast as the pulley, and nothing is carried.
        parameters.pulley.output_radius = 0.03;
        parameters.impedance.gravity = 0.0;
        let (torque, _) = asked(&parameters, [0.4, 0.3], [1.0, 0.5]);
        assert!((torque - 0.2375).abs() < 1e-5, "{torque}");
        parameters.limits.contact_torque = 0.1;
        for (theta_out, expected) in [(0.3, 0.1), (0.7, -0.1)] {
            assert_eq!(
                asked(&parameters, [0.4, theta_out], [1.0, 0.5]),
                (Torque::from_f32(expected).to_f32(), true)
            );
        }
    }

    #[test]
    fn spring_and_damper_are_lowered_to_what_the_joint_can_do() {
        let mut parameters = Parameters::default();
        parameters.impedance.stiffness = 10_000.0;
        parameters.impedance.damping = 1000.0;
        // Half of 2·72 900·0.015² N·m/rad, and 0.0045 kg·m²·2π·20 Hz/5.
        let (spring, _) = asked(&parameters, [0.01, 0.0], [0.0, 0.0]);
        assert!((spring - 0.164_025).abs() < 1e-5, "{spring}");
        let (damper, _) = asked(&parameters, [0.0, 0.0], [1.0, 0.0]);
        assert!((damper - 0.113_10).abs() < 1e-4, "{damper}");
    }
}
