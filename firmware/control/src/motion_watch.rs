//! Whether the joint moves as it may: speed, range, error of its angle, and tension channels that stand while others move.
//!
//! A look at each every 10 ms, while the bridge drives.
//!
//! | fault | in | found where |
//! |---|---|---|
//! | joint speed | every mode, homing too | the joint turned farther between two looks than its largest speed allows |
//! | joint range | position mode | the measured angle is beyond the range of the reference, and beyond the reference, by a margin |
//! | tracking error | position mode | at every look for a time, the angle was farther from the reference than it may be |
//! | tension stuck | every mode, homing too | at every look for a time, a channel had the same code, while another one moved |
//!
//! A joint that follows its reference back into a range that was narrowed, or from where it rested, is no fault. Homing has no range. A
//! count of an encoder in 10 ms is 0.15 rad/s. A tension channel has the noise of its amplifier; at a standard deviation of one code it
//! repeats a code in two of five looks at most, so 30 in a row are one in 10¹¹.

use bowden_link::Fault;

use crate::detection::Detection;
use crate::scale::{Angle, Quantity, Tension};
use crate::sheath::Fitted;

/// Time between two looks, s.
pub const LOOK_S: f32 = 0.01;

/// What is allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionConfig {
    /// Ticks from one look to the next, at least 13.
    pub look_ticks: u16,
    /// Largest turn of the joint between two looks.
    pub travel: Angle,
    /// Range of the reference in position mode, margin included.
    pub range: [Angle; 2],
    /// How far the measured angle may be beyond a reference that is out of that range.
    pub margin: Angle,
    /// Largest error of the angle in position mode.
    pub error: Angle,
    /// Looks for which it has to be there, at least 1.
    pub error_looks: u16,
    /// Change of one tension that another channel has to notice.
    pub tension_travel: Tension,
    /// Looks for which a channel has to stand, at least 1.
    pub tension_looks: u16,
    /// Tension channels that are there.
    pub fitted: Fitted,
}

/// A channel that may stand.
#[derive(Clone, Copy, Debug, Default)]
struct Standing {
    /// Looks since it had another code.
    looks: u16,
    code_raw: u16,
    /// All tensions at the first of them.
    tensions: [Tension; 4],
}

/// State of the watch.
#[derive(Clone, Copy, Debug, Default)]
pub struct MotionWatch {
    /// Ticks until the next round of looks.
    left: u16,
    /// Angle at the last look.
    theta_out: Option<Angle>,
    error_looks: u16,
    standing: [Standing; 4],
    /// Channels that were looked at, a bit each.
    begun: u8,
}

/// Samples of duty and current in a round of looks of this many ticks.
#[must_use]
pub const fn samples(look_ticks: u16) -> u16 {
    look_ticks / 4
}

/// What a tick looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// Back-EMF of the motor, see [`crate::surplus_current`].
    SurplusSpeed,
    /// Whether its current is beyond what its voltage makes.
    SurplusCurrent,
    /// Codes of the tension channels, to be kept for the next tick, see [`crate::restless_channels`].
    Remember,
    /// Their jumps since then.
    Jumps,
    /// Order of the tension channels, see [`crate::channel_order`].
    Order,
    /// Voltage of the motor since the last look, see [`crate::motor_circuit`].
    Voltage,
    /// Its current.
    Current,
    /// Angle of the joint.
    Joint,
    /// A tension channel, 0 to 3.
    Tension(usize),
}

impl MotionWatch {
    /// Forgets what was, for the time in which nothing drives the joint.
    pub const fn reset(&mut self) {
        self.left = 0;
        self.theta_out = None;
        self.begun = 0;
    }

    /// Counts a tick; what it is to look at. One thing at a time, so that no tick is much longer than the others.
    #[inline]
    pub const fn turn(&mut self, config: &MotionConfig) -> Option<Turn> {
        if self.left == 0 {
            self.left = config.look_ticks;
        }
        self.left -= 1;
        // Nearly always.
        if self.left > 11 {
            // Two and three ticks behind a sample of the duty.
            return match self.left % 4 {
                1 => Some(Turn::SurplusSpeed),
                0 => Some(Turn::SurplusCurrent),
                _ => None,
            };
        }
        Some(match self.left {
            11 => Turn::Remember,
            10 => Turn::Jumps,
            8 => Turn::Order,
            7 | 9 => return None,
            6 => Turn::Voltage,
            5 => Turn::Current,
            4 => Turn::Joint,
            channel => Turn::Tension(channel as usize),
        })
    }

    /// Whether this tick takes a sample of duty and current: every fourth does.
    #[inline]
    #[must_use]
    pub const fn samples_now(&self) -> bool {
        self.left % 4 == 3
    }

