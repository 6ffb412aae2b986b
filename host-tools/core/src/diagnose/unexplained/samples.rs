//! What is left, as rows of a table: differences of every series over 10 ms beside the variables that they may follow.

use bowden_model::channel::Channel;

use crate::diagnose::place;
use crate::fit::objective::{Objective, Part, Series, soft};
use crate::simulation::Prediction;

/// Pieces of a block of the fit that make one row each: 10 ms, so that up to 45 Hz can be told.
const PIECES: usize = 5;

/// Speed at which a direction counts for three quarters, rad/s: an encoder's count a few samples long is no motion.
const DIRECTION_RAD_S: f64 = 0.05;

/// Turn of the input pulley over which the sign of a dry friction changes after a reversal, rad: three counts of a 12-bit
/// encoder, so that one count to and fro is no reversal.
const TURNING_RAD: f64 = 5e-3;

/// Something that a difference may depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Variable {
    /// Angle of the joint, as measured.
    ThetaOut,
    /// Angle of the input pulley.
    ThetaIn,
    /// Speed of the input pulley.
    Speed,
    /// Time since the beginning of the recording.
    Time,
    /// Largest of the recorded tensions.
    Tension,
    /// Current of the motor, as measured.
    Current,
}

impl Variable {
    /// All of them.
    const ALL: [Self; 6] =
        [Self::ThetaOut, Self::ThetaIn, Self::Speed, Self::Time, Self::Tension, Self::Current];

    /// Name in files.
    #[must_use]
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::ThetaOut => "theta_out_rad",
            Self::ThetaIn => "theta_in_rad",
            Self::Speed => "omega_in_rad_s",
            Self::Time => "t_s",
            Self::Tension => "tension_n",
            Self::Current => "i_motor_a",
        }
    }

    /// Unit.
    #[must_use]
    pub(crate) const fn unit(self) -> &'static str {
        match self {
            Self::ThetaOut | Self::ThetaIn => "rad",
            Self::Speed => "rad/s",
            Self::Time => "s",
            Self::Tension => "N",
            Self::Current => "A",
        }
    }
}

/// What a row is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RowUse {
    /// Forms are fitted to it.
    Fitted,
    /// Confirms what was fitted to the others.
    Confirming,
    /// Held out: nothing is chosen by it.
    HeldOut,
}

/// Differences of one series.
#[derive(Clone, Debug)]
pub(crate) struct Left {
    /// Series.
    pub(crate) series: Series,
    /// Scale of the series, in its unit.
    pub(crate) scale: f64,
    /// Measured minus simulated over each row, in scales, about its mean in each recording; not a number where the recording
    /// lacks the channel. Large ones enter with their root, as in a fit.
    pub(crate) soft: Vec<f64>,
    /// The same in the unit of the series, as it is.
    pub(crate) plain: Vec<f64>,
}

/// The table.
#[derive(Clone, Debug, Default)]
pub(crate) struct Samples {
    /// Number of the recording of each row; rows of one recording follow one another.
    pub(crate) recording: Vec<usize>,
    /// What each row is used for.
    pub(crate) used_for: Vec<RowUse>,
    /// Direction of motion, -1 to 1.
    pub(crate) direction: Vec<f64>,
    /// Direction of the last motion of the input pulley, -1 to 1, as dry friction keeps it at rest.
    pub(crate) last_direction: Vec<f64>,
    /// One entry a series.
    pub(crate) left: Vec<Left>,
    variables: Vec<Vec<f64>>,
}

impl Samples {
    /// Differences between the recordings of `objective` and `predictions`.
    pub(crate) fn new(objective: &Objective, predictions: &[Prediction]) -> Self {
        let mut samples = Self { variables: vec![Vec::new(); Variable::ALL.len()], ..Self::default() };
        for (series, scale) in objective.scales() {
            let (soft, plain) = (Vec::new(), Vec::new());
            samples.left.push(Left { series: *series, scale: *scale, soft, plain });
        }
        for (recording, prediction) in predictions.iter().enumerate() {
            samples.append(objective, recording, prediction);
        }
        samples
    }

    /// Number of rows.
    pub(crate) const fn len(&self) -> usize {
        self.recording.len()
    }

    /// Whether forms are fitted to a row.
    pub(crate) fn is_fitted(&self, row: usize) -> bool {
        self.used_for[row] == RowUse::Fitted
    }

    /// Whether something may be chosen by a row.
    pub(crate) fn may_choose(&self, row: usize) -> bool {
        self.used_for[row] != RowUse::HeldOut
    }

    /// Values of a variable; `None` where some recording lacks it.
    pub(crate) fn variable(&self, variable: Variable) -> Option<&[f64]> {
        let values = &self.variables[variable as usize];
        (values.len() == self.len() && values.iter().all(|value| value.is_finite())).then_some(values)
    }

    /// One series.
    pub(crate) fn of(&self, series: Series) -> Option<&Left> {
        self.left.iter().find(|left| left.series == series)
    }

