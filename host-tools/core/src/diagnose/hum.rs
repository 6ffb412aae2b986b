//! Hum: oscillations of single sensors that are faster than the blocks of a fit resolve, such as the mains on an amplifier.
//!
//! A fit compares means over 50 ms, which average such an oscillation away, and of the rest only how strong it is. Here what is
//! left of every channel is searched sample by sample: a line in its spectrum (Fourier transform of a part of the training samples of
//! the longest recording), then amplitude and phase by linear least squares over the bench's clock, confirmed on the other training
//! samples, fitted once more to both, and judged on what is held out.

use std::f64::consts::TAU;

use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Target};
use bowden_model::law;
use nalgebra::{Matrix2, Vector2};
use realfft::RealFftPlanner;

use super::stated_laws::stated;
use super::unexplained::shape::{Rows, best_rate};
use super::verdict::FoundLaw;
use crate::fit::objective::{Block, Objective, Part, Series};
use crate::simulation::Prediction;

/// Lowest frequency, Hz: slower swings show in the means over 10 ms that other searches use.
const LOWEST_HZ: f64 = 45.0;

/// Highest frequency, over the sampling rate.
const HIGHEST: f64 = 0.49;

/// Chance of calling white noise a line, over all channels of a bench.
const FALSE_ALARM: f64 = 1e-6;

/// Frequencies either side among which the floor of the spectrum is taken.
const FLOOR_BINS: usize = 100;

/// Root mean square of a line, over the noise of its channel, below which it is no more than what any amplifier has.
const LEAST_OVER_NOISE: f64 = 0.5;

/// Part of its power that a line has to take off samples that it was not fitted to.
const CONFIRMED: f64 = 0.5;

/// Cosine of the angle between two channels beyond which they swing together.
const TOGETHER: f64 = 0.5;

/// A line of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hum {
    /// The law that says it, with its channel.
    pub law: ActiveEffect,
    /// Standard deviations of its coefficients.
    pub stds: [f64; 3],
    channel: Channel,
    /// Of sine and cosine over the bench's clock.
    amplitudes: [f64; 2],
    /// Part that it takes off the mean square of the training samples.
    taken_off: f64,
}

impl Hum {
    /// Mean square of what is left of the channel on held-out samples without and with it, in its unit squared. `predictions` are those of
    /// a model without it.
    pub(super) fn heldout(&self, objective: &Objective, predictions: &[Prediction]) -> [f64; 2] {
        let is_heldout = |block: &Block| block.part == Part::HeldOut;
        let recordings = 0..objective.recordings();
        let judging: Vec<BlockSamples> = recordings
            .flat_map(|recording| {
                BlockSamples::of(objective, predictions, self.channel, recording, is_heldout)
            })
            .collect();
        let rate = TAU * self.law.parameters[1];
        [left(&judging), rest(&judging, rate, self.amplitudes)]
    }

    /// What a diagnosis says of it.
    pub(super) fn stated(&self, heldout: [f64; 2]) -> Option<FoundLaw> {
        let law = law::of(&self.law)?;
        Some(stated(law, &self.law, heldout, self.taken_off, &self.stds.map(Some)))
    }
}

/// A line as it was found, before it is known whose it is.
#[derive(Clone, Copy, Debug)]
struct Line {
    channel: Channel,
    frequency_hz: f64,
    /// Of sine and cosine over the bench's clock.
    amplitudes: [f64; 2],
    /// Standard deviation of the samples it was fitted to, about it.
    noise: f64,
    samples: f64,
    span_s: f64,
    /// Power that it takes off training samples to which it was not fitted, over its own.
    confirmed: f64,
    /// Part that it takes off the mean square of those to which it was fitted.
    taken_off: f64,
}

/// Lines of sensors, loudest over its noise first. What swings in an angle, or in several channels otherwise than together, is a motion of
/// the joint and no sensor's.
pub(super) fn hums(objective: &Objective, predictions: &[Prediction]) -> Vec<Hum> {
    let channels = || objective.scales().iter().filter_map(|(series, _)| channel_of(*series));
    let count = channels().count();
    let lines: Vec<Line> =
        channels().filter_map(|channel| line(objective, predictions, channel, count)).collect();
    let is_sensors = |line: &&Line| {
        lines.iter().filter(|other| other.channel != line.channel && line.is_at(other)).all(|other| {
            Channel::TENSIONS.contains(&other.channel)
                && Channel::TENSIONS.contains(&line.channel)
                && line.together(other) > TOGETHER
        })
    };
    let mut found: Vec<&Line> = lines
        .iter()
        .filter(|line| !line.channel.is_angle() && line.is_loud(objective) && line.is_confirmed())
        .filter(is_sensors)
        .collect();
    found.sort_by(|a, b| (b.amplitude() / b.noise).total_cmp(&(a.amplitude() / a.noise)));
    found.into_iter().filter_map(Line::hum).collect()
}

