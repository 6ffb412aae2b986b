//! A look at all channels of the board with the bridge off: mean, spread, drift.

use std::ops::ControlFlow;

use bowden_link::Sample;

use super::Trouble;
use crate::session::{RunEnd, Session, Stop};

/// Length of a look, s: 25 periods of 50 Hz, 30 of 60 Hz.
pub(super) const LOOK_S: f64 = 0.5;

/// Time of telemetry that is passed over first, s: what was under way before the person said Enter.
const STALE_S: f64 = 0.05;

/// Length of a block of a watch, s.
const BLOCK_S: f64 = 0.01;

/// Blocks in a row for which a change has to be there.
const HELD_BLOCKS: usize = 20;

/// How long a change is waited for, s.
pub(super) const PATIENCE_S: f64 = 20.0;

/// What one channel did in a look, in its raw unit: codes or counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Channel {
    first: i64,
    count: [i64; 2],
    sum: [i64; 2],
    squares: i64,
    lowest: i64,
    highest: i64,
}

impl Channel {
    /// Takes a value into the first or second half.
    fn take(&mut self, value: i64, half: usize) {
        if self.samples() == 0 {
            self.first = value;
            (self.lowest, self.highest) = (value, value);
        }
        let off = value - self.first;
        self.count[half] += 1;
        self.sum[half] += off;
        self.squares += off * off;
        self.lowest = self.lowest.min(value);
        self.highest = self.highest.max(value);
    }

    /// Number of samples.
    pub(super) fn samples(&self) -> u64 {
        self.count.iter().sum::<i64>() as u64
    }

    /// Mean.
    pub(super) fn mean(&self) -> f64 {
        self.first as f64 + self.sum.iter().sum::<i64>() as f64 / (self.samples().max(1) as f64)
    }

    /// Standard deviation of a sample.
    pub(super) fn spread(&self) -> f64 {
        let count = self.samples() as f64;
        let sum = self.sum.iter().sum::<i64>() as f64;
        ((self.squares as f64 - sum * sum / count.max(1.0)).max(0.0) / (count - 1.0).max(1.0)).sqrt()
    }

    /// Mean of the second half less that of the first.
    pub(super) fn drift(&self) -> f64 {
        let half = |half: usize| self.sum[half] as f64 / (self.count[half].max(1) as f64);
        half(1) - half(0)
    }

    /// Largest less smallest value.
    pub(super) fn range(&self) -> i64 {
        self.highest - self.lowest
    }
}

/// All channels.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Look {
    /// Codes of f1 to f4.
    pub tension: [Channel; 4],
    /// Code of the motor current.
    pub current: Channel,
    /// Code of the bus voltage.
    pub bus: Channel,
    /// Counts of the encoders at input pulley and joint.
    pub encoder: [Channel; 2],
}

impl Look {
    fn take(&mut self, sample: &Sample, half: usize) {
        for (channel, code) in self.tension.iter_mut().zip(sample.tension_raw) {
            channel.take(code.into(), half);
        }
        self.current.take(sample.current_raw.into(), half);
        self.bus.take(sample.bus_raw.into(), half);
        for (channel, count) in self.encoder.iter_mut().zip(sample.encoder_count_raw) {
            channel.take(count.into(), half);
        }
    }

    /// Looks for [`LOOK_S`].
    pub(super) fn new(session: &mut Session, stop: Stop) -> Result<Self, Trouble> {
        let mut look = Self::default();
        let mut begun = None;
        observe(session, stop, &mut |time_s, sample| {
            let passed_s = time_s - *begun.get_or_insert(time_s);
            // Half a nanosecond is below every control period.
            if passed_s >= LOOK_S - 5e-10 {
                return ControlFlow::Break(());
            }
            look.take(sample, usize::from(passed_s >= LOOK_S / 2.0));
            ControlFlow::Continue(())
        })?;
        Ok(look)
    }

    /// Means of f1 to f4 and both encoders.
    fn means(&self) -> [f64; 6] {
        let [f1, f2, f3, f4] = self.tension.map(|channel| channel.mean());
        let [input, joint] = self.encoder.map(|channel| channel.mean());
        [f1, f2, f3, f4, input, joint]
    }
}

/// Changes of f1 to f4, codes, and of both encoders, counts, since a look.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Change {
    /// Codes of f1 to f4.
    pub tension: [f64; 4],
    /// Counts of the encoders at input pulley and joint.
    pub encoder: [f64; 2],
}

/// Waits until `enough` holds for [`HELD_BLOCKS`] in a row, and returns the mean change over them; none if that does not happen
/// within [`PATIENCE_S`].
pub(super) fn wait_for(
    session: &mut Session,
    stop: Stop,
    before: &Look,
    enough: impl Fn(&Change) -> bool,
) -> Result<Option<Change>, Trouble> {
    let rest = before.means();
    let mut block = ([0.0; 6], 0.0);
    let mut held: Vec<[f64; 6]> = Vec::new();
    let mut times = None;
    observe(session, stop, &mut |time_s, sample| {
        let (begun_s, block_s) = times.get_or_insert((time_s, time_s));
        let tension = sample.tension_raw.map(f64::from);
        let encoder = sample.encoder_count_raw.map(f64::from);
        for (sum, value) in block.0.iter_mut().zip(tension.into_iter().chain(encoder)) {
            *sum += value;
        }
        block.1 += 1.0;
        if time_s - *block_s >= BLOCK_S {
            *block_s = time_s;
            let change = std::array::from_fn(|place| block.0[place] / block.1 - rest[place]);
            block = ([0.0; 6], 0.0);
            if enough(&change_of(change)) {
                held.push(change);
            } else {
                held.clear();
            }
        }
        if held.len() >= HELD_BLOCKS || time_s - *begun_s >= PATIENCE_S {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })?;
    if held.len() < HELD_BLOCKS {
        return Ok(None);
    }
    let mean = |place: usize| held.iter().map(|change| change[place]).sum::<f64>() / held.len() as f64;
    Ok(Some(change_of(std::array::from_fn(mean))))
}

fn change_of([f1, f2, f3, f4, input, joint]: [f64; 6]) -> Change {
    Change { tension: [f1, f2, f3, f4], encoder: [input, joint] }
}

/// Gives the time of every tick, s, and its signals to `sink` until it breaks; the first [`STALE_S`] are left out.
fn observe(
    session: &mut Session,
    stop: Stop,
    sink: &mut dyn FnMut(f64, &Sample) -> ControlFlow<()>,
) -> Result<(), Trouble> {
    let mut begun = None;
    let end = session.observe(stop, &mut |tick| {
        let time_s = tick.tick as f64 * f64::from(tick.period_ns) * 1e-9;
        if time_s - *begun.get_or_insert(time_s) < STALE_S {
            return ControlFlow::Continue(());
        }
        sink(time_s, &tick.sample)
    })?;
    match end {
        RunEnd::Interrupted => Err(Trouble::Stopped),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_spread_and_drift_are_those_of_the_textbook() {
        // 2 4 4 4 | 5 5 7 9: mean 5, squares of deviations 32, over n − 1 = 7; halves 3.5 and 6.5.
        let mut channel = Channel::default();
        for (place, value) in [2, 4, 4, 4, 5, 5, 7, 9].into_iter().enumerate() {
            channel.take(value, place / 4);
        }
        assert_eq!((channel.mean(), channel.drift(), channel.range(), channel.samples()), (5.0, 3.0, 7, 8));
        assert!((channel.spread() - (32.0_f64 / 7.0).sqrt()).abs() < 1e-12);
        assert_eq!((Channel::default().mean(), Channel::default().spread()), (0.0, 0.0));
    }
}
