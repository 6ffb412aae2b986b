//! Shapes a reference: limits its speed, acceleration and jerk, without lag where the goal stays within them.
//!
//! State: value `x`, speed `v`, acceleration `a`, per tick, in units of the largest jerk `j`. Each tick adds a jerk `u` to
//! `a`, `a` to `v`, `v` to `x`.
//!
//! | case | rule |
//! |---|---|
//! | locked | `x` is the goal, as long as its speed, acceleration and jerk are within the limits and the stopping distance is within the range |
//! | catching up | `u` is the first of `+j`, `0`, `−j` (towards the goal) after which the state, seen from the goal, can still stop before it |
//! | end of the range | a state that could not stop before it is braked with `j` instead |
//!
//! Speed and acceleration of the goal come from a fading-memory filter of third order with a pole of 7/8 a tick.
//!
//! Stopping distance of a state `(v, a)` that moves towards +, with jerk `j` and largest deceleration `A`:
//! `D = v a/j + a³/(3 j²) + D₀`, with the speed at which `a` would be zero, `w = v + a²/(2 j)`:
//!
//! | stop | `D₀` | if |
//! |---|---|---|
//! | with `a = 0` | `w²/(2 A) + w A/(2 j)` | `w ≥ A²/j` |
//! | | `√(w³/j)` | else |
//! | with any `a` | `w²/(2 A) + w A/(2 j) − A³/(24 j²)` | `2 w ≥ A²/j` |
//! | | `√(8 w³/(9 j))` | else |
//!
//! Distances are compared without root or division: in units of `j` both sides are squared, or multiplied by `2 A`.

mod goal;
mod limits;
mod stopping;

pub use limits::{Ends, ShaperLimits};

use goal::{Goal, Motion};
use stopping::Approach;

/// Bits behind the point of the state, in units of the jerk: ticks, ticks², ticks³.
const STATE_BITS: u32 = 12;

/// Bits behind the point of an acceleration in a comparison, ticks.
const RISE_BITS: u32 = 4;

/// From an acceleration of the state to one in a comparison.
const RISE_SHIFT: u32 = STATE_BITS - RISE_BITS;

/// Longest time in which the largest acceleration is reached, ticks.
const LONGEST_RISE: i32 = 1024;

/// Speed at which comparisons saturate, ticks².
const LARGEST: i32 = 1 << 27;

/// Distance, ticks³, by which a locked goal may miss what the filter expected: 512 for a goal with the largest jerk, and corners
/// between the points of a stream.
const LOCKED_STEPS: i32 = 768;

/// Distance below which the grid of ticks shows, ticks³.
const GRID: i64 = 16;

/// A motion as it is compared.
#[derive(Clone, Copy)]
struct Course {
    /// Speed over the jerk, ticks².
    speed: i32,
    /// Acceleration over the jerk, 1/16 tick.
    rise: i32,
    /// Speed by the time the acceleration is zero, ticks².
    end: i32,
}

impl Course {
    #[inline]
    fn of(speed: i64, acceleration: i32) -> Self {
        let (speed, rise) = (Motion::ticks(speed), Motion::rise(acceleration));
        let gain = Approach::gain(rise);
        Self { speed, rise, end: if rise < 0 { speed - gain } else { speed + gain } }
    }
}

/// State of the shaper.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shaper {
    /// Value, 2⁻⁴⁰.
    value: i64,
    /// The jerk whose units the state has; 0 before the first tick.
    jerk: i32,
    state: i64,
    speed: i64,
    acceleration: i32,
    goal: Goal,
    locked: bool,
}

/// What a tick of the shaper was limited by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limited {
    /// The speed.
    pub speed: bool,
    /// The acceleration or the jerk: the value is not the goal.
    pub acceleration: bool,
}

impl Shaper {
    /// Stands at `value`, 2⁻⁴⁰.
    #[must_use]
    pub fn standing_at(value: i64) -> Self {
        Self { value, ..Self::default() }
    }

    /// Value, 2⁻⁴⁰.
    #[inline]
    #[must_use]
    pub const fn value(&self) -> i64 {
        self.value
    }

