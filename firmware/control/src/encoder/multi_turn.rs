//! Position over more than one turn from readings within a turn.
//!
//! Between two readings the shaft is taken to have moved the shorter way round. That holds while it moves by less than
//! half a turn; a step beyond the largest that the joint can make is a fault and changes nothing. Positions wrap after
//! 2³¹ counts, half a million turns.

use core::fmt;

use super::CountRaw;

/// Half a turn, counts.
const HALF_TURN: i32 = CountRaw::PER_TURN as i32 / 2;

/// Largest step between two readings: configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepLimit {
    counts: u16,
}

impl StepLimit {
    /// A limit from 1 to 2047 counts; from half a turn on, the direction would be unknown: `None`.
    ///
    /// A pulley at 20 rad/s that is read every millisecond moves by 13 counts.
    #[must_use]
    pub const fn new(counts: u16) -> Option<Self> {
        if counts >= 1 && (counts as i32) < HALF_TURN { Some(Self { counts }) } else { None }
    }

    /// Counts.
    #[must_use]
    pub const fn counts(self) -> u16 {
        self.counts
    }

    /// The limit for readings that lie `ticks` apart: as many times larger, below half a turn.
    #[must_use]
    pub const fn over_ticks(self, ticks: u16) -> Self {
        let counts = self.counts.saturating_mul(ticks);
        let largest = HALF_TURN as u16 - 1;
        Self { counts: if counts < largest { counts } else { largest } }
    }
}

/// The shaft cannot have moved so far since the last reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Jump {
    /// Step that the readings tell, counts.
    pub step_counts: i32,
    /// Largest step, counts.
    pub limit_counts: u16,
}

impl fmt::Display for Jump {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "encoder jumped by {} counts, at most {} are possible; read faster or look for a loose magnet",
            self.step_counts, self.limit_counts
        )
    }
}

/// Position over turns: state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MultiTurn {
    last: CountRaw,
    turns_counts: i32,
}

impl MultiTurn {
    /// Starts within the first turn.
    #[must_use]
    pub const fn starting_at(first: CountRaw) -> Self {
        Self { last: first, turns_counts: 0 }
    }

    /// Starts in the turn in which the position is nearest to `zero_counts`, half a turn below it at most.
    #[must_use]
    pub const fn starting_near(first: CountRaw, zero_counts: i32) -> Self {
        let per_turn = CountRaw::PER_TURN as i32;
        let from_zero = (first.get() as i32 - zero_counts + HALF_TURN).rem_euclid(per_turn) - HALF_TURN;
        Self { last: first, turns_counts: zero_counts + from_zero - first.get() as i32 }
    }

    /// Goes on from `reading`, the shorter way round, whatever its step.
    pub const fn restart(&mut self, reading: CountRaw) {
        *self = Self::starting_near(reading, self.position_counts());
    }

    /// Position, counts; 0 is the encoder's zero in the turn in which it started.
    #[must_use]
    pub const fn position_counts(&self) -> i32 {
        self.turns_counts.wrapping_add(self.last.get() as i32)
    }

    /// Takes the next reading and returns the position, counts.
    ///
    /// # Errors
    /// [`Jump`] when the step is above the limit. The state is then as before: the next good reading goes on from the
    /// last good one, and one that never comes back needs a new start.
    pub const fn advance(&mut self, limit: StepLimit, reading: CountRaw) -> Result<i32, Jump> {
        let mut step = reading.get() as i32 - self.last.get() as i32;
        let mut turn = 0;
        if step >= HALF_TURN {
            turn = -1;
        } else if step < -HALF_TURN {
            turn = 1;
        }
        step += turn * CountRaw::PER_TURN as i32;
        if step.unsigned_abs() > limit.counts as u32 {
            return Err(Jump { step_counts: step, limit_counts: limit.counts });
        }
        self.turns_counts = self.turns_counts.wrapping_add(turn * CountRaw::PER_TURN as i32);
        self.last = reading;
        Ok(self.position_counts())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(counts: i32) -> CountRaw {
        CountRaw::new(counts.rem_euclid(4096) as u16).unwrap()
    }

    #[test]
    fn a_walk_over_many_turns_is_followed_exactly() {
        let limit = StepLimit::new(2047).unwrap();
        // Steps of a linear congruential generator, from -2047 to 2047, so that every border is crossed both ways.
        let (mut position, mut random) = (100_i32, 1_u32);
        let mut state = MultiTurn::starting_at(count(position));
        let (mut lowest, mut highest) = (position, position);
        for _ in 0..200_000 {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            position += (random >> 8).cast_signed() % 4095 - 2047;
            assert_eq!(state.advance(limit, count(position)), Ok(position));
            (lowest, highest) = (lowest.min(position), highest.max(position));
        }
        assert!(highest - lowest > 20 * 4096, "the walk spans {lowest} to {highest}");
    }

    #[test]
    fn the_border_of_a_turn_is_crossed_both_ways() {
        let limit = StepLimit::new(10).unwrap();
        let mut state = MultiTurn::starting_at(count(4090));
        assert_eq!(state.advance(limit, count(4)), Ok(4100));
        assert_eq!(state.advance(limit, count(4095)), Ok(4095));
        let mut state = MultiTurn::starting_at(count(3));
        assert_eq!(state.advance(limit, count(4093)), Ok(-3));
    }

    #[test]
    fn the_first_turn_is_the_one_around_zero() {
        for (first, zero, expected) in
            [(0, 1000, 0), (4095, 1000, -1), (3047, 1000, 3047), (3048, 1000, -1048), (10, 4000, 4106)]
        {
            assert_eq!(MultiTurn::starting_near(count(first), zero).position_counts(), expected);
        }
        let mut state = MultiTurn::starting_near(count(4095), 1000);
        state.restart(count(100));
        assert_eq!(state.position_counts(), 100);
    }

    #[test]
    fn a_jump_is_refused_and_forgotten() {
        let limit = StepLimit::new(13).unwrap();
        let mut state = MultiTurn::starting_at(count(1000));
        assert_eq!(state.advance(limit, count(1014)), Err(Jump { step_counts: 14, limit_counts: 13 }));
        assert_eq!(state.advance(limit, count(986)), Err(Jump { step_counts: -14, limit_counts: 13 }));
        // Half a turn away: either direction is as likely, and both are too far.
        assert_eq!(state.advance(limit, count(3048)), Err(Jump { step_counts: -2048, limit_counts: 13 }));
        assert_eq!(state.position_counts(), 1000);
        assert_eq!(state.advance(limit, count(1013)), Ok(1013));
    }

    #[test]
    fn a_limit_leaves_the_direction_known() {
        assert!(StepLimit::new(0).is_none());
        assert!(StepLimit::new(2047).is_some());
        assert!(StepLimit::new(2048).is_none());
    }
}
