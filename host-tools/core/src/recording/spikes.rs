//! Spikes of a sensor: a bit lost on a wire, a converter that was read too early.
//!
//! A run of at most [`LONGEST`] samples is a spike where
//! - all of it lies beyond both its neighbours, to the same side, by more than `h`,
//! - its neighbours differ from each other by less than `h` / [`OUTSTANDING`], and so do samples that follow one another
//!   among the [`AROUND`] before and after it, but for the two largest changes, which a second spike may make,
//! - `h` is more than [`FEWEST_QUANTA`] times the channel's resolution, or of a channel without one, its median change, and
//!   more than [`LEAST_HEIGHT`] of the range in which all but the outermost samples lie: a smaller one does no harm.
//!
//! So is a run of as many that lies beyond what the channel can show, between neighbours that do not, where that is rare
//! ([`RARE`]) and no run is longer: another unit shows in most samples.
//!
//! Friction that lets go and a stop that is hit leave steps, ramps and ringing, whose neighbours differ; white noise of
//! standard deviation σ has changes up to 3.5 σ among the twenty around, so that `h` is 20 σ and more.

use std::ops::Range;

use crate::reconstruct::quantum_of;

/// Samples of the longest spike.
const LONGEST: usize = 2;

/// Samples on each side whose changes are compared with a spike.
const AROUND: usize = 10;

/// Height of a spike over the changes around it.
const OUTSTANDING: f64 = 8.0;

/// Least height of a spike, in counts of a quantised channel.
const FEWEST_QUANTA: f64 = 8.0;

/// Least height of a spike, as a part of the channel's range.
const LEAST_HEIGHT: f64 = 0.02;

/// Share of the samples at each end that the range leaves out.
const OUTERMOST: f64 = 0.01;

/// Share of the samples from which on what stands out is how the channel is.
const LARGEST_SHARE: f64 = 0.02;

/// Share of the samples up to which values that a channel cannot show are spikes.
const RARE: f64 = 0.005;

/// Samples whose magnitude is beyond `largest`, as runs in ascending order; none where one of these is no spike.
pub(super) fn beyond(values: &[f64], largest: f64) -> Vec<Range<usize>> {
    let samples: Vec<usize> = (0..values.len()).filter(|sample| values[*sample].abs() > largest).collect();
    let runs = runs(&samples);
    let is_spike = |run: &Range<usize>| run.len() <= LONGEST && run.start > 0 && run.end < values.len();
    let is_rare = samples.len() as f64 <= RARE * values.len() as f64;
    if is_rare && runs.iter().all(is_spike) { runs } else { Vec::new() }
}

/// The samples of both, as runs in ascending order.
pub(super) fn together(one: Vec<Range<usize>>, other: Vec<Range<usize>>) -> Vec<Range<usize>> {
    let mut samples: Vec<usize> = one.into_iter().chain(other).flatten().collect();
    samples.sort_unstable();
    samples.dedup();
    runs(&samples)
}

/// Runs of samples that follow one another, of samples in ascending order.
fn runs(samples: &[usize]) -> Vec<Range<usize>> {
    let follow = |one: &usize, next: &usize| one + 1 == *next;
    samples.chunk_by(follow).map(|run| run[0]..run[0] + run.len()).collect()
}

/// Runs of samples that are spikes, in ascending order; each has a neighbour on both sides.
pub(super) fn find(values: &[f64]) -> Vec<Range<usize>> {
    let quantum = quantum_of(values).unwrap_or_else(|| median_change(values));
    let least = (FEWEST_QUANTA * quantum).max(LEAST_HEIGHT * range(values));
    let mut found: Vec<Range<usize>> = Vec::new();
    let mut start = 1;
    while start + 1 < values.len() {
        // Most samples lie between their neighbours.
        let spike = (1..=LONGEST)
            .map(|length| start..start + length)
            .find(|run| run.end < values.len() && is_spike(values, run, least));
        match spike {
            Some(run) => {
                start = run.end + 1;
                found.push(run);
            }
            None => start += 1,
        }
    }
    let count: usize = found.iter().map(ExactSizeIterator::len).sum();
    if count as f64 > LARGEST_SHARE * values.len() as f64 {
        found.clear();
    }
    found
}

/// `values` with a straight line from neighbour to neighbour over every run.
pub(super) fn between_neighbours(t_s: &[f64], values: &[f64], runs: &[Range<usize>]) -> Vec<f64> {
    let mut repaired = values.to_vec();
    for run in runs {
        let (before, after) = (run.start - 1, run.end);
        let slope = (values[after] - values[before]) / (t_s[after] - t_s[before]);
        for sample in run.clone() {
            repaired[sample] = values[before] + slope * (t_s[sample] - t_s[before]);
        }
    }
    repaired
}

fn is_spike(values: &[f64], run: &Range<usize>, least: f64) -> bool {
    let (before, after) = (values[run.start - 1], values[run.end]);
    let inside = &values[run.clone()];
    let above = inside.iter().fold(f64::INFINITY, |h, value| h.min(value - before.max(after)));
    let below = inside.iter().fold(f64::INFINITY, |h, value| h.min(before.min(after) - value));
    let height = above.max(below);
    if height <= least || height <= OUTSTANDING * (after - before).abs() {
        return false;
    }
    let first = run.start.saturating_sub(AROUND);
    let last = (run.end + AROUND).min(values.len());
    let changes =
        |around: &[f64]| -> Vec<f64> { around.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect() };
    let mut around = changes(&values[first..run.start]);
    around.extend(changes(&values[run.end..last]));
    around.sort_unstable_by(|a, b| b.total_cmp(a));
    around.get(2).is_some_and(|change| height > OUTSTANDING * change)
}