    /// Acceleration, 2⁻⁴⁰ per tick².
    #[inline]
    #[must_use]
    pub fn acceleration(&self) -> i64 {
        (i64::from(self.acceleration) * i64::from(self.jerk)) >> STATE_BITS
    }

    /// Follows another goal from now on, which begins at the present value and at rest.
    pub fn restart(&mut self) {
        self.goal = Goal::at(self.state);
        self.locked = false;
    }

    /// Other limits have another jerk: the state is counted in units of the new one.
    #[cold]
    fn count_in(&mut self, limits: &ShaperLimits) {
        let before = ShaperLimits { jerk: self.jerk, ..ShaperLimits::default() };
        let again = |state: i64| limits.state_of(before.value_of(state));
        let fastest = i64::from(LARGEST) << STATE_BITS;
        self.state = limits.state_of(self.value);
        self.speed = again(self.speed).clamp(-fastest, fastest);
        let longest = i64::from(LONGEST_RISE) << STATE_BITS;
        self.acceleration = again(self.acceleration.into()).clamp(-longest, longest) as i32;
        self.jerk = limits.jerk;
        self.restart();
    }

    /// One tick towards `goal`. Inside the range whose `ends` these are the value never leaves it: it stops before either end.
    pub fn step(&mut self, limits: &ShaperLimits, ends: &Ends, goal: i64) -> Limited {
        if self.jerk != limits.jerk {
            self.count_in(limits);
        }
        let target = limits.state_of(goal);
        let steady = self.goal.follow(target);
        let inward = i32::from(limits.rise);
        let outward = limits.outward(self.value);
        let bounds = Bounds {
            ends,
            most: if self.value < 0 { [outward, inward] } else { [inward, outward] },
            speed: limits.speed,
        };
        let seen = self.goal.motion();
        self.locked = self.meets(&seen, target, steady) && bounds.allow(&seen, target);
        if self.locked {
            (self.value, self.state) = (goal, target);
            (self.speed, self.acceleration) = (seen.speed, seen.acceleration);
            return Limited::default();
        }
        let limited = self.catch_up(&bounds, &seen, target);
        self.value = limits.value_of(self.state);
        limited
    }

    /// Whether the goal is where this tick leads without jerk, within a few steps of the jerk. Once locked, the value is the
    /// goal, which must go on steadily.
    #[inline]
    fn meets(&self, seen: &Motion, target: i64, steady: bool) -> bool {
        let near = |difference: i64, steps: i64| difference.abs() <= steps << STATE_BITS;
        let speed = self.speed + i64::from(self.acceleration);
        seen.jerk.abs() <= 1 << STATE_BITS
            && (self.acceleration - seen.acceleration).abs() <= 4 << STATE_BITS
            && if self.locked {
                steady
            } else {
                near(speed - seen.speed, 12) && near(self.state + speed - target, 32)
            }
    }

