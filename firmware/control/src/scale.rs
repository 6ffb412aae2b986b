//! Fixed-point quantities: the unit is in the type, the scale in its constant.
//!
//! Stored in `fixed::types::I12F20` and `I20F12` (crate `fixed`: saturating arithmetic on any machine, no float). idsp's
//! `Q` has accumulators of its own, but no unit either; what is missing in both, that an angle cannot be added to a
//! torque, is the newtype here. Products are widened to 64 bits in [`Gain`] and [`Sum`] and nowhere else.
//!
//! | type | unit | range | resolution |
//! |---|---|---|---|
//! | [`Angle`] | rad | ±2048 | 0.95e-6 |
//! | [`Speed`] | rad/s | ±2048 | 0.95e-6 |
//! | [`Acceleration`] | rad/s² | ±524 288 | 244e-6 |
//! | [`Torque`] | N·m | ±2048 | 0.95e-6 |
//! | [`Tension`] | N | ±2048 | 0.95e-6 |
//! | [`Current`] | A | ±2048 | 0.95e-6 |
//! | [`Voltage`] | V | ±2048 | 0.95e-6 |
//! | [`Code`] | ADC code | ±524 288 | 1/4096 |
//! | [`Ratio`] | 1 | ±128 | 60e-9 |
//! | [`Share`] | 1 | ±1 | 0.93e-9 |
//!
//! Sums and differences saturate. A [`Gain`] rounds to nearest (half up) and saturates; its factor is exactly the `f32`
//! it was made from, so the error of a product is at most half a step of the result.

use core::cmp::Ordering;
use core::marker::PhantomData;

use fixed::types::{I2F30, I8F24, I12F20, I20F12};

/// A fixed-point quantity with a unit.
pub trait Quantity: Copy + Default + PartialOrd {
    /// Bits behind the binary point.
    const FRACTION_BITS: u32;

    /// The quantity with these bits.
    fn from_bits(bits: i32) -> Self;

    /// Its bits.
    fn to_bits(self) -> i32;

    /// Value in its unit; for reports, not for the control law.
    #[must_use]
    fn to_f32(self) -> f32 {
        self.to_bits() as f32 * (1.0 / (1_u32 << Self::FRACTION_BITS) as f32)
    }

    /// Nearest quantity to `value`, saturated; 0 for a value that is no number. For configuration, not for the tick.
    #[must_use]
    fn from_f32(value: f32) -> Self {
        let scaled = value * (1_u32 << Self::FRACTION_BITS) as f32;
        Self::from_bits(libm::rintf(scaled) as i32)
    }
}

macro_rules! quantity {
    ($name:ident, $store:ty, $bits:literal, $text:literal) => {
        #[doc = $text]
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $name($store);

        // Compared as what they are: one instruction, where the general comparison of `fixed` takes six.
        impl PartialOrd for $name {
            #[inline]
            fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
                Some(self.cmp(other))
            }

            #[inline]
            fn lt(&self, other: &Self) -> bool {
                self.0.to_bits() < other.0.to_bits()
            }

            #[inline]
            fn le(&self, other: &Self) -> bool {
                self.0.to_bits() <= other.0.to_bits()
            }

            #[inline]
            fn gt(&self, other: &Self) -> bool {
                self.0.to_bits() > other.0.to_bits()
            }

            #[inline]
            fn ge(&self, other: &Self) -> bool {
                self.0.to_bits() >= other.0.to_bits()
            }
        }

        impl Ord for $name {
            #[inline]
            fn cmp(&self, other: &Self) -> Ordering {
                self.0.to_bits().cmp(&other.0.to_bits())
            }
        }

        impl Quantity for $name {
            const FRACTION_BITS: u32 = $bits;

            #[inline]
            fn from_bits(bits: i32) -> Self {
                Self(<$store>::from_bits(bits))
            }

            #[inline]
            fn to_bits(self) -> i32 {
                self.0.to_bits()
            }
        }

        impl $name {
            /// Nothing of it.
            pub const ZERO: Self = Self(<$store>::ZERO);
            /// Largest of it.
            pub const MAX: Self = Self(<$store>::MAX);

            /// Sum, saturated.
            #[must_use]
            #[inline]
            pub const fn plus(self, other: Self) -> Self {
                Self(self.0.saturating_add(other.0))
            }

            /// Difference, saturated.
            #[must_use]
            #[inline]
            pub const fn minus(self, other: Self) -> Self {
                Self(self.0.saturating_sub(other.0))
            }

            /// With the other sign, saturated.
            #[must_use]
            #[inline]
            pub const fn negated(self) -> Self {
                Self(self.0.saturating_neg())
            }

            /// Size without sign, saturated.
            #[must_use]
            #[inline]
            pub const fn magnitude(self) -> Self {
                Self(self.0.saturating_abs())
            }

            /// Whether it is from `low` to `high`, of which `low` is the lesser: one comparison.
            #[must_use]
            #[inline]
            pub const fn is_within(self, low: Self, high: Self) -> bool {
                let (bits, low, high) = (self.0.to_bits(), low.0.to_bits(), high.0.to_bits());
                bits.wrapping_sub(low).cast_unsigned() <= high.wrapping_sub(low).cast_unsigned()
            }

            /// Whether it is from `-limit` to `limit`; `limit` is 0 or more.
            #[must_use]
            #[inline]
            pub const fn is_at_most(self, limit: Self) -> bool {
                let limit = limit.0.to_bits();
                let from_low = self.0.to_bits().wrapping_add(limit).cast_unsigned();
                from_low <= limit.cast_unsigned().wrapping_mul(2)
            }

            /// The nearest value from `-limit` to `limit`; `limit` is 0 or more.
            #[must_use]
            #[inline]
            pub fn limited(self, limit: Self) -> Self {
                let (bits, limit) = (self.0.to_bits(), limit.0.to_bits());
                Self(<$store>::from_bits(bits.max(-limit).min(limit)))
            }
        }
    };
}

