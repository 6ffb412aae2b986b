//! Shapes a reference: limits its speed, acceleration and jerk, without lag where the goal stays within them.
//!
//! State: value `x`, speed `v`, acceleration `a`, per tick, in 2⁻⁴⁰. Each tick adds a jerk `u` to `a`, `a` to `v`, `v` to `x`.
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
//! Distances are compared without root or division: everything is divided by `j` (a product with its inverse), and both
//! sides are squared, or multiplied by `2 A`.

/// Bits behind the point of an acceleration over the jerk, in ticks.
const RISE_BITS: u32 = 4;

/// Bits behind the point of the inverse of the jerk's mantissa.
const INVERSE_BITS: u32 = 28;

/// Steps of the jerk by which a locked goal may deviate from a steady motion in a tick: corners between the points of a
/// stream, the grid of the goal.
const LOCKED_STEPS: i64 = 256;

/// Distance over the jerk below which the grid of ticks shows, ticks³.
const GRID: i64 = 16;

/// Longest time in which the largest acceleration is reached, ticks.
const LONGEST_RISE: i32 = 1024;

/// Limits of a reference, as the tick needs them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShaperLimits {
    /// Largest speed, 2⁻³² a tick.
    pub speed: u32,
    /// Largest jerk, 2⁻⁴⁰ a tick³; at least 8.
    pub jerk: i32,
    /// `2^(shift + 28) / jerk`, rounded down.
    pub inverse: u32,
    /// Bits of `jerk` less one.
    pub shift: u8,
    /// Largest acceleration over the jerk, 1/16 tick, at most 1024 ticks.
    pub rise: u16,
    /// Part of it that gravity takes away from zero, at a quarter turn and beyond, 1/16 tick.
    pub gravity: u16,
}

impl ShaperLimits {
    /// Limits per tick: `speed` in 2⁻³², `acceleration` and `gravity` in 2⁻⁴⁰, `jerk` in 2⁻⁴⁰.
    ///
    /// The acceleration is lowered to what the jerk reaches in 1024 ticks, the jerk to what reaches the acceleration in
    /// 8; the jerk is at least 8, below which the resolution of the state would show.
    #[must_use]
    pub fn new(speed: u32, acceleration: f32, gravity: f32, jerk: f32) -> Self {
        const LEAST_JERK: f32 = 8.0;
        const SHORTEST_RISE: f32 = 8.0;
        const LARGEST_JERK: f32 = 1_073_741_824.0;
        let jerk = jerk.min(acceleration / SHORTEST_RISE).clamp(LEAST_JERK, LARGEST_JERK) as i32;
        let shift = 31 - jerk.leading_zeros();
        let ticks = |value: f32| {
            let ticks = value / jerk as f32 * (1_u32 << RISE_BITS) as f32;
            ticks.max(0.0).min((LONGEST_RISE << RISE_BITS) as f32) as u16
        };
        let rise = ticks(acceleration).max(1 << RISE_BITS);
        Self {
            speed: speed.max(1),
            jerk,
            inverse: ((1_u64 << (INVERSE_BITS + shift)) / u64::from(jerk.unsigned_abs())) as u32,
            shift: shift as u8,
            rise,
            gravity: ticks(gravity),
        }
    }

    /// `value` over the jerk, rounded down, saturated at 2³⁴.
    #[inline]
    fn over_jerk(&self, value: i64) -> i64 {
        const BEYOND: i64 = 1 << 34;
        let high = (value >> self.shift).clamp(-BEYOND, BEYOND);
        (high * i64::from(self.inverse)) >> INVERSE_BITS
    }

    /// `speed` over the jerk, ticks², saturated.
    #[inline]
    fn ticks_of(&self, speed: i64) -> i32 {
        const BEYOND: i64 = 1 << 28;
        self.over_jerk(speed).clamp(-BEYOND, BEYOND) as i32
    }

    /// `acceleration` over the jerk, 1/16 tick, saturated at twice the longest rise.
    #[inline]
    fn rise_of(&self, acceleration: i64) -> i32 {
        const BEYOND: i64 = (LONGEST_RISE as i64) << (RISE_BITS + 1);
        self.over_jerk(acceleration << RISE_BITS).clamp(-BEYOND, BEYOND) as i32
    }

