//! What an effect is worth without what speaks most for it: what a single moment asks for, or a single recording of several, is no
//! physics to be named.

use std::collections::BTreeMap;

use crate::fit::objective::StretchLosses;

/// Of so many stretches, or recordings, one does not count for what it asks for.
const LOUDEST: usize = 10;

/// Recordings from which on none may decide alone.
const SEVERAL: usize = 3;

/// Mean losses without and with something, but for the stretches in which it takes most off, and, where there are several recordings, but for
/// the recordings in which it does.
pub(super) fn without_the_loudest(without: &StretchLosses, with: &StretchLosses) -> Vec<[f64; 2]> {
    let mut quieter = vec![of_units(without.values().zip(with.values()).map(|(a, b)| (*a, *b)).collect())];
    let [of_recordings, with] = [without, with].map(by_recording);
    if of_recordings.len() >= SEVERAL {
        quieter.push(of_units(of_recordings.into_values().zip(with.into_values()).collect()));
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

/// Mean losses without and with something over all but the loudest of some parts of the data.
fn of_units(mut pairs: Vec<([f64; 2], [f64; 2])>) -> [f64; 2] {
    let taken_off = |([without, _], [with, _]): &([f64; 2], [f64; 2])| without - with;
    pairs.sort_by(|a, b| taken_off(a).total_cmp(&taken_off(b)));
    pairs.truncate(pairs.len() - pairs.len().div_ceil(LOUDEST));
    let mean = |losses: &mut dyn Iterator<Item = [f64; 2]>| {
        let [sum, count] = losses.fold([0.0, 0.0], |[sum, count], [s, c]| [sum + s, count + c]);
        sum / f64::max(count, 1.0)
    };
    [mean(&mut pairs.iter().map(|(without, _)| *without)), mean(&mut pairs.iter().map(|(_, with)| *with))]
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
