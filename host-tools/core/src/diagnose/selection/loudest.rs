//! Loss reduction of an effect without the data that support it most. Support by a single moment, or by one recording of several, is not enough
//! to name an effect.
//!
//! A joint may touch its end stop three times in a recording, for a few seconds in all. An effect that acts always in the same way is therefore
//! tested without the one moment that supports it most. One that is adapted to moments, because it begins at one or because it is a law with
//! many forms, is tested without all that support it most, wherever they are.

use std::collections::BTreeMap;

use crate::fit::objective::StretchLosses;

/// One of so many stretches, or recordings, is left out.
const LOUDEST: usize = 10;

/// Minimum number of recordings from which no single one may decide.
const SEVERAL: usize = 3;

/// Sums of the losses of a part of the data, and their numbers, without and with an effect.
type Pair = ([f64; 2], [f64; 2]);

/// Mean losses without and with an effect, leaving out the stretches with the largest reduction, and for several recordings a second pair
/// that leaves out the recordings with the largest reduction.
pub(super) fn without_the_loudest(without: &StretchLosses, with: &StretchLosses) -> Vec<[f64; 2]> {
    let stretches = of_units(without.values().copied().zip(with.values().copied()).collect());
    and_of_recordings(stretches, without, with)
}

/// The same, leaving out as many stretches that follow one another in one recording. If none is that long, there are so many recordings that
/// the second pair leaves out more than a moment.
pub(super) fn without_the_loudest_moment(without: &StretchLosses, with: &StretchLosses) -> Vec<[f64; 2]> {
    let recordings: Vec<usize> = without.keys().map(|(recording, _)| *recording).collect();
    let pairs: Vec<Pair> = without.values().copied().zip(with.values().copied()).collect();
    let length = pairs.len().div_ceil(LOUDEST).max(1);
    let reduction = |first: usize| -> f64 { pairs[first..first + length].iter().map(taken_off).sum() };
    let loudest = (0..(pairs.len() + 1).saturating_sub(length))
        .filter(|first| recordings[*first] == recordings[first + length - 1])
        .max_by(|one, other| reduction(*one).total_cmp(&reduction(*other)));
    let is_left = |place: usize| loudest.is_none_or(|first| !(first..first + length).contains(&place));
    let stretches =
        means(pairs.iter().enumerate().filter(|(place, _)| is_left(*place)).map(|(_, pair)| pair));
    and_of_recordings(stretches, without, with)
}

/// `stretches`, and for several recordings the losses without the loudest of these.
fn and_of_recordings(stretches: [f64; 2], without: &StretchLosses, with: &StretchLosses) -> Vec<[f64; 2]> {
    let mut quieter = vec![stretches];
    let [without, with] = [without, with].map(by_recording);
    if without.len() >= SEVERAL {
        quieter.push(of_units(without.into_values().zip(with.into_values()).collect()));
    }
    quieter
}

fn by_recording(stretches: &StretchLosses) -> BTreeMap<usize, [f64; 2]> {
    let mut sums: BTreeMap<usize, [f64; 2]> = BTreeMap::new();
    for ((recording, _), [sum, count]) in stretches {
        let of = sums.entry(*recording).or_default();
        *of = [of[0] + sum, of[1] + count];
    }
    sums
}

/// Mean losses without and with an effect over all parts of the data but those with the largest reduction.
fn of_units(mut pairs: Vec<Pair>) -> [f64; 2] {
    pairs.sort_by(|a, b| taken_off(a).total_cmp(&taken_off(b)));
    pairs.truncate(pairs.len() - pairs.len().div_ceil(LOUDEST));
    means(pairs.iter())
}

fn taken_off(([without, _], [with, _]): &Pair) -> f64 {
    without - with
}

