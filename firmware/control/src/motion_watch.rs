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
//! | tension restless | every mode, homing too | looks at which a channel had jumped since the tick before outweigh the others |
//!
//! A joint that follows its reference back into a range that was narrowed, or from where it rested, is no fault. Homing has no range. A
//! count of an encoder in 10 ms is 0.15 rad/s. A tension channel has the noise of its amplifier; at a standard deviation of one code it
//! repeats a code in two of five looks at most, so 30 in a row are one in 10¹¹.
//!
//! A jump is a change from one tick to the next beyond four standard deviations of a difference of two readings with the noise of
//! `supervisor.tension_noise`: white noise as large as the self test lets pass makes one in 16 000 looks. Each counts four up, each look
//! without one down, and 40 are a fault: noise of three times that size, 18 % of whose looks are jumps, is never named in the mean, of four times,
//! 32 %, after 0.7 s, and of eight times, 62 %, after 0.2 s. A tension itself changes by 2 N a tick in a blow of 5 ms that ends at its limit, and not for long.

use bowden_link::Fault;

use crate::detection::Detection;
use crate::scale::{Angle, Quantity, Tension};
use crate::sheath::Fitted;

/// Time between two looks, s.
pub const LOOK_S: f32 = 0.01;

/// Square of a change from one tick to the next that counts as a jump, over the largest variance of a reading: 4² of a variance twice as large.
const JUMP_SQUARE: u32 = 32;
/// What a jump counts, and what is a fault.
const JUMP: u8 = 4;
const JUMPS: u8 = 40;

/// What is allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionConfig {
    /// Ticks from one look to the next, at least 8.
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
    /// Codes in the tick before a look at one of them, and what its jumps count.
    before_raw: [u16; 4],
    jumps: [u8; 4],
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
    /// Whether the motor's current is beyond what its voltage makes, see [`crate::surplus_current`].
    Surplus,
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
        self.jumps = [0; 4];
    }

    /// Counts a tick; what it is to look at. One thing at a time, so that no tick is much longer than the others.
    #[inline]
    pub const fn turn(&mut self, config: &MotionConfig) -> Option<Turn> {
        if self.left == 0 {
            self.left = config.look_ticks;
        }
        self.left -= 1;
        // Nearly always.
        if self.left > 7 {
            // Two ticks behind a sample of the duty.
            return if self.left % 4 == 1 { Some(Turn::Surplus) } else { None };
        }
        Some(match self.left {
            7 => Turn::Order,
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

    /// Keeps the codes of the tick before the looks at the channels.
    #[inline]
    pub const fn remember(&mut self, tension_raw: &[u16; 4]) {
        self.before_raw = *tension_raw;
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

    /// A look at tension channel `n`, 0 to 3; `variance_raw` is the largest of each channel, codes², in 2⁻⁸.
    #[inline(never)]
    pub fn tension(
        &mut self,
        config: &MotionConfig,
        n: usize,
        tension_raw: &[u16; 4],
        tensions: &[Tension; 4],
        variance_raw: &[u32; 4],
    ) -> Option<Detection> {
        let n = n & 3;
        let change_raw = tension_raw[n].abs_diff(self.before_raw[n]);
        self.before_raw = *tension_raw;
        // A code has 12 bits, so its square fits with eight places; 2⁸/32 are 2³.
        if u32::from(change_raw) * u32::from(change_raw) * (256 / JUMP_SQUARE) > variance_raw[n] {
            self.jumps[n] = self.jumps[n].saturating_add(JUMP);
            if self.jumps[n] >= JUMPS && config.fitted.has(n) {
                return Some(restless(n, change_raw, variance_raw[n]));
            }
        } else {
            self.jumps[n] = self.jumps[n].saturating_sub(1);
        }
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

/// A channel that jumps about, with its last jump.
#[cold]
#[inline(never)]
fn restless(n: usize, change_raw: u16, variance_raw: u32) -> Detection {
    let limit_raw = libm::sqrtf(variance_raw as f32 * (JUMP_SQUARE as f32 / 256.0));
    Detection::new(Fault::TensionRestless, n, f32::from(change_raw), limit_raw)
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

    /// 200 codes²: four standard deviations of a difference are 80 codes.
    const VARIANCE_RAW: [u32; 4] = [200 << 8; 4];

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
        watch.remember(&tension_raw);
        let stuck =
            (0..4).filter_map(|n| watch.tension(config, n, &tension_raw, &tensions, &VARIANCE_RAW)).last();
        joint.or(stuck)
    }

    /// By hand: of ten ticks the first looks for a surplus of current, the third at the order of the channels, the next two at the motor, the sixth at the
    /// joint, the others behind it at f4 to f1; the third and the seventh take samples, two ticks before a look for a surplus at the tenth before the last.
    #[test]
    fn every_round_looks_at_each_once() {
        let mut watch = MotionWatch::default();
        let config = || MotionConfig { look_ticks: 10, ..CONFIG() };
        let round = [
            Some(Turn::Surplus),
            None,
            Some(Turn::Order),
            Some(Turn::Voltage),
            Some(Turn::Current),
            Some(Turn::Joint),
        ];
        let channels = [3, 2, 1, 0].map(|channel| Some(Turn::Tension(channel)));
        let expected = [&round[..], &channels].concat();
        for _ in 0..2 {
            let turns: Vec<_> = (0..10).map(|_| (watch.turn(&config()), watch.samples_now())).collect();
            let (turns, sampled): (Vec<_>, Vec<_>) = turns.into_iter().unzip();
            assert_eq!(turns, expected);
            let taken: Vec<_> = (0..10).filter(|n| sampled[*n]).collect();
            assert_eq!((taken.len(), taken), (usize::from(samples(10)), [2, 6].to_vec()));
        }
        watch.turn(&config());
        watch.reset();
        assert_eq!((0..6).map(|_| watch.turn(&config())).collect::<Vec<_>>(), round);
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

    /// Jumps of 100 codes at every look, limit 80: 4 each, so the tenth is named; at every third look, 4 less 2, the twentieth at the 58th look.
    #[test]
    fn a_channel_that_jumps_about_is_restless() {
        let run = |config: &MotionConfig, every: u16, jump_raw: u16| {
            let mut watch = MotionWatch::default();
            (0..200).find_map(|n| {
                watch.remember(&[1000 + n % 7; 4]);
                let jumped = if n % every == 0 { jump_raw } else { 0 };
                let tension_raw = [1000 + n % 7, 1000, 1000 + n % 7 + jumped, 1000 + n % 3];
                let tensions = [Tension::ZERO; 4];
                watch.tension(config, 2, &tension_raw, &tensions, &VARIANCE_RAW).map(|found| (n, found))
            })
        };
        let config = CONFIG();
        let named = Detection::new(Fault::TensionRestless, 2, 100.0, 80.0);
        assert_eq!(run(&config, 1, 100), Some((9, named)));
        assert_eq!(run(&config, 3, 100), Some((54, named)));
        // A jump in five looks, and changes that are no jumps.
        assert_eq!((run(&config, 5, 100), run(&config, 1, 80)), (None, None));
        let of_the_motor = MotionConfig { fitted: Fitted::Nothing, ..config };
        assert_eq!(run(&of_the_motor, 1, 100), None);
    }
}
