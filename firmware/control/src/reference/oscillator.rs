//! Sine and the other periodic forms over a phase of 32 bits, 2³² a turn; values in 2⁻³⁰ from -1 to 1.

use bowden_link::message::Shape;

/// 1 in the scale of the forms.
pub const ONE: i32 = 1 << 30;

/// Bits behind the point of a form.
const BITS: u32 = 30;

/// Sine of `2π·phase/2³²`.
///
/// Odd polynomial of ninth degree over a quarter turn, minimax coefficients: error below 3.4e-9, with rounding below 8e-9,
/// RMS below 4e-9, bias below 1e-10 (test `sine_error_max_rms_bias`).
#[must_use]
pub const fn sine(phase: u32) -> i32 {
    /// Coefficients of x, x³, ... x⁹ for sin(π x/2), in 2⁻³⁰.
    const C: [i32; 5] = [1_686_629_674, -693_597_876, 85_564_854, -5_016_767, 161_942];
    let turned = phase.cast_signed();
    // The second and third quarter mirror the first and fourth.
    let x = if (phase ^ phase << 1) >> 31 == 1 { i32::MIN.wrapping_sub(turned) } else { turned };
    let square = product(x, x);
    // Up to here a sum is below 1/4: four times of it leaves the product in the upper half of 64 bits.
    let mut sum = C[3] + upper(C[4] << 2, square);
    sum = C[2] + upper(sum << 2, square);
    sum = C[1] + upper(sum << 2, square);
    sum = C[0] + product(sum, square);
    // The polynomial is 4 steps above 1 at its end.
    let value = product(sum, x);
    if value > ONE {
        ONE
    } else if value < -ONE {
        -ONE
    } else {
        value
    }
}

/// Product in 2⁻³⁰, rounded; both at most 2 in size and one of them at most 1.
const fn product(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64 + (1 << (BITS - 1))) >> BITS) as i32
}

/// Upper half of a product, rounded.
const fn upper(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64 + (1 << 31)) >> 32) as i32
}

/// Triangle that starts at 0 rising, exact.
#[must_use]
pub const fn triangle(phase: u32) -> i32 {
    let turned = phase.cast_signed();
    if (phase ^ phase << 1) >> 31 == 1 { i32::MIN.wrapping_sub(turned) } else { turned }
}

/// Eight steps up and eight down a period, starting at the middle level going up. The first quarter of each step is the
/// way to its level, without a jump of speed or acceleration: a load that jumps slackens its tendons.
#[must_use]
pub const fn staircase(phase: u32) -> i32 {
    const STEP: i32 = ONE / 4;
    /// Bits of a step, a sixteenth of a period, and of its quarter.
    const SLOT_BITS: u32 = 28;
    const WAY_BITS: u32 = SLOT_BITS - 2;
    let slot = (phase >> SLOT_BITS).cast_signed();
    // Level that the slot is to reach, and the way to it from the one before.
    let (level, way) = match slot {
        0..=3 => ((slot + 1) * STEP, STEP),
        4..=11 => ((7 - slot) * STEP, -STEP),
        _ => ((slot - 15) * STEP, STEP),
    };
    let within = phase & ((1 << SLOT_BITS) - 1);
    if within >> WAY_BITS != 0 {
        return level;
    }
    let left = ONE - smooth((within << (BITS - WAY_BITS)).cast_signed());
    level - product(way, left)
}

/// `6 x⁵ − 15 x⁴ + 10 x³`, from 0 to 1 without speed and acceleration at either end.
#[must_use]
pub const fn smooth(x: i32) -> i32 {
    let square = product(x, x);
    let cube = product(square, x);
    // Up to 10, in 2⁻³⁰; times the cube at most 1.
    let rest = 10 * ONE as i64 - 15 * x as i64 + 6 * square as i64;
    ((cube as i64 * rest) >> BITS) as i32
}

/// Odd lines 1, 3, ... 15 of equal amplitude, scaled to a peak of 1; crest factor 1.50.
///
/// The phases are the best of a search over 64ths of a turn that began from Schroeder's; his have a peak of 3.78 where
/// these have 3.0041 for lines of amplitude 1 (test `multisine_has_eight_lines_and_a_peak_of_one`).
#[must_use]
pub fn multisine(phase: u32) -> i32 {
    /// Phases, 64ths of a turn.
    const PHASES: [u32; 8] = [50, 31, 31, 0, 29, 42, 38, 56];
    /// One over the peak, in 2⁻³⁰: 1/3.00425.
    const SCALE: i64 = 357_407_614;
    let mut line = phase;
    let mut sum = 0_i64;
    for start in PHASES {
        sum += i64::from(sine(line.wrapping_add(start << 26)));
        line = line.wrapping_add(phase.wrapping_mul(2));
    }
    (((sum >> 3) * SCALE) >> (BITS - 3)) as i32
}

