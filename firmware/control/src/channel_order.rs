//! Whether the tensions at either end of the sheaths change with the stretch of the tendons: channels that are exchanged change against it.
//!
//! Where cable a is stretched by more, cable b is by less, and `s = EA r1 lag/L` is what the lag of the joint, which both encoders tell,
//! adds to the mean tension of one and takes from the other (Eq. (6)-(9)). Friction moves tension from one end to the other:
//!
//! ```text
//! F1 − F3 = 2 s + φ,    F2 − F4 = 2 s − φ,    |φ| ≤ 2 F0 tanh(mu K/2)
//! ```
//!
//! with the sign of φ that of the motion where the motor drives. Compared are the differences where `s` was highest and lowest since the bridge
//! went on, `Δs` apart. At the motor the friction adds to `2 Δs`. At the joint the load decides: `F2 − F4` is what it takes, so `s` is
//! highest where the joint moves up against the most and lowest where it moves down against the most, and `F2 − F4` falls from the first to the second
//! unless something takes the load over in one direction only. Channels that are exchanged turn the sign of one of the differences:
//!
//! | exchanged | F1 − F3 reads | F2 − F4 reads |
//! |---|---|---|
//! | f1, f3 | −(F1 − F3) | right |
//! | f2, f4 | right | −(F2 − F4) |
//! | f1, f4 or f2, f3 | ± (friction of one cable) | ∓ (friction of the other) |
//! | f1, f2 or f3, f4 | less by friction | more by friction: not found here |
//!
//! A difference that falls by a quarter of the pretension while `s` rises by half of it is a fault, if it stays so for 0.3 s. Play, a wrong stiffness
//! and wrong zeros change how far it has to rise, not the sign; changes of both pretensions fall out of the differences. An encoder that stands
//! makes a lag that no tendon bears: a cable would be slack at `s = F0`. Beyond that and the margin of the stretch nothing is named here until the bridge
//! goes on again, so at 0.1 rad/s and more on the joint of the paper such an encoder has its own name.

use bowden_link::Fault;

use crate::detection::Detection;
use crate::scale::{Angle, Quantity, Ratio, Tension};
use crate::sheath::Fitted;
use crate::tension::TensionConfig;

/// Looks, 10 ms apart, for which the differences have to be against the stretch.
const LOOKS: u8 = 30;
/// Part of the pretension by which a difference may change against the stretch: noise, and zeros that drift.
const AGAINST: Ratio = Ratio::from_parts(1, 4);

/// Both differences at an extreme of the stretch.
#[derive(Clone, Copy, Debug)]
struct Extreme {
    /// `2 s`.
    twice_stretch: Tension,
    /// `F1 − F3` and `F2 − F4`.
    across: [Tension; 2],
}

/// State of the watch: lowest and highest stretch since the bridge went on.
#[derive(Clone, Copy, Debug, Default)]
pub struct ChannelOrder {
    extremes: Option<[Extreme; 2]>,
    looks: u8,
    /// The lag was beyond what tendons bear.
    is_unbelievable: bool,
}

impl ChannelOrder {
    /// Forgets what was, for the time in which nothing drives the joint.
    pub const fn reset(&mut self) {
        self.extremes = None;
        self.looks = 0;
        self.is_unbelievable = false;
    }