    /// Largest acceleration at `value` away from zero, 1/16 tick: gravity grows as `sin θ`, which `4 θ (π − θ)/π²` bounds
    /// from above.
    #[inline]
    fn outward(&self, value: i64) -> i32 {
        /// π and π/2 in 2⁻²⁰, 4/π² in 2⁻³¹.
        const PI: i64 = 3_294_199;
        const QUARTER: i64 = 1_647_099;
        const FACTOR: i64 = 870_342_461;
        let angle = (value >> 20).abs().min(QUARTER);
        let sine = (((angle * (PI - angle)) >> 20) * FACTOR) >> 31;
        let left = i32::from(self.rise) - ((sine * i64::from(self.gravity)) >> 20) as i32;
        left.max(1 << RISE_BITS)
    }
}

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
    /// Whether it stops within the distance by a deceleration of `most` at most, 1/16 tick. `lenient` makes room for a goal
    /// that turns without coming to rest, as a sine does: `a³/(16 j²)`, and for the grid of ticks.
    #[inline]
    fn stops(self, most: i32, lenient: bool) -> bool {
        /// 1/3 and 1/12 in 2⁻¹⁶.
        const THIRD: i64 = 21_845;
        const TWELFTH: i64 = 5461;
        let (speed, rise) = (i64::from(self.speed), i64::from(self.rise));
        let square = rise * rise;
        let gain = square >> (2 * RISE_BITS + 1);
        // Speed once the acceleration is zero.
        let end = if rise < 0 { speed - gain } else { speed + gain };
        if speed <= 0 && end <= 0 {
            return true;
        }
        let cube = (square * rise) >> (3 * RISE_BITS);
        let way = ((speed * rise) >> RISE_BITS) + ((cube * THIRD) >> 16);
        let mut left = self.distance - way;
        if lenient {
            left += GRID;
            if rise < 0 {
                left += speed - (cube >> 4);
            }
        }
        if left < 0 {
            return false;
        }
        let near = left.min(1 << 31);
        let left_square = near * near;
        let most = i64::from(most);
        let most_square = (most * most) >> (2 * RISE_BITS);
        let room = (left * most) >> (RISE_BITS - 1);
        let top = speed + gain;
        if end > 0 {
            if top >= most_square {
                top * (top + most_square) <= room
            } else {
                top * top * top <= left_square
            }
        } else if 2 * top >= most_square {
            top * (top + most_square) - ((most_square * most_square * TWELFTH) >> 16) <= room
        } else {
            top * top * top <= left_square + (left_square >> 3)
        }
    }
}

/// Filter for the motion of a goal, 2⁻⁴⁰ per tick.
#[derive(Clone, Copy, Debug, Default)]
struct Goal {
    /// Goal of this tick.
    last: i64,
    /// It is that of the tick before.
    held: bool,
    value: i64,
    speed: i64,
    acceleration: i64,
    /// Change of the acceleration a tick, low-passed.
    jerk: i64,
}

impl Goal {
    fn at(value: i64) -> Self {
        Self { last: value, value, ..Self::default() }
    }

    /// Takes the goal of this tick. Gains for a pole p of 7/8: `1 − p³`, `1.5 (1 − p²)(1 − p)`, `(1 − p)³`. The filter
    /// starts anew where the goal rests, steps or turns at a corner: where eight times the largest jerk does not explain it.
    #[inline]
    fn follow(&mut self, goal: i64, jerk: i64) {
        const GAIN_BITS: u32 = 9;
        let value = self.value + self.speed + (self.acceleration >> 1);
        let error = goal - value;
        let raw_speed = goal - self.last;
        let rests = raw_speed == 0 && self.held;
        (self.last, self.held) = (goal, raw_speed == 0);
        if rests || error.abs() >> (GAIN_BITS + 3) > jerk {
            (self.value, self.speed, self.acceleration, self.jerk) = (goal, raw_speed, 0, 0);
            return;
        }
        self.value = value + ((error * 21) >> 6);
        self.speed += self.acceleration + ((error * 45) >> 10);
        let change = error >> GAIN_BITS;
        self.acceleration += change;
        self.jerk += (change - self.jerk) >> 5;
    }

    /// Speed half a tick ago, as the shaper counts it, and acceleration, without the lag of the filter behind a steady jerk
    /// (157 ticks² and 22 ticks of it).
    #[inline]
    fn motion(&self) -> (i64, i64) {
        let acceleration = self.acceleration + 22 * self.jerk;
        (self.speed + 157 * self.jerk - (acceleration >> 1), acceleration)
    }
}

