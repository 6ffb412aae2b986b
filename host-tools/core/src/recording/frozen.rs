//! Stretches in which a recording stood still while the bench moved on: a logger that wrote its last row again and again.
//!
//! In at least [`SHORTEST`] rows every column repeats the row before. At their end an angle, a tension or a torque has changed by more
//! than [`JUMP`] times what it changes by from one row to the next anywhere else. A bench at rest repeats its rows too, but sets out
//! from there; a stretch at the end of a recording cannot be told from one.

use std::ops::Range;

/// Fewest rows that repeat the one before.
const SHORTEST: usize = 10;

/// Largest other change from row to row that the change at the end has to exceed, in such changes.
const JUMP: f64 = 2.0;

/// A step in time longer than so many median steps is a gap, over which more changes.
const GAP_IN_STEPS: f64 = 2.0;

/// Share of the rows from which on repeated rows are how the recording is.
const LARGEST_SHARE: f64 = 0.2;

/// Rows, in ascending order, that repeat a row before them while the bench moved on. `columns` are all that was recorded, and
/// whether masses and cables keep it from jumping.
pub(super) fn find(t_s: &[f64], step_s: f64, columns: &[(&[f64], bool)]) -> Vec<Range<usize>> {
    let repeated = repeated(t_s.len(), columns);
    let mut stands_out = vec![false; repeated.len()];
    for (values, _) in columns.iter().filter(|(_, is_mechanical)| *is_mechanical) {
        let change = |row: usize| (values[row] - values[row - 1]).abs();
        let is_end = |row: usize| repeated.binary_search_by(|run| run.end.cmp(&row)).is_ok();
        let is_usual = |row: &usize| t_s[*row] - t_s[*row - 1] <= GAP_IN_STEPS * step_s && !is_end(*row);
        let largest = (1..values.len()).filter(is_usual).map(change).fold(0.0, f64::max);
        for (run, stands_out) in repeated.iter().zip(&mut stands_out) {
            *stands_out |= run.end < values.len() && change(run.end) > JUMP * largest;
        }
    }
    let mut frozen: Vec<Range<usize>> =
        repeated.into_iter().zip(stands_out).filter_map(|(run, out)| out.then_some(run)).collect();
    let rows: usize = frozen.iter().map(ExactSizeIterator::len).sum();
    if rows as f64 > LARGEST_SHARE * t_s.len() as f64 {
        frozen.clear();
    }
    frozen
}

