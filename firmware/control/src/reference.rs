//! Where the joint is to be: references held, streamed or made on the board, within what the joint can do.
//!
//! Values are rad or N·m, after the mode, in 2⁻⁴⁰ inside (64 bits): at 10 kHz a step of 2⁻²⁰ rad a tick would be a
//! speed of 0.01 rad/s, too coarse to tell the direction of a slow motion.
//!
//! A new reference takes over from the present value within `reference.ramp_time`: `r = r0 + s (g − r0)`, s from 0 to 1 as
//! `6 x⁵ − 15 x⁴ + 10 x³`. The generator runs from the start, so a sine grows in amplitude. Then `r` is clamped to its
//! range (flag [`Limit::ReferenceRange`]) and the [`shaper`] follows it with limited speed, acceleration and jerk (flags
//! [`Limit::ReferenceSpeed`], [`Limit::ReferenceAcceleration`]). A reference made on the board never goes beyond its
//! own extremes: corners are rounded inside.

pub mod oscillator;
pub mod shaper;

use bowden_link::message::Shape;
use bowden_link::{Limit, Limits};

use crate::scale::{Acceleration, Angle, Gain, Quantity, Speed, Torque, saturated};
use crate::tick::Inbox;
use shaper::{Ends, Shaper, ShaperLimits};

pub use crate::parameters::{ReferenceConfig, reference_config};

/// Bits between 2⁻²⁰ and the scale of this module.
const EXTRA_BITS: u32 = 20;

/// Where a reference comes from, in 2⁻²⁰ of its unit; phases 2³² a turn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Origin {
    /// The value at which the joint is.
    #[default]
    Here,
    /// This value.
    Hold(i32),
    /// Points from the inbox; phase a tick, so that 2³² is a point.
    Stream(u32),
    /// A periodic form.
    Generated {
        /// Its form.
        shape: Shape,
        /// Half of the peak-to-peak value.
        amplitude: i32,
        /// Middle.
        offset: i32,
        /// Phase a tick.
        phase_step: u32,
    },
}

/// Range and limits of a reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReferenceBounds {
    /// Least and largest value, 2⁻²⁰.
    pub range: [i32; 2],
    /// Speed, acceleration and jerk.
    pub limits: ShaperLimits,
}

/// Narrows the range of a torque near the ends of the joint's range, so that a free joint is not pushed out of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueWindow {
    /// Torque a distance to the end.
    pub slope: Gain<Angle, Torque>,
    /// Torque outward that is left at the upper end and, as −, at the lower one: less than what gravity holds there.
    pub left: [Torque; 2],
}

impl TorqueWindow {
    /// Least and largest torque at the angle `theta` of the joint, 2⁻²⁰ N·m.
    #[inline]
    #[must_use]
    pub fn at(&self, angles: [i32; 2], torques: [i32; 2], theta: Angle) -> [i32; 2] {
        let [low, high] = angles.map(Angle::from_bits);
        let [least, most] = torques;
        let up = self.slope.apply(high.minus(theta)).plus(self.left[1]).to_bits();
        let down = self.slope.apply(low.minus(theta)).minus(self.left[0]).to_bits();
        [down.max(least).min(0), up.min(most).max(0)]
    }
}

/// State of the reference.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReferenceState {
    config: ReferenceConfig,
    shaper: Shaper,
    /// Least and largest value that the reference takes by itself, 2⁻⁴⁰.
    extremes: [i64; 2],
    /// Value from which the present reference took over, 2⁻⁴⁰.
    from: i64,
    /// Ends of the shaper's range, and range and jerk of the bounds that they were made for.
    ends: Ends,
    ends_for: Option<([i32; 2], i32)>,
    /// Part of the ramp that is done, 2³² the whole; stays at its end.
    ramp: u32,
    phase: u32,
    /// Streamed points, 2⁻²⁰: the one before and the one ahead.
    points: [i32; 2],
    /// No point is ahead.
    starved: bool,
}

/// The reference in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReferenceOutput {
    /// Value, 2⁻²⁰ of its unit.
    pub value_bits: i32,
    /// Its change in this tick, 2⁻⁴⁰, at most 2⁴⁰ of them.
    pub change: i64,
    /// Acceleration, 2⁻⁴⁰ a tick².
    pub acceleration: i64,
}

impl ReferenceOutput {
    /// Rate of change at `rate_hz` ticks a second, saturated.
    #[inline]
    #[must_use]
    pub fn speed(&self, rate_hz: u16) -> Speed {
        Speed::from_bits(saturated((self.change * i64::from(rate_hz)) >> EXTRA_BITS))
    }

