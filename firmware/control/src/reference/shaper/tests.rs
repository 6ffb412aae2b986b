extern crate std;
use std::vec::Vec;

use super::*;

const RATE_HZ: f64 = 10_000.0;
const ONE: f64 = (1_u64 << 40) as f64;
/// The jerk, in units of the state.
const ONE_STEP: i64 = 1 << STATE_BITS;

/// Speed, acceleration, gravity, jerk, in units of the reference a second.
fn limits(speed: f64, acceleration: f64, gravity: f64, jerk: f64) -> ShaperLimits {
    ShaperLimits::new(
        (speed / RATE_HZ * ONE) as f32,
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
        shaper.restart();
        Self { shaper, limits, range: range.map(bits), limited: Vec::new(), values: Vec::new() }
    }

    fn tick(&mut self, goal: i64) {
        let before = self.shaper;
        let limited = self.shaper.step(&self.limits, &self.limits.ends(self.range), goal);
        let now = self.shaper;
        let most = i64::from(self.limits.rise) << RISE_SHIFT;
        // Where it locks, a few steps of the jerk come together; a locked value follows the grid of the goal.
        let steps = if now.locked { 5 } else { 1 };
        let changed = i64::from(now.acceleration - before.acceleration);
        assert!(changed.abs() <= steps * ONE_STEP, "jerk {changed} at {}", self.values.len());
        let acceleration = i64::from(now.acceleration);
        assert!(acceleration.abs() <= most + ONE_STEP, "acceleration {acceleration} of {most}");
        let speed = i64::from(self.limits.speed) << STATE_BITS;
        assert!(now.speed.abs() <= speed + 2 * ONE_STEP, "speed {} of {speed}", now.speed);
        if now.locked {
            let deviation = now.speed - before.speed - i64::from(before.acceleration);
            assert!(deviation.abs() <= 64 << STATE_BITS, "speed {deviation}");
            assert_eq!(now.value(), goal);
        } else if before.jerk != 0 {
            assert_eq!(now.state - before.state, now.speed);
            assert_eq!(now.speed - before.speed, acceleration);
            // The output has a step of a 256th of the jerk.
            let exact = now.state as f64 * f64::from(self.limits.jerk) / ONE_STEP as f64;
            let off = (now.value() as f64 - exact).abs();
            assert!(off <= 2.0 + f64::from(self.limits.jerk) / 256.0, "{off}");
        }
        let [low, high] = self.range;
        let grid = (GRID + 1) * i64::from(self.limits.jerk);
        assert!(
            now.value() >= low - grid && now.value() <= high + grid,
            "{} beyond {:?}",
            now.value(),
            self.range
        );
        self.values.push(now.value());
        self.limited.push(limited);
    }
}

#[test]
fn a_held_goal_is_reached_in_nearly_the_shortest_time_without_overshoot() {
    let mut random = Random(1);
    for _ in 0..300 {
        let (speed, acceleration) = (random.spread(0.05, 20.0), random.spread(2.0, 2000.0));
        let jerk = f64::max(acceleration * random.spread(15.0, 1000.0), 600.0);
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
        let limits =
            limits(random.spread(0.05, 20.0), acceleration, acceleration * random.between(0.0, 0.9), jerk);
        let mut run = Run::new(limits, [-0.7, 0.9], random.between(-0.7, 0.9));
        let mut goal = 0.0;
        let mut slope = 0.0;
        for _ in 0..5000 {
            // Steps, corners and noise.
            match (random.uniform() * 500.0) as u32 {
                0 => goal = random.between(-0.7, 0.9),
                1 => slope = random.between(-10.0, 10.0) / RATE_HZ,
                2 => slope = 0.0,
                3 => run.shaper.restart(),
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
    for speed in [0.0, f32::MAX] {
        for acceleration in [0.0, 1.0, 1e5, f32::MAX] {
            for jerk in [0.0, 1e4, f32::MAX] {
                let limits = ShaperLimits::new(speed, acceleration, acceleration / 2.0, jerk);
                let mut shaper = Shaper::standing_at(end);
                for (n, goal) in [-end, end, 0, -end, 1, end].into_iter().enumerate() {
                    if n % 2 == 0 {
                        shaper.restart();
                    }
                    for _ in 0..200 {
                        shaper.step(&limits, &limits.ends([-end, end]), goal);
                    }
                }
                let jerk = i64::from(limits.jerk);
                assert!(shaper.value().abs() <= end + 4 * jerk, "{limits:?}: {}", shaper.value().abs() - end);
            }
        }
    }
}