/// Width of the range in which all but the outermost values lie.
fn range(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let outside = (OUTERMOST * sorted.len() as f64) as usize;
    match (sorted.get(outside), sorted.iter().nth_back(outside)) {
        (Some(low), Some(high)) => high - low,
        _ => 0.0,
    }
}

fn median_change(values: &[f64]) -> f64 {
    let mut changes: Vec<f64> = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    if changes.is_empty() {
        return f64::INFINITY;
    }
    let middle = changes.len() / 2;
    *changes.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, Normal};
    use rand_pcg::Pcg64;

    use super::*;

    /// A tension of 30 N that swings by 12 N at 1 Hz, with noise of 0.08 N, at 1 kHz.
    fn tension(seed: u64) -> Vec<f64> {
        let mut random = Pcg64::new(u128::from(seed), 0x0073_7069_6b65);
        let noise = Normal::new(0.0, 0.08).unwrap();
        (0..20_000)
            .map(|k| {
                30.0 + 12.0 * (f64::from(k) * 1e-3 * std::f64::consts::TAU).sin() + noise.sample(&mut random)
            })
            .collect()
    }

    #[test]
    fn spikes_are_found_where_they_were_put_and_taken_out() {
        let clean = tension(1);
        let mut values = clean.clone();
        // One alone, one of two samples, two that are nine samples apart, and one at a turn.
        for (sample, height) in [
            (500, 9.0),
            (3000, -7.0),
            (3001, -8.0),
            (7000, 20.0),
            (7009, -15.0),
            (12_250, 4.0),
            (15_000, -30.0),
        ] {
            values[sample] += height;
        }
        let found = find(&values);
        assert_eq!(found, [500..501, 3000..3002, 7000..7001, 7009..7010, 12_250..12_251, 15_000..15_001]);
        let t_s: Vec<f64> = (0..20_000).map(|k| f64::from(k) * 1e-3).collect();
        let repaired = between_neighbours(&t_s, &values, &found);
        for (sample, (repaired, clean)) in repaired.iter().zip(&clean).enumerate() {
            assert!((repaired - clean).abs() < 0.6, "{sample}: {repaired} N for {clean} N");
        }
    }

    #[test]
    fn what_a_bench_does_is_no_spike() {
        let noise = tension(2);
        // Lets go, rings at 150 Hz and comes to rest in 20 ms, every half second.
        let slip = |k: usize| {
            let since_s = (k % 500) as f64 * 1e-3;
            -6.0 * (1.0 - (-since_s / 0.02).exp() * (since_s * 150.0 * std::f64::consts::TAU).cos())
        };
        // Three samples in a thousand of a play that is taken up: up within a sample, down in eight.
        let knock = |k: usize| 20.0 * (-((k % 1000) as f64) / 8.0).exp();
        let counts = |k: usize| (400.0 * (k as f64 * 3e-3).sin()).round() * 1.534e-3;
        let flicker = |k: usize| if k.is_multiple_of(77) { 1.534e-3 } else { 0.0 };
        let of = |value: &dyn Fn(usize) -> f64| (0..20_000).map(value).collect::<Vec<f64>>();
        for (what, values) in [
            ("noise", noise.clone()),
            ("stick and slip", of(&|k| noise[k] + slip(k))),
            ("stick and slip without noise", of(&slip)),
            ("a knock", of(&|k| noise[k] + knock(k))),
            ("an encoder", of(&counts)),
            ("an encoder that flickers", of(&flicker)),
            ("a triangle", of(&|k| ((k % 400) as f64 - 200.0).abs())),
            ("a pulse drive", of(&|k| if k.is_multiple_of(20) { 1.0 } else { 0.0 })),
            ("nothing", Vec::new()),
            ("a trace of one", of(&|k| noise[k] + if k == 600 { 0.4 } else { 0.0 })),
            ("too few", vec![1.0, 50.0, 1.0]),
        ] {
            assert_eq!(find(&values), [], "{what}");
        }
    }

    /// A duty that chatters by a third in every sample hides a spike from its neighbours, but 1.4 is no duty; one in percent is no spike.
    #[test]
    fn what_a_channel_cannot_show_is_a_spike_where_it_is_rare() {
        let duty = |k: usize| 0.3 * (k as f64 * 2e-3).sin() + if k.is_multiple_of(2) { 0.17 } else { -0.17 };
        let clean: Vec<f64> = (0..4000).map(duty).collect();
        let with = |samples: &[usize]| {
            let mut values = clean.clone();
            for sample in samples {
                values[*sample] = -1.4;
            }
            values
        };
        let rare = with(&[100, 2000, 2001]);
        assert_eq!((find(&rare), beyond(&rare, 1.05)), (Vec::new(), vec![100..101, 2000..2002]));
        let often: Vec<usize> = (0..21).map(|k| 100 + 10 * k).collect();
        let percent: Vec<f64> = clean.iter().map(|duty| 100.0 * duty).collect();
        assert_eq!(together(vec![4..5, 9..10], vec![2..4, 9..11]), [2..5, 9..11]);
        for values in [clean.clone(), with(&[0]), with(&[3999]), with(&[7, 8, 9]), with(&often), percent] {
            assert_eq!(beyond(&values, 1.05), []);
        }
    }

    #[test]
    fn an_encoder_that_loses_a_bit_is_found() {
        let mut values: Vec<f64> =
            (0..4000).map(|k| (300.0 * (f64::from(k) * 2e-3).sin()).round() * 1.534e-3).collect();
        values[1777] += 256.0 * 1.534e-3;
        assert_eq!((find(&values).len(), find(&values)[0].clone()), (1, 1777..1778));
    }
}