    /// Acceleration at `rate_hz` ticks a second, saturated.
    #[inline]
    #[must_use]
    pub fn acceleration(&self, rate_hz: u16) -> Acceleration {
        const EXCESS: u32 = 2 * EXTRA_BITS - Acceleration::FRACTION_BITS;
        let rate = i64::from(rate_hz);
        Acceleration::from_bits(saturated((self.acceleration * (rate * rate)) >> EXCESS))
    }
}

impl ReferenceState {
    /// Stands at `value_bits`, 2⁻²⁰.
    #[must_use]
    pub fn standing_at(value_bits: i32) -> Self {
        let value = i64::from(value_bits) << EXTRA_BITS;
        Self {
            shaper: Shaper::standing_at(value),
            extremes: [value; 2],
            from: value,
            ramp: u32::MAX,
            points: [value_bits; 2],
            ..Self::default()
        }
    }

    /// Value, 2⁻²⁰ of its unit.
    #[must_use]
    pub const fn value_bits(&self) -> i32 {
        (self.shaper.value() >> EXTRA_BITS) as i32
    }

    /// Takes another reference, from the present value on.
    pub fn follow(&mut self, config: ReferenceConfig) {
        let from = self.shaper.value();
        let points = [self.value_bits(); 2];
        let mut shaper = self.shaper;
        shaper.restart();
        let wide = |value: i32| i64::from(value) << EXTRA_BITS;
        let [low, high] = match config.origin {
            Origin::Here => [from; 2],
            Origin::Hold(value) => [wide(value); 2],
            Origin::Stream(_) => [i64::MIN, i64::MAX],
            Origin::Generated { amplitude, offset, .. } => {
                let size = wide(amplitude).abs();
                [wide(offset) - size, wide(offset) + size]
            }
        };
        *self =
            Self { config, shaper, extremes: [low, high], from, points, starved: true, ..Self::default() };
    }

    /// One tick. The goal is clamped to `window`, which is within the range of `bounds`.
    pub fn step(
        &mut self,
        bounds: &ReferenceBounds,
        window: [i32; 2],
        inbox: &mut impl Inbox,
        limits: &mut Limits,
    ) -> ReferenceOutput {
        let goal = match self.config.origin {
            Origin::Here => self.from,
            Origin::Hold(value) => i64::from(value) << EXTRA_BITS,
            Origin::Stream(phase_step) => self.streamed(phase_step, inbox, limits),
            Origin::Generated { shape, amplitude, offset, phase_step } => {
                let value = i64::from(amplitude) * i64::from(oscillator::form(shape, self.phase));
                self.phase = self.phase.wrapping_add(phase_step);
                (i64::from(offset) << EXTRA_BITS) + (value >> (30 - EXTRA_BITS))
            }
        };
        let goal = self.blended(goal);
        let clamped = self::clamped(goal, window);
        if clamped != goal {
            limits.insert(Limit::ReferenceRange);
        }
        if self.ends_for != Some((bounds.range, bounds.limits.jerk)) {
            self.set_ends(bounds);
        }
        let before = self.shaper.value();
        let limited = self.shaper.step(&bounds.limits, &self.ends, clamped);
        if limited.speed {
            limits.insert(Limit::ReferenceSpeed);
        }
        if limited.acceleration {
            limits.insert(Limit::ReferenceAcceleration);
        }
        ReferenceOutput {
            value_bits: self.value_bits(),
            change: self.shaper.value() - before,
            acceleration: self.shaper.acceleration(),
        }
    }

    /// Makes the ends of the shaper's range for these bounds.
    #[cold]
    fn set_ends(&mut self, bounds: &ReferenceBounds) {
        let [low, high] = bounds.range.map(|bound| i64::from(bound) << EXTRA_BITS);
        // It begins where it is, which may be outside.
        let [lowest, highest] = self.extremes.map(|extreme| extreme.max(low).min(high));
        self.ends = bounds.limits.ends([lowest.min(self.from), highest.max(self.from)]);
        self.ends_for = Some((bounds.range, bounds.limits.jerk));
    }

    /// `from + s (goal − from)`.
    fn blended(&mut self, goal: i64) -> i64 {
        self.ramp = self.ramp.saturating_add(self.config.ramp_step);
        if self.ramp == u32::MAX {
            return goal;
        }
        let share = i64::from(oscillator::smooth((self.ramp >> 2).cast_signed()));
        let distance = goal - self.from;
        // In two parts, so that 53 and 30 bits fit into 64: the high one exactly, the low one rounded down.
        let (high, low) = (distance >> 30, distance & ((1 << 30) - 1));
        self.from + high * share + ((low * share) >> 30)
    }

