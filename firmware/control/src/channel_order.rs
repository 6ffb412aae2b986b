//! Whether the four tensions differ from each other as friction and load have it: channels that are exchanged differ the other way.
//!
//! A cable that moves towards the motor is held back by its sheath, so its tension is higher at the motor, and higher at the joint while it moves
//! the other way, whatever drives the motion (Eq. (2)-(3)). With `F` the mean of both ends:
//!
//! ```text
//! F1 − F2 = 2 F tanh(mu K/2) sign ω,    F4 − F3 = 2 F tanh(mu K/2) sign ω
//! ```
//!
//! and with both cables together, `F0` the pretension, `F1 − F3 = F2 − F4 + 4 F0 tanh(mu K/2) sign ω`: while the pulley moves one way, what the
//! motor gives changes as what the joint takes. So four things are compared, from 0.0245 rad behind the last turn of the motion on, which is more than
//! the cables of the joint of the paper stretch before they slip anew:
//!
//! | difference | is | if not |
//! |---|---|---|
//! | means of `F1 − F2` while the pulley moves up and down | up above down | f1 and f2 are exchanged |
//! | means of `F4 − F3` | the same | f3 and f4; both cables: f1 and f3 |
//! | `F1 − F3` where it is highest and lowest on one way, half a pretension apart or more, and `F2 − F4` there | change together | f1 and f3, or f2 and f4 |
//!
//! Wrong by a quarter of the pretension for eight looks of 10 ms on one way and then for eight on the other is a fault: a channel that
//! begins to read something else shifts both. Zeros that are off fall out of the differences, and neither stiffness nor encoders' zeros are needed. The
//! first two tell nothing where `4 F tanh(mu K/2)` is less than that, the third nothing where the load does not change. Channels exchanged crosswise,
//! f1 with f4 or f2 with f3, are found by chance only: `bowden calibrate` finds them.

use bowden_link::Fault;

use crate::detection::Detection;
use crate::scale::{Angle, Quantity, Tension};
use crate::sheath::Fitted;
use crate::tension::TensionConfig;

/// Part of the pretension by which a difference may have the wrong sign: 2⁻².
const AGAINST_PLACES: u32 = 2;
/// Part of it by which `F1 − F3` has to change: 2⁻¹.
const SPAN_PLACES: u32 = 1;
/// Half the way behind a turn that does not count, 2⁻²⁰ rad: eight counts of an encoder, 0.0123 rad.
const HALF_TURN_BITS: i32 = 12_868;
/// Part of a mean that a look renews: 2⁻³.
const RENEWED_PLACES: u32 = 3;
/// Looks that a mean has to have, and for which an extreme has to be wrong.
const LOOKS: u8 = 8;

/// Numbers of the pairs in the record.
const AT_THE_MOTOR: usize = 0;
const AT_THE_JOINT: usize = 1;
const CABLE_A: usize = 2;
const CABLE_B: usize = 3;

/// `F1 − F3` and `F2 − F4`.
type Across = [Tension; 2];

/// `2^-places` of a tension, rounded down.
#[inline]
fn part(tension: Tension, places: u32) -> Tension {
    Tension::from_bits(tension.to_bits() >> places)
}

/// What was seen while the pulley moved one way.
#[derive(Clone, Copy, Debug, Default)]
struct Way {
    /// Means of `F1 − F2` and of `F4 − F3`.
    along: [Tension; 2],
    looks: u8,
    /// Where `F1 − F3` was lowest and highest.
    extremes: [Across; 2],
    wrong_looks: u8,
}

impl Way {
    /// Takes a look.
    fn add(&mut self, along: [Tension; 2], across: Across) {
        if self.looks == 0 {
            (self.along, self.extremes) = (along, [across; 2]);
        }
        for (mean, now) in self.along.iter_mut().zip(along) {
            *mean = mean.plus(part(now.minus(*mean), RENEWED_PLACES));
        }
        let [low, high] = &mut self.extremes;
        if across[0] < low[0] {
            *low = across;
        } else if across[0] > high[0] {
            *high = across;
        }
        self.looks = self.looks.saturating_add(1);
    }

    /// By how much `F2 − F4` falls where `F1 − F3` rises by more than `span`.
    fn falls(&self, span: Tension) -> Tension {
        let [low, high] = self.extremes;
        if high[0].minus(low[0]) > span { low[1].minus(high[1]) } else { Tension::ZERO }
    }
}

/// State of the watch.
#[derive(Clone, Copy, Debug, Default)]
pub struct ChannelOrder {
    /// Angle that follows the input pulley at half the way of a turn; none before the bridge goes on.
    follower: Option<Angle>,
    /// Up and down.
    ways: [Way; 2],
}

