//! A curve in the terminal, eight dots a character.

use std::fmt::Write;

/// Characters of a chart.
const COLUMNS: usize = 72;
const ROWS: usize = 8;

/// Dots of a character.
const ACROSS: usize = 2;
const DOWN: usize = 4;

/// Bits of a Braille character, by column and row of its dots.
const DOTS: [[u8; DOWN]; ACROSS] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];

/// Draws values over time; every dot column spans from the smallest to the largest value in its time, so that no peak is lost.
/// Without values, or with values that are no numbers, nothing.
pub fn chart(title: &str, t_s: &[f64], values: &[f64]) -> String {
    let (Some(first_s), Some(last_s)) = (t_s.first(), t_s.last()) else { return String::new() };
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !(least.is_finite() && most.is_finite()) || t_s.len() != values.len() {
        return String::new();
    }
    let (wide, high) = (COLUMNS * ACROSS, ROWS * DOWN);
    let at = |value: f64, from: f64, to: f64, dots: usize| {
        if to > from {
            ((value - from) / (to - from) * (dots - 1) as f64).round() as usize
        } else {
            (dots - 1) / 2
        }
    };
    let mut spans: Vec<Option<(usize, usize)>> = vec![None; wide];
    for (t_s, value) in t_s.iter().zip(values) {
        let (x, y) = (at(*t_s, *first_s, *last_s, wide), at(*value, least, most, high));
        let (low, top) = spans[x].unwrap_or((y, y));
        spans[x] = Some((low.min(y), top.max(y)));
    }
    let mut cells = vec![[0_u8; COLUMNS]; ROWS];
    for (x, (low, top)) in spans.iter().enumerate().filter_map(|(x, span)| Some((x, (*span)?))) {
        for y in low..=top {
            let down = high - 1 - y;
            cells[down / DOWN][x / ACROSS] |= DOTS[x % ACROSS][down % DOWN];
        }
    }
    let mut text = format!("{title}\n");
    for (row, cells) in cells.iter().enumerate() {
        let mark = match row {
            0 => format!("{most:.4}"),
            _ if row + 1 == ROWS => format!("{least:.4}"),
            _ => String::new(),
        };
        let dots: String =
            cells.iter().map(|bits| char::from_u32(0x2800 + u32::from(*bits)).unwrap_or(' ')).collect();
        let _ = writeln!(text, "{mark:>12} {}", dots.trim_end_matches('\u{2800}'));
    }
    let _ = writeln!(text, "{:>12} {:<36}{:>36}", "t_s", format!("{first_s:.3}"), format!("{last_s:.3}"));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_rises_from_the_lower_left_to_the_upper_right() {
        let t_s: Vec<f64> = (0..1000).map(f64::from).collect();
        let text = chart("x", &t_s, &t_s);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), ROWS + 2);
        // By hand: 32 dots high and 144 wide, the two dots at either end are at the height of the end.
        assert!(
            lines[1].starts_with("    999.0000 \u{2800}") && lines[1].ends_with('\u{2809}'),
            "{}",
            lines[1]
        );
        assert!(lines[ROWS].starts_with("      0.0000 \u{28c0}"), "{}", lines[ROWS]);
        assert_eq!(lines[1].chars().count(), 13 + COLUMNS);
    }

    #[test]
    fn a_peak_of_one_row_is_seen() {
        let t_s: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut values = vec![0.0; t_s.len()];
        values[50_000] = 1.0;
        let text = chart("x", &t_s, &values);
        assert!(
            text.lines()
                .nth(1)
                .is_some_and(|line| line.chars().any(|c| ('\u{2801}'..='\u{28ff}').contains(&c)))
        );
    }

    #[test]
    fn nothing_and_no_numbers_give_nothing() {
        assert_eq!(chart("x", &[], &[]), "");
        assert_eq!(chart("x", &[0.0, 1.0], &[f64::NAN, f64::INFINITY]), "");
    }
}
