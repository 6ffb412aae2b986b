//! Numbers as the report prints them: three significant digits, true minus sign, narrow space before the unit.

/// Stands for a number that does not exist.
const NONE: &str = "–";
/// Narrow space that does not break.
const THIN: char = '\u{202f}';

/// Number with three significant digits; powers of ten below 0.001 and from a million on.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return NONE.into();
    }
    if value == 0.0 {
        return "0".into();
    }
    let exponent = exponent_at(value, 3);
    if (-3..6).contains(&exponent) {
        return fixed(value, (2 - exponent).max(0) as usize);
    }
    format!("{}{THIN}×{THIN}{}", fixed(value / 10_f64.powi(exponent), 2), power_of_ten(exponent))
}

/// Number with its unit.
pub fn quantity(value: f64, unit: &str) -> String {
    attach(number(value), unit)
}

/// Value with its standard deviation: two digits of the latter decide how many the value shows.
pub(super) fn estimate(value: f64, std: Option<f64>, unit: &str) -> String {
    let Some(std) = std.filter(|std| std.is_finite() && *std > 0.0 && value.is_finite()) else {
        return quantity(value, unit);
    };
    let largest = exponent_at(value.abs().max(std), 3);
    let shift = if (-3..6).contains(&largest) { 0 } else { largest };
    let (value, std) = (value / 10_f64.powi(shift), std / 10_f64.powi(shift));
    let decimals = (1 - exponent_at(std, 2)).max(0);
    // A value known to more than six digits is cut there, and its deviation is printed by itself.
    let most = if value == 0.0 { decimals } else { (5 - exponent_at(value, 6)).max(0) };
    let pair = if decimals <= most {
        format!("{}{THIN}±{THIN}{}", fixed(value, decimals as usize), fixed(std, decimals as usize))
    } else {
        format!("{}{THIN}±{THIN}{}", fixed(value, most as usize), number(std))
    };
    if shift == 0 {
        // Brackets keep the unit from reading as that of the deviation alone.
        return if unit_text(unit).is_empty() { pair } else { attach(format!("({pair})"), unit) };
    }
    attach(format!("({pair}){THIN}×{THIN}{}", power_of_ten(shift)), unit)
}

/// Share of a whole, in per cent; never rounded to none or all.
pub(super) fn share(value: f64) -> String {
    let percent = 100.0 * value;
    if !value.is_finite() {
        NONE.into()
    } else if percent > 0.0 && percent < 0.1 {
        format!("<{THIN}0.1{THIN}%")
    } else if percent < 100.0 && percent > 99.9 {
        format!(">{THIN}99.9{THIN}%")
    } else {
        // One decimal near either end, where it tells: 0.4 %, 99.5 %.
        let decimals =
            usize::from((percent.abs() < 10.0 || percent > 98.95) && percent != 0.0 && percent != 100.0);
        format!("{}{THIN}%", fixed(percent, decimals))
    }
}

/// Change from `from` to `to` in per cent, with its sign.
pub fn change(from: f64, to: f64) -> String {
    let percent = 100.0 * (to - from) / from.abs();
    if !percent.is_finite() {
        return NONE.into();
    }
    let decimals = usize::from(percent.abs() < 100.0);
    let text = fixed(percent, decimals);
    let sign = if text.starts_with('−') || text == "0.0" { "" } else { "+" };
    format!("{sign}{text}{THIN}%")
}

/// Time, s, to a hundredth.
pub fn seconds(t_s: f64) -> String {
    if t_s.is_finite() { format!("{}{THIN}s", fixed(t_s, 2)) } else { NONE.into() }
}

/// Number with a fixed count of decimals; five digits and more before the point are grouped by threes.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let (whole, rest) = text.split_at(text.find('.').unwrap_or(text.len()));
    let mut grouped = String::with_capacity(text.len() + 8);
    for (i, digit) in whole.char_indices() {
        if i > 0 && whole.len() > 4 && (whole.len() - i) % 3 == 0 {
            grouped.push(THIN);
        }
        grouped.push(digit);
    }
    let is_zero = text.bytes().all(|b| matches!(b, b'0' | b'.'));
    format!("{}{grouped}{rest}", if value < 0.0 && !is_zero { "−" } else { "" })
}

/// Exponent of ten to take out of numbers up to `largest` that stand together: 0 where they read well as they are.
pub(super) fn shared_exponent(largest: f64) -> i32 {
    if largest == 0.0 || !largest.is_finite() || (0.02..1e5).contains(&largest) {
        return 0;
    }
    3 * (largest.log10() / 3.0).floor() as i32
}

/// Unit with the power of ten that was taken out of the numbers, such as `10⁻³ N·m`; empty for a plain ratio.
pub(super) fn scaled_unit(exponent: i32, unit: &str) -> String {
    let unit = unit_text(unit);
    match exponent {
        0 => unit,
        _ if unit.is_empty() => power_of_ten(exponent),
        _ => format!("{}{THIN}{unit}", power_of_ten(exponent)),
    }
}

