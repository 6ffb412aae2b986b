//! Comparison of numbers that shows both and the tolerance.

/// Asserts `|got - want| ≤ tolerance`.
#[track_caller]
pub fn near(what: &str, got: f64, want: f64, tolerance: f64) {
    assert!(
        (got - want).abs() <= tolerance,
        "{what}: got {got:.12e}, want {want:.12e}, off by {:.2e}, allowed {tolerance:.1e}",
        (got - want).abs()
    );
}