const fn channel_of(series: Series) -> Option<Channel> {
    match series {
        Series::Channel(channel) => Some(channel),
        Series::Guide => None,
    }
}

/// Samples of one block of a channel.
struct BlockSamples {
    first: usize,
    clock_s: Vec<f64>,
    /// What is left, about its mean: what is slower than a block is no hum.
    left: Vec<f64>,
}

impl BlockSamples {
    /// Those of one recording, block by block.
    fn of(
        objective: &Objective,
        predictions: &[Prediction],
        channel: Channel,
        recording: usize,
        is_one: impl Fn(&Block) -> bool,
    ) -> Vec<Self> {
        let Some(measured) = objective.measured(recording, Series::Channel(channel)) else {
            return Vec::new();
        };
        let Some(predicted) = predictions[recording].channel(channel) else { return Vec::new() };
        let input = objective.input(recording);
        let offset_s = input.clock_s()[0] - input.t_s()[0];
        let blocks = objective.blocks(recording).iter().filter(|block| is_one(block));
        let samples = blocks.map(|block| {
            let samples = block.start..block.end;
            let left = samples.clone().map(|k| measured[k] - predicted[k]).collect();
            let clock_s = samples.map(|k| offset_s + input.t_s()[k]).collect();
            Self { first: block.start, clock_s, left: about_mean(left) }
        });
        samples.collect()
    }

    /// Sine and cosine at the samples, about their means as the samples are.
    fn waves(&self, rate: f64) -> impl Iterator<Item = (f64, f64)> {
        let wave = |of: fn(f64) -> f64| {
            about_mean(self.clock_s.iter().map(|clock_s| of(rate * clock_s)).collect()).into_iter()
        };
        wave(f64::sin).zip(wave(f64::cos))
    }

    /// What a line leaves.
    fn rest(&self, rate: f64, [sine, cosine]: [f64; 2]) -> impl Iterator<Item = f64> {
        let shown = self.waves(rate).map(move |(sin, cos)| sine * sin + cosine * cos);
        shown.zip(&self.left).map(|(shown, left)| left - shown)
    }
}

fn about_mean(mut values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    for value in &mut values {
        *value -= mean;
    }
    values
}

fn mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    sum / f64::max(count, 1.0)
}

/// The clearest line of a channel, if it is one.
fn line(
    objective: &Objective,
    predictions: &[Prediction],
    channel: Channel,
    channels: usize,
) -> Option<Line> {
    let recordings = 0..objective.recordings();
    let is_trained = |block: &Block| block.part == Part::Training;
    let of = |recording, confirms: bool| {
        BlockSamples::of(objective, predictions, channel, recording, |block| {
            is_trained(block) && block.confirms() == confirms
        })
    };
    let count = |samples: &[BlockSamples]| samples.iter().map(|block| block.left.len()).sum::<usize>();
    let trained = |recording: &usize| -> usize {
        let blocks = objective.blocks(*recording).iter().filter(|block| is_trained(block));
        blocks.map(|block| block.end - block.start).sum()
    };
    let measured = |recording: &usize| objective.measured(*recording, Series::Channel(channel)).is_some();
    let longest = recordings.clone().filter(measured).max_by_key(trained)?;
    let mut fitted_to = of(longest, false);
    let t_s = objective.input(longest).t_s();
    let span_s = t_s[t_s.len() - 1] - t_s[0];
    let rate_hz = (t_s.len() - 1) as f64 / span_s;
    let rough_hz = peak_hz(&fitted_to, t_s.len(), rate_hz, channels)?;
    let beside = TAU / span_s;
    let in_phase = |blocks: &[BlockSamples]| {
        let table = Rows {
            x: blocks.iter().flat_map(|block| &block.clock_s).copied().collect(),
            values: blocks.iter().flat_map(|block| &block.left).copied().collect(),
            weights: vec![1.0; count(blocks)],
        };
        let rate = best_rate(&table, (TAU * rough_hz - beside, TAU * rough_hz + beside), 0.1 * beside)?;
        Some((rate, fitted(blocks, rate)?))
    };
    let (rate, amplitudes) = in_phase(&fitted_to)?;
    let confirming: Vec<BlockSamples> = recordings.flat_map(|recording| of(recording, true)).collect();
    let taken_off = left(&confirming) - rest(&confirming, rate, amplitudes);
    let [sine, cosine] = amplitudes;
    let confirmed = taken_off / (0.5 * (sine * sine + cosine * cosine));
    fitted_to.extend(of(longest, true));
    let (rate, amplitudes) = in_phase(&fitted_to)?;
    Some(Line {
        channel,
        frequency_hz: rate / TAU,
        amplitudes,
        taken_off: 1.0 - rest(&fitted_to, rate, amplitudes) / left(&fitted_to),
        noise: rest(&fitted_to, rate, amplitudes).sqrt(),
        samples: count(&fitted_to) as f64,
        span_s,
        confirmed,
    })
}

