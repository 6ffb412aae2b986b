//! An encoder that stands while the other one moves: its frames are good and always the same.

use crate::scale::Angle;

use super::channel::EncoderConfig;

/// When an encoder counts as stuck.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StuckConfig {
    /// Turn of one encoder that the other one has to notice; far above the dead zone and the stretch of the tendons.
    pub travel: Angle,
    /// Counts within which an encoder stands.
    pub band_counts: u16,
    /// Ticks for which that has to be so, at least 1.
    pub ticks: u16,
}

/// State of the comparison: where the two were when both had last moved.
#[derive(Clone, Copy, Debug, Default)]
pub struct StuckWatch {
    anchor_counts: Option<[i32; 2]>,
    ticks: u16,
}

impl StuckWatch {
    /// Forgets what was, for the time in which nothing drives the joint.
    pub const fn reset(&mut self) {
        self.anchor_counts = None;
        self.ticks = 0;
    }

    /// Takes both positions, counts; returns the encoder that stands and how far the other one has moved.
    pub fn observe(
        &mut self,
        config: &StuckConfig,
        encoders: &[EncoderConfig; 2],
        counts: [i32; 2],
    ) -> Option<(u8, Angle)> {
        let anchor = *self.anchor_counts.get_or_insert(counts);
        let band = u32::from(config.band_counts);
        let stands = [0, 1].map(|n: usize| counts[n].abs_diff(anchor[n]) <= band);
        let moved = |n: usize| encoders[n].angle(counts[n]).minus(encoders[n].angle(anchor[n])).magnitude();
        let suspect = match stands {
            [false, false] => {
                self.anchor_counts = Some(counts);
                None
            }
            [true, true] => None,
            [true, false] => Some((0, moved(1))),
            [false, true] => Some((1, moved(0))),
        };
        let suspect = suspect.filter(|(_, travel)| *travel > config.travel);
        self.ticks = if suspect.is_some() { self.ticks.saturating_add(1) } else { 0 };
        suspect.filter(|_| self.ticks >= config.ticks)
    }
}
