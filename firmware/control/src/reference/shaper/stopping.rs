//! Whether a motion can stop within a distance.

use super::{GRID, RISE_BITS};

/// A motion and the distance to where it has to stop; the motion is towards + if its speed is positive.
#[derive(Clone, Copy)]
pub(super) struct Approach {
    /// Speed over the jerk, ticks².
    pub(super) speed: i32,
    /// Acceleration over the jerk, 1/16 tick.
    pub(super) rise: i32,
    /// Distance over the jerk, ticks³.
    pub(super) distance: i64,
}

impl Approach {
    /// Speed that comes until the acceleration is zero, ticks².
    #[inline]
    pub(super) fn gain(rise: i32) -> i32 {
        (rise * rise) >> (2 * RISE_BITS + 1)
    }

    /// Whether it stops within the distance by a deceleration of `most` at most, 1/16 tick. `lenient` makes room for a goal
    /// that turns without coming to rest, as a sine does: `a³/(16 j²)`, and for the grid of ticks.
    #[inline]
    pub(super) fn stops(self, most: i32, lenient: bool) -> bool {
        /// 2/3 in 2⁻³².
        const TWO_THIRDS: i64 = 2_863_311_531;
        /// 1/12 in 2⁻¹⁶.
        const TWELFTH: u64 = 5461;
        let Self { speed, rise, distance } = self;
        let gain = Self::gain(rise);
        let end = if rise < 0 { speed - gain } else { speed + gain };
        if speed <= 0 && end <= 0 {
            return true;
        }
        // v a + a³/3, where a² is twice the gain.
        let two_thirds = ((i64::from(gain) * TWO_THIRDS) >> 32) as i32;
        let way = (i64::from(speed + two_thirds) * i64::from(rise)) >> RISE_BITS;
        let mut left = distance - way;
        if lenient {
            left += GRID;
            if rise < 0 {
                left += i64::from(speed) - ((i64::from(gain) * i64::from(rise)) >> (RISE_BITS + 3));
            }
        }
        if left < 0 {
            return false;
        }
        let left = u64::from(left.min(i64::from(i32::MAX)) as u32);
        let most = u64::from(most.unsigned_abs());
        let most_square = (most * most) >> (2 * RISE_BITS);
        let room = (left * most) >> (RISE_BITS - 1);
        let top = u64::from((speed + gain).unsigned_abs());
        if end > 0 {
            if top >= most_square {
                top * (top + most_square) <= room
            } else {
                top * top * top <= left * left
            }
        } else if 2 * top >= most_square {
            top * (top + most_square) <= room + ((most_square * most_square * TWELFTH) >> 16)
        } else {
            let square = left * left;
            top * top * top <= square + (square >> 3)
        }
    }
}