    fn append(&mut self, objective: &Objective, recording: usize, prediction: &Prediction) {
        let input = objective.input(recording);
        let t_s = input.t_s();
        let first = self.len();
        let measured = |channel| objective.measured(recording, Series::Channel(channel));
        let theta_in =
            input.motion().map(|motion| motion.theta_rad.as_slice()).or(measured(Channel::ThetaIn));
        let omega = place::speed(objective, recording);
        let tensions: Vec<&[f64]> =
            Channel::TENSIONS.iter().filter_map(|channel| measured(*channel)).collect();
        for block in objective.blocks(recording) {
            let pieces = PIECES.min(block.end - block.start);
            for piece in 0..pieces {
                let at = |piece: usize| block.start + (block.end - block.start) * piece / pieces;
                let samples = at(piece)..at(piece + 1);
                let mean = |values: &[f64]| mean(&values[samples.clone()]);
                let or_none = |values: Option<&[f64]>| values.map_or(f64::NAN, mean);
                let speed = mean(&omega);
                let largest = tensions.iter().map(|tension| mean(tension)).fold(f64::NAN, f64::max);
                let since_s = t_s[samples.start] - t_s[0];
                self.recording.push(recording);
                self.used_for.push(match block.part {
                    Part::HeldOut | Part::Unused => RowUse::HeldOut,
                    Part::Training if block.confirms() => RowUse::Confirming,
                    Part::Training => RowUse::Fitted,
                });
                self.direction.push((speed / DIRECTION_RAD_S).tanh());
                let values = [
                    or_none(measured(Channel::ThetaOut)),
                    or_none(theta_in),
                    speed,
                    since_s,
                    largest,
                    or_none(measured(Channel::MotorCurrent)),
                ];
                self.variables.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
                for left in &mut self.left {
                    let simulated = left.series.of(prediction);
                    let difference = objective
                        .measured(recording, left.series)
                        .zip(simulated.filter(|values| values.len() == t_s.len()))
                        .map_or(f64::NAN, |(real, simulated)| mean(real) - mean(simulated));
                    left.plain.push(difference);
                }
            }
        }
        self.last_direction.extend(last_direction(&self.variables[Variable::ThetaIn as usize][first..]));
        for left in &mut self.left {
            let rows = &mut left.plain[first..];
            let used_for = &self.used_for[first..];
            // What is held out tells no zero, but where nothing else is there.
            let told = |held_out: bool| -> Vec<f64> {
                let of =
                    rows.iter().zip(used_for).filter(|(_, used)| (**used == RowUse::HeldOut) == held_out);
                of.map(|(value, _)| *value).collect()
            };
            let chosen_by = told(false);
            let centre = if chosen_by.is_empty() { mean(&told(true)) } else { mean(&chosen_by) };
            for value in &mut *rows {
                *value -= centre;
            }
            left.soft.extend(rows.iter().map(|value| soft(value / left.scale)));
        }
    }
}

#[cfg(test)]
impl Samples {
    /// A table of one recording of rows 10 ms apart, the joint following the input; every third second confirms.
    pub(crate) fn of_one_recording(theta_rad: &[f64], current_a: &[f64], left: Vec<Left>) -> Self {
        let n = theta_rad.len();
        let t_s: Vec<f64> = (0..n).map(|k| 0.01 * k as f64).collect();
        let speed: Vec<f64> =
            (0..n).map(|k| (theta_rad[(k + 1).min(n - 1)] - theta_rad[k.saturating_sub(1)]) / 0.02).collect();
        let used_for = |t_s: &f64| if *t_s as usize % 3 == 2 { RowUse::Confirming } else { RowUse::Fitted };
        Self {
            recording: vec![0; n],
            used_for: t_s.iter().map(used_for).collect(),
            direction: speed.iter().map(|speed| (speed / DIRECTION_RAD_S).tanh()).collect(),
            last_direction: last_direction(theta_rad),
            left,
            variables: vec![
                theta_rad.to_vec(),
                theta_rad.to_vec(),
                speed,
                t_s,
                vec![f64::NAN; n],
                current_a.to_vec(),
            ],
        }
    }
}

#[cfg(test)]
impl Samples {
    /// The same table, another recording behind it.
    pub(crate) fn followed_by(mut self, mut other: Self) -> Self {
        let number = self.recording.last().map_or(0, |last| last + 1);
        self.recording.extend(other.recording.iter().map(|recording| number + recording));
        self.used_for.append(&mut other.used_for);
        self.direction.append(&mut other.direction);
        self.last_direction.append(&mut other.last_direction);
        for (left, mut other) in self.left.iter_mut().zip(other.left) {
            left.soft.append(&mut other.soft);
            left.plain.append(&mut other.plain);
        }
        for (values, mut other) in self.variables.iter_mut().zip(other.variables) {
            values.append(&mut other);
        }
        self
    }
}

/// Direction that dry friction has at every row of one recording: it follows the angle over [`TURNING_RAD`] and no farther
/// (Prandtl's element). Zero before the first motion, and where the angle is not known.
fn last_direction(theta_rad: &[f64]) -> Vec<f64> {
    let (mut direction, mut last) = (0.0, theta_rad.first().copied().unwrap_or(0.0));
    let follow = |theta_rad: &f64| {
        let turned = (theta_rad - last) / TURNING_RAD;
        last = *theta_rad;
        if turned.is_finite() {
            direction = f64::clamp(direction + turned, -1.0, 1.0);
        }
        direction
    };
    theta_rad.iter().map(follow).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