impl ChannelOrder {
    /// Forgets what was, for the time in which nothing drives the joint.
    pub fn reset(&mut self) {
        self.follower = None;
        for way in &mut self.ways {
            // The first look begins everything else anew.
            (way.looks, way.wrong_looks) = (0, 0);
        }
    }

    /// A look at the tensions behind their low-pass.
    #[inline(never)]
    pub fn look(
        &mut self,
        config: &TensionConfig,
        tensions: [Tension; 4],
        theta_in: Angle,
    ) -> Option<Detection> {
        let follower = self.follower.get_or_insert(theta_in);
        let ahead = theta_in.minus(*follower);
        let within = ahead.limited(Angle::from_bits(HALF_TURN_BITS));
        if config.fitted != Fitted::All || within == ahead {
            return None;
        }
        *follower = theta_in.minus(within);
        let [f1, f2, f3, f4] = tensions;
        let against = part(config.pretension, AGAINST_PLACES);
        let is_down = ahead < Angle::ZERO;
        let way = &mut self.ways[usize::from(is_down)];
        way.add([f1.minus(f2), f4.minus(f3)], [f1.minus(f3), f2.minus(f4)]);
        let falls = way.falls(part(config.pretension, SPAN_PLACES));
        let [up, down] = &mut self.ways;
        let has_both = up.looks.min(down.looks) >= LOOKS;
        let wrong = [0, 1].map(|cable: usize| down.along[cable].minus(up.along[cable]));
        // Nearly always.
        if falls <= against && !(has_both && (wrong[0] > against || wrong[1] > against)) {
            (up.wrong_looks, down.wrong_looks) = (0, 0);
            return None;
        }
        let way = if is_down { down } else { up };
        way.wrong_looks = way.wrong_looks.saturating_add(1);
        let [up, down] = &self.ways;
        if up.wrong_looks.min(down.wrong_looks) < LOOKS {
            return None;
        }
        Some(named(has_both, wrong, falls, against))
    }
}

