//! Sheath friction beyond one constant `mu K` for both sheaths, as a torque of both tendons at the joint:
//!
//! `ΔT = s { 2 r2 [ F0 mu (K(θ) (1 + e f(v)) - K) + q K(θ) + c |v| ] + α mu K T }`, `K(θ) = K + k θ_out`, `v = r1 ω`
//!
//! | symbol | what | effect of the model |
//! |---|---|---|
//! | `c` | friction that grows with speed, N·s/m a tendon | `sheath_viscous_friction` |
//! | `e f(v)` | relative excess at low speed, `f = e^{-(v/v_s)^n}` | `sheath_stribeck_friction` |
//! | `q` | friction that does not scale with tension, N/rad | `bending_friction` |
//! | `α` | half the relative difference of the two sheaths | `asymmetric_friction` |
//! | `k` | wrap angle a joint angle | `wrap_angle_varies_with_pose` |
//!
//! `s` is the smooth sign of the speed ω of the input pulley, `T = (T_in + T_out)/2` the mean of the torques at both ends, both
//! at the joint. First order in `mu K`: the tensions along both sheaths are taken as `F0 ± T/(2 r2)`. For `mu K` = 0.377 each
//! part agrees with `bowden-model` within 2 % and 0.3 % of the nominal friction (test `sheath_correction`).
//!
//! Friction spread along the sheath stretches the tendons by half of what it would at their end: the input pulley leads by
//! `ΔT L/(4 EA r1 r2)`. There `T = T_out + (T_in - T_out)/6`: with the mean tensions `T_a (1 + a/2 + a²/6)` of a cable that is
//! pulled and `T_b (1 - b/2 + b²/6)` of the other one, `a, b = (1 ± α) mu K`, the part of α that does not depend on the
//! torque is `F0 α (mu K)²/12`, a third of what the mean torque makes of it.

use super::shape::{Fade, SmoothSign};
use crate::parameters::Parameters;
use crate::scale::{Angle, Gain, Quantity, Share, Speed, Torque};

/// Sheath friction beyond the nominal one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheathCorrection {
    sign: SmoothSign<Speed>,
    fade: Fade,
    /// `e`.
    excess: Share,
    /// `2 r2 F0 mu K`.
    nominal: Torque,
    /// `2 r2 F0 mu k`.
    nominal_by_pose: Gain<Angle, Torque>,
    /// `2 r2 q K`.
    bending: Torque,
    /// `2 r2 q k`, and that of the nominal friction.
    by_pose: Gain<Angle, Torque>,
    /// `2 r2 c r1`.
    viscous: Gain<Speed, Torque>,
    /// `α mu K`.
    asymmetry: Gain<Torque, Torque>,
    /// `L/(4 EA r1 r2)`.
    stretch: Gain<Torque, Angle>,
    /// 0 while it is switched off.
    limit: Torque,
}