/// Mean losses without and with the effect.
fn means<'p>(pairs: impl Iterator<Item = &'p Pair>) -> [f64; 2] {
    let add = |[sum, count]: [f64; 2], [s, c]: [f64; 2]| [sum + s, count + c];
    let (without, with) =
        pairs.fold(([0.0; 2], [0.0; 2]), |(without, with), pair| (add(without, pair.0), add(with, pair.1)));
    [without, with].map(|[sum, count]| sum / f64::max(count, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten stretches of ten residuals in one recording: a moment takes half of the loss off, a friction a third of every stretch.
    #[test]
    fn what_a_single_moment_asks_for_is_no_physics() {
        let without: StretchLosses =
            (0..10).map(|k| ((0, k), [if k == 3 { 100.0 } else { 10.0 }, 10.0])).collect();
        let mut of_a_moment = without.clone();
        of_a_moment.insert((0, 3), [5.0, 10.0]);
        assert_eq!(without_the_loudest(&without, &of_a_moment), [[1.0, 1.0]]);
        let of_friction = without.iter().map(|(key, [sum, count])| (*key, [sum / 1.5, *count])).collect();
        let [[before, after]] = without_the_loudest(&without, &of_friction)[..] else {
            panic!("one recording")
        };
        assert!((before - 1.0).abs() < 1e-12 && (after - 2.0 / 3.0).abs() < 1e-12, "{before} {after}");
        let nothing = StretchLosses::new();
        assert_eq!(
            without_the_loudest(&nothing, &nothing),
            [[0.0, 0.0]],
            "without any stretch nothing is told"
        );
    }

    /// A stop that is touched in seconds 8, 9, 14 and 32 of forty takes 30 off in each of them. Without seconds 8 to 11 it takes 60 off in 36;
    /// without the four that support it most, wherever they are, nothing.
    #[test]
    fn what_acts_at_several_moments_shows_without_any_one_of_them() {
        let touched = [8, 9, 14, 32];
        let of = |at_the_stop: f64| -> StretchLosses {
            (0..40).map(|k| ((0, k), [if touched.contains(&k) { at_the_stop } else { 1.0 }, 1.0])).collect()
        };
        let (without, with) = (of(31.0), of(1.0));
        let [[before, after]] = without_the_loudest_moment(&without, &with)[..] else {
            panic!("one recording")
        };
        assert!((before - 96.0 / 36.0).abs() < 1e-12 && after == 1.0, "{before} {after}");
        assert_eq!(without_the_loudest(&without, &with), [[1.0, 1.0]]);
        let nothing = StretchLosses::new();
        assert_eq!(without_the_loudest_moment(&nothing, &nothing), [[0.0, 0.0]]);
    }

    /// The last second of one recording and the first of the next are two moments.
    #[test]
    fn a_moment_is_of_one_recording() {
        let keys = || (0..2).flat_map(|recording| (0..10).map(move |second| (recording, second)));
        let of = |loud: f64| -> StretchLosses {
            let sum = |key: &(usize, usize)| if matches!(key, (0, 9) | (1, 0)) { loud } else { 1.0 };
            keys().map(|key| (key, [sum(&key), 1.0])).collect()
        };
        // Two of twenty seconds are left out, one of them loud.
        assert_eq!(without_the_loudest_moment(&of(10.0), &of(1.0)), [[27.0 / 18.0, 1.0]]);
    }

    /// Three recordings of twenty stretches: what one of them asks for throughout shows in nine tenths of the stretches, and in no other one.
    #[test]
    fn what_one_recording_of_several_asks_for_is_no_physics() {
        let all = |first: f64| -> StretchLosses {
            let sum = |recording| if recording == 0 { first } else { 10.0 };
            (0..60).map(|k| ((k / 20, k % 20), [sum(k / 20), 10.0])).collect()
        };
        let [stretches, recordings] = without_the_loudest(&all(100.0), &all(10.0))[..] else { panic!("two") };
        assert!(stretches[0] > 3.0 && stretches[1] == 1.0, "{stretches:?}");
        assert_eq!(recordings, [1.0, 1.0]);
    }
}
