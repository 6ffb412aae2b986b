//! Forms that several corrections share.

use core::marker::PhantomData;

use crate::reference::oscillator::sine;
use crate::scale::{Angle, Quantity, Share, Speed};

/// Upper half of a product of 64 bits: one instruction.
#[inline]
const fn upper(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64) >> 32) as i32
}

/// A value over a width, limited to ±1.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Span<I> {
    width: i32,
    /// Places by which the width can be moved up.
    shift: u8,
    /// 2⁶¹ over the width so moved.
    factor: i32,
    of: PhantomData<I>,
}

impl<I: Quantity> Span<I> {
    fn new(width: f32) -> Option<Self> {
        let bits = I::from_f32(width).to_bits();
        if bits <= 0 {
            return None;
        }
        let shift = bits.leading_zeros() - 1;
        let factor = (1_i64 << 61) / (i64::from(bits) << shift);
        let factor = factor.min(i64::from(i32::MAX)) as i32;
        Some(Self { width: bits, shift: shift as u8, factor, of: PhantomData })
    }

    /// The share in 2⁻³⁰, rounded down to an even one.
    #[inline]
    fn share(self, value: I) -> i32 {
        let limited = value.to_bits().max(-self.width).min(self.width);
        upper(limited << self.shift, self.factor) << 1
    }
}

/// Sign with a smooth middle: `s(x) = (3 x − x³)/2` with `x = value/width` within ±1, else ±1.
///
/// It has no corner at ±1 and a slope of `1.5/width` at zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothSign<I>(Span<I>);

impl<I: Quantity> SmoothSign<I> {
    /// A sign that is reached at `width`, unit of `I`; `None` for a width below a step of `I`.
    #[must_use]
    pub fn new(width: f32) -> Option<Self> {
        Span::new(width).map(Self)
    }

    /// The sign of `value`, -1 to 1. Error below 2e-8, steps of the value aside.
    #[must_use]
    #[inline]
    pub fn of(self, value: I) -> Share {
        let x = self.0.share(value);
        // In 2⁻²⁸, 2⁻²⁹ and 2⁻²⁷.
        let factor = (3 << 28) - upper(x, x);
        Share::from_bits(upper(x, factor << 1) << 2)
    }
}

/// Segments of a [`Fade`], and over how many characteristic speeds they reach.
const SEGMENTS: usize = 16;
const REACH: f32 = 4.0;

/// Bits of a [`Share`] below 1 that say where in a segment a speed is.
const WITHIN_BITS: u32 = Share::FRACTION_BITS - SEGMENTS.trailing_zeros();

/// Excess of dry friction at low speed, `f(v) = e^{-|v/v_s|^n}`: 1 at standstill, 0.37 at `v_s`.
///
/// Linear between 17 points up to `4 v_s`, constant beyond. Error below 0.016 for `n` from 1 to 2, 0.13 for `n = 0.5`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fade {
    reach: Span<Speed>,
    /// Values in 2⁻¹⁴.
    points_raw: [i16; SEGMENTS + 1],
}

impl Fade {
    /// The fade with `v_s` in rad/s (or the unit that `speed` has in a `Speed`) and the exponent `n`; `None` for a speed
    /// below a step of it.
    #[must_use]
    pub fn new(speed: f32, exponent: f32) -> Option<Self> {
        let points_raw = core::array::from_fn(|point| {
            let x = REACH * point as f32 / SEGMENTS as f32;
            libm::rintf(libm::expf(-libm::powf(x, exponent)) * 16_384.0) as i16
        });
        Some(Self { reach: Span::new(REACH * speed)?, points_raw })
    }

    /// The excess at a speed, 0 to 1.
    #[must_use]
    #[inline]
    pub fn of(&self, speed: Speed) -> Share {
        const POINT_BITS: u32 = 14;
        let last = (1 << Share::FRACTION_BITS) - 1;
        let place = self.reach.share(speed.magnitude()).min(last);
        let segment = (place >> WITHIN_BITS) as usize;
        let within = place & ((1 << WITHIN_BITS) - 1);
        let point = |n: usize| self.points_raw.get(n).map_or(0, |raw| i32::from(*raw));
        let (start, end) = (point(segment), point(segment + 1));
        // 14 bits of a difference by 26 bits of a place.
        let fine =
            (i64::from(end - start) * i64::from(within)) >> (WITHIN_BITS + POINT_BITS - Share::FRACTION_BITS);
        Share::from_bits((start << (Share::FRACTION_BITS - POINT_BITS)) + fine as i32)
    }
}

/// Sine of an angle: `sin(n θ + φ)`, `n` periods a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonic {
    /// Phase in 2⁻³² turn for an angle in 2⁻²⁰ rad, in 2⁻¹⁰.
    phase_per_angle: i32,
    phase: u32,
}

impl Harmonic {
    /// Most periods a turn.
    pub const MOST_PERIODS: f32 = 3000.0;