impl SheathCorrection {
    /// The friction of these parameters; `None` if a value is beyond what fixed point holds.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Option<Self> {
        let Parameters { pulley, tendon, sheath, .. } = parameters;
        let own = &parameters.correction.sheath;
        let lever_m = 2.0 * pulley.output_radius;
        let rubbing_n = tendon.pretension * sheath.friction_coefficient;
        let arms_m2 = pulley.input_radius * pulley.output_radius;
        Some(Self {
            sign: SmoothSign::new(parameters.correction.reversal_speed)?,
            fade: Fade::new(own.speed / pulley.input_radius, own.exponent)?,
            // Up to four times the friction at speed: more than a ratio in fixed point holds.
            excess: Share::from_f32(own.excess / EXCESS_UNIT),
            nominal: Torque::from_f32(lever_m * rubbing_n * sheath.wrap_angle * EXCESS_UNIT),
            nominal_by_pose: Gain::new(lever_m * rubbing_n * own.pose_slope * EXCESS_UNIT)?,
            bending: Torque::from_f32(lever_m * own.bending * sheath.wrap_angle),
            by_pose: Gain::new(lever_m * (rubbing_n + own.bending) * own.pose_slope)?,
            viscous: Gain::new(lever_m * own.viscous * pulley.input_radius)?,
            asymmetry: Gain::new(own.asymmetry * sheath.friction_coefficient * sheath.wrap_angle)?,
            stretch: Gain::new(tendon.length / (4.0 * tendon.axial_stiffness * arms_m2))?,
            limit: Torque::from_f32(own.enable * own.limit),
        })
    }

    /// Friction of both tendons at the joint beyond the nominal one, for the speed of the input pulley, the angle of the
    /// joint and the mean torque of both ends, at the joint; positive where the motion is towards +θ.
    #[must_use]
    #[inline]
    pub fn friction_torque(&self, speed: Speed, theta_out: Angle, mean_torque: Torque) -> Torque {
        if self.limit == Torque::ZERO {
            return Torque::ZERO;
        }
        let mut level = self.bending;
        if self.excess != Share::ZERO {
            let nominal = self.nominal.plus(self.nominal_by_pose.apply(theta_out));
            level = level.plus(self.fade.of(speed).of(self.excess.of(nominal)));
        }
        if self.by_pose != Gain::ZERO {
            level = level.plus(self.by_pose.apply(theta_out));
        }
        if self.viscous != Gain::ZERO {
            level = level.plus(self.viscous.apply(speed.magnitude()));
        }
        if self.asymmetry != Gain::ZERO {
            level = level.plus(self.asymmetry.apply(mean_torque));
        }
        self.sign.of(speed).of(level).limited(self.limit)
    }

    /// Angle by which the input pulley leads, for the torques that it and the joint are to pass on, both at the joint:
    /// `(r2/r1) T_in` and `T_out`.
    #[must_use]
    #[inline]
    pub fn lead(&self, speed: Speed, theta_out: Angle, torque_in: Torque, torque_out: Torque) -> Angle {
        /// 1/6 in 2⁻³⁰.
        const SIXTH: i32 = 178_956_971;
        if self.limit == Torque::ZERO {
            return Angle::ZERO;
        }
        let torque = torque_out.plus(Share::from_bits(SIXTH).of(torque_in.minus(torque_out)));
        self.stretch.apply(self.friction_torque(speed, theta_out, torque))
    }
}