    /// A look at the tensions behind their low-pass; `lag` is `theta_in - (r2/r1) theta_out`.
    #[inline(never)]
    pub fn look(&mut self, config: &TensionConfig, tensions: [Tension; 4], lag: Angle) -> Option<Detection> {
        let twice_stretch = config.stretch.apply(lag);
        let bearable = config.pretension.plus(config.pretension).plus(config.stretch_margin);
        self.is_unbelievable |= !twice_stretch.is_at_most(bearable);
        if config.fitted == Fitted::Nothing || self.is_unbelievable {
            return None;
        }
        let [f1, f2, f3, f4] = tensions;
        let now = Extreme { twice_stretch, across: [f1.minus(f3), f2.minus(f4)] };
        let [low, high] = self.extremes.get_or_insert([now; 2]);
        if now.twice_stretch < low.twice_stretch {
            *low = now;
        } else if now.twice_stretch > high.twice_stretch {
            *high = now;
        }
        let fell = |end: usize| low.across[end].minus(high.across[end]);
        let against = AGAINST.of(config.pretension);
        let wide = high.twice_stretch.minus(low.twice_stretch) > config.pretension;
        let is_there = |end: usize| end == 0 || config.fitted == Fitted::All;
        let is_against = |end: &usize| is_there(*end) && fell(*end) > against;
        let end = [0, 1].into_iter().find(is_against).filter(|_| wide);
        self.looks = if end.is_some() { self.looks.saturating_add(1) } else { 0 };
        end.filter(|_| self.looks >= LOOKS).map(|end| named(end, fell(end), against))
    }
}

