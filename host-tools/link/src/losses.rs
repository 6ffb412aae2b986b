//! What was lost between the control tick and the host, and where.

use bowden_link::Batch;

/// Steps back in the count of frames that are taken for a frame that came late or twice; more is a new count.
const LATE_FRAMES: u16 = 64;

/// Ticks back that are taken for a batch that came late or twice; more is a board that started again.
const LATE_TICKS: u32 = 10_000;

/// Counts what is missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Losses {
    /// Frames of the board that never came: gaps in [`bowden_link::Answer::sequence`].
    pub frames: u64,
    /// Frames that came with wrong bytes; they are missing as well.
    pub damaged_frames: u64,
    /// Samples between batches that never came: gaps in the count of ticks.
    pub samples: u64,
    /// Of these, samples that the board itself dropped because the link was too slow: its own counter.
    pub dropped_by_board: u64,
    /// Batches that came late or twice and were left out.
    pub late_batches: u64,
    last_frame: Option<u16>,
    clock: Option<Clock>,
    paused: bool,
}

/// Count of ticks that does not wrap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Clock {
    next: u64,
    board_lost: u32,
}

/// What a batch is in the order of ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Its first sample is the one of this tick, counted without wrapping.
    At(u64),
    /// It came late or twice.
    Late,
    /// The board started again.
    Restarted {
        /// The tick that would have come.
        expected: u32,
    },
}

impl Losses {
    /// Notes the number of a frame.
    pub fn frame(&mut self, sequence: u16) {
        let Some(last) = self.last_frame else {
            self.last_frame = Some(sequence);
            return;
        };
        let missing = sequence.wrapping_sub(last).wrapping_sub(1);
        let back = last.wrapping_sub(sequence);
        if back <= LATE_FRAMES {
            return;
        }
        self.last_frame = Some(sequence);
        if missing < u16::MAX / 2 {
            self.frames += u64::from(missing);
        }
    }

    /// Notes the ticks of a batch.
    pub fn batch(&mut self, batch: &Batch) -> Place {
        let first = batch.first_tick;
        let length = batch.samples.len() as u64;
        let paused = std::mem::take(&mut self.paused);
        let expected = self.clock.map_or(first, |clock| clock.next as u32);
        let back = expected.wrapping_sub(first);
        let missing = first.wrapping_sub(expected);
        let anew = paused && missing > u32::MAX / 2;
        let Some(clock) = self.clock.as_mut().filter(|_| !anew) else {
            self.clock = Some(Clock { next: u64::from(first) + length, board_lost: batch.lost });
            return Place::At(first.into());
        };
        if missing > u32::MAX / 2 {
            if back > LATE_TICKS {
                return Place::Restarted { expected };
            }
            self.late_batches += 1;
            return Place::Late;
        }
        let at = clock.next + u64::from(missing);
        if !paused {
            self.samples += u64::from(missing);
            self.dropped_by_board += u64::from(batch.lost.wrapping_sub(clock.board_lost));
        }
        *clock = Clock { next: at + length, board_lost: batch.lost };
        Place::At(at)
    }

    /// Counts so far, for a new connection to the same board: frames are numbered anew. So are ticks of a board that
    /// `restarted`. What comes first leaves a gap that is no loss of the link.
    #[must_use]
    pub fn carried(&self, restarted: bool) -> Self {
        let clock = self.clock.filter(|_| !restarted);
        Self { last_frame: None, clock, paused: true, ..*self }
    }

    /// Tick that is expected next, counted without wrapping; none before the first batch.
    pub fn next_tick(&self) -> Option<u64> {
        self.clock.map(|clock| clock.next)
    }

    /// Telemetry rests: up to the next batch nothing counts as lost. The count of ticks goes on without wrapping.
    pub fn pause(&mut self) {
        self.paused = true;
    }
}

#[cfg(test)]
mod tests {
    use bowden_link::Sample;

    use super::*;

    fn batch(first_tick: u32, samples: usize, lost: u32) -> Batch {
        let samples = std::iter::repeat_n(Sample::default(), samples).collect();
        Batch { first_tick, period_ns: 100_000, lost, samples }
    }

    #[test]
    fn gaps_are_counted_where_they_are() {
        let mut losses = Losses::default();
        assert_eq!(losses.batch(&batch(1000, 24, 5)), Place::At(1000));
        assert_eq!(losses.batch(&batch(1024, 24, 5)), Place::At(1024));
        // Ticks 1048 to 1057 are missing, three of them dropped by the board.
        assert_eq!(losses.batch(&batch(1058, 2, 8)), Place::At(1058));
        assert_eq!(losses.batch(&batch(1061, 2, 8)), Place::At(1061));
        assert_eq!((losses.samples, losses.dropped_by_board), (11, 3));
    }

    #[test]
    fn late_batches_are_left_out_and_a_restart_is_told() {
        let mut losses = Losses::default();
        losses.batch(&batch(50_000, 24, 0));
        assert_eq!(losses.batch(&batch(50_000, 24, 0)), Place::Late);
        assert_eq!(losses.batch(&batch(49_990, 24, 0)), Place::Late);
        assert_eq!(losses.batch(&batch(50_024, 24, 0)), Place::At(50_024));
        assert_eq!(losses.batch(&batch(3, 24, 0)), Place::Restarted { expected: 50_048 });
        assert_eq!((losses.late_batches, losses.samples), (2, 0));
    }

    #[test]
    fn the_count_of_ticks_goes_on_where_the_boards_wraps() {
        let mut losses = Losses::default();
        losses.batch(&batch(u32::MAX - 23, 24, 0));
        assert_eq!(losses.batch(&batch(1, 24, 0)), Place::At((1 << 32) + 1));
        assert_eq!(losses.samples, 1);
        // A pause is no loss and no step back in time; a board that started again meanwhile counts anew.
        losses.pause();
        assert_eq!(losses.batch(&batch(5000, 24, 9)), Place::At((1 << 32) + 5000));
        assert_eq!((losses.samples, losses.dropped_by_board), (1, 0));
        losses.pause();
        assert_eq!(losses.batch(&batch(40, 24, 0)), Place::At(40));
    }

    #[test]
    fn frames_are_counted_across_the_wrap_and_not_twice() {
        let mut losses = Losses::default();
        for sequence in [65_533, 65_534, 1, 1, 0, 2, 5] {
            losses.frame(sequence);
        }
        // 65535 and 0 before 1; 3 and 4 before 5; the late 0 and the second 1 count for nothing.
        assert_eq!(losses.frames, 4);
    }
}