quantity!(Angle, I12F20, 20, "Angle, rad, in 2⁻²⁰.");
quantity!(Speed, I12F20, 20, "Speed, rad/s, in 2⁻²⁰.");
quantity!(Acceleration, I20F12, 12, "Acceleration, rad/s², in 2⁻¹².");
quantity!(Torque, I12F20, 20, "Torque, N·m, in 2⁻²⁰.");
quantity!(Tension, I12F20, 20, "Tension, N, in 2⁻²⁰.");
quantity!(Current, I12F20, 20, "Current, A, in 2⁻²⁰.");
quantity!(Voltage, I12F20, 20, "Voltage, V, in 2⁻²⁰.");
quantity!(Code, I20F12, 12, "Code of a converter, with fractions, in 2⁻¹².");
quantity!(Ratio, I8F24, 24, "Number without a unit, in 2⁻²⁴.");

impl Ratio {
    /// 1.
    pub const ONE: Self = Self::from_parts(1, 1);
    /// 1/3.
    pub const THIRD: Self = Self::from_parts(1, 3);
    /// 1/5.
    pub const FIFTH: Self = Self::from_parts(1, 5);

    /// `numerator/denominator`, rounded towards 0; for constants.
    #[must_use]
    pub const fn from_parts(numerator: i32, denominator: i32) -> Self {
        Self(I8F24::from_bits((numerator << 24) / denominator))
    }

    /// This part of `value`, rounded down, saturated.
    #[must_use]
    #[inline]
    pub fn of<Q: Quantity>(self, value: Q) -> Q {
        let product = i64::from(self.0.to_bits()) * i64::from(value.to_bits());
        Q::from_bits(saturated(product >> 24))
    }

    /// Product, rounded down, saturated.
    #[must_use]
    #[inline]
    pub fn times(self, other: Self) -> Self {
        self.of(other)
    }

    /// Mean of two.
    #[must_use]
    #[inline]
    pub const fn half_sum(self, other: Self) -> Self {
        Self(I8F24::from_bits((self.0.to_bits() >> 1) + (other.0.to_bits() >> 1)))
    }
}

quantity!(Share, I2F30, 30, "Share from -1 to 1, in 2⁻³⁰.");

impl Share {
    /// 1.
    pub const ONE: Self = Self(I2F30::ONE);

    /// This share of a quantity, rounded to nearest.
    #[must_use]
    #[inline]
    pub fn of<Q: Quantity>(self, quantity: Q) -> Q {
        // Within ±1 the product is within the range of the quantity.
        let product = i64::from(self.to_bits()) * i64::from(quantity.to_bits());
        Q::from_bits(((product + (1 << (Self::FRACTION_BITS - 1))) >> Self::FRACTION_BITS) as i32)
    }
}

/// Nearest `i32`.
#[inline]
pub(crate) const fn saturated(wide: i64) -> i32 {
    let (low, high) = (wide as i32, (wide >> 32) as i32);
    // In range if the high word repeats the sign of the low one; else its own sign says which end.
    if high == low >> 31 { low } else { i32::MAX ^ (high >> 31) }
}