/// The fault with its numbers.
#[cold]
#[inline(never)]
fn named(end: usize, fell: Tension, against: Tension) -> Detection {
    Detection::new(Fault::TensionSwapped, end, fell.to_f32(), against.to_f32())
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::vec::Vec;

    use super::*;
    use crate::parameters::Parameters;
    use crate::scale::Gain;
    use crate::tick_config;

    /// Pretension 30 N; `2 s` of a rad is 2000 N.
    fn config(fitted: Fitted) -> TensionConfig {
        let tension = tick_config(&Parameters::default()).unwrap().tension;
        TensionConfig { fitted, stretch: Gain::new(2000.0).unwrap(), ..tension }
    }

    /// Pretension and `mu K` of the joint of the paper.
    const PRETENSION_N: f64 = 30.0;
    const EXPONENT: f64 = 0.377;

    /// Two tendons under capstan friction by Eq. (2)-(3): tension in the middle of a cable moves with the stretch, an end slips where it is
    /// beyond `e^(mu K/2)` of it. `driven` is where the motion comes from, 1 for the motor and -1 for the joint.
    fn tensions(stretch_n: f64, rising: f64, driven: f64) -> [f64; 4] {
        let ends = |mean_n: f64, sign: f64| {
            let friction = (sign * EXPONENT / 2.0).tanh();
            [mean_n * (1.0 + friction), mean_n * (1.0 - friction)]
        };
        let [f1, f2] = ends(PRETENSION_N + stretch_n, driven * rising);
        let [f3, f4] = ends(PRETENSION_N - stretch_n, -driven * rising);
        [f1, f2, f3, f4]
    }

    /// Four turns of the stretch; where its channels are read as `order` says. Index and end of the detection.
    fn run(order: [usize; 4], fitted: Fitted, stretch_n: f64, driven: f64) -> Option<(usize, u8)> {
        let (mut watch, config) = (ChannelOrder::default(), config(fitted));
        (0..400).find_map(|n| {
            let phase_rad = n as f64 * core::f64::consts::TAU / 100.0;
            let (now_n, rising) = (stretch_n * libm::sin(phase_rad), libm::cos(phase_rad).signum());
            let all = tensions(now_n, rising, driven);
            let read = order.map(|channel| Tension::from_f32(all[channel] as f32));
            let lag = Angle::from_f32((now_n / 1000.0) as f32);
            watch.look(&config, read, lag).map(|found| {
                assert_eq!((found.fault, found.limit), (Fault::TensionSwapped, 7.5));
                assert!(found.got > 7.5, "{found:?}");
                (n, found.channel)
            })
        })
    }

    const RIGHT: [usize; 4] = [0, 1, 2, 3];

    #[test]
    fn channels_in_their_order_are_never_named() {
        for fitted in [Fitted::All, Fitted::Input, Fitted::Nothing] {
            for driven in [1.0, -1.0] {
                for stretch_n in [2.0, 10.0, 16.0, 22.0, 28.0] {
                    assert_eq!(
                        run(RIGHT, fitted, stretch_n, driven),
                        None,
                        "{fitted:?} {stretch_n} N {driven}"
                    );
                }
            }
        }
    }

    /// `2 s` has to change by 30 N: never at 7 N, and with 12 N on the way from 12 N to -12 N; 30 looks later.
    #[test]
    fn exchanged_channels_are_named_with_the_end_that_shows_it() {
        for (order, end) in [([2, 1, 0, 3], 0), ([0, 3, 2, 1], 1), ([3, 1, 2, 0], 1), ([0, 2, 1, 3], 1)] {
            assert_eq!(run(order, Fitted::All, 7.0, 1.0), None, "{order:?}");
            let (n, found) = run(order, Fitted::All, 12.0, 1.0).unwrap();
            assert!(found == end && (60..110).contains(&n), "{order:?}: {found} at {n}");
        }
        let (n, found) = run([2, 1, 0, 3], Fitted::Input, 12.0, 1.0).unwrap();
        assert!(found == 0 && (60..110).contains(&n), "{found} at {n}");
    }

    /// The table's last row.
    #[test]
    fn both_ends_of_a_cable_may_be_exchanged_unnoticed() {
        let unnoticed = |order| run(order, Fitted::All, 20.0, 1.0).is_none();
        let found: Vec<_> = [[1, 0, 2, 3], [0, 1, 3, 2]].into_iter().map(unnoticed).collect();
        assert_eq!(found, [true, true]);
    }

    /// Play of 0.03 rad lets the lag go on without the tensions: of 22 N that it tells 7 N are there. Where the motion turns, the ends at the joint keep
    /// their tensions until the friction has changed its sign.
    #[test]
    fn play_is_no_exchange() {
        let (mut watch, config) = (ChannelOrder::default(), config(Fitted::All));
        let largest_n = 2.0 * PRETENSION_N * libm::tanh(EXPONENT / 2.0);
        let (mut stretch_n, mut friction_n) = (0.0_f64, 0.0_f64);
        for n in 0..400 {
            let told_n = 22.0 * libm::sin(n as f64 * core::f64::consts::TAU / 100.0);
            let next_n = stretch_n.clamp(told_n - 15.0, told_n + 15.0);
            friction_n = (friction_n + 2.0 * (next_n - stretch_n)).clamp(-largest_n, largest_n);
            stretch_n = next_n;
            let across = [2.0 * stretch_n + friction_n, 2.0 * stretch_n - friction_n];
            let read = [across[0] / 2.0, across[1] / 2.0, -across[0] / 2.0, -across[1] / 2.0]
                .map(|tension_n| Tension::from_f32((PRETENSION_N + tension_n) as f32));
            let lag = Angle::from_f32((told_n / 1000.0) as f32);
            assert_eq!(watch.look(&config, read, lag), None, "{n}: {stretch_n} N, {friction_n} N");
        }
    }

    #[test]
    fn what_was_before_the_bridge_went_on_does_not_count() {
        let (mut watch, config) = (ChannelOrder::default(), config(Fitted::All));
        let at = |watch: &mut ChannelOrder, twice_n: f32, across_n: f32| {
            let read = [30.0 + across_n, 30.0, 30.0, 30.0].map(Tension::from_f32);
            watch.look(&config, read, Angle::from_f32(twice_n / 2000.0))
        };
        assert_eq!(at(&mut watch, 0.0, 20.0), None);
        watch.reset();
        assert_eq!(at(&mut watch, 40.0, 0.0), None);
        assert!((0..29).all(|_| at(&mut watch, 0.0, 20.0).is_none()));
        assert!(at(&mut watch, 0.0, 20.0).is_some());
        // A lag of 100 N is none that 30 N of pretension, 15 N of margin and friction bear.
        watch.reset();
        assert_eq!(at(&mut watch, 100.0, 0.0), None);
        assert!((0..100).all(|_| at(&mut watch, 0.0, 20.0).is_none()));
    }
}
