//! Analog front end: volts at the pins for tensions, current and bus voltage, and codes of a 12-bit converter.
//!
//! The figures are those of the amplifiers, written down here independently of any constant of the firmware.

/// Reference of the converter \[V\].
const REFERENCE_V: f64 = 3.3;
/// Largest code.
const LARGEST_CODE: f64 = 4095.0;
/// Tension amplifier at 0 N \[V\].
const TENSION_ZERO_V: f64 = 0.50;
/// Tension amplifier \[V/N\].
const TENSION_V_PER_N: f64 = 0.023;
/// Current amplifier at 0 A \[V\].
const CURRENT_ZERO_V: f64 = 1.65;
/// Current amplifier \[V/A\].
const CURRENT_V_PER_A: f64 = 0.12;
/// Divider of the bus voltage \[1\].
const BUS_DIVIDER: f64 = 11.0;

/// Volts of a tension channel.
pub(crate) fn tension_v(tension_n: f64) -> f64 {
    TENSION_ZERO_V + TENSION_V_PER_N * tension_n
}

/// Volts of the current channel.
pub(crate) fn current_v(current_a: f64) -> f64 {
    CURRENT_ZERO_V + CURRENT_V_PER_A * current_a
}

/// Volts of the bus voltage channel.
pub(crate) fn bus_v(bus_v: f64) -> f64 {
    bus_v / BUS_DIVIDER
}

/// Code of a 12-bit conversion of `volts`.
pub(crate) fn code(volts: f64) -> u32 {
    (volts / REFERENCE_V * LARGEST_CODE).round().clamp(0.0, LARGEST_CODE) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Codes from the front end's table: 98.07 N gives 2.756 V, 24 V gives 2.1818 V.
    #[test]
    fn codes_of_known_quantities() {
        assert_eq!(code(tension_v(98.07)), 3419);
        assert_eq!(code(tension_v(-50.0)), 0, "below the rail");
        assert_eq!(code(tension_v(0.0)), 620);
        assert_eq!(code(current_v(0.0)), 2048);
        assert_eq!(code(current_v(13.75)), 4095);
        assert_eq!(code(bus_v(24.0)), 2707);
    }
}