    /// A tick that is not locked.
    fn catch_up(&mut self, bounds: &Bounds, seen: &Motion, target: i64) -> Limited {
        const ONE: i32 = 1 << STATE_BITS;
        let speed = self.speed + i64::from(self.acceleration);
        let ahead = self.state + speed - target;
        // Mirrored, so that the goal is towards +.
        let towards = if ahead > 0 { -1 } else { 1 };
        let [below, above] = bounds.most;
        let (fall, rise) = if ahead > 0 { (above, below) } else { (below, above) };
        let own_rise = towards * Motion::rise(self.acceleration);
        let goal_rise = towards * Motion::rise(seen.acceleration);
        let relative = Approach {
            speed: towards * Motion::ticks(speed - seen.speed),
            rise: own_rise - goal_rise,
            distance: ahead.abs() >> STATE_BITS,
        };
        // A goal with a jerk of its own leaves a part of the jerk for braking, counted as 1, 1/2, 1/4 or 1/8.
        let part = |of: i32| u32::from(seen.jerk.abs() > of);
        let halvings = part(ONE / 8) + part(ONE / 2) + part(ONE * 3 / 4);
        // Its acceleration takes or leaves some of the deceleration.
        let fall = (fall + goal_rise).max(fall >> 2).min(fall + (fall >> 1));
        let fall = (fall << halvings).min(LONGEST_RISE << RISE_BITS);
        let may = |steps: i32| {
            const BEYOND: i32 = LONGEST_RISE << (RISE_BITS + 1);
            if own_rise + (steps << RISE_BITS) > rise {
                return false;
            }
            let after = Approach {
                speed: (relative.speed + steps) << halvings,
                rise: ((relative.rise + (steps << RISE_BITS)) << halvings).clamp(-BEYOND, BEYOND),
                distance: (relative.distance - i64::from(steps)) << halvings,
            };
            after.stops(fall, false)
        };
        let steps = if may(1) {
            1
        } else if may(0) {
            0
        } else {
            -1
        };
        let wanted = self.acceleration + towards * steps * ONE;
        let course = |acceleration: i32| Course::of(self.speed + i64::from(acceleration), acceleration);
        let mut next = course(wanted);
        let slowed = if bounds.too_fast(next) { self.slowed(bounds, wanted) } else { wanted };
        let mut acceleration = self.bounded(bounds, slowed);
        if acceleration != wanted {
            next = course(acceleration);
        }
        let speed = self.speed + i64::from(acceleration);
        let [low, high] = bounds.hold(next, self.state + speed, false);
        if !(low && high) {
            let brake = if high || (!low && speed < 0) { ONE } else { -ONE };
            acceleration = self.bounded(bounds, self.acceleration + brake);
        }
        self.acceleration = acceleration;
        self.speed += i64::from(acceleration);
        self.state += self.speed;
        Limited { acceleration: true, speed: slowed != wanted }
    }

    /// Less than `wanted`, with which the speed would be beyond its limit by the time the acceleration is zero.
    #[inline]
    fn slowed(&self, bounds: &Bounds, wanted: i32) -> i32 {
        let sign = if wanted < 0 { -1 } else { 1 };
        let held = (sign * self.acceleration).min(sign * wanted).max(0);
        let less = (sign * self.acceleration - (1 << STATE_BITS)).max(0);
        let course = Course::of(self.speed + i64::from(sign * held), sign * held);
        sign * if bounds.too_fast(course) { held.min(less) } else { held }
    }

    /// `wanted` within the limits of the acceleration, and no further from the present one than the jerk allows.
    #[inline]
    fn bounded(&self, bounds: &Bounds, wanted: i32) -> i32 {
        let [below, above] = bounds.most.map(|most| most << RISE_SHIFT);
        let least = (-below).min(self.acceleration + (1 << STATE_BITS));
        let most = above.max(self.acceleration - (1 << STATE_BITS));
        wanted.max(least).min(most)
    }
}

/// Limits at the present value.
struct Bounds<'l> {
    ends: &'l Ends,
    /// Largest acceleration towards − and towards +, 1/16 tick.
    most: [i32; 2],
    /// ticks²
    speed: i32,
}

impl Bounds<'_> {
    /// Whether the goal itself is within the limits.
    #[inline]
    fn allow(&self, seen: &Motion, target: i64) -> bool {
        let [below, above] = self.most;
        let course = Course::of(seen.speed, seen.acceleration);
        -below <= course.rise
            && course.rise <= above
            && course.speed.abs() <= self.speed
            && !self.too_fast(course)
            && self.hold(course, target, true) == [true; 2]
    }

    /// Whether the speed will be beyond its limit by the time the acceleration is zero.
    #[inline]
    fn too_fast(&self, course: Course) -> bool {
        course.end.abs() > self.speed && (course.end < 0) == (course.rise < 0)
    }

    /// Whether a motion at `value` stops before the lower and before the upper end of the range.
    #[inline]
    fn hold(&self, course: Course, value: i64, lenient: bool) -> [bool; 2] {
        let Ends([low, high]) = *self.ends;
        // Braked by the acceleration towards the other end.
        let [below, above] = self.most;
        let Course { speed, rise, end } = course;
        let distance = |from: i64, to: i64| (to - from) >> STATE_BITS;
        let down = (speed >= 0 && end >= 0)
            || Approach { speed: -speed, rise: -rise, distance: distance(low, value) }.stops(above, lenient);
        let up = (speed <= 0 && end <= 0)
            || Approach { speed, rise, distance: distance(value, high) }.stops(below, lenient);
        [down, up]
    }
}

#[cfg(test)]
mod tests;