/// State of the shaper.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shaper {
    value: i64,
    speed: i64,
    acceleration: i64,
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
        Self { value, goal: Goal::at(value), locked: true, ..Self::default() }
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
    pub const fn acceleration(&self) -> i64 {
        self.acceleration
    }

    /// Follows another goal from now on, which begins at `value` and at rest.
    pub fn restart(&mut self, value: i64) {
        self.goal = Goal::at(value);
        self.locked = false;
    }

    /// One tick towards `goal`. Inside `range` the value never leaves it: it stops before either end.
    pub fn step(&mut self, limits: &ShaperLimits, range: [i64; 2], goal: i64) -> Limited {
        self.goal.follow(goal, i64::from(limits.jerk));
        let inward = i32::from(limits.rise);
        let outward = limits.outward(self.value);
        let bounds = Bounds {
            range,
            most: if self.value < 0 { [outward, inward] } else { [inward, outward] },
            speed: i64::from(limits.speed) << 8,
        };
        let seen = Seen::new(limits, &self.goal);
        self.locked = self.meets(limits, &seen, goal) && bounds.allow_lock(limits, &seen, goal);
        if self.locked {
            (self.value, self.speed, self.acceleration) = (goal, seen.speed, seen.acceleration);
            return Limited::default();
        }
        self.catch_up(limits, &bounds, &seen, goal)
    }

    /// Whether the goal is where this tick leads without jerk, within a few steps of the jerk. Once locked, the value is the
    /// goal; its speed and acceleration, as the filter knows them, must go on as steadily.
    #[inline]
    fn meets(&self, limits: &ShaperLimits, seen: &Seen, goal: i64) -> bool {
        let near = |difference: i64, steps: i64| difference.abs() <= steps * i64::from(limits.jerk);
        let speed = self.speed + self.acceleration;
        let (value_steps, speed_steps) = if self.locked { (LOCKED_STEPS, LOCKED_STEPS) } else { (32, 12) };
        near(seen.jerk, 1)
            && near(self.acceleration - seen.acceleration, 4)
            && near(speed - seen.speed, speed_steps)
            && near(self.value + speed - goal, value_steps)
    }

    /// A tick that is not locked.
    fn catch_up(&mut self, limits: &ShaperLimits, bounds: &Bounds, seen: &Seen, goal: i64) -> Limited {
        let jerk = i64::from(limits.jerk);
        let speed = self.speed + self.acceleration;
        let ahead = self.value + speed - goal;
        // Mirrored, so that the goal is towards +.
        let towards = if ahead > 0 { -1 } else { 1 };
        let [below, above] = bounds.most;
        let (fall, rise) = if ahead > 0 { (above, below) } else { (below, above) };
        let relative = Approach {
            speed: towards * limits.ticks_of(speed - seen.speed),
            rise: towards * (limits.rise_of(self.acceleration) - seen.rise),
            distance: limits.over_jerk(ahead.abs()),
        };
        // A goal with a jerk of its own leaves a part of the jerk for braking, counted as 1, 1/2, 1/4 or 1/8.
        let part = |of: i64| u32::from(seen.jerk.abs() > of);
        let halvings = part(jerk >> 3) + part(jerk >> 1) + part(jerk - (jerk >> 2));
        // Its acceleration takes or leaves some of the deceleration.
        let fall = (fall + towards * seen.rise).max(fall >> 2).min(fall + (fall >> 1));
        let fall = (fall << halvings).min(LONGEST_RISE << RISE_BITS);
        let own_rise = towards * limits.rise_of(self.acceleration);
        let may = |steps: i32| {
            let after = Approach {
                speed: (relative.speed + steps) << halvings,
                rise: (relative.rise + (steps << RISE_BITS)) << halvings,
                distance: (relative.distance - i64::from(steps)) << halvings,
            };
            own_rise + (steps << RISE_BITS) <= rise && after.stops(fall, false)
        };
        let steps = if may(1) {
            1
        } else if may(0) {
            0
        } else {
            -1
        };
        let wanted = self.acceleration + i64::from(towards * steps) * jerk;
        let slowed = self.slowed(limits, bounds, wanted);
        let mut acceleration = self.bounded(jerk, bounds, slowed);
        let speed = self.speed + acceleration;
        let motion =
            Approach { speed: limits.ticks_of(speed), rise: limits.rise_of(acceleration), distance: 0 };
        let [low, high] = bounds.hold(limits, motion, self.value + speed, false);
        if !(low && high) {
            let brake = if high || (!low && speed < 0) { jerk } else { -jerk };
            acceleration = self.bounded(jerk, bounds, self.acceleration + brake);
        }
        self.acceleration = acceleration;
        self.speed += acceleration;
        self.value += self.speed;
        Limited { acceleration: true, speed: slowed != wanted }
    }

    /// `wanted`, or less where the speed would be beyond its limit by the time the acceleration is zero.
    #[inline]
    fn slowed(&self, limits: &ShaperLimits, bounds: &Bounds, wanted: i64) -> i64 {
        let jerk = i64::from(limits.jerk);
        let sign = if wanted < 0 { -1 } else { 1 };
        let too_fast = |acceleration: i64| bounds.too_fast(limits, self.speed + acceleration, acceleration);
        if !too_fast(wanted) {
            return wanted;
        }
        let held = (sign * self.acceleration).min(sign * wanted).max(0);
        let less = (sign * self.acceleration - jerk).max(0);
        sign * if too_fast(sign * held) { held.min(less) } else { held }
    }

    /// `wanted` within the limits of the acceleration, and no further from the present one than the jerk allows.
    #[inline]
    fn bounded(&self, jerk: i64, bounds: &Bounds, wanted: i64) -> i64 {
        let [below, above] = bounds.most.map(|most| (i64::from(most) * jerk) >> RISE_BITS);
        let least = (-below).min(self.acceleration + jerk);
        let most = above.max(self.acceleration - jerk);
        wanted.max(least).min(most)
    }
}