    /// A look at the joint: speed, and where it follows `reference`, range and error. The first fault.
    #[inline(never)]
    pub fn joint(
        &mut self,
        config: &MotionConfig,
        theta_out: Angle,
        reference: Option<Angle>,
    ) -> Option<Detection> {
        let Some(before) = self.theta_out.replace(theta_out) else {
            self.error_looks = 0;
            return None;
        };
        let turn = theta_out.minus(before);
        let mut fine = turn.is_at_most(config.travel);
        let mut beyond = Angle::ZERO;
        if let Some(reference) = reference {
            beyond = theta_out.minus(reference);
            if beyond.is_at_most(config.error) {
                self.error_looks = 0;
            } else {
                self.error_looks = self.error_looks.saturating_add(1);
            }
            fine &= theta_out.is_within(config.range[0], config.range[1])
                && self.error_looks < config.error_looks;
        }
        if fine { None } else { self.misses(config, theta_out, turn, reference.is_some(), beyond) }
    }

    /// What of it is wrong. An angle out of range may follow a reference back into it.
    #[cold]
    #[inline(never)]
    fn misses(
        &self,
        config: &MotionConfig,
        theta_out: Angle,
        turn: Angle,
        follows: bool,
        beyond: Angle,
    ) -> Option<Detection> {
        let [low, high] = config.range;
        let is_low = theta_out < low && beyond < config.margin.negated();
        let is_high = theta_out > high && beyond > config.margin;
        if !turn.is_at_most(config.travel) {
            let speed = |angle: Angle| angle.to_f32() * (1.0 / LOOK_S);
            Some(Detection::new(Fault::JointSpeed, 0, speed(turn.magnitude()), speed(config.travel)))
        } else if follows && (is_low || is_high) {
            let limit = if is_low { low } else { high };
            Some(Detection::new(Fault::JointRange, 0, theta_out.to_f32(), limit.to_f32()))
        } else if self.error_looks >= config.error_looks {
            let error = beyond.magnitude();
            Some(Detection::new(Fault::TrackingError, 0, error.to_f32(), config.error.to_f32()))
        } else {
            None
        }
    }

    /// A look at tension channel `n`, 0 to 3.
    #[inline(never)]
    pub fn tension(
        &mut self,
        config: &MotionConfig,
        n: usize,
        tension_raw: &[u16; 4],
        tensions: &[Tension; 4],
    ) -> Option<Detection> {
        let n = n & 3;
        let standing = &mut self.standing[n];
        let bit = 1 << n;
        if self.begun & bit == 0 || standing.code_raw != tension_raw[n] {
            self.begun |= bit;
            *standing = Standing { looks: 0, code_raw: tension_raw[n], tensions: *tensions };
            return None;
        }
        standing.looks = standing.looks.saturating_add(1);
        if standing.looks < config.tension_looks { None } else { self.stands(config, n, tensions) }
    }