/// Factor from a quantity to another: `O = factor · I`.
///
/// `bits(O) = ((bits(I) · 2^up · mantissa >> (32 + down)) + 1) >> 1`, in 64 bits: the upper half of the product holds the result,
/// unless `bits(I) · 2^up` leaves 32 bits, which takes results of 2²⁸ steps and more and another way. The mantissa has 24 bits
/// and seven zeros, so it is the `f32` itself.
#[derive(Debug)]
pub struct Gain<I, O> {
    mantissa: i32,
    /// `up` in the lowest byte, `down` in the next: both are taken out and bounded by one instruction each.
    shifts: u32,
    from_to: PhantomData<fn(I) -> O>,
}

impl<I, O> Clone for Gain<I, O> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<I, O> Copy for Gain<I, O> {}

impl<I, O> PartialEq for Gain<I, O> {
    fn eq(&self, other: &Self) -> bool {
        (self.mantissa, self.shifts) == (other.mantissa, other.shifts)
    }
}

impl<I: Quantity, O: Quantity> Gain<I, O> {
    /// The gain `factor`, unit of O over unit of I. `None` if it is no number or its size is 2²⁹ or more; zero below 2⁻⁴⁰
    /// (both times 2⁸ or 2⁻⁸ where the scales of I and O differ by eight bits).
    #[must_use]
    pub fn new(factor: f32) -> Option<Self> {
        /// Bits of an `f32` mantissa behind its leading one, and the bias of its exponent.
        const MANTISSA_BITS: i32 = 23;
        const BIAS: i32 = 127;
        /// Zeros below the mantissa.
        const SPARE_BITS: i32 = 7;
        if !factor.is_finite() {
            return None;
        }
        let bits = factor.to_bits();
        let exponent = (bits >> MANTISSA_BITS & 0xff).cast_signed();
        let magnitude = if exponent == 0 { 0 } else { (bits & 0x7f_ffff | 0x80_0000).cast_signed() };
        let mantissa = if factor < 0.0 { -magnitude } else { magnitude };
        // Places behind the point of a product with the 24 bits alone, less the one of the rounding.
        let places = BIAS + MANTISSA_BITS - 1 - exponent + I::FRACTION_BITS.cast_signed()
            - O::FRACTION_BITS.cast_signed();
        let beyond = places + SPARE_BITS - 32;
        match places {
            _ if mantissa == 0 => Some(Self::ZERO),
            -6..=62 => {
                // By 31 places down nothing is left of any product.
                let (up, down) = ((-beyond).max(0), beyond.clamp(0, 31));
                let shifts = (up | down << 8).cast_unsigned();
                Some(Self { mantissa: mantissa << SPARE_BITS, shifts, from_to: PhantomData })
            }
            63.. => Some(Self::ZERO),
            _ => None,
        }
    }

    /// The gain nothing.
    pub const ZERO: Self = Self { mantissa: 0, shifts: 0, from_to: PhantomData };

    /// `factor · value`, rounded to nearest, saturated.
    #[inline]
    #[must_use]
    pub fn apply(self, value: I) -> O {
        let (up, down) = (self.shifts & 31, self.shifts >> 8 & 31);
        let value = value.to_bits();
        let raised = value << up;
        if raised >> up != value {
            return O::from_bits(large(value, self.mantissa, up));
        }
        let upper = ((i64::from(raised) * i64::from(self.mantissa)) >> 32) as i32;
        O::from_bits(((upper >> down) + 1) >> 1)
    }
}

/// `value · mantissa · 2^up`, of which 33 places go, rounded and saturated; for values that leave 32 bits when they are raised.
#[cold]
#[inline(never)]
fn large(value: i32, mantissa: i32, up: u32) -> i32 {
    let product = i64::from(value) * i64::from(mantissa);
    saturated(((product >> (32 - up)) + 1) >> 1)
}

/// Ticks in a row in which something was wrong.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Debounce(u16);

impl Debounce {
    /// Counts this tick; whether it has been wrong for `ticks` in a row now.
    #[inline]
    pub const fn count(&mut self, wrong: bool, ticks: u16) -> bool {
        if !wrong {
            self.0 = 0;
            return false;
        }
        self.0 = self.0.saturating_add(1);
        self.0 >= ticks
    }
}

/// Part of a sum's step: bits below a bit of the quantity.
const SUM_BITS: u32 = 31;

/// Weight with which an input enters a [`Sum`] each tick, `factor · 2^(31 + O - I)`.
#[derive(Debug)]
pub struct Weight<I, O> {
    bits: i32,
    from_to: PhantomData<fn(I) -> O>,
}

