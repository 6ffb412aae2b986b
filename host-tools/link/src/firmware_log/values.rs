//! Numbers of a log line and their names.

use defmt_decoder::Frame;
use defmt_parser::{DisplayHint, Fragment, Type};

/// Numbers that a name stands before: `f1_n={=f32}`, `tick {=u32}`, `limits: {=u16:b}`.
pub(super) fn named(frame: &Frame) -> Vec<(String, f64)> {
    let mut before = String::new();
    let mut values = Vec::new();
    for (fragment, shown) in frame.fragments().iter().zip(frame.display_fragments()) {
        match fragment {
            Fragment::Literal(text) => before = text.to_string(),
            Fragment::Parameter(parameter) => {
                let text = std::mem::take(&mut before);
                if let (Some(name), true) = (name_at_end(&text), is_number(&parameter.ty))
                    && let Some(value) = number(&shown, parameter.hint.as_ref())
                {
                    values.push((name.to_owned(), value));
                }
            }
        }
    }
    values
}

/// The word at the end of a text, with `=`, `:` or spaces behind it.
fn name_at_end(text: &str) -> Option<&str> {
    let text = text.trim_end_matches([' ', '=', ':']);
    let is_part = |letter: char| letter.is_ascii_alphanumeric() || letter == '_' || letter == '.';
    let start = text.rfind(|letter| !is_part(letter)).map_or(0, |place| place + 1);
    let name = &text[start..];
    name.starts_with(|letter: char| letter.is_ascii_alphabetic() || letter == '_').then_some(name)
}

const fn is_number(kind: &Type) -> bool {
    matches!(
        kind,
        Type::BitField(_)
            | Type::Bool
            | Type::F32
            | Type::F64
            | Type::I8
            | Type::I16
            | Type::I32
            | Type::I64
            | Type::Isize
            | Type::U8
            | Type::U16
            | Type::U32
            | Type::U64
            | Type::Usize
    )
}

/// Value of a number as it is shown.
fn number(shown: &str, hint: Option<&DisplayHint>) -> Option<f64> {
    let radix = match hint {
        Some(DisplayHint::Hexadecimal { .. }) => 16,
        Some(DisplayHint::Octal { .. }) => 8,
        Some(DisplayHint::Binary { .. }) => 2,
        _ => 10,
    };
    if radix != 10 {
        let digits = ["0x", "0o", "0b"].iter().find_map(|prefix| shown.strip_prefix(prefix)).unwrap_or(shown);
        return u64::from_str_radix(digits, radix).ok().map(|value| value as f64);
    }
    match shown {
        "true" => Some(1.0),
        "false" => Some(0.0),
        _ => shown.parse().ok().filter(|value: &f64| value.is_finite()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_the_word_before_a_number() {
        for (text, name) in [
            ("tick ", Some("tick")),
            (", limits ", Some("limits")),
            ("f1_n=", Some("f1_n")),
            ("angle of the joint: ", Some("joint")),
            (", ", None),
            (" -> ", None),
            ("", None),
            ("at 12 ", None),
        ] {
            assert_eq!(name_at_end(text), name, "{text}");
        }
    }

    #[test]
    fn numbers_are_read_in_the_base_that_they_are_shown_in() {
        let binary = DisplayHint::Binary { alternate: false, zero_pad: 0 };
        let hexadecimal = DisplayHint::Hexadecimal { alternate: true, uppercase: false, zero_pad: 0 };
        assert_eq!(number("101", Some(&binary)), Some(5.0));
        assert_eq!(number("0xff", Some(&hexadecimal)), Some(255.0));
        assert_eq!(number("-0.25", None), Some(-0.25));
        assert_eq!(number("true", None), Some(1.0));
        assert_eq!(number("NaN", None), None);
    }
}
