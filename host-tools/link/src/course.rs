//! What a running joint is to follow, as the command line says it.

use std::path::{Path, PathBuf};

use bowden_control::parameters::{Parameters, Quantity, Reach, Unreachable, check_reference};
use bowden_core::outcome::Failure;
use bowden_core::recording::{Column, ReadOptions, Recording};
use bowden_link::message::{Mode, Reference, Shape};
use bowden_model::channel::Channel;

/// Column with the reference of a torque run.
pub const TORQUE_REFERENCE: &str = "torque_ref_nm";

/// What is controlled, as an argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ModeName {
    /// Angle of the joint, rad
    Position,
    /// Torque at the joint, N·m
    Torque,
    /// Angle of the joint, rad, yielding beyond `limits.contact_torque`
    Hybrid,
    /// Angle of the joint, rad, as a spring and damper: `impedance.stiffness`, `impedance.damping`
    Impedance,
}

impl From<ModeName> for Mode {
    fn from(name: ModeName) -> Self {
        match name {
            ModeName::Position => Self::Position,
            ModeName::Torque => Self::Torque,
            ModeName::Hybrid => Self::Hybrid,
            ModeName::Impedance => Self::Impedance,
        }
    }
}

/// Arguments that say what the joint is to follow.
#[derive(Clone, Debug, clap::Args)]
pub struct CourseArguments {
    /// What is controlled; amplitude and offset are in rad, in torque mode in N·m
    #[arg(long, value_enum, default_value = "position")]
    mode: ModeName,
    /// hold (at the offset), sine, triangle, multisine, staircase, or a recording with `theta_ref_rad` (`torque_ref_nm`
    /// in torque mode) that is sent point by point
    #[arg(long, value_name = "NAME|FILE", default_value = "hold")]
    reference: PathBuf,
    /// Half of the peak-to-peak value, rad or N·m
    #[arg(long, default_value = "0.3", allow_negative_numbers = true)]
    amplitude: f32,
    /// Middle, or the value to hold, rad or N·m
    #[arg(long, default_value = "0", allow_negative_numbers = true)]
    offset: f32,
    /// Periods a second, Hz; the lowest line of a multisine
    #[arg(long, value_name = "HZ", default_value = "0.5")]
    frequency: f32,
}

/// Reads the length of a run, s, from an argument.
///
/// # Errors
/// Says what is allowed.
pub fn run_seconds(text: &str) -> Result<f64, String> {
    const ALLOWED: std::ops::RangeInclusive<f64> = 0.001..=1e6;
    match text.parse::<f64>() {
        Ok(value) if ALLOWED.contains(&value) => Ok(value),
        _ => Err(format!("allowed {} to {} s", ALLOWED.start(), ALLOWED.end())),
    }
}

/// Names of references that are no files.
const NAMES: [(&str, Option<Shape>); 5] = [
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

impl CourseArguments {
    /// What is controlled.
    pub fn mode(&self) -> Mode {
        self.mode.into()
    }

    /// The file that the reference comes from, if it does.
    pub fn file(&self) -> Option<&Path> {
        let is_name = NAMES.iter().any(|(name, _)| self.reference.as_os_str() == *name);
        (!is_name).then_some(self.reference.as_path())
    }

    /// Reads what there is to read.
    ///
    /// # Errors
    /// A number that is none, or a file that cannot be used.
    pub fn course(&self) -> Result<Course, Failure> {
        let numbers = [("amplitude", self.amplitude), ("offset", self.offset), ("frequency", self.frequency)];
        if let Some((name, value)) = numbers.iter().find(|(_, value)| !value.is_finite()) {
            return Err(Failure::bad_input(format!("--{name} {value}: expected a finite number; give one")));
        }
        let Self { amplitude, offset, frequency, .. } = *self;
        match NAMES.iter().find(|(name, _)| self.reference.as_os_str() == *name) {
            Some((_, None)) => Ok(Course::OnBoard(Reference::Hold(offset))),
            Some((_, Some(shape))) => Ok(Course::OnBoard(Reference::Generated {
                shape: *shape,
                amplitude,
                offset,
                frequency_hz: frequency,
            })),
            None => Track::load(&self.reference, self.mode()).map(Course::Streamed),
        }
    }
}

impl CourseArguments {
    /// Checks that the joint of these parameters can do the course, as the board does before it runs.
    ///
    /// # Errors
    /// One line with what can be done.
    pub fn check(&self, course: &Course, parameters: &Parameters) -> Result<(), Failure> {
        let unit = if self.mode().follows_torque() { "N·m" } else { "rad" };
        let reference = match course {
            Course::OnBoard(reference) => *reference,
            Course::Streamed(_) => Reference::Stream,
        };
        if let Err(no) = check_reference(parameters, self.mode(), reference) {
            return Err(Failure::bad_input(self.refused(&no, unit)));
        }
        let Course::Streamed(track) = course else { return Ok(()) };
        let reach = Reach::of(parameters, self.mode());
        let [minimum, maximum] =
            if self.mode().follows_torque() { [-reach.torque, reach.torque] } else { reach.angle };
        let Some((t_s, got)) = track.first_outside(minimum.into(), maximum.into()) else {
            return Ok(());
        };
        Err(Failure::bad_input(format!(
            "--reference {}: {got} {unit} at {t_s} s, the joint can do {} to {} {unit}; scale the reference",
            self.reference.display(),
            rounded(minimum),
            rounded(maximum)
        )))
    }

    /// One line on what the joint cannot do, and what it can.
    fn refused(&self, no: &Unreachable, unit: &str) -> String {
        let (got, minimum, maximum) = (no.got, rounded(no.minimum), rounded(no.maximum));
        match no.quantity {
            Quantity::Amplitude => format!(
                "--amplitude {got}: the joint can do {maximum} {unit} at most at {} Hz around {} {unit}; lower it or \
                 the frequency",
                self.frequency, self.offset
            ),
            Quantity::Offset | Quantity::Value => {
                format!(
                    "--offset {got}: the joint can do {minimum} to {maximum} {unit}; choose a value within it"
                )
            }
            Quantity::Frequency => {
                format!("--frequency {got}: the board can do {minimum} to {maximum} Hz; choose one within it")
            }
            Quantity::Stiffness => format!(
                "impedance.stiffness {got}: the tendons can do {maximum} N·m/rad at most; lower it with \
                 `bowden params set`"
            ),
            Quantity::Damping => format!(
                "impedance.damping {got}: the motor can do {maximum} N·m·s/rad at most; lower it with \
                 `bowden params set`"
            ),
        }
    }
}

/// Four digits, towards zero, so that what is said can be done.
fn rounded(value: f32) -> f64 {
    let value = f64::from(value);
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let digits = 3 - value.abs().log10().floor() as i32;
    let scale = 10_f64.powi(digits);
    (value * scale).trunc() / scale
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
    fn first_outside(&self, minimum: f64, maximum: f64) -> Option<(f64, f64)> {
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
    fn limits_are_said_with_four_digits_that_can_be_done() {
        for (value, expected) in
            [(0.873_13, 0.8731), (99.999, 99.99), (0.005_208_65, 0.005_208), (-0.873_19, -0.8731)]
        {
            assert!((rounded(value) - expected).abs() < 1e-9, "{value}: {}", rounded(value));
        }
        assert_eq!(rounded(0.0), 0.0);
    }

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