impl<I, O> Clone for Weight<I, O> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<I, O> Copy for Weight<I, O> {}

impl<I, O> PartialEq for Weight<I, O> {
    fn eq(&self, other: &Self) -> bool {
        self.bits == other.bits
    }
}

impl<I: Quantity, O: Quantity> Weight<I, O> {
    /// The weight `factor`, unit of O over unit of I; saturates just below `2^(I - O)` of the scales, error 2⁻³² of that.
    #[must_use]
    pub fn new(factor: f32) -> Self {
        let exponent =
            SUM_BITS.cast_signed() + O::FRACTION_BITS.cast_signed() - I::FRACTION_BITS.cast_signed();
        Self { bits: libm::rintf(libm::scalbnf(factor, exponent)) as i32, from_to: PhantomData }
    }

    /// A weight between two quantities of one scale that the tick computes, -1/2 to 1/2.
    #[inline]
    pub(crate) fn of_ratio(ratio: Ratio) -> Self {
        /// From 2⁻²⁴ to 2⁻³¹.
        const EXTRA_BITS: u32 = SUM_BITS - Ratio::FRACTION_BITS;
        const { assert!(I::FRACTION_BITS == O::FRACTION_BITS) };
        Self { bits: ratio.limited(Ratio::from_parts(1, 2)).to_bits() << EXTRA_BITS, from_to: PhantomData }
    }

    /// The weight of a first-order low-pass that reaches 63 % in `time_s` at `period_s` a tick: `T / (τ + T)`.
    #[must_use]
    pub fn low_pass(time_s: f32, period_s: f32) -> Self {
        Self::new(period_s / (time_s + period_s))
    }
}

/// Sum over ticks with 31 bits below a step of the quantity, so that small inputs are not lost; saturates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sum<O> {
    wide: i64,
    of: PhantomData<O>,
}

impl<O: Quantity> Sum<O> {
    /// Starts at `value`.
    #[must_use]
    #[inline]
    pub fn at(value: O) -> Self {
        Self { wide: i64::from(value.to_bits()) << SUM_BITS, of: PhantomData }
    }

    /// Adds `weight · input`.
    #[inline]
    pub fn add<I: Quantity>(&mut self, weight: Weight<I, O>, input: I) {
        // Below 2⁶² each, since the sum is kept in the range of its quantity.
        let wide = self.wide + i64::from(weight.bits) * i64::from(input.to_bits());
        let (low, high) = ((wide >> SUM_BITS) as i32, (wide >> (SUM_BITS + 31)) as i32);
        self.wide = if high == low >> 31 { wide } else { i64::from(i32::MAX ^ (high >> 31)) << SUM_BITS };
    }

    /// The sum, rounded down.
    #[inline]
    #[must_use]
    pub fn value(&self) -> O {
        O::from_bits((self.wide >> SUM_BITS) as i32)
    }
}

