//! The digest with every correction on.

use super::{Hash, Random, run_with};
use crate::correction::backlash::Backlash;
use crate::correction::sheath::SheathCorrection;
use crate::parameters::Parameters;
use crate::scale::{Angle, Quantity, Speed, Torque};

/// Hash over `ticks` ticks as [`super::digest`], with every correction on, and over the leads of sheath and backlash for as
/// many inputs, extremes among them.
#[must_use]
pub fn correction_digest(seed: u32, ticks: u32) -> u32 {
    let mut hash = Hash(run_with(seed, ticks, None, switch_on).digest);
    let mut random = Random(seed);
    let mut parameters = Parameters::default();
    switch_on(&mut parameters);
    let (Some(sheath), Some(backlash)) = (SheathCorrection::new(&parameters), Backlash::new(&parameters))
    else {
        return 0;
    };
    for _ in 0..ticks {
        // A wild number, moved to any size.
        let mut any = || random.wild() >> random.below(24);
        let (speed, angle) = (Speed::from_bits(any()), Angle::from_bits(any()));
        let torques = [any(), any()].map(Torque::from_bits);
        hash.word(sheath.friction_torque(speed, angle, torques[0]).to_bits().cast_unsigned());
        hash.word(sheath.lead(speed, angle, torques[0], torques[1]).to_bits().cast_unsigned());
        hash.word(backlash.lead(torques[0], torques[1]).to_bits().cast_unsigned());
    }
    hash.0
}

/// Every term on, with numbers that leave no bit of it zero.
pub(super) fn switch_on(parameters: &mut Parameters) {
    let own = &mut parameters.correction;
    (own.motor_friction.enable, own.motor_friction.coulomb, own.motor_friction.excess) = (1.0, 0.08, 0.07);
    (own.gear_friction.enable, own.gear_friction.coefficient) = (1.0, 0.13);
    (own.cogging.enable, own.cogging.amplitude_1, own.cogging.amplitude_2) = (1.0, 0.06, 0.03);
    (own.cogging.phase_1, own.cogging.phase_2) = (0.7, -2.1);
    (own.dead_zone.enable, own.dead_zone.duty) = (1.0, 0.017);
    (own.joint_friction.enable, own.joint_friction.coulomb) = (1.0, 0.05);
    (own.joint_spring.enable, own.joint_spring.stiffness, own.joint_spring.rest) = (1.0, 0.3, 0.2);
    (own.sheath.enable, own.sheath.viscous, own.sheath.excess) = (1.0, 60.0, 0.6);
    (own.sheath.bending, own.sheath.asymmetry, own.sheath.pose_slope) = (0.6, -0.3, 1.2);
    (own.backlash.enable, own.backlash.transmission_gap, own.backlash.joint_gap) = (1.0, 0.02, 0.013);
    for encoder in [&mut own.input_encoder, &mut own.joint_encoder] {
        (encoder.enable, encoder.amplitude, encoder.phase) = (1.0, 0.011, 1.3);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_is_another_one_with_corrections() {
        assert_ne!(run_with(1, 2000, None, switch_on).digest, super::super::digest(1, 2000));
        assert_ne!(correction_digest(1, 2000), correction_digest(2, 2000));
    }

    /// Frozen, as that without corrections. In debug builds no arithmetic overflows on the way.
    #[test]
    fn regress_correction_digest() {
        assert_eq!(correction_digest(1, 20_000), 1_602_744_468);
    }
}
