//! Read-only words of the system memory: unique id, flash size, package, calibration (DS12288, RM0440).

use crate::error::Refusal;

/// Unique device id: wafer coordinates and lot, here a fixed text.
const UNIQUE_ID: [u32; 3] = [0x0041_0033, 0x3357_5005, 0x2034_3251];

/// Word at `address`.
pub(crate) fn read(address: u32) -> Result<u32, Refusal> {
    Ok(match address & !3 {
        0x1fff_7500 => 0x0002,
        0x1fff_7590 => UNIQUE_ID[0],
        0x1fff_7594 => UNIQUE_ID[1],
        0x1fff_7598 => UNIQUE_ID[2],
        // TS_CAL1 in the lower, VREFINT_CAL (1.212 V against 3.0 V, 12 bits) in the upper half.
        0x1fff_75a8 => 0x0676_040d,
        0x1fff_75c8 => 0x0566_0000,
        0x1fff_75e0 => 512,
        _ => return Err(Refusal::because("no modelled word of the system memory")),
    })
}
