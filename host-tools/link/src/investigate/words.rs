//! Numbers and tables as an investigation prints them.

/// Three significant digits.
pub fn digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let decimals = (2 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.decimals$}")
}

/// `1 parameter`, `2 parameters`.
pub fn parameters(count: usize) -> String {
    if count == 1 { "1 parameter".to_owned() } else { format!("{count} parameters") }
}

/// Rows of cells in columns as wide as their longest cell.
pub fn table<const N: usize>(rows: impl Iterator<Item = [String; N]>) -> String {
    let rows: Vec<[String; N]> = rows.collect();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..N).map(width).collect();
    let line = |row: &[String; N]| {
        let cells: Vec<String> =
            row.iter().zip(&widths).map(|(cell, width)| format!("{cell:width$}")).collect();
        cells.join("  ").trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits_and_columns_line_up() {
        assert_eq!(
            [0.0, 0.5937, 12.345, 1234.5, -0.012_345].map(digits),
            ["0", "0.594", "12.3", "1234", "-0.0123"]
        );
        let rows = [["a", "bcd"], ["ef", "g"]].map(|row| row.map(str::to_owned));
        assert_eq!(table(rows.into_iter()), "a   bcd\nef  g\n");
    }
}