/// Mean square of what is left.
fn left(blocks: &[BlockSamples]) -> f64 {
    mean_square(blocks.iter().flat_map(|block| &block.left).copied())
}

/// Mean square of what a line leaves of it.
fn rest(blocks: &[BlockSamples], rate: f64, amplitudes: [f64; 2]) -> f64 {
    mean_square(blocks.iter().flat_map(|block| block.rest(rate, amplitudes)))
}

/// Frequency of the highest line above [`LOWEST_HZ`], if noise alone hardly makes one so high: the power of white noise is distributed
/// exponentially about its mean, so that the highest of `n` exceeds `x` times the mean with a chance of `n exp(-x)`.
fn peak_hz(blocks: &[BlockSamples], samples: usize, rate_hz: f64, channels: usize) -> Option<f64> {
    if samples < 4 * FLOOR_BINS {
        return None;
    }
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(samples);
    let mut values = transform.make_input_vec();
    for block in blocks {
        values[block.first..block.first + block.left.len()].copy_from_slice(&block.left);
    }
    let mut spectrum = transform.make_output_vec();
    transform.process(&mut values, &mut spectrum).ok()?;
    let power: Vec<f64> = spectrum.iter().map(nalgebra::Complex::norm_sqr).collect();
    let bin_hz = rate_hz / samples as f64;
    let first = (LOWEST_HZ / bin_hz).ceil() as usize;
    let last = ((HIGHEST * rate_hz / bin_hz) as usize).min(power.len().saturating_sub(1));
    let highest = (first..=last).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
    let mut around: Vec<f64> =
        power[highest.saturating_sub(FLOOR_BINS).max(1)..(highest + FLOOR_BINS).min(power.len())].to_vec();
    let middle = around.len() / 2;
    let median = *around.select_nth_unstable_by(middle, f64::total_cmp).1;
    let mean = median / std::f64::consts::LN_2;
    let least = (((last - first + 1) * channels) as f64 / FALSE_ALARM).ln();
    (power[highest] > least * mean).then_some(bin_hz * highest as f64)
}

/// Amplitudes of sine and cosine that take most off the samples.
fn fitted(blocks: &[BlockSamples], rate: f64) -> Option<[f64; 2]> {
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for block in blocks {
        for ((sin, cos), left) in block.waves(rate).zip(&block.left) {
            let terms = Vector2::new(sin, cos);
            normal += terms * terms.transpose();
            right += terms * *left;
        }
    }
    normal.cholesky().map(|normal| normal.solve(&right).into())
}

impl Line {
    fn amplitude(&self) -> f64 {
        let [sine, cosine] = self.amplitudes;
        sine.hypot(cosine)
    }

    /// Whether another line is at the same frequency, as far as the recording tells.
    fn is_at(&self, other: &Self) -> bool {
        (self.frequency_hz - other.frequency_hz).abs() < 2.0 / self.span_s
    }

    /// Cosine of the angle between the two.
    fn together(&self, other: &Self) -> f64 {
        let product: f64 = self.amplitudes.iter().zip(other.amplitudes).map(|(a, b)| a * b).sum();
        product / (self.amplitude() * other.amplitude())
    }

    fn is_loud(&self, objective: &Objective) -> bool {
        let of_sensor = objective.noise_variance(Series::Channel(self.channel)).sqrt();
        self.amplitude() / 2.0_f64.sqrt() > LEAST_OVER_NOISE * of_sensor.max(self.noise)
    }

    fn is_confirmed(&self) -> bool {
        self.confirmed > CONFIRMED
    }

