//! Loss reduction of an effect without the data that support it most. Support by a single moment, or by one recording of several, is not enough
//! to name an effect.

use std::collections::BTreeMap;

use crate::fit::objective::StretchLosses;

/// One of so many stretches, or recordings, is left out.
const LOUDEST: usize = 10;

/// Minimum number of recordings from which no single one may decide.
const SEVERAL: usize = 3;

/// Mean losses without and with an effect, leaving out the stretches with the largest reduction, and for several recordings a second pair
/// that leaves out the recordings with the largest reduction.
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

/// Mean losses without and with an effect over all parts of the data but those with the largest reduction.
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