impl<O: Quantity> Sum<O> {
    /// Low-pass step towards `input`; returns the new value.
    #[inline]
    pub fn approach(&mut self, weight: Weight<O, O>, input: O) -> O {
        debug_assert!(weight.bits >= 0, "a low-pass goes towards its input");
        let difference = input.to_bits().saturating_sub(self.value().to_bits());
        // Between the old value and the input, and so in range: nothing to saturate.
        self.wide += i64::from(weight.bits) * i64::from(difference);
        self.value()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn angle(bits: i32) -> Angle {
        Angle::from_bits(bits)
    }

    #[test]
    fn a_gain_rounds_half_up_and_saturates() {
        let half = Gain::<Angle, Torque>::new(0.5).unwrap();
        let halves = [(3, 2), (1, 1), (-1, 0), (-3, -1), (4, 2), (i32::MAX, 1 << 30), (i32::MIN, -(1 << 30))];
        for (input, output) in halves {
            assert_eq!(half.apply(angle(input)).to_bits(), output, "{input}");
        }
        let large = Gain::<Angle, Torque>::new(-1e6).unwrap();
        assert_eq!(large.apply(angle(1 << 20)).to_bits(), i32::MIN);
        assert_eq!(large.apply(angle(-(1 << 20))).to_bits(), i32::MAX);
        assert_eq!(large.apply(angle(-2)).to_bits(), 2_000_000);
    }

    #[test]
    fn ranges_are_asked_by_one_comparison() {
        let extremes = [i32::MIN, i32::MIN + 1, -7, -1, 0, 1, 6, i32::MAX - 1, i32::MAX];
        for bits in extremes {
            for low in extremes {
                for high in extremes.into_iter().filter(|high| low <= *high) {
                    let got = angle(bits).is_within(angle(low), angle(high));
                    assert_eq!(got, low <= bits && bits <= high, "{bits} from {low} to {high}");
                }
                if low >= 0 {
                    let got = angle(bits).is_at_most(angle(low));
                    assert_eq!(got, -low <= bits && bits <= low, "{bits} of {low}");
                }
            }
        }
    }

    #[test]
    fn a_share_of_a_quantity_is_rounded() {
        let third = Share::from_bits(357_913_941);
        for (bits, expected) in [(3, 1), (300, 100), (-301, -100), (i32::MAX, 715_827_882)] {
            assert_eq!(third.of(angle(bits)).to_bits(), expected, "{bits}");
        }
        for bits in [i32::MAX, -77, i32::MIN + 1] {
            assert_eq!(Share::ONE.of(angle(bits)).to_bits(), bits);
            assert_eq!(Share::ONE.negated().of(angle(bits)).to_bits(), -bits);
        }
    }

    #[test]
    fn a_gain_is_the_number_it_was_made_from() {
        // Exact products in f64, which holds 24 by 29 bits; half a step for the rounding.
        for factor in [1.0_f32, -0.030_13, 1.0e-7, 333.25, 0.1, 3.3e-4] {
            let gain = Gain::<Angle, Acceleration>::new(factor).unwrap();
            for bits in [1, -77, 123_456, -98_765_432, 1 << 28] {
                let expected = f64::from(bits) * f64::from(factor) / 256.0;
                let got = f64::from(gain.apply(angle(bits)).to_bits());
                assert!((got - expected).abs() <= 0.5, "{factor} · {bits}: {got} for {expected}");
            }
        }
    }

    #[test]
    fn gains_out_of_range_are_refused_or_zero() {
        for factor in [f32::NAN, f32::INFINITY, 1_073_741_824.0, -1e20] {
            assert_eq!(Gain::<Angle, Angle>::new(factor), None, "{factor}");
        }
        for factor in [0.0, -0.0, 1e-20, f32::MIN_POSITIVE / 2.0] {
            assert_eq!(Gain::<Angle, Angle>::new(factor), Some(Gain::ZERO), "{factor}");
        }
        let largest = Gain::<Angle, Angle>::new(536_870_880.0).unwrap();
        assert_eq!(largest.apply(angle(1)).to_bits(), 536_870_880);
        assert_eq!(largest.apply(angle(i32::MIN)).to_bits(), i32::MIN);
    }

    #[test]
    fn a_sum_loses_nothing_small() {
        // A tenth of a step, a million times: 100 000 steps, and the weight is right to 2⁻³².
        let weight = Weight::<Angle, Angle>::new(0.1);
        let mut sum = Sum::at(angle(0));
        for _ in 0..1_000_000 {
            sum.add(weight, angle(1));
        }
        assert!((99_999..=100_000).contains(&sum.value().to_bits()), "{:?}", sum.value());
    }

    #[test]
    fn a_low_pass_arrives_and_keeps_its_time() {
        let weight = Weight::<Angle, Angle>::low_pass(0.01, 1e-4);
        let mut sum = Sum::at(angle(0));
        let mut after_time_constant = 0;
        for tick in 1..=5000 {
            let value = sum.approach(weight, angle(1_000_000)).to_bits();
            if tick == 100 {
                after_time_constant = value;
            }
        }
        // 1 - (1 - 1/101)^100 = 0.6303.
        assert!((after_time_constant - 630_288).abs() < 100, "{after_time_constant}");
        assert!((999_999..=1_000_000).contains(&sum.value().to_bits()));
    }

    #[test]
    fn sums_saturate() {
        let weight = Weight::<Angle, Angle>::new(1e9);
        let mut sum = Sum::at(Angle::MAX);
        for _ in 0..10 {
            sum.add(weight, Angle::MAX);
        }
        assert_eq!(sum.value(), Angle::MAX);
        for _ in 0..40 {
            sum.add(weight, angle(i32::MIN));
        }
        assert_eq!(sum.value().to_bits(), i32::MIN);
    }

    #[test]
    fn numbers_beyond_the_range_saturate() {
        assert_eq!(Angle::from_f32(1e9), Angle::MAX);
        assert_eq!(Angle::from_f32(-1e9).to_bits(), i32::MIN);
        assert_eq!(Angle::from_f32(f32::NAN), Angle::ZERO);
        assert_eq!(angle(i32::MIN).magnitude(), Angle::MAX);
        assert_eq!(angle(i32::MIN).negated(), Angle::MAX);
    }
}