    /// The law, with the standard deviations of a sine in white noise (Rife and Boorstyn, IEEE Trans. Inf. Theory 20 (1974) 591):
    /// `σ √(2/n)` of the amplitude `A`, that over `A` of the phase in the middle, and `√6 σ / (π A T √n)` of the frequency.
    fn hum(&self) -> Option<Hum> {
        let ([sine, cosine], amplitude) = (self.amplitudes, self.amplitude());
        let law = law::find("law_reading_over_time")?;
        let law = ActiveEffect { target: Target::One(self.channel), ..ActiveEffect::with_defaults(law) }
            .with("amplitude", amplitude)
            .with("frequency_hz", self.frequency_hz)
            .with("phase_rad", cosine.atan2(sine));
        let of_amplitude = self.noise * (2.0 / self.samples).sqrt();
        let of_frequency_hz = 6.0_f64.sqrt() * self.noise
            / (std::f64::consts::PI * amplitude * self.span_s * self.samples.sqrt());
        // The phase is told at the clock's zero, half the recording away from its middle.
        let of_phase_rad = 2.0 * of_amplitude / amplitude;
        let stds = [of_amplitude, of_frequency_hz, of_phase_rad];
        let Self { channel, amplitudes, taken_off, .. } = *self;
        Some(Hum { law, stds, channel, amplitudes, taken_off })
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::joint_model::JointModel;
    use crate::recording::Recording;
    use crate::simulation::replay;
    use crate::test_bench;

    const NOISE_N: f64 = 0.3;

    /// What a bench whose tensions carry noise and the given swings (channel, amplitude, frequency, phase) is left with.
    fn found(seed: u64, swings: &[(Channel, f64, f64, f64)]) -> Vec<(Hum, [f64; 2])> {
        let mut recording: Recording = test_bench::swung(12_000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let input = crate::simulation::ReplayInput::new(&model, &recording).unwrap();
        let measured = replay(&model, &input).unwrap();
        let mut random = Pcg64::new(u128::from(seed), 5);
        for (channel, values) in measured.channels() {
            let swings = || swings.iter().filter(|(on, ..)| *on == channel);
            let noise = if channel.is_angle() { 0.0 } else { NOISE_N };
            let shown = values.iter().zip(recording.t_s()).map(|(value, t_s)| {
                let swing: f64 = swings().map(|(_, a, hz, phase)| a * (TAU * hz * t_s + phase).sin()).sum();
                let noise_now: f64 = StandardNormal.sample(&mut random);
                value + noise * noise_now + swing
            });
            let shown = shown.collect();
            recording.set(channel, shown);
        }
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let predictions = objective.predict(&model).unwrap();
        let found = hums(&objective, &predictions);
        found.iter().map(|hum| (*hum, hum.heldout(&objective, &predictions))).collect()
    }

    #[test]
    fn mains_on_one_amplifier_are_found_with_amplitude_frequency_and_phase() {
        let hums = found(1, &[(Channel::F3, 0.9, 50.02, 0.7)]);
        let [(hum, [before, after])] = &hums[..] else { panic!("{hums:?}") };
        assert_eq!(hum.law.target, Target::One(Channel::F3));
        for ((value, want), std) in hum.law.parameters.iter().zip([0.9, 50.02, 0.7]).zip(hum.stds) {
            assert!((value - want).abs() < 4.0 * std, "{value} ± {std}, expected {want}");
        }
        // 12 s at 1 kHz, two thirds of them fitted.
        assert!(hum.stds[0] < 0.006 && hum.stds[1] < 0.001, "{:?}", hum.stds);
        assert!((before - after - 0.405).abs() < 0.03, "{before} to {after}");
    }

    #[test]
    fn mains_on_all_amplifiers_swing_together_and_a_joint_that_swings_does_not() {
        let all = Channel::TENSIONS.map(|channel| (channel, 0.8, 50.0, 0.2));
        assert_eq!(found(2, &all).len(), 4);
        let mut antagonists = all;
        antagonists[2].1 = -0.8;
        antagonists[3].1 = -0.8;
        assert_eq!(found(3, &antagonists), []);
    }

    #[test]
    fn noise_alone_and_what_hides_in_it_is_no_hum() {
        for seed in 10..16 {
            assert_eq!(found(seed, &[]), [], "seed {seed}");
        }
        assert_eq!(found(20, &[(Channel::F3, 0.15, 50.0, 0.0)]), []);
    }
}
