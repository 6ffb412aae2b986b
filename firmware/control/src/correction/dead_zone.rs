//! A bridge that answers only beyond a duty: `d' = d + d_0 s(d)`.
//!
//! `s` is the smooth sign of the duty that is reached at the width `w`. Beyond it the bridge answers with exactly `d`; within,
//! the step of `2 d_0` that would be needed is spread over `2 w`. Where the duty is 0, nothing is added.

use super::shape::SmoothSign;
use crate::parameters::Parameters;
use crate::scale::{Quantity, Share};

/// Bits of a [`Share`] below a step of the duty, 1/32767, which is taken for 2⁻¹⁵: 3e-5 of the offset.
const EXTRA_BITS: u32 = Share::FRACTION_BITS - 15;

/// Dead zone of the bridge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadZone {
    sign: SmoothSign<Share>,
    /// 0 while it is switched off.
    offset: Share,
}

impl DeadZone {
    /// The dead zone of these parameters; `None` if a value is beyond what fixed point holds.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Option<Self> {
        let own = &parameters.correction.dead_zone;
        Some(Self {
            sign: SmoothSign::new(own.width)?,
            offset: Share::from_f32(own.enable * own.duty.min(own.limit)),
        })
    }

    /// The duty, 1/32767 and at most 1 in size, with what the bridge leaves of it made up for.
    #[must_use]
    #[inline]
    pub fn duty_raw(&self, duty_raw: i32) -> i32 {
        if self.offset == Share::ZERO {
            return duty_raw;
        }
        let added = self.sign.of(Share::from_bits(duty_raw << EXTRA_BITS)).of(self.offset);
        duty_raw + (((added.to_bits() >> (EXTRA_BITS - 1)) + 1) >> 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn duty_by_hand() {
        let mut parameters = Parameters::default();
        let own = &mut parameters.correction.dead_zone;
        (own.enable, own.duty, own.width, own.limit) = (1.0, 0.03, 0.01, 0.1);
        let zone = DeadZone::new(&parameters).unwrap();
        // 0.03 are 983 steps. Half of the width, 164 steps: 0.6875 of it, 676.
        for (duty, expected) in [
            (0, 0),
            (164, 164 + 676),
            (-164, -164 - 676),
            (328, 328 + 983),
            (10_000, 10_983),
            (-32_767, -33_750),
        ] {
            let got = zone.duty_raw(duty);
            assert!((got - expected).abs() <= 2, "{duty}: {got}");
        }
        parameters.correction.dead_zone.limit = 0.01;
        assert_eq!(DeadZone::new(&parameters).unwrap().duty_raw(10_000), 10_328);
        parameters.correction.dead_zone.enable = 0.0;
        assert_eq!(DeadZone::new(&parameters).unwrap().duty_raw(10_000), 10_000);
    }
}