    /// Between the last two points, 2⁻⁴⁰; the last one while there is no other.
    fn streamed(&mut self, phase_step: u32, inbox: &mut impl Inbox, limits: &mut Limits) -> i64 {
        let (phase, due) = self.phase.overflowing_add(phase_step);
        let [_, ahead] = self.points;
        if !due && !self.starved {
            self.phase = phase;
        } else if let Some(next) = inbox.stream_point() {
            // After a gap the next point is approached from its beginning.
            self.phase = if self.starved { 0 } else { phase };
            self.points = [ahead, next];
            self.starved = false;
        } else {
            limits.insert(Limit::StreamEmpty);
            self.points = [ahead; 2];
            self.starved = true;
        }
        let [before, ahead] = self.points;
        let distance = i64::from(ahead) - i64::from(before);
        (i64::from(before) << EXTRA_BITS) + ((distance * i64::from(self.phase >> 8)) >> (24 - EXTRA_BITS))
    }
}

/// `goal`, 2⁻⁴⁰, within a window, 2⁻²⁰.
#[inline]
fn clamped(goal: i64, window: [i32; 2]) -> i64 {
    let [least, most] = window.map(i64::from);
    let place = goal >> EXTRA_BITS;
    if place > least && place < most {
        // Nearly always.
        return goal;
    }
    goal.max(least << EXTRA_BITS).min(most << EXTRA_BITS)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::collections::VecDeque;
    use std::vec::Vec;

    use super::*;
    use crate::tick::{Command, NoInbox};

    const ONE: i32 = 1 << 20;

    /// Range ±2 and, at 10 kHz, so much a second, a second² and a second³.
    fn bounds(speed: f32, acceleration: f32, jerk: f32) -> ReferenceBounds {
        let tick = |value: f32, power: i32| value * 1e-4_f32.powi(power) * 1_099_511_627_776.0;
        let limits = ShaperLimits::new(tick(speed, 1), tick(acceleration, 2), 0.0, tick(jerk, 3));
        ReferenceBounds { range: [-2 * ONE, 2 * ONE], limits }
    }

    struct Points(VecDeque<i32>);

    impl Inbox for Points {
        fn command<R>(&mut self, _: impl FnOnce(&Command) -> R) -> Option<R> {
            None
        }

        fn stream_point(&mut self) -> Option<i32> {
            self.0.pop_front()
        }
    }

    fn config(origin: Origin) -> ReferenceConfig {
        // A ramp of 1000 ticks.
        ReferenceConfig { origin, ramp_step: u32::MAX / 1000 + 1 }
    }

    fn run(state: &mut ReferenceState, ticks: usize) -> (Vec<i32>, Limits) {
        let bounds = bounds(3.0, 100.0, 10_000.0);
        let mut limits = Limits::default();
        let mut step = || state.step(&bounds, bounds.range, &mut NoInbox, &mut limits).value_bits;
        ((0..ticks).map(|_| step()).collect(), limits)
    }

    #[test]
    fn a_held_value_is_reached_smoothly_from_the_present_one() {
        let mut state = ReferenceState::standing_at(ONE / 2);
        state.follow(config(Origin::Hold(ONE * 7 / 16)));
        let (values, limits) = run(&mut state, 1400);
        // 6 x⁵ − 15 x⁴ + 10 x³ is 0.00856 at 0.1 and 1/2 at 1/2.
        assert!((values[99] - (ONE / 2 - ONE / 16 * 856 / 100_000)).abs() < 100, "{}", values[99]);
        assert!((values[499] - ONE * 15 / 32).abs() < 100, "{}", values[499]);
        assert_eq!((values[1000], values[1399]), (ONE * 7 / 16, ONE * 7 / 16));
        let up = values.windows(2).position(|pair| pair[1] > pair[0]);
        assert_eq!(up, None, "{:?}", up.map(|at| &values[at - 5..at + 5]));
        assert_eq!(limits, Limits::default());
    }

    #[test]
    fn range_and_speed_are_limited_and_told() {
        let mut state = ReferenceState::standing_at(0);
        state.follow(ReferenceConfig { origin: Origin::Hold(5 * ONE), ramp_step: u32::MAX });
        let (values, limits) = run(&mut state, 10_000);
        assert!(limits.contains(Limit::ReferenceRange) && limits.contains(Limit::ReferenceSpeed));
        // 0.3 in 0.1 s, but for the start: 3/2·(3/100 + 100/10 000) = 0.06.
        assert!((values[999] - ONE * 24 / 100).abs() < 1000, "{}", values[999]);
        assert_eq!(values[9_999], 2 * ONE);
        // Range alone, once it is there.
        assert!(
            run(&mut state, 1).1 == {
                let mut only = Limits::default();
                only.insert(Limit::ReferenceRange);
                only
            }
        );
    }

    #[test]
    fn speed_and_acceleration_are_those_of_the_sine() {
        // 0.5 sin(2π·2t) at 10 kHz: speed 6.283 cos within a speed limit of 10, acceleration -78.96 sin.
        let bounds = bounds(10.0, 200.0, 10_000.0);
        let mut state = ReferenceState::standing_at(0);
        let phase_step = (2.0 / 10_000.0 * 4_294_967_296.0) as u32;
        let origin = Origin::Generated { shape: Shape::Sine, amplitude: ONE / 2, offset: 0, phase_step };
        state.follow(ReferenceConfig { origin, ramp_step: u32::MAX });
        let mut limits = Limits::default();
        for n in 0..10_000_u32 {
            let output = state.step(&bounds, bounds.range, &mut NoInbox, &mut limits);
            // It starts with the sine's full speed, which takes its time.
            if n < 5000 {
                continue;
            }
            // A backward difference is that of half a tick before.
            let phase = |ticks: f64| 2.0 * std::f64::consts::TAU * (f64::from(n) - ticks) / 10_000.0;
            let speed = f64::from(output.speed(10_000).to_bits()) / f64::from(ONE);
            assert!((speed - std::f64::consts::TAU * phase(0.5).cos()).abs() < 1e-4, "{speed} at {n}");
            let acceleration = f64::from(output.acceleration(10_000).to_f32());
            // The filter lags behind a sine by what it does not correct, (22·32)·(4π·1e-4)² of it, 0.09 rad/s².
            assert!((acceleration + 78.957 * phase(0.0).sin()).abs() < 0.2, "{acceleration} at {n}");
            limits = if n == 5000 { Limits::default() } else { limits };
        }
        assert_eq!(limits, Limits::default());
    }

    #[test]
    fn a_stream_is_followed_in_straight_lines_and_held_when_it_ends() {
        // A point every four ticks; two equal ones, which take their time as well.
        let mut inbox = Points([400, 800, 800, 0].into());
        let mut state = ReferenceState::standing_at(0);
        state.follow(ReferenceConfig { origin: Origin::Stream(1 << 30), ramp_step: u32::MAX });
        // Limits beyond what these few steps of 2⁻²⁰ ask for.
        let bounds = bounds(100.0, 100_000.0, 1e9);
        let (mut values, mut empty) = (Vec::new(), Vec::new());
        for _ in 0..22 {
            let mut limits = Limits::default();
            values.push(state.step(&bounds, bounds.range, &mut inbox, &mut limits).value_bits);
            empty.push(limits.contains(Limit::StreamEmpty));
        }
        let expected =
            [0, 100, 200, 300, 400, 500, 600, 700, 800, 800, 800, 800, 800, 600, 400, 200, 0, 0, 0, 0, 0, 0];
        assert_eq!(values, expected);
        assert!(empty.iter().take(16).all(|empty| !empty) && empty.iter().skip(16).all(|empty| *empty));
        // Points that come late are followed from where it stands.
        inbox.0.push_back(400);
        let mut limits = Limits::default();
        let late: Vec<i32> =
            (0..5).map(|_| state.step(&bounds, bounds.range, &mut inbox, &mut limits).value_bits).collect();
        assert_eq!(late, [0, 100, 200, 300, 400]);
    }

    #[test]
    fn extremes_neither_panic_nor_leave_the_range() {
        let extremes = [i32::MIN, -1, 0, i32::MAX];
        for start in extremes {
            for goal in extremes {
                let mut state = ReferenceState::standing_at(start);
                for origin in [
                    Origin::Hold(goal),
                    Origin::Stream(u32::MAX),
                    Origin::Generated {
                        shape: Shape::Multisine,
                        amplitude: goal,
                        offset: goal,
                        phase_step: u32::MAX / 3,
                    },
                ] {
                    state.follow(config(origin));
                    let mut inbox = Points([goal, start, goal].into());
                    let wide = ReferenceBounds { range: [-ONE, ONE], ..bounds(1e4, 1e6, 1e8) };
                    // One a tick at most: 2048 ticks from the end of the scale to the range, and 200 to start and stop.
                    let mut value = start;
                    for _ in 0..2400 {
                        let output = state.step(&wide, wide.range, &mut inbox, &mut Limits::default());
                        let _ = (output.speed(20_000), output.acceleration(20_000));
                        value = output.value_bits;
                    }
                    assert!((-ONE..=ONE).contains(&value), "{start} to {goal}: {value}");
                }
            }
        }
    }
}
