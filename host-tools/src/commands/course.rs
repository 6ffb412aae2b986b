//! Arguments that say what the joint is to follow, and whether it can.

use std::path::{Path, PathBuf};

use bowden_control::parameters::{Parameters, Quantity, Reach, Unreachable, check_reference};
use bowden_core::outcome::Failure;
use bowden_host_link::course::{Course, NAMES, Track};
use bowden_link::message::{Mode, Reference};

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

    /// The reference in words.
    pub fn words(&self) -> String {
        let Self { reference, amplitude, offset, frequency, .. } = self;
        let unit = if self.mode().follows_torque() { "N m" } else { "rad" };
        let name = reference.display();
        match NAMES.iter().find(|(name, _)| reference.as_os_str() == *name) {
            Some((_, Some(_))) => {
                format!("{name} of {amplitude} {unit} at {frequency} Hz around {offset} {unit}")
            }
            Some((_, None)) => format!("hold at {offset} {unit}"),
            None => format!("file {name}"),
        }
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
}
