//! Speed and acceleration of a goal.

use super::{LARGEST, LOCKED_STEPS, LONGEST_RISE, RISE_BITS, RISE_SHIFT, STATE_BITS};
use crate::scale::saturated;

/// Filter for the motion of a goal, in units of the state.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Goal {
    /// Goal of this tick.
    last: i64,
    /// It is that of the tick before.
    held: bool,
    value: i64,
    speed: i64,
    acceleration: i32,
    /// Change of the acceleration a tick, low-passed, 32 times.
    jerk: i32,
}

impl Goal {
    pub(super) fn at(value: i64) -> Self {
        Self { last: value, value, ..Self::default() }
    }

    /// Takes the goal of this tick. Gains for a pole p of 7/8: `1 − p³`, `1.5 (1 − p²)(1 − p)`, `(1 − p)³`. The filter
    /// starts anew where the goal rests, steps or turns at a corner: where eight times the largest jerk does not explain it.
    /// Returns whether the goal went on steadily: within [`LOCKED_STEPS`] of where the filter expected it.
    #[inline]
    pub(super) fn follow(&mut self, goal: i64) -> bool {
        const GAIN_BITS: u32 = 9;
        const LARGEST_ERROR: i64 = 1 << (STATE_BITS + GAIN_BITS + 3);
        let value = self.value + self.speed + i64::from(self.acceleration >> 1);
        let error = goal - value;
        let change = goal - self.last;
        let rests = change == 0 && self.held;
        (self.last, self.held) = (goal, change == 0);
        if rests || error.abs() > LARGEST_ERROR {
            (self.value, self.speed, self.acceleration, self.jerk) = (goal, change, 0, 0);
            return rests;
        }
        let error = error as i32;
        self.value = value + i64::from((error * 21) >> 6);
        self.speed += i64::from(self.acceleration + ((error * 45) >> 10));
        let jerk = error >> GAIN_BITS;
        self.acceleration += jerk;
        self.jerk += jerk - (self.jerk >> 5);
        error.abs() <= LOCKED_STEPS << STATE_BITS
    }

    /// Motion without the lag of the filter behind a steady jerk: 157 ticks² of it for the speed, 22 ticks for the
    /// acceleration. The speed is that of half a tick ago, as the shaper counts it.
    #[inline]
    pub(super) fn motion(&self) -> Motion {
        let jerk = self.jerk >> 5;
        let acceleration = self.acceleration + 22 * jerk;
        Motion { speed: self.speed + i64::from(157 * jerk - (acceleration >> 1)), acceleration, jerk }
    }
}

/// A motion in units of the state.
#[derive(Clone, Copy)]
pub(super) struct Motion {
    pub(super) speed: i64,
    pub(super) acceleration: i32,
    pub(super) jerk: i32,
}

impl Motion {
    /// Speed, ticks², saturated.
    #[inline]
    pub(super) fn ticks(speed: i64) -> i32 {
        saturated(speed >> STATE_BITS).clamp(-LARGEST, LARGEST)
    }

    /// Acceleration, 1/16 tick, saturated at twice the longest rise.
    #[inline]
    pub(super) fn rise(acceleration: i32) -> i32 {
        const BEYOND: i32 = LONGEST_RISE << (RISE_BITS + 1);
        (acceleration >> RISE_SHIFT).clamp(-BEYOND, BEYOND)
    }
}