/// Runs of rows that repeat the row before in every column.
fn repeated(rows: usize, columns: &[(&[f64], bool)]) -> Vec<Range<usize>> {
    let repeats = |row: usize| columns.iter().all(|(values, _)| values[row] == values[row - 1]);
    let mut runs: Vec<Range<usize>> = Vec::new();
    for row in (1..rows).filter(|row| repeats(*row)) {
        match runs.last_mut() {
            Some(run) if run.end == row => run.end = row + 1,
            _ => runs.push(row..row + 1),
        }
    }
    runs.retain(|run| run.len() >= SHORTEST);
    runs
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;
    use rand_distr::{Distribution, Normal};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::recording::{Column, Recording, TextColumn};

    const STEP_S: f64 = 1e-3;

    /// What stretches are found in an angle and a tension at 1 kHz, beside a duty that holds for half a second each.
    fn found(
        angle_rad: &dyn Fn(f64) -> f64,
        noise_n: f64,
        spoil: &dyn Fn(&mut [Vec<f64>]),
    ) -> Vec<Range<usize>> {
        let mut random = Pcg64::new(1, 0x0066_726f_7a65);
        let noise = Normal::new(0.0, noise_n).unwrap();
        let t_s: Vec<f64> = (0..10_000).map(|k| f64::from(k) * STEP_S).collect();
        let angle = t_s.iter().map(|t_s| (angle_rad(*t_s) / 1.534e-3).round() * 1.534e-3).collect();
        let tension =
            t_s.iter().map(|t_s| 20.0 + 10.0 * angle_rad(*t_s) + noise.sample(&mut random)).collect();
        let duty = t_s.iter().map(|t_s| f64::from(u8::from(t_s.fract() < 0.5))).collect();
        let mut columns = [angle, tension, duty];
        spoil(&mut columns);
        let [angle, tension, duty] = &columns;
        find(&t_s, STEP_S, &[(angle, true), (tension, true), (duty, false)])
    }

    fn freeze(columns: &mut [Vec<f64>], rows: Range<usize>) {
        for column in columns {
            let value = column[rows.start];
            column[rows.clone()].fill(value);
        }
    }

    fn swing(t_s: f64) -> f64 {
        (3.0 * t_s).sin()
    }

    #[test]
    fn what_repeats_while_the_bench_moves_on_is_found() {
        for noise_n in [0.1, 0.0] {
            let spoil = |columns: &mut [Vec<f64>]| {
                freeze(columns, 2000..2400);
                freeze(columns, 7000..7050);
            };
            assert_eq!(found(&swing, noise_n, &spoil), [2001..2400, 7001..7050], "noise {noise_n} N");
        }
    }

    /// To and fro with 0.3 s of rest at each end, so short that they are not taken for how the recording is.
    #[test]
    fn a_bench_at_rest_is_not_frozen() {
        let swept = |t_s: f64| 0.5 * (1.0 - (std::f64::consts::PI * t_s / 1.7).cos());
        let rests = |t_s: f64| match t_s % 4.0 {
            phase_s @ 0.0..1.7 => swept(phase_s),
            1.7..2.0 => 1.0,
            phase_s @ 2.0..3.7 => 1.0 - swept(phase_s - 2.0),
            _ => 0.0,
        };
        for noise_n in [0.1, 0.0] {
            assert_eq!(found(&rests, noise_n, &|_| {}), [], "noise {noise_n} N");
        }
    }

    #[test]
    fn what_is_not_frozen_is_kept_in_all_columns_with_its_place() {
        let t_s: Vec<f64> = (0..400).map(|k| f64::from(k) * STEP_S).collect();
        let mut values = [swing, |t_s| 20.0 + swing(t_s)].map(|of| t_s.iter().map(|t_s| of(*t_s)).collect());
        freeze(&mut values, 100..150);
        let [theta_rad, f1_n] = values;
        let mut recording = Recording::new("run", t_s.clone())
            .with(Channel::ThetaIn, theta_rad.clone())
            .with(Channel::F1, f1_n.clone());
        let mut remarks = TextColumn::new("remark");
        (0..400).for_each(|row| remarks.push(&row.to_string()));
        recording.columns.push(Column::Unknown(remarks));

        recording.drop_frozen_rows();
        let kept: Vec<usize> = (0..101).chain(150..400).collect();
        let of = |values: &[f64]| kept.iter().map(|row| values[*row]).collect::<Vec<f64>>();
        assert_eq!(recording.t_s(), of(&t_s));
        assert_eq!(recording.channel(Channel::ThetaIn).unwrap(), of(&theta_rad));
        assert_eq!(recording.channel(Channel::F1).unwrap(), of(&f1_n));
        let Some(Column::Unknown(remarks)) = recording.columns().last() else { panic!("no remarks") };
        assert!(remarks.cells().eq(kept.iter().map(usize::to_string)));
        assert_eq!(recording.place(101), "run: sample 150");
        let note = "run: sample 101: all columns stand still for 0.050 s and then jump, 49 of 400 rows, were dropped";
        assert_eq!(recording.notes(), [note]);
    }

    /// One column alone may stand still, a few rows may repeat, and a recording of a source that is slower than its rows repeats them all.
    #[test]
    fn what_repeats_for_another_reason_stays() {
        let one = |columns: &mut [Vec<f64>]| freeze(&mut columns[..1], 2000..2400);
        assert_eq!(found(&swing, 0.1, &one), []);
        let few = |columns: &mut [Vec<f64>]| freeze(columns, 2000..2010);
        assert_eq!(found(&swing, 0.1, &few), []);
        let slow = |columns: &mut [Vec<f64>]| (0..500).for_each(|k| freeze(columns, 20 * k..20 * (k + 1)));
        assert_eq!(found(&swing, 0.1, &slow), []);
    }
}