    /// Whether another channel has moved while this one stood.
    #[cold]
    #[inline(never)]
    fn stands(&self, config: &MotionConfig, n: usize, tensions: &[Tension; 4]) -> Option<Detection> {
        let moved = |m: usize| tensions[m].minus(self.standing[n].tensions[m]).magnitude();
        let other = (0..4).find(|m| config.fitted.has(*m) && moved(*m) > config.tension_travel)?;
        let (got, limit) = (moved(other).to_f32(), config.tension_travel.to_f32());
        config.fitted.has(n).then(|| Detection::new(Fault::TensionStuck, n, got, limit))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::vec::Vec;

    use super::*;

    const CONFIG: fn() -> MotionConfig = || MotionConfig {
        look_ticks: 7,
        travel: Angle::from_f32(0.05),
        range: [-1.0, 1.0].map(Angle::from_f32),
        margin: Angle::from_f32(0.1),
        error: Angle::from_f32(0.2),
        error_looks: 4,
        tension_travel: Tension::from_f32(5.0),
        tension_looks: 10,
        fitted: Fitted::All,
    };

    /// A look at this angle and reference; codes and tensions of channels as given, 1 N a code.
    fn look(
        watch: &mut MotionWatch,
        config: &MotionConfig,
        theta_out_rad: f32,
        reference_rad: Option<f32>,
        tension_raw: [u16; 4],
    ) -> Option<Detection> {
        let tensions = tension_raw.map(|code_raw| Tension::from_f32(f32::from(code_raw)));
        let joint = watch.joint(config, Angle::from_f32(theta_out_rad), reference_rad.map(Angle::from_f32));
        let stuck = (0..4).filter_map(|n| watch.tension(config, n, &tension_raw, &tensions)).last();
        joint.or(stuck)
    }

    /// By hand: of 15 ticks the second and the third look for a surplus of current, two and three behind a sample; the fourth keeps
    /// the codes of the channels for the fifth, the seventh looks at their order, the ninth and the tenth at the motor, the eleventh at the joint, the others
    /// behind it at f4 to f1; the fourth, the eighth and the twelfth take samples.
    #[test]
    fn every_round_looks_at_each_once() {
        let mut watch = MotionWatch::default();
        let config = || MotionConfig { look_ticks: 15, ..CONFIG() };
        let surplus = [None, Some(Turn::SurplusSpeed), Some(Turn::SurplusCurrent)];
        let cables = [Some(Turn::Remember), Some(Turn::Jumps), None, Some(Turn::Order), None];
        let joint = [Some(Turn::Voltage), Some(Turn::Current), Some(Turn::Joint)];
        let round = [&surplus[..], &cables, &joint].concat();
        let channels = [3, 2, 1, 0].map(|channel| Some(Turn::Tension(channel)));
        let expected = [&round[..], &channels].concat();
        for _ in 0..2 {
            let turns: Vec<_> = (0..15).map(|_| (watch.turn(&config()), watch.samples_now())).collect();
            let (turns, sampled): (Vec<_>, Vec<_>) = turns.into_iter().unzip();
            assert_eq!(turns, expected);
            let taken: Vec<_> = (0..15).filter(|n| sampled[*n]).collect();
            assert_eq!((taken.len(), taken), (usize::from(samples(15)), [3, 7, 11].to_vec()));
        }
        watch.turn(&config());
        watch.reset();
        assert_eq!((0..11).map(|_| watch.turn(&config())).collect::<Vec<_>>(), round);
    }

    /// 0.05 rad in 10 ms are 5 rad/s.
    #[test]
    fn a_turn_beyond_the_largest_speed_is_found_either_way() {
        for sign in [1.0, -1.0] {
            let mut watch = MotionWatch::default();
            let mut at = |rad: f32| look(&mut watch, &CONFIG(), sign * rad, None, [30; 4]);
            assert_eq!((at(0.3), at(0.349)), (None, None));
            let found = at(0.409).unwrap();
            assert_eq!((found.fault, found.channel), (Fault::JointSpeed, 0));
            assert!((found.got - 6.0).abs() < 1e-3 && (found.limit - 5.0).abs() < 1e-3, "{found:?}");
        }
        // Where the bridge goes on nothing is known of the angle before.
        let mut watch = MotionWatch::default();
        look(&mut watch, &CONFIG(), 0.0, None, [30; 4]);
        watch.reset();
        assert_eq!(look(&mut watch, &CONFIG(), 0.9, None, [30; 4]), None);
    }

    #[test]
    fn an_angle_out_of_range_counts_in_position_mode() {
        for (angle_rad, limit) in [(1.02, 1.0), (-1.02, -1.0)] {
            let mut watch = MotionWatch::default();
            let mut at = |rad: f32, reference| look(&mut watch, &CONFIG(), rad, reference, [30; 4]);
            assert_eq!((at(angle_rad, None), at(angle_rad, None)), (None, None));
            let found = at(angle_rad, Some(0.0)).unwrap();
            assert_eq!((found.fault, found.limit), (Fault::JointRange, limit));
            assert!((found.got - angle_rad).abs() < 1e-5, "{found:?}");
            assert_eq!(at(angle_rad / 1.02, Some(0.9 * angle_rad)), None, "the range itself");
            // On the way back with its reference, a little behind it.
            assert_eq!(at(angle_rad, Some(0.95 * angle_rad)), None);
        }
    }

    #[test]
    fn an_error_counts_when_it_stays() {
        let mut watch = MotionWatch::default();
        let mut at = |reference| look(&mut watch, &CONFIG(), 0.1, reference, [30; 4]);
        assert_eq!(at(Some(0.4)), None);
        // Three looks and one without an error, then four.
        let looks = [0.4, 0.4, 0.4, 0.25, -0.2, 0.4, -0.2, 0.4].map(|reference| at(Some(reference)));
        assert_eq!(looks[..7], [None; 7]);
        let found = looks[7].unwrap();
        assert_eq!(found.fault, Fault::TrackingError);
        assert!((found.got - 0.3).abs() < 1e-5 && (found.limit - 0.2).abs() < 1e-5, "{found:?}");
    }

    #[test]
    fn a_channel_with_one_code_is_stuck_when_another_one_has_moved() {
        let run = |config: &MotionConfig, codes: fn(u16) -> [u16; 4]| {
            let mut watch = MotionWatch::default();
            (0..40).find_map(|n| look(&mut watch, config, 0.0, None, codes(n)).map(|found| (n, found)))
        };
        let config = CONFIG();
        // f3 stands, f1 and f2 move by a code a look, f4 to and fro: at the tenth look f1 has moved by 10 N.
        let (n, found) = run(&config, |n| [30 + n, 40 + n, 50, 30 + n % 2]).unwrap();
        assert_eq!((n, found), (10, Detection::new(Fault::TensionStuck, 2, 10.0, 5.0)));
        // Nothing moves farther than it may, all stand, and a channel that repeats its code and changes now and then.
        assert_eq!(run(&config, |n| [30 + n % 5, 40, 50, 30]), None);
        assert_eq!(run(&config, |_| [30, 40, 50, 60]), None);
        assert_eq!(run(&config, |n| [30 + n, 40 + n, 50 + n / 9 % 2, 30 + n]), None);
        // Channels that are not there stand.
        let of_the_motor = MotionConfig { fitted: Fitted::Input, ..config };
        assert_eq!(run(&of_the_motor, |n| [30 + n, 0, 90 - n, 0]), None);
        assert_eq!(
            run(&of_the_motor, |n| [30, n, 90 - n, 0]).map(|(n, found)| (n, found.channel)),
            Some((10, 0))
        );
    }
}
