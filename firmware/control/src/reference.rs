//! Where the joint is to be: references held, streamed or made on the board, within range and speed.
//!
//! Values are rad or N·m, after the mode, in 2⁻⁴⁰ inside (64 bits): at 10 kHz a step of 2⁻²⁰ rad a tick would be a
//! speed of 0.01 rad/s, too coarse to tell the direction of a slow motion.
//!
//! A new reference takes over from the present value within `reference.ramp_time`: `r = r0 + s (g − r0)`, s from 0 to 1 as
//! `3 x² − 2 x³`. The generator runs from the start, so a sine grows in amplitude. Then `r` is clamped to its
//! range (flag [`Limit::ReferenceRange`]) and follows with limited speed (flag [`Limit::ReferenceSpeed`]).

pub mod oscillator;
pub mod shaper;

use bowden_link::message::Shape;
use bowden_link::{Limit, Limits};

use crate::scale::{Acceleration, Quantity, Speed, saturated};
use crate::tick::Inbox;

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

/// Range and speed of a reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReferenceBounds {
    /// Least and largest value, 2⁻²⁰.
    pub range: [i32; 2],
    /// Largest change a tick, 2⁻³².
    pub step: u32,
}

/// State of the reference.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReferenceState {
    config: ReferenceConfig,
    /// Value, 2⁻⁴⁰.
    value: i64,
    /// Value from which the present reference took over, 2⁻⁴⁰.
    from: i64,
    /// Part of the ramp that is done, 2³² the whole; stays at its end.
    ramp: u32,
    /// Change in the last tick, 2⁻⁴⁰.
    change: i64,
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
    /// The change in the tick before, 2⁻⁴⁰.
    pub change_before: i64,
}

impl ReferenceOutput {
    /// Rate of change at `rate_hz` ticks a second, saturated.
    #[inline]
    #[must_use]
    pub fn speed(&self, rate_hz: u16) -> Speed {
        Speed::from_bits(saturated((self.change * i64::from(rate_hz)) >> EXTRA_BITS))
    }

    /// Rate of change of that, saturated. A reference that turns at a corner has a large one for a single tick.
    #[inline]
    #[must_use]
    pub fn acceleration(&self, rate_hz: u16) -> Acceleration {
        /// 2⁻⁴⁰ a tick² to 2⁻²⁸: with two factors of the rate, 15 bits each, below 2⁶⁰.
        const DROPPED: u32 = 12;
        let change = (self.change - self.change_before) >> DROPPED;
        let rate = i64::from(rate_hz);
        let excess = 2 * EXTRA_BITS - DROPPED - Acceleration::FRACTION_BITS;
        Acceleration::from_bits(saturated((change * rate * rate) >> excess))
    }
}

impl ReferenceState {
    /// Stands at `value_bits`, 2⁻²⁰.
    #[must_use]
    pub fn standing_at(value_bits: i32) -> Self {
        let value = i64::from(value_bits) << EXTRA_BITS;
        Self { value, from: value, ramp: u32::MAX, points: [value_bits; 2], ..Self::default() }
    }

    /// Value, 2⁻²⁰ of its unit.
    #[must_use]
    pub const fn value_bits(&self) -> i32 {
        (self.value >> EXTRA_BITS) as i32
    }

    /// Takes another reference, from the present value on.
    pub fn follow(&mut self, config: ReferenceConfig) {
        let here = (self.value >> EXTRA_BITS) as i32;
        let (value, change) = (self.value, self.change);
        let points = [here; 2];
        *self = Self { config, value, from: value, ramp: 0, change, phase: 0, points, starved: true };
    }