/// `10ⁿ`.
pub(super) fn power_of_ten(exponent: i32) -> String {
    format!("10{}", superscript(&exponent.to_string()))
}

/// Unit as print wants it: `N m^2` becomes `N·m²`, a ratio has none.
pub fn unit_text(unit: &str) -> String {
    if unit == "1" {
        return String::new();
    }
    let mut text = String::with_capacity(unit.len() + 4);
    let mut characters = unit.chars().peekable();
    while let Some(c) = characters.next() {
        match c {
            '^' => {
                let mut power = String::new();
                while let Some(digit) = characters.next_if(|c| c.is_ascii_digit() || *c == '-') {
                    power.push(digit);
                }
                text.push_str(&superscript(&power));
            }
            ' ' | '*' => text.push('·'),
            other => text.push(other),
        }
    }
    text
}

fn attach(number: String, unit: &str) -> String {
    let unit = unit_text(unit);
    if unit.is_empty() { number } else { format!("{number}{THIN}{unit}") }
}

/// Decimal exponent of the value once it is rounded to so many significant digits.
fn exponent_at(value: f64, digits: usize) -> i32 {
    // Rust writes `-1.235e-4`; reading the exponent there counts a carry such as 9.999 to 10.0.
    format!("{value:.*e}", digits - 1).split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0)
}

fn superscript(digits: &str) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    digits.chars().map(|c| c.to_digit(10).map_or('⁻', |d| RAISED[d as usize])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Narrow spaces written as plain ones, for reading.
    fn plain(text: &str) -> String {
        text.replace(THIN, " ")
    }

    #[test]
    fn numbers_have_three_digits() {
        let shown =
            [0.0, 1.0, -12.345, 0.09996, 9.999, 123.4, 25_000.0, 0.001_234, 4.56e-5, -7.891e7, f64::NAN]
                .map(|value| plain(&number(value)));
        let by_hand = [
            "0",
            "1.00",
            "−12.3",
            "0.100",
            "10.0",
            "123",
            "25 000",
            "0.00123",
            "4.56 × 10⁻⁵",
            "−7.89 × 10⁷",
            "–",
        ];
        assert_eq!(shown, by_hand);
    }

    #[test]
    fn deviation_decides_the_digits() {
        let cases = [
            (0.213_4, Some(0.011), "1", "0.213 ± 0.011"),
            (12.345_6, Some(0.021), "N", "(12.346 ± 0.021) N"),
            (1234.5, Some(250.0), "N/m", "(1234 ± 250) N/m"),
            (-3.21e-5, Some(4.0e-7), "kg m^2", "(−3.210 ± 0.040) × 10⁻⁵ kg·m²"),
            (0.05, None, "N m", "0.0500 N·m"),
            (0.0, Some(0.3), "rad", "(0.00 ± 0.30) rad"),
            (1.234_567_8, Some(1e-9), "1", "1.23457 ± 1.00 × 10⁻⁹"),
            (2.0, Some(f64::NAN), "s", "2.00 s"),
        ];
        for (value, std, unit, expected) in cases {
            assert_eq!(plain(&estimate(value, std, unit)), expected);
        }
    }

    #[test]
    fn shares_are_never_rounded_to_all_or_nothing() {
        let shown = [0.0, 0.000_4, 0.042, 0.5, 0.986, 0.994, 0.999_7, 1.0].map(|value| plain(&share(value)));
        assert_eq!(shown, ["0 %", "< 0.1 %", "4.2 %", "50 %", "99 %", "99.4 %", "> 99.9 %", "100 %"]);
    }

    #[test]
    fn changes_carry_a_sign() {
        assert_eq!(plain(&change(0.2, 0.25)), "+25.0 %");
        assert_eq!(plain(&change(-2.0, -3.0)), "−50.0 %");
        assert_eq!(plain(&change(1.0, 4.0)), "+300 %");
        assert_eq!(plain(&change(1.0, 1.0)), "0.0 %");
        assert_eq!(change(0.0, 1.0), "–");
    }

    #[test]
    fn numbers_that_stand_together_share_a_power_of_ten() {
        assert_eq!([0.0, 0.02, 99_999.0, f64::NAN].map(shared_exponent), [0; 4]);
        assert_eq!([0.019, 0.001, 0.000_9, 1e5, 2.5e6].map(shared_exponent), [-3, -3, -6, 3, 6]);
        assert_eq!(plain(&scaled_unit(-3, "N m")), "10⁻³ N·m");
        assert_eq!((scaled_unit(0, "rad").as_str(), scaled_unit(6, "1").as_str()), ("rad", "10⁶"));
    }

    #[test]
    fn units_read_as_in_print() {
        assert_eq!(unit_text("N m s/rad"), "N·m·s/rad");
        assert_eq!(unit_text("kg m^2"), "kg·m²");
        assert_eq!(unit_text("s^-1"), "s⁻¹");
        assert_eq!(unit_text("1"), "");
    }
}
