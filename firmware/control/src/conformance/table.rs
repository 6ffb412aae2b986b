//! The digest with a ripple table.

use bowden_link::message::TABLE_POINTS;

use super::corrections::switch_on;
use super::{Hash, Random, run_with};
use crate::correction::ripple_table::RippleTable;
use crate::parameters::Parameters;
use crate::scale::{Angle, Quantity};

/// Angles under one table.
const ANGLES_A_TABLE: u32 = 500;

/// Hash over `ticks` ticks as [`super::correction_digest`], with a ripple table in the place of the harmonics, and over the
/// torques of tables at as many angles, extremes of points and angles among them.
#[must_use]
pub fn ripple_table_digest(seed: u32, ticks: u32) -> u32 {
    let mut random = Random(seed);
    let Some(first) = any_table(&mut random) else { return 0 };
    let mut hash = Hash(run_with(seed, ticks, Some(&first), with_table).digest);
    for _ in 0..ticks.div_ceil(ANGLES_A_TABLE) {
        let Some(table) = any_table(&mut random) else { return 0 };
        hash.word(table.head().crc);
        for _ in 0..ANGLES_A_TABLE {
            let angle = Angle::from_bits(random.wild() >> random.below(24));
            hash.word(table.torque(angle).to_bits().cast_unsigned());
        }
    }
    hash.0
}

/// A table of any points, with a period of 0.01 to 8 rad and a full scale of 0.01 to 1.3 N·m.
fn any_table(random: &mut Random) -> Option<RippleTable> {
    let period_rad = 0.01 + random.below(8000) as f32 * 1e-3;
    let full_scale_nm = 0.01 + random.below(128) as f32 * 1e-2;
    let mut points_raw = [0; TABLE_POINTS];
    for point in &mut points_raw {
        *point = (random.wild() >> 16) as i16;
    }
    RippleTable::new(period_rad, full_scale_nm, &points_raw).ok()
}

fn with_table(parameters: &mut Parameters) {
    switch_on(parameters);
    parameters.correction.ripple_table.enable = 1.0;
    parameters.correction.ripple_table.limit = 0.15;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_is_another_one_with_a_table() {
        let table = any_table(&mut Random(1)).unwrap();
        let without = run_with(1, 2000, None, with_table).digest;
        assert_ne!(run_with(1, 2000, Some(&table), with_table).digest, without);
        // Switched on, but without a table, and with a table, but switched off, the harmonics act.
        assert_eq!(run_with(1, 2000, None, switch_on).digest, without);
        assert_eq!(run_with(1, 2000, Some(&table), switch_on).digest, without);
    }

    /// Frozen, as that without a table. In debug builds no arithmetic overflows on the way.
    #[test]
    fn regress_ripple_table_digest() {
        assert_eq!(ripple_table_digest(1, 20_000), 2_943_366_088);
    }
}