/// Motion of the goal, as far as the filter knows it.
struct Seen {
    speed: i64,
    acceleration: i64,
    jerk: i64,
    /// Acceleration over the largest jerk, 1/16 tick.
    rise: i32,
}

impl Seen {
    #[inline]
    fn new(limits: &ShaperLimits, goal: &Goal) -> Self {
        let (speed, acceleration) = goal.motion();
        Self { speed, acceleration, jerk: goal.jerk, rise: limits.rise_of(acceleration) }
    }
}

/// Limits at the present value.
struct Bounds {
    range: [i64; 2],
    /// Largest acceleration towards − and towards +, 1/16 tick.
    most: [i32; 2],
    /// 2⁻⁴⁰ per tick
    speed: i64,
}

impl Bounds {
    /// Whether the goal itself is within the limits.
    #[inline]
    fn allow_lock(&self, limits: &ShaperLimits, seen: &Seen, goal: i64) -> bool {
        let [below, above] = self.most;
        let motion = Approach { speed: limits.ticks_of(seen.speed), rise: seen.rise, distance: 0 };
        let [low, high] = self.hold(limits, motion, goal, true);
        let too_fast = seen.speed.abs() > self.speed || self.too_fast(limits, seen.speed, seen.acceleration);
        -below <= seen.rise && seen.rise <= above && !too_fast && low && high
    }

    /// Whether the speed will be beyond its limit by the time the acceleration is zero.
    #[inline]
    fn too_fast(&self, limits: &ShaperLimits, speed: i64, acceleration: i64) -> bool {
        let rise = i64::from(limits.rise_of(acceleration));
        let gain = ((rise * rise) >> (2 * RISE_BITS + 1)) * i64::from(limits.jerk);
        let end = if acceleration < 0 { speed - gain } else { speed + gain };
        end.abs() > self.speed && (end < 0) == (acceleration < 0)
    }

    /// Whether a motion at `value` stops before the lower and before the upper end of the range.
    #[inline]
    fn hold(&self, limits: &ShaperLimits, motion: Approach, value: i64, lenient: bool) -> [bool; 2] {
        let [low, high] = self.range;
        let [below, above] = self.most;
        let down =
            Approach { speed: -motion.speed, rise: -motion.rise, distance: limits.over_jerk(value - low) };
        let up = Approach { distance: limits.over_jerk(high - value), ..motion };
        [down.stops(above, lenient), up.stops(below, lenient)]
    }
}

#[cfg(test)]
mod tests;