    const EXTRA_BITS: u32 = 10;

    /// `n` periods a turn, up to [`Harmonic::MOST_PERIODS`], and the phase `φ` at angle zero, rad.
    #[must_use]
    pub fn new(periods: f32, phase_rad: f32) -> Self {
        use core::f32::consts::TAU;
        let exponent = 32 + Self::EXTRA_BITS.cast_signed() - Angle::FRACTION_BITS.cast_signed();
        let turn = phase_rad / TAU;
        Self {
            phase_per_angle: libm::rintf(libm::scalbnf(periods / TAU, exponent)) as i32,
            phase: libm::rintf(libm::scalbnf(turn - libm::floorf(turn), 32)) as u32,
        }
    }

    /// Phase at an angle, 2³² a turn.
    #[inline]
    pub(super) const fn phase_at(self, angle_bits: i32) -> u32 {
        let turned = (angle_bits as i64 * self.phase_per_angle as i64) >> Self::EXTRA_BITS;
        (turned as u32).wrapping_add(self.phase)
    }

    /// The sine at an angle. Error below 1e-7, and 8e-7 a radian of the angle, and 2e-7 a radian of the phase.
    #[must_use]
    #[inline]
    pub fn sine(self, angle: Angle) -> Share {
        Share::from_bits(sine(self.phase_at(angle.to_bits())))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    fn value(ratio: Share) -> f64 {
        f64::from(ratio.to_bits()) / f64::from(1 << 30)
    }

    #[test]
    fn the_smooth_sign_by_hand() {
        // x = 0.5: 0.75 - 0.0625.
        let sign = SmoothSign::<Speed>::new(0.04).unwrap();
        for (speed, expected) in
            [(0.0, 0.0), (0.02, 0.6875), (-0.02, -0.6875), (0.04, 1.0), (7.0, 1.0), (-2000.0, -1.0)]
        {
            // The speed has steps of 2⁻²⁰ rad/s, of which the slope makes 37.5/rad/s.
            let got = value(sign.of(Speed::from_f32(speed)));
            assert!((got - expected).abs() < 3.6e-5, "{speed}: {got}");
        }
        assert_eq!(SmoothSign::<Speed>::new(0.0), None);
    }

    #[test]
    fn the_smooth_sign_is_odd_and_rises_without_a_corner() {
        let sign = SmoothSign::<Share>::new(1.0).unwrap();
        let mut last = -1.0;
        for step in -1999..=1999 {
            let x = f64::from(step) * 1e-3;
            let expected = if x.abs() > 1.0 { x.signum() } else { 0.5 * (3.0 * x - x.powi(3)) };
            let got = value(sign.of(Share::from_f32(x as f32)));
            // An f32 of x is right to 6e-8 of it.
            assert!((got - expected).abs() < 1e-7, "{x}: {got}");
            assert!(got - last < 1.6e-3 && got >= last, "{x}");
            last = got;
        }
    }

    #[test]
    fn the_fade_is_right_within_its_chords() {
        for (exponent, allowed) in [(0.5, 0.13), (1.0, 0.016), (1.5, 0.016), (2.0, 0.016), (3.0, 0.025)] {
            let fade = Fade::new(0.2, exponent).unwrap();
            let mut worst = 0.0_f64;
            for step in 0..4000 {
                let speed = 2e-4 * f64::from(step);
                let expected = (-(speed / 0.2).powf(f64::from(exponent))).exp();
                for sign in [1.0, -1.0] {
                    let got = value(fade.of(Speed::from_f32((sign * speed) as f32)));
                    worst = worst.max((got - expected).abs());
                }
            }
            std::println!("exponent {exponent}: {worst}");
            assert!(worst < allowed, "exponent {exponent}: {worst}");
            // Exact at the points: 0.2 rad/s is one of them. 2⁻¹⁴ and a step of the speed.
            assert!((value(fade.of(Speed::from_f32(0.2))) - 0.367_879).abs() < 4e-5);
            assert_eq!(fade.of(Speed::ZERO), Share::ONE);
            assert_eq!(fade.of(Speed::MAX), fade.of(Speed::from_bits(i32::MIN)));
        }
    }

    #[test]
    fn harmonics_are_sines_over_many_turns() {
        for (periods, phase) in [(1.0, 0.3), (40.0, -2.0), (2000.0, 3.0)] {
            let harmonic = Harmonic::new(periods, phase);
            for step in -1000..1000 {
                let angle = Angle::from_f32(0.013 * step as f32);
                let rad = f64::from(angle.to_bits()) / f64::from(1 << 20);
                let phase_rad = f64::from(periods) * rad + f64::from(phase);
                let got = value(harmonic.sine(angle));
                let allowed = 1e-7 + 8e-7 * rad.abs() + 2e-7 * phase_rad.abs();
                assert!((got - phase_rad.sin()).abs() < allowed, "{periods} {rad}: {got}");
            }
        }
    }
}
