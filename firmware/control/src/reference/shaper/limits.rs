//! Limits of a reference, and the units that they give the state.

use super::{LARGEST, LONGEST_RISE, RISE_BITS, STATE_BITS};

/// Limits of a reference, as the tick needs them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShaperLimits {
    /// Largest speed over the jerk, ticks².
    pub speed: i32,
    /// Largest jerk, 2⁻⁴⁰ a tick³.
    pub jerk: i32,
    /// `2^(shift + 36) / jerk`, rounded down: from 2⁻⁴⁰ to the state.
    pub scale: u32,
    /// Bits of the jerk less five.
    pub shift: u8,
    /// Largest acceleration over the jerk, 1/16 tick, at most 1024 ticks.
    pub rise: u16,
    /// Part of it that gravity takes away from zero, at a quarter turn and beyond, 1/16 tick.
    pub gravity: u16,
}

impl ShaperLimits {
    /// Limits per tick, in 2⁻⁴⁰.
    ///
    /// The acceleration is lowered to what the jerk reaches in 1024 ticks, the jerk to what reaches the acceleration in
    /// 8; the jerk is at least 64, below which the resolution of the value would show.
    #[must_use]
    pub fn new(speed: f32, acceleration: f32, gravity: f32, jerk: f32) -> Self {
        const LEAST_JERK: f32 = 64.0;
        const SHORTEST_RISE: f32 = 8.0;
        const LARGEST_JERK: f32 = 1_073_741_824.0;
        let jerk = jerk.min(acceleration / SHORTEST_RISE).clamp(LEAST_JERK, LARGEST_JERK) as i32;
        let shift = 27 - jerk.leading_zeros();
        let ticks = |value: f32| {
            let ticks = value / jerk as f32 * (1_u32 << RISE_BITS) as f32;
            ticks.max(0.0).min((LONGEST_RISE << RISE_BITS) as f32) as u16
        };
        Self {
            speed: (speed / jerk as f32).max(1.0).min(LARGEST as f32) as i32,
            jerk,
            scale: ((1_u64 << (36 + shift)) / u64::from(jerk.unsigned_abs())).min(u64::from(u32::MAX)) as u32,
            shift: shift as u8,
            rise: ticks(acceleration).max(1 << RISE_BITS),
            gravity: ticks(gravity),
        }
    }

    /// `value`, at most 2⁵¹ of 2⁻⁴⁰, in units of the state.
    #[inline]
    pub(super) fn state_of(&self, value: i64) -> i64 {
        let wide = value << 8;
        let (low, high) = (wide & 0xffff_ffff, wide >> 32);
        let scale = i64::from(self.scale);
        // 96 bits less the lowest 32; the product of the low halves is without sign.
        let product = high * scale + ((low.cast_unsigned() * u64::from(self.scale)) >> 32).cast_signed();
        // Below 32, said so that the shift takes half as many instructions.
        product >> (self.shift & 31)
    }

    /// Both ends of a range (2⁻⁴⁰), for [`super::Shaper::step`].
    #[must_use]
    pub fn ends(&self, range: [i64; 2]) -> Ends {
        Ends(range.map(|end| self.state_of(end)))
    }

    /// `state`, in 2⁻⁴⁰.
    #[inline]
    pub(super) fn value_of(&self, state: i64) -> i64 {
        ((state >> 4) * i64::from(self.jerk)) >> (STATE_BITS - 4)
    }

    /// Largest acceleration at `value` (2⁻⁴⁰) away from zero, 1/16 tick: gravity grows as `sin θ`, which `4 θ (π − θ)/π²`
    /// bounds from above.
    #[inline]
    pub(super) fn outward(&self, value: i64) -> i32 {
        /// π and π/2 in 2⁻¹⁴, 4/π² in 2⁻¹⁶.
        const PI: u32 = 51_472;
        const QUARTER: u32 = 25_736;
        const FACTOR: u32 = 26_561;
        let angle = ((value >> 26) as i32).unsigned_abs().min(QUARTER);
        let sine = (((angle * (PI - angle)) >> 14) * FACTOR) >> 16;
        let taken = (sine * u32::from(self.gravity)) >> 14;
        (i32::from(self.rise) - taken.cast_signed()).max(1 << RISE_BITS)
    }
}

/// Ends of a range in units of the state, made by [`ShaperLimits::ends`] once for many ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ends(pub(super) [i64; 2]);
