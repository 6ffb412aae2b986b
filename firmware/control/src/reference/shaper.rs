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
mod tests {
    extern crate std;
    use std::vec::Vec;

    use super::*;

    const RATE_HZ: f64 = 10_000.0;
    const ONE: f64 = (1_u64 << 40) as f64;

    /// Speed, acceleration, gravity, jerk, in units of the reference a second.
    fn limits(speed: f64, acceleration: f64, gravity: f64, jerk: f64) -> ShaperLimits {
        ShaperLimits::new(
            (speed / RATE_HZ * 4_294_967_296.0) as u32,
            (acceleration / RATE_HZ.powi(2) * ONE) as f32,
            (gravity / RATE_HZ.powi(2) * ONE) as f32,
            (jerk / RATE_HZ.powi(3) * ONE) as f32,
        )
    }

    fn bits(value: f64) -> i64 {
        (value * ONE) as i64
    }

    /// Xorshift generator, 0 to 1.
    struct Random(u64);

    impl Random {
        fn uniform(&mut self) -> f64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        }

        fn between(&mut self, low: f64, high: f64) -> f64 {
            low + (high - low) * self.uniform()
        }

        /// Evenly in the logarithm.
        fn spread(&mut self, low: f64, high: f64) -> f64 {
            low * (high / low).powf(self.uniform())
        }
    }

    /// A run and what it must not do: leave range, speed, acceleration or jerk.
    struct Run {
        shaper: Shaper,
        limits: ShaperLimits,
        range: [i64; 2],
        limited: Vec<Limited>,
        values: Vec<i64>,
    }

    impl Run {
        fn new(limits: ShaperLimits, range: [f64; 2], start: f64) -> Self {
            let mut shaper = Shaper::standing_at(bits(start));
            shaper.restart(bits(start));
            Self { shaper, limits, range: range.map(bits), limited: Vec::new(), values: Vec::new() }
        }

        fn tick(&mut self, goal: i64) {
            let before = self.shaper;
            let limited = self.shaper.step(&self.limits, self.range, goal);
            let (now, jerk) = (self.shaper, i64::from(self.limits.jerk));
            let most = (i64::from(self.limits.rise) * jerk) >> RISE_BITS;
            // Where it locks, a few steps of the jerk come together; a locked value follows the grid of the goal.
            let steps = if now.locked { 5 } else { 1 };
            let changed = now.acceleration - before.acceleration;
            assert!(changed.abs() <= steps * jerk, "jerk {changed} of {jerk} at {}", self.values.len());
            assert!(now.acceleration.abs() <= most + jerk, "acceleration {} of {most}", now.acceleration);
            let speed = i64::from(self.limits.speed) << 8;
            assert!(now.speed.abs() <= speed + 2 * jerk, "speed {} of {speed}", now.speed);
            if now.locked {
                let deviation = now.speed - before.speed - before.acceleration;
                assert!(deviation.abs() <= LOCKED_STEPS * jerk, "speed {deviation} of {jerk}");
            } else {
                assert_eq!(now.value - before.value, now.speed);
                assert_eq!(now.speed - before.speed, now.acceleration);
                assert!(changed.abs() <= jerk);
            }
            let [low, high] = self.range;
            let grid = GRID * jerk;
            assert!(
                now.value >= low - grid && now.value <= high + grid,
                "{} beyond {:?}",
                now.value,
                self.range
            );
            self.values.push(now.value);
            self.limited.push(limited);
        }
    }

    #[test]
    fn a_held_goal_is_reached_in_nearly_the_shortest_time_without_overshoot() {
        let mut random = Random(1);
        for _ in 0..300 {
            let (speed, acceleration) = (random.spread(0.05, 20.0), random.spread(2.0, 2000.0));
            let jerk = acceleration * random.spread(15.0, 1000.0);
            let distance = random.spread(1e-6, 3.0);
            let sign = if random.uniform() < 0.5 { -1.0 } else { 1.0 };
            let mut run = Run::new(limits(speed, acceleration, 0.0, jerk), [-4.0, 4.0], 0.0);
            // Shortest: rise and fall of the acceleration four times, a time at its limit twice, a time at full speed.
            let rise_s = (distance / (2.0 * jerk)).cbrt().min((speed / jerk).sqrt()).min(acceleration / jerk);
            let top = jerk * rise_s;
            let hold_s = ((0.25 * rise_s * rise_s + distance / top).sqrt() - 1.5 * rise_s)
                .min(speed / top - rise_s)
                .max(0.0);
            let reached = top * (rise_s + hold_s);
            let cruise_s = (distance / reached - 2.0 * rise_s - hold_s).max(0.0);
            let shortest = (4.0 * rise_s + 2.0 * hold_s + cruise_s) * RATE_HZ;
            let goal = bits(sign * distance);
            let ticks = (1.05 * shortest) as usize + 60;
            for _ in 0..ticks {
                run.tick(goal);
                let over = (run.shaper.value() - goal) as f64 * sign;
                assert!(over <= 0.0, "{distance}: {over} beyond");
            }
            let missing = (run.shaper.value() - goal).abs();
            assert_eq!(missing, 0, "{distance} by {speed}, {acceleration}, {jerk} in {ticks} for {shortest}");
            assert_eq!(run.limited.last(), Some(&Limited::default()));
        }
    }

    #[test]
    fn a_goal_within_the_limits_is_followed_bit_for_bit() {
        let mut random = Random(2);
        for _ in 0..100 {
            let frequency_hz = random.spread(0.05, 5.0);
            let amplitude = random.spread(0.01, 1.0);
            let turn = std::f64::consts::TAU * frequency_hz;
            // Speed, acceleration and jerk 1.3 times what the sine has.
            let [speed, acceleration, jerk] = [1, 2, 3].map(|power| 1.3 * amplitude * turn.powi(power));
            let limits = limits(speed, acceleration.max(20.0), 0.0, jerk.max(4000.0));
            let mut run = Run::new(limits, [-amplitude, amplitude], 0.0);
            let ticks = (3.0 * RATE_HZ / frequency_hz) as usize;
            let goal = |tick: usize| bits(amplitude * (turn * tick as f64 / RATE_HZ).sin() * (1.0 - 1e-9));
            for tick in 0..ticks {
                run.tick(goal(tick));
            }
            // From the third period on.
            let late = ticks * 2 / 3..ticks;
            let off = late.clone().filter(|tick| run.values[*tick] != goal(*tick)).count();
            assert_eq!(off, 0, "{amplitude} at {frequency_hz} Hz");
            assert!(late.into_iter().all(|tick| run.limited[tick] == Limited::default()));
        }
    }

    #[test]
    fn wild_goals_break_no_limit() {
        let mut random = Random(3);
        for _ in 0..200 {
            let acceleration = random.spread(2.0, 2000.0);
            let jerk = acceleration * random.spread(15.0, 1000.0);
            let limits = limits(
                random.spread(0.05, 20.0),
                acceleration,
                acceleration * random.between(0.0, 0.9),
                jerk,
            );
            let mut run = Run::new(limits, [-0.7, 0.9], random.between(-0.7, 0.9));
            let mut goal = 0.0;
            let mut slope = 0.0;
            for _ in 0..5000 {
                // Steps, corners and noise.
                match (random.uniform() * 500.0) as u32 {
                    0 => goal = random.between(-0.7, 0.9),
                    1 => slope = random.between(-10.0, 10.0) / RATE_HZ,
                    2 => slope = 0.0,
                    3 => run.shaper.restart(run.shaper.value()),
                    _ => {}
                }
                goal = f64::clamp(goal + slope + random.between(-1e-8, 1e-8), -0.7, 0.9);
                run.tick(bits(goal));
            }
        }
    }

    #[test]
    fn corners_at_the_ends_of_the_range_are_rounded_inside() {
        let (amplitude, frequency_hz) = (0.3, 1.0);
        let mut run = Run::new(limits(3.0, 100.0, 0.0, 4000.0), [-amplitude, amplitude], 0.0);
        for tick in 0..30_000 {
            let phase = (f64::from(tick) * frequency_hz / RATE_HZ + 0.25).fract();
            run.tick(bits(amplitude * (1.0 - 4.0 * (phase - 0.5).abs())));
        }
        let late = run.values.split_off(10_000);
        let top = late.iter().copied().max().unwrap() as f64 / ONE;
        // 1.2 rad/s are stopped from within 2·√(v³/j) = 42 mrad of the corner; it falls short by less than a tenth of that.
        assert!((0.296..0.3).contains(&top), "{top}");
        let locked = run.limited.iter().filter(|limited| **limited == Limited::default()).count();
        // Both sides of a corner are over within 2·2·√(v/j) = 70 ms each, of 500 ms.
        assert!(locked > 19_000, "{locked} of 30 000 ticks");
    }

    #[test]
    fn stopping_distances_are_those_of_a_simulated_stop() {
        // In units of the jerk: brake at -1 a tick² to -most, then let go at +1, by steps of 1/64 tick.
        let distance = |speed: f64, acceleration: f64, most: f64| {
            const STEP: f64 = 1.0 / 64.0;
            let (mut x, mut v, mut a) = (0.0, speed, acceleration);
            while v > 0.0 {
                let releases = a < 0.0 && v <= a * a / 2.0;
                a = if releases { f64::min(a + STEP, 0.0) } else { f64::max(a - STEP, -most) };
                v += STEP * a;
                x += STEP * v;
                if a == 0.0 && releases {
                    break;
                }
            }
            x
        };
        let mut random = Random(4);
        for _ in 0..2000 {
            let most = (16.0 * random.spread(5.0, 1000.0)).round() / 16.0;
            let acceleration = random.between(-most, most);
            let speed = random.spread(100.0, 100_000.0)
                + if acceleration < 0.0 { acceleration.powi(2) / 2.0 } else { 0.0 };
            let exact = distance(speed, acceleration, most);
            let stops = |distance: f64| {
                let approach = Approach {
                    speed: speed as i32,
                    rise: (acceleration * 16.0) as i32,
                    distance: distance as i64,
                };
                approach.stops((most * 16.0) as i32, false)
            };
            // A tick's way for the grid.
            let margin = 0.01 * exact + 2.0 * (speed + acceleration.max(0.0).powi(2));
            assert!(stops(exact + margin), "{speed}, {acceleration}, {most}: {exact}");
            assert!(!stops(exact - margin), "{speed}, {acceleration}, {most}: {exact}");
        }
    }

    #[test]
    fn gravity_takes_of_the_acceleration_what_the_sine_says() {
        let limits = limits(3.0, 200.0, 150.0, 4000.0);
        for n in 0..=400 {
            let angle = f64::from(n) * 0.01 - 2.0;
            let left = f64::from(limits.outward(bits(angle))) / f64::from(limits.rise) * 200.0;
            let exact = 200.0 - 150.0 * angle.abs().min(std::f64::consts::FRAC_PI_2).sin();
            // The parabola is above the sine by 0.056 at most.
            assert!(left <= exact + 0.1 && left >= exact - 150.0 * 0.0565, "{angle}: {left} for {exact}");
        }
    }

    #[test]
    fn numbers_at_the_end_of_the_scale_neither_panic_nor_stick() {
        let end = i64::from(i32::MAX) << 20;
        for speed in [0, u32::MAX] {
            for acceleration in [0.0, 1.0, 1e5, f32::MAX] {
                for jerk in [0.0, 1e4, f32::MAX] {
                    let limits = ShaperLimits::new(speed, acceleration, acceleration / 2.0, jerk);
                    let mut shaper = Shaper::standing_at(end);
                    for (n, goal) in [-end, end, 0, -end, 1, end].into_iter().enumerate() {
                        if n % 2 == 0 {
                            shaper.restart(shaper.value());
                        }
                        for _ in 0..200 {
                            shaper.step(&limits, [-end, end], goal);
                        }
                    }
                    let jerk = i64::from(limits.jerk);
                    assert!(
                        shaper.value().abs() <= end + 4 * jerk,
                        "{limits:?}: {}",
                        shaper.value().abs() - end
                    );
                }
            }
        }
    }
}