/// The fault with its numbers: which pair it is, by what is wrong along the cables, if there are means of both ways, and at the joint.
#[cold]
#[inline(never)]
fn named(has_both: bool, wrong: [Tension; 2], falls: Tension, against: Tension) -> Detection {
    let (pair, got) = match wrong.map(|by| has_both && by > against) {
        [true, true] => (AT_THE_MOTOR, wrong[0]),
        [true, false] => (CABLE_A, wrong[0]),
        [false, true] => (CABLE_B, wrong[1]),
        [false, false] => (AT_THE_JOINT, falls),
    };
    Detection::new(Fault::TensionSwapped, pair, got.to_f32(), against.to_f32())
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::parameters::Parameters;
    use crate::tick_config;

    fn config(fitted: Fitted) -> TensionConfig {
        let tension = tick_config(&Parameters::default()).unwrap().tension;
        TensionConfig { fitted, ..tension }
    }

    /// A joint that swings, and what its tensions are by Eq. (2)-(3).
    #[derive(Clone, Copy)]
    struct Joint {
        exponent: f64,
        swing_rad: f64,
        /// What the joint takes at the end of the swing, `F2 − F4`.
        load_n: f64,
        /// Zeros of f1 and f4 are off by this.
        zero_n: f64,
    }

    const JOINT: Joint = Joint { exponent: 0.377, swing_rad: 0.3, load_n: 14.0, zero_n: 3.0 };
    const RIGHT: [usize; 4] = [0, 1, 2, 3];

    impl Joint {
        /// Four swings of 100 looks; channels are read as `order` says. Look and pair of the detection.
        fn run(self, order: [usize; 4], fitted: Fitted) -> Option<(usize, u8)> {
            let (mut watch, config) = (ChannelOrder::default(), config(fitted));
            (0..400).find_map(|n| {
                let phase_rad = n as f64 * core::f64::consts::TAU / 100.0;
                let (angle_rad, sign) =
                    (self.swing_rad * libm::sin(phase_rad), libm::cos(phase_rad).signum());
                let friction = libm::tanh(self.exponent / 2.0) * sign;
                // Means of both cables: F2 − F4 = 2 s − 2 F0 friction.
                let stretch_n = 0.5 * self.load_n * libm::sin(phase_rad) + 30.0 * friction;
                let [a, b] = [30.0 + stretch_n, 30.0 - stretch_n];
                let all = [
                    a * (1.0 + friction) + self.zero_n,
                    a * (1.0 - friction),
                    b * (1.0 - friction),
                    b * (1.0 + friction) + self.zero_n,
                ];
                let read = order.map(|channel| Tension::from_f32(all[channel] as f32));
                watch.look(&config, read, Angle::from_f32(angle_rad as f32)).map(|found| {
                    assert_eq!((found.fault, found.limit), (Fault::TensionSwapped, 7.5));
                    assert!(found.got > 7.5, "{found:?}");
                    (n, found.channel)
                })
            })
        }
    }

    #[test]
    fn channels_in_their_order_are_never_named() {
        for fitted in [Fitted::All, Fitted::Input, Fitted::Nothing] {
            for exponent in [0.0, 0.05, 0.377, 0.8] {
                for swing_rad in [0.003, 0.03, 0.3] {
                    for load_n in [-14.0, 0.0, 5.0, 14.0] {
                        let joint = Joint { exponent, swing_rad, load_n, ..JOINT };
                        assert_eq!(joint.run(RIGHT, fitted), None, "{exponent} {swing_rad} rad {load_n} N");
                    }
                }
            }
        }
    }

    /// Up to the 25th look the joint moves up, then down to the 75th: eight looks of each, from 0.0245 rad behind the turn on, which is 6.5 looks, and eight
    /// more up.
    #[test]
    fn exchanged_ends_of_a_cable_are_named() {
        for (order, pair) in [([1, 0, 2, 3], 2), ([0, 1, 3, 2], 3)] {
            for exponent in [0.2, 0.377, 0.8] {
                let joint = Joint { exponent, zero_n: 0.0, ..JOINT };
                let (n, found) = joint.run(order, Fitted::All).unwrap();
                assert!(found == pair && (75..=115).contains(&n), "{order:?}, {exponent}: {found} at {n}");
            }
            assert_eq!(JOINT.run(order, Fitted::Input), None);
            // Nothing slips, so nothing is told.
            assert_eq!(Joint { swing_rad: 0.01, ..JOINT }.run(order, Fitted::All), None);
        }
    }

    /// At the motor both cables contradict the motion. At the joint what it takes falls where it rises, 28 N on the way from -0.3 to 0.3 rad; it tells
    /// nothing where the load is the same everywhere.
    #[test]
    fn exchanged_cables_are_named_with_the_end() {
        let (n, found) = JOINT.run([2, 1, 0, 3], Fitted::All).unwrap();
        assert!(found == 0 && (75..=115).contains(&n), "{found} at {n}");
        let (n, found) = JOINT.run([0, 3, 2, 1], Fitted::All).unwrap();
        assert!(found == 1 && (75..=165).contains(&n), "{found} at {n}");
        assert_eq!(Joint { load_n: 5.0, ..JOINT }.run([0, 3, 2, 1], Fitted::All), None);
    }

    /// f1 reads 36 N more from the 40th look on, on the way down, where friction makes 11 N between the ends.
    #[test]
    fn a_channel_that_begins_to_read_more_is_no_exchange() {
        let (mut watch, config) = (ChannelOrder::default(), config(Fitted::All));
        for n in 0..400 {
            let phase_rad = f64::from(n) * core::f64::consts::TAU / 100.0;
            let (angle_rad, sign) = (0.3 * libm::sin(phase_rad), libm::cos(phase_rad).signum());
            let more_n = if n < 40 { 0.0 } else { 36.0 };
            let read = [30.0 + 5.5 * sign + more_n, 30.0 - 5.5 * sign, 30.0 - 5.5 * sign, 30.0 + 5.5 * sign]
                .map(|tension_n| Tension::from_f32(tension_n as f32));
            assert_eq!(watch.look(&config, read, Angle::from_f32(angle_rad as f32)), None, "{n}");
        }
    }

    #[test]
    fn what_was_before_the_bridge_went_on_does_not_count() {
        let (mut watch, config) = (ChannelOrder::default(), config(Fitted::All));
        let way = |watch: &mut ChannelOrder, from_rad: f32, to_rad: f32, across_n: f32| {
            (0..20).find_map(|n| {
                let angle_rad = from_rad + (to_rad - from_rad) * n as f32 / 19.0;
                let read = [30.0 + across_n, 30.0, 30.0, 30.0].map(Tension::from_f32);
                watch.look(&config, read, Angle::from_f32(angle_rad))
            })
        };
        assert_eq!(way(&mut watch, 0.0, 0.3, -20.0), None);
        watch.reset();
        assert_eq!(way(&mut watch, 0.3, 0.0, 20.0), None);
        assert_eq!(way(&mut watch, 0.0, 0.3, -20.0), None);
        assert!(way(&mut watch, 0.3, 0.0, 20.0).is_some());
    }
}
