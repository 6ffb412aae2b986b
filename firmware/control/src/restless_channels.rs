//! Whether a tension channel jumps about: a loose contact, a shield that is open, an amplifier that oscillates.
//!
//! A jump is a change from one tick to the next beyond four standard deviations of a difference of two readings with the noise of
//! `supervisor.tension_noise`: white noise as large as the self test lets pass makes one in 16 000 looks. The channels have a look each in turn, 40 ms
//! apart. A jump counts four up, a look without one down, and 24 are a fault: noise of four times that size, 32 % of whose looks are jumps, is named after
//! 1.6 s in the mean, of eight times, 62 %, after 0.5 s. A tension itself changes by 2 N a tick in a blow of 5 ms that ends at its limit, and not for
//! long.

use bowden_link::Fault;

use crate::detection::Detection;
use crate::sheath::Fitted;

/// Square of a change that counts as a jump, over the largest variance of a reading: 4² of a variance twice as large.
const JUMP_SQUARE: u32 = 32;
/// What a jump counts, and what is a fault.
const JUMP: u8 = 4;
const JUMPS: u8 = 24;

/// State of the watch.
#[derive(Clone, Copy, Debug, Default)]
pub struct RestlessChannels {
    /// Channel of the next look, and its code in the tick before.
    next: u8,
    before_raw: u16,
    jumps: [u8; 4],
}

impl RestlessChannels {
    /// Forgets what was, for the time in which nothing drives the joint.
    pub const fn reset(&mut self) {
        self.jumps = [0; 4];
    }

    /// Keeps the code of the tick before a look.
    #[inline]
    pub fn remember(&mut self, tension_raw: &[u16; 4]) {
        self.before_raw = tension_raw[usize::from(self.next & 3)];
    }

    /// A look; `variance_raw` is the largest of each channel, codes², in 2⁻⁸.
    #[inline(never)]
    pub fn look(
        &mut self,
        fitted: Fitted,
        variance_raw: &[u32; 4],
        tension_raw: &[u16; 4],
    ) -> Option<Detection> {
        let n = usize::from(self.next & 3);
        self.next = self.next.wrapping_add(1);
        let change_raw = tension_raw[n].abs_diff(self.before_raw);
        let change = u32::from(change_raw);
        // A code has 12 bits, so its square fits with eight places; 2⁸/32 are 2³.
        if change * change * (256 / JUMP_SQUARE) <= variance_raw[n] {
            self.jumps[n] = self.jumps[n].saturating_sub(1);
            return None;
        }
        self.jumps[n] = self.jumps[n].saturating_add(JUMP);
        if self.jumps[n] < JUMPS { None } else { named(fitted, n, change_raw, variance_raw[n]) }
    }
}

/// The fault with the last jump, if the channel is there.
#[cold]
#[inline(never)]
fn named(fitted: Fitted, n: usize, change_raw: u16, variance_raw: u32) -> Option<Detection> {
    let limit_raw = libm::sqrtf(variance_raw as f32 * (JUMP_SQUARE as f32 / 256.0));
    fitted.has(n).then(|| Detection::new(Fault::TensionRestless, n, f32::from(change_raw), limit_raw))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 200 codes²: four standard deviations of a difference are 80 codes.
    const VARIANCE_RAW: [u32; 4] = [200 << 8; 4];

    /// Jumps of 100 codes at every look at f3, limit 80: 4 each, so the sixth is named, the 23rd look of all; at every third look, 4 less 2, the
    /// eleventh at its 31st look.
    #[test]
    fn a_channel_that_jumps_about_is_restless() {
        let run = |fitted: Fitted, every: u16, jump_raw: u16| {
            let mut watch = RestlessChannels::default();
            (0..800).find_map(|n| {
                watch.remember(&[1000 + n % 7; 4]);
                let jumped = if n / 4 % every == 0 { jump_raw } else { 0 };
                let tension_raw = [1000 + n % 7, 1000, 1000 + n % 7 + jumped, 1000 + n % 3];
                watch.look(fitted, &VARIANCE_RAW, &tension_raw).map(|found| (n, found))
            })
        };
        let named = Detection::new(Fault::TensionRestless, 2, 100.0, 80.0);
        assert_eq!(run(Fitted::All, 1, 100), Some((22, named)));
        assert_eq!(run(Fitted::Input, 3, 100), Some((122, named)));
        // A jump in five looks, and changes that are no jumps.
        assert_eq!((run(Fitted::All, 5, 100), run(Fitted::All, 1, 80)), (None, None));
        assert_eq!(run(Fitted::Nothing, 1, 100), None);
    }

    #[test]
    fn jumps_before_the_bridge_went_on_do_not_count() {
        let mut watch = RestlessChannels::default();
        let jump = |watch: &mut RestlessChannels| {
            watch.remember(&[1000; 4]);
            watch.look(Fitted::All, &VARIANCE_RAW, &[1000, 1200, 1000, 1000])
        };
        assert!((0..20).all(|_| jump(&mut watch).is_none()));
        watch.reset();
        assert!((0..20).all(|_| jump(&mut watch).is_none()));
        assert!((0..4).any(|_| jump(&mut watch).is_some()));
    }
}