    /// One tick.
    pub fn step(
        &mut self,
        bounds: &ReferenceBounds,
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
        let [low, high] = bounds.range.map(|bound| i64::from(bound) << EXTRA_BITS);
        let clamped = goal.max(low).min(high);
        if clamped != goal {
            limits.insert(Limit::ReferenceRange);
        }
        let change = clamped - self.value;
        let step = i64::from(bounds.step) << (2 * EXTRA_BITS - 32);
        let limited = change.max(-step).min(step);
        if limited != change {
            limits.insert(Limit::ReferenceSpeed);
        }
        self.value += limited;
        let change_before = core::mem::replace(&mut self.change, limited);
        ReferenceOutput { value_bits: (self.value >> EXTRA_BITS) as i32, change: limited, change_before }
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

#[cfg(test)]
mod tests {
    extern crate std;
    use std::collections::VecDeque;
    use std::vec::Vec;

    use super::*;
    use crate::tick::{Command, NoInbox};

    const ONE: i32 = 1 << 20;

    /// Range ±2, and 3 a second at 10 kHz.
    const BOUNDS: ReferenceBounds =
        ReferenceBounds { range: [-2 * ONE, 2 * ONE], step: ((3_u64 << 32) / 10_000) as u32 };

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
        let mut limits = Limits::default();
        let values = (0..ticks).map(|_| state.step(&BOUNDS, &mut NoInbox, &mut limits).value_bits).collect();
        (values, limits)
    }

    #[test]
    fn a_held_value_is_reached_smoothly_from_the_present_one() {
        let mut state = ReferenceState::standing_at(ONE / 2);
        state.follow(config(Origin::Hold(ONE * 7 / 16)));
        let (values, limits) = run(&mut state, 1500);
        // 3 x² − 2 x³ is 0.028 at 0.1 and 1/2 at 1/2.
        assert!((values[99] - (ONE / 2 - ONE / 16 * 28 / 1000)).abs() < 100, "{}", values[99]);
        assert!((values[499] - ONE * 15 / 32).abs() < 100, "{}", values[499]);
        assert_eq!((values[1000], values[1499]), (ONE * 7 / 16, ONE * 7 / 16));
        assert!(values.windows(2).all(|pair| pair[1] <= pair[0]), "monotonous");
        assert_eq!(limits, Limits::default());
    }

    #[test]
    fn range_and_speed_are_limited_and_told() {
        let mut state = ReferenceState::standing_at(0);
        state.follow(ReferenceConfig { origin: Origin::Hold(5 * ONE), ramp_step: u32::MAX });
        let (values, limits) = run(&mut state, 10_000);
        assert!(limits.contains(Limit::ReferenceRange) && limits.contains(Limit::ReferenceSpeed));
        // 3 a second: 0.3 after 1000 ticks.
        assert!((values[999] - ONE * 3 / 10).abs() < 4, "{}", values[999]);
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
        let bounds = ReferenceBounds { step: ((10_u64 << 32) / 10_000) as u32, ..BOUNDS };
        let mut state = ReferenceState::standing_at(0);
        let phase_step = (2.0 / 10_000.0 * 4_294_967_296.0) as u32;
        let origin = Origin::Generated { shape: Shape::Sine, amplitude: ONE / 2, offset: 0, phase_step };
        state.follow(ReferenceConfig { origin, ramp_step: u32::MAX });
        let mut limits = Limits::default();
        for n in 0..10_000_u32 {
            let output = state.step(&bounds, &mut NoInbox, &mut limits);
            if n < 2 {
                continue;
            }
            // A backward difference is that of half a tick before, a second one of a whole tick.
            let phase = |ticks: f64| 2.0 * std::f64::consts::TAU * (f64::from(n) - ticks) / 10_000.0;
            let speed = f64::from(output.speed(10_000).to_bits()) / f64::from(ONE);
            assert!((speed - std::f64::consts::TAU * phase(0.5).cos()).abs() < 1e-4, "{speed} at {n}");
            let acceleration = f64::from(output.acceleration(10_000).to_f32());
            // The sine rounds by 3e-9 of 0.5; differenced twice at 10 kHz 4e8 times that.
            assert!((acceleration + 78.957 * phase(1.0).sin()).abs() < 0.6, "{acceleration} at {n}");
        }
        assert_eq!(limits, Limits::default());
    }

    #[test]
    fn a_stream_is_followed_in_straight_lines_and_held_when_it_ends() {
        // A point every four ticks; two equal ones, which take their time as well.
        let mut inbox = Points([400, 800, 800, 0].into());
        let mut state = ReferenceState::standing_at(0);
        state.follow(ReferenceConfig { origin: Origin::Stream(1 << 30), ramp_step: u32::MAX });
        let (mut values, mut empty) = (Vec::new(), Vec::new());
        for _ in 0..22 {
            let mut limits = Limits::default();
            values.push(state.step(&BOUNDS, &mut inbox, &mut limits).value_bits);
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
            (0..5).map(|_| state.step(&BOUNDS, &mut inbox, &mut limits).value_bits).collect();
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
                    let wide = ReferenceBounds { range: [-ONE, ONE], step: u32::MAX };
                    // One a tick at most: 2048 ticks from the end of the scale to the range.
                    let mut value = start;
                    for _ in 0..2100 {
                        let output = state.step(&wide, &mut inbox, &mut Limits::default());
                        let _ = (output.speed(20_000), output.acceleration(20_000));
                        value = output.value_bits;
                    }
                    assert!((-ONE..=ONE).contains(&value), "{start} to {goal}: {value}");
                }
            }
        }
    }
}
