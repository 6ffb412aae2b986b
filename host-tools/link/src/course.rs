//! What a running joint is to follow.

use std::path::Path;

use bowden_core::outcome::Failure;
use bowden_core::recording::{Column, ReadOptions, Recording};
use bowden_link::message::{Mode, Reference, Shape};
use bowden_model::channel::Channel;

/// Column with the reference of a torque run.
pub const TORQUE_REFERENCE: &str = "torque_ref_nm";

/// Names of references that are no files; `None` holds a value.
pub const NAMES: [(&str, Option<Shape>); 5] = [
    ("hold", None),
    ("sine", Some(Shape::Sine)),
    ("triangle", Some(Shape::Triangle)),
    ("multisine", Some(Shape::Multisine)),
    ("staircase", Some(Shape::Staircase)),
];

/// What the joint is to follow.
#[derive(Clone, Debug, PartialEq)]
pub enum Course {
    /// Made on the board.
    OnBoard(Reference),
    /// Sent point by point.
    Streamed(Track),
}

/// A reference over time, linear between its points.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    t_s: Vec<f64>,
    values: Vec<f64>,
}

impl Track {
    /// Reads the reference of a recording; its first sample is at 0 s.
    ///
    /// # Errors
    /// See [`Recording::load`]; also a file without the column of the mode, and cells of it that are no numbers.
    pub fn load(path: &Path, mode: Mode) -> Result<Self, Failure> {
        if !path.exists() {
            let names: Vec<&str> = NAMES.iter().map(|(name, _)| *name).collect();
            return Err(Failure::bad_input(format!(
                "--reference {}: neither a file nor one of {}; correct it",
                path.display(),
                names.join(", ")
            )));
        }
        let recording = Recording::load(path, &ReadOptions::default())?;
        let missing = |column: &str| {
            Failure::bad_input(format!(
                "{}: no column `{column}`, which this mode follows; name the reference so",
                recording.source()
            ))
        };
        let values = match mode {
            Mode::Position | Mode::Hybrid | Mode::Impedance => {
                let column = Channel::ThetaRef;
                recording.channel(column).ok_or_else(|| missing(column.role()))?.to_vec()
            }
            Mode::Torque => {
                let text = recording.columns().iter().find_map(|column| match column {
                    Column::Unknown(text) if text.name() == TORQUE_REFERENCE => Some(text),
                    _ => None,
                });
                let text = text.ok_or_else(|| missing(TORQUE_REFERENCE))?;
                let number = |sample: usize| {
                    let cell = text.cell(sample).unwrap_or_default();
                    cell.trim().parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| {
                        Failure::bad_input(format!(
                            "{}: column `{TORQUE_REFERENCE}`: got `{cell}`, expected a finite number; correct it",
                            recording.place(sample)
                        ))
                    })
                };
                (0..recording.len()).map(number).collect::<Result<_, _>>()?
            }
        };
        let start_s = recording.t_s().first().copied().unwrap_or(0.0);
        Ok(Self { t_s: recording.t_s().iter().map(|t_s| t_s - start_s).collect(), values })
    }

    /// The reference angle of a recording in memory; its first sample is at 0 s. `None` without such a column.
    pub fn of_angle(recording: &Recording) -> Option<Self> {
        let values = recording.channel(Channel::ThetaRef)?.to_vec();
        let start_s = recording.t_s().first().copied().unwrap_or(0.0);
        Some(Self { t_s: recording.t_s().iter().map(|t_s| t_s - start_s).collect(), values })
    }

    /// Values at `rate_hz`.
    pub fn values_at(&self, rate_hz: f64) -> Vec<f64> {
        (0..).map_while(|index| self.point(index, rate_hz)).map(f64::from).collect()
    }

    /// Length, s.
    pub fn duration_s(&self) -> f64 {
        self.t_s.last().copied().unwrap_or(0.0)
    }

    /// Time and value of the first sample that is not within these, s.
    pub fn first_outside(&self, minimum: f64, maximum: f64) -> Option<(f64, f64)> {
        let mut samples = self.t_s.iter().copied().zip(self.values.iter().copied());
        samples.find(|(_, value)| *value < minimum || *value > maximum)
    }

    /// Point `index` at `rate_hz`, up to the end of the track.
    pub fn point(&self, index: u64, rate_hz: f64) -> Option<f32> {
        let t_s = index as f64 / rate_hz;
        let after = self.t_s.partition_point(|sample_s| *sample_s <= t_s);
        let before = after.checked_sub(1)?;
        let Some(next_s) = self.t_s.get(after) else {
            // The last sample itself, and half a point of rounding beyond it.
            let over_s = t_s - self.t_s[before];
            return (over_s * rate_hz < 0.5).then_some(self.values[before] as f32);
        };
        let share = (t_s - self.t_s[before]) / (next_s - self.t_s[before]);
        Some((self.values[before] + share * (self.values[after] - self.values[before])) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_track_is_resampled_on_straight_lines() {
        let track = Track { t_s: vec![0.0, 0.01, 0.03], values: vec![0.0, 1.0, 0.0] };
        let points: Vec<f32> = (0..).map_while(|index| track.point(index, 200.0)).collect();
        assert_eq!(points.len(), 7);
        for (got, expected) in points.iter().zip([0.0, 0.5, 1.0, 0.75, 0.5, 0.25, 0.0]) {
            assert!((got - expected).abs() < 1e-6, "{points:?}");
        }
    }
}