/// Excess that stands for 1 in [`SheathCorrection::excess`].
const EXCESS_UNIT: f32 = 4.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// Base of all cases: `2 r2 F0 mu K` = 0.03 · 30 · 0.12 · 3 = 0.324 N·m.
    fn base() -> Parameters {
        let mut parameters = Parameters::default();
        parameters.sheath.wrap_angle = 3.0;
        parameters.correction.sheath.enable = 1.0;
        parameters.correction.sheath.limit = 1.0;
        parameters
    }

    fn torque(parameters: &Parameters, speed: f32, theta_out: f32, mean_torque: f32) -> f32 {
        let sheath = SheathCorrection::new(parameters).unwrap();
        let (speed, torque) = (Speed::from_f32(speed), Torque::from_f32(mean_torque));
        sheath.friction_torque(speed, Angle::from_f32(theta_out), torque).to_f32()
    }

    #[test]
    fn each_part_by_hand() {
        let near = |got: f32, expected: f32| assert!((got - expected).abs() < 2e-5, "{got} for {expected}");
        // c = 60 N·s/m at 0.5 rad/s · 0.015 m: 0.45 N a tendon, 0.0135 N·m for both.
        let mut viscous = base();
        viscous.correction.sheath.viscous = 60.0;
        near(torque(&viscous, 0.5, 0.0, 0.0), 0.0135);
        near(torque(&viscous, -0.5, 0.3, 0.2), -0.0135);
        // Excess 0.6 at 3 mm/s, 0.2 rad/s: 37 % of 0.6 · 0.324; exponent 1 or 2 is the same there.
        let mut stribeck = base();
        let own = &mut stribeck.correction.sheath;
        (own.excess, own.speed, own.exponent) = (0.6, 0.003, 1.0);
        near(torque(&stribeck, 0.2, 0.0, 0.0), 0.071_516);
        // q = 0.6 N/rad over 3 rad: 1.8 N a tendon, 0.054 N·m.
        let mut bending = base();
        bending.correction.sheath.bending = 0.6;
        near(torque(&bending, 1.0, 0.7, 0.5), 0.054);
        // α mu K = 0.2 · 0.36 of the torque.
        let mut asymmetric = base();
        asymmetric.correction.sheath.asymmetry = 0.2;
        near(torque(&asymmetric, 1.0, 0.0, 0.5), 0.036);
        near(torque(&asymmetric, -1.0, 0.0, 0.5), -0.036);
        // k = 1 at 0.5 rad: 0.03 · 30 · 0.12 · 0.5.
        let mut pose = base();
        pose.correction.sheath.pose_slope = 1.0;
        near(torque(&pose, 1.0, 0.5, 0.0), 0.054);
        near(torque(&pose, 1.0, -0.5, 0.0), -0.054);
        // All at once at 0.2 rad/s, 0.5 rad, 0.5 N·m: 3.5 rad of wrap instead of 3.
        let mut all = base();
        let own = &mut all.correction.sheath;
        (own.viscous, own.bending, own.asymmetry, own.pose_slope) = (60.0, 0.6, 0.2, 1.0);
        (own.excess, own.speed, own.exponent) = (0.6, 0.003, 1.0);
        let expected =
            0.03 * (3.6 * (3.5 * (1.0 + 0.6 * 0.367_879) - 3.0) + 0.6 * 3.5 + 60.0 * 0.003) + 0.036;
        near(torque(&all, 0.2, 0.5, 0.5), expected);
        all.correction.sheath.limit = 0.1;
        near(torque(&all, 0.2, 0.5, 0.5), 0.1);
        all.correction.sheath.enable = 0.0;
        assert_eq!(torque(&all, 0.2, 0.5, 0.5), 0.0);
    }

    #[test]
    fn the_lead_is_that_of_the_nominal_friction_where_friction_is_small() {
        // The compensator's own angle for a friction torque 2 r2 F0 a is F0 L tanh(a/2)/(EA r1); bending friction of 0.3 N
        // a tendon is a = 0.01.
        let mut parameters = base();
        (parameters.sheath.friction_coefficient, parameters.sheath.wrap_angle) = (0.02, 0.5);
        parameters.correction.sheath.bending = 0.6;
        let lead = SheathCorrection::new(&parameters).unwrap().lead(
            Speed::from_f32(1.0),
            Angle::ZERO,
            Torque::from_f32(0.3),
            Torque::from_f32(0.2),
        );
        let angles = crate::compensator::LagAngles::new(&parameters);
        assert!((lead.to_f32() - angles.friction_rad).abs() < 2e-6);
    }

    #[test]
    fn the_lead_of_unequal_sheaths_by_hand() {
        // α mu K = 0.2 · 0.36; T = 0.2 + 0.3/6 = 0.25 N·m: 18 mN·m, times L/(4 EA r1 r2) = 0.015242: 0.2744 mrad.
        let mut parameters = base();
        parameters.correction.sheath.asymmetry = 0.2;
        let sheath = SheathCorrection::new(&parameters).unwrap();
        let lead = |speed: f32| {
            sheath
                .lead(Speed::from_f32(speed), Angle::ZERO, Torque::from_f32(0.5), Torque::from_f32(0.2))
                .to_f32()
        };
        assert!((lead(1.0) - 2.744e-4).abs() < 2e-6, "{}", lead(1.0));
        assert!((lead(-1.0) + 2.744e-4).abs() < 2e-6);
        parameters.correction.sheath.enable = 0.0;
        let off = SheathCorrection::new(&parameters).unwrap();
        assert_eq!(off.lead(Speed::MAX, Angle::ZERO, Torque::MAX, Torque::MAX), Angle::ZERO);
    }
}