/// The form.
#[must_use]
pub fn form(shape: Shape, phase: u32) -> i32 {
    match shape {
        Shape::Sine => sine(phase),
        Shape::Triangle => triangle(phase),
        Shape::Multisine => multisine(phase),
        Shape::Staircase => staircase(phase),
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::f64::consts::TAU;

    use super::*;

    fn value(bits: i32) -> f64 {
        f64::from(bits) / f64::from(ONE)
    }

    #[test]
    fn sine_error_max_rms_bias() {
        let (mut largest, mut squares, mut sum) = (0.0_f64, 0.0, 0.0);
        let step = 40_503_u32;
        let count = u32::MAX / step;
        for n in 0..count {
            let phase = n * step;
            let error = value(sine(phase)) - (TAU * f64::from(phase) / 4_294_967_296.0).sin();
            largest = largest.max(error.abs());
            squares += error * error;
            sum += error;
        }
        let (rms, bias) = ((squares / f64::from(count)).sqrt(), sum / f64::from(count));
        // Five roundings of 2⁻³¹ at most, of which the last two count in full and the others by x² and less: 2e-9.
        assert!(largest < 6e-9, "{largest}");
        assert!(rms < 3e-9 && bias.abs() < 1e-10, "rms {rms}, bias {bias}");
    }

    #[test]
    fn sine_stays_within_one_and_is_odd() {
        for phase in (0..u32::MAX - 70_001).step_by(70_001).chain([1 << 30, 3 << 30, 1 << 31]) {
            assert!((-ONE..=ONE).contains(&sine(phase)), "{phase:#x}");
            assert!((sine(phase) + sine(phase.wrapping_neg())).abs() <= 4, "{phase:#x}");
        }
    }

    #[test]
    fn triangle_and_stairs_by_hand() {
        let eighth = 1 << 29;
        let triangles = [0, 1, 2, 1, 0, -1, -2, -1].map(|n| n * (ONE / 2));
        for (n, expected) in triangles.into_iter().enumerate() {
            assert_eq!(triangle(n as u32 * eighth), expected, "eighth {n}");
        }
        let levels = [1, 2, 3, 4, 3, 2, 1, 0, -1, -2, -3, -4, -3, -2, -1, 0];
        for (slot, level) in levels.into_iter().enumerate() {
            for within in [1 << 26, 1 << 27, (1 << 28) - 1] {
                assert_eq!(staircase(((slot as u32) << 28) + within), level * (ONE / 4), "slot {slot}");
            }
            // Half way to it after an eighth of the step.
            let before = level - [1, 1, 1, 1, -1, -1, -1, -1, -1, -1, -1, -1, 1, 1, 1, 1][slot];
            let middle = staircase(((slot as u32) << 28) + (1 << 25));
            assert!((middle - (level + before) * (ONE / 8)).abs() <= 2, "slot {slot}");
        }
    }

    #[test]
    fn nothing_jumps_between_phases() {
        // A 16 384th of a period: stairs rise by 1/4 within 1/64, at 1.875 times the mean: 1.8e-3·ONE; the 15th line of the
        // multisine has 15·2π/16384/3 = 1.9e-3, all eight 64/15 times that.
        for shape in [Shape::Sine, Shape::Triangle, Shape::Multisine, Shape::Staircase] {
            let mut last = form(shape, 0);
            for n in 1..=16_384_u32 {
                let next = form(shape, (n % 16_384) << 18);
                assert!((value(next) - value(last)).abs() < 9e-3, "{shape:?} at {n}");
                last = next;
            }
        }
    }

    #[test]
    fn multisine_has_eight_lines_and_a_peak_of_one() {
        let samples: std::vec::Vec<f64> = (0..4096_u32).map(|n| value(multisine(n << 20))).collect();
        let peak = samples.iter().fold(0.0_f64, |peak, value| peak.max(value.abs()));
        assert!(peak <= 1.0 && peak > 0.999, "peak {peak}");
        for line in 0..32 {
            let part = |turn: f64| -> f64 {
                let terms = samples
                    .iter()
                    .enumerate()
                    .map(|(n, value)| value * (TAU * (f64::from(line) * n as f64 / 4096.0 + turn)).cos());
                terms.sum::<f64>() / 2048.0
            };
            let amplitude = part(0.0).hypot(part(0.25));
            // One over the peak of 3.00425.
            let expected = if line % 2 == 1 && line < 16 { 0.332_862 } else { 0.0 };
            assert!((amplitude - expected).abs() < 1e-6, "line {line}: {amplitude}");
        }
    }
}
