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

use crate::scale::saturated;

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

/// Limits of a reference, as the tick needs them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShaperLimits {
    /// Largest speed over the jerk, ticks².
    pub speed: i32,
    /// Largest jerk, 2⁻⁴⁰ a tick³.
    pub jerk: i32,
    /// `2^(shift + 36) / jerk`, rounded down: from 2⁻⁴⁰ to the state.
    pub scale: u32,
    /// Bits of the jerk less five.
    pub shift: u8,
    /// Largest acceleration over the jerk, 1/16 tick, at most 1024 ticks.
    pub rise: u16,
    /// Part of it that gravity takes away from zero, at a quarter turn and beyond, 1/16 tick.
    pub gravity: u16,
}

impl ShaperLimits {
    /// Limits per tick, in 2⁻⁴⁰.
    ///
    /// The acceleration is lowered to what the jerk reaches in 1024 ticks, the jerk to what reaches the acceleration in
    /// 8; the jerk is at least 64, below which the resolution of the value would show.
    #[must_use]
    pub fn new(speed: f32, acceleration: f32, gravity: f32, jerk: f32) -> Self {
        const LEAST_JERK: f32 = 64.0;
        const SHORTEST_RISE: f32 = 8.0;
        const LARGEST_JERK: f32 = 1_073_741_824.0;
        let jerk = jerk.min(acceleration / SHORTEST_RISE).clamp(LEAST_JERK, LARGEST_JERK) as i32;
        let shift = 27 - jerk.leading_zeros();
        let ticks = |value: f32| {
            let ticks = value / jerk as f32 * (1_u32 << RISE_BITS) as f32;
            ticks.max(0.0).min((LONGEST_RISE << RISE_BITS) as f32) as u16
        };
        Self {
            speed: (speed / jerk as f32).max(1.0).min(LARGEST as f32) as i32,
            jerk,
            scale: ((1_u64 << (36 + shift)) / u64::from(jerk.unsigned_abs())).min(u64::from(u32::MAX)) as u32,
            shift: shift as u8,
            rise: ticks(acceleration).max(1 << RISE_BITS),
            gravity: ticks(gravity),
        }
    }

    /// `value`, at most 2⁵¹ of 2⁻⁴⁰, in units of the state.
    #[inline]
    fn state_of(&self, value: i64) -> i64 {
        let wide = value << 8;
        let (low, high) = (wide & 0xffff_ffff, wide >> 32);
        let scale = i64::from(self.scale);
        // 96 bits less the lowest 32; the product of the low halves is without sign.
        let product = high * scale + ((low.cast_unsigned() * u64::from(self.scale)) >> 32).cast_signed();
        // Below 32, said so that the shift takes half as many instructions.
        product >> (self.shift & 31)
    }

    /// Both ends of a range (2⁻⁴⁰), for [`Shaper::step`].
    #[must_use]
    pub fn ends(&self, range: [i64; 2]) -> Ends {
        Ends(range.map(|end| self.state_of(end)))
    }

    /// `state`, in 2⁻⁴⁰.
    #[inline]
    fn value_of(&self, state: i64) -> i64 {
        ((state >> 4) * i64::from(self.jerk)) >> (STATE_BITS - 4)
    }

    /// Largest acceleration at `value` (2⁻⁴⁰) away from zero, 1/16 tick: gravity grows as `sin θ`, which `4 θ (π − θ)/π²`
    /// bounds from above.
    #[inline]
    fn outward(&self, value: i64) -> i32 {
        /// π and π/2 in 2⁻¹⁴, 4/π² in 2⁻¹⁶.
        const PI: u32 = 51_472;
        const QUARTER: u32 = 25_736;
        const FACTOR: u32 = 26_561;
        let angle = ((value >> 26) as i32).unsigned_abs().min(QUARTER);
        let sine = (((angle * (PI - angle)) >> 14) * FACTOR) >> 16;
        let taken = (sine * u32::from(self.gravity)) >> 14;
        (i32::from(self.rise) - taken.cast_signed()).max(1 << RISE_BITS)
    }
}

/// Ends of a range in units of the state, made by [`ShaperLimits::ends`] once for many ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ends([i64; 2]);

/// A motion and the distance to where it has to stop; the motion is towards + if its speed is positive.
#[derive(Clone, Copy)]
struct Approach {
    /// Speed over the jerk, ticks².
    speed: i32,
    /// Acceleration over the jerk, 1/16 tick.
    rise: i32,
    /// Distance over the jerk, ticks³.
    distance: i64,
}

impl Approach {
    /// Speed that comes until the acceleration is zero, ticks².
    #[inline]
    fn gain(rise: i32) -> i32 {
        (rise * rise) >> (2 * RISE_BITS + 1)
    }

    /// Whether it stops within the distance by a deceleration of `most` at most, 1/16 tick. `lenient` makes room for a goal
    /// that turns without coming to rest, as a sine does: `a³/(16 j²)`, and for the grid of ticks.
    #[inline]
    fn stops(self, most: i32, lenient: bool) -> bool {
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

/// Filter for the motion of a goal, in units of the state.
#[derive(Clone, Copy, Debug, Default)]
struct Goal {
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
    fn at(value: i64) -> Self {
        Self { last: value, value, ..Self::default() }
    }

    /// Takes the goal of this tick. Gains for a pole p of 7/8: `1 − p³`, `1.5 (1 − p²)(1 − p)`, `(1 − p)³`. The filter
    /// starts anew where the goal rests, steps or turns at a corner: where eight times the largest jerk does not explain it.
    /// Returns whether the goal went on steadily: within [`LOCKED_STEPS`] of where the filter expected it.
    #[inline]
    fn follow(&mut self, goal: i64) -> bool {
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
    fn motion(&self) -> Motion {
        let jerk = self.jerk >> 5;
        let acceleration = self.acceleration + 22 * jerk;
        Motion { speed: self.speed + i64::from(157 * jerk - (acceleration >> 1)), acceleration, jerk }
    }
}

/// A motion in units of the state.
#[derive(Clone, Copy)]
struct Motion {
    speed: i64,
    acceleration: i32,
    jerk: i32,
}

impl Motion {
    /// Speed, ticks², saturated.
    #[inline]
    fn ticks(speed: i64) -> i32 {
        saturated(speed >> STATE_BITS).clamp(-LARGEST, LARGEST)
    }

    /// Acceleration, 1/16 tick, saturated at twice the longest rise.
    #[inline]
    fn rise(acceleration: i32) -> i32 {
        const BEYOND: i32 = LONGEST_RISE << (RISE_BITS + 1);
        (acceleration >> RISE_SHIFT).clamp(-BEYOND, BEYOND)
    }
}

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
