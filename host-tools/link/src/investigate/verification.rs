//! How well the joint follows a reference, with the board's old parameters and with the new ones.

use std::f64::consts::TAU;

use bowden_control::correction::eccentricity::Eccentricity;
use bowden_control::scale::{Angle, Quantity};
use bowden_core::outcome::Failure;
use bowden_core::recording::Recording;
use bowden_model::channel::Channel;
use serde::Serialize;

use super::plan::Run;
use crate::{LinkError, ParameterSet};

/// Beginning of a run that is not judged, s: the reference is blended in over half a second and the joint leaves rest.
const RUN_IN_S: f64 = 1.0;

/// Relative change of an error that two runs with equal parameters may differ by.
pub const REPEATABILITY: f64 = 0.03;

/// Counts a turn of the joint's encoder.
const COUNTS_PER_TURN: f64 = 4096.0;

/// Difference between reference and joint over one run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TrackingError {
    /// Root mean square, rad.
    pub rms_rad: f64,
    /// Largest, rad.
    pub largest_rad: f64,
}

/// One reference with the old parameters and with the new ones.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Followed {
    /// The reference.
    pub run: Run,
    /// With the board's old parameters.
    pub before: TrackingError,
    /// With the new ones; `None` where nothing was changed.
    pub after: Option<TrackingError>,
    /// Reference and joint over time before and after, for the report.
    #[serde(skip)]
    pub traces: Vec<Motion>,
}

/// What the new parameters do to the tracking.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Effect {
    /// The error falls by more than two equal runs differ.
    Better,
    /// As far as two equal runs differ.
    Same,
    /// The error grows by more than that.
    Worse,
}

/// Reference and angle of the joint over time, from the start of the run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// Time, s.
    pub t_s: Vec<f64>,
    /// Reference, rad.
    pub reference_rad: Vec<f64>,
    /// Joint, rad.
    pub joint_rad: Vec<f64>,
}

/// Verification of a set of parameters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// Each reference.
    pub references: Vec<Followed>,
    /// Root mean square error over all references with the old parameters, rad.
    pub before_rms_rad: f64,
    /// With the new ones, rad; `None` where nothing was changed.
    pub after_rms_rad: Option<f64>,
    /// What the new ones do.
    pub effect: Option<Effect>,
}

impl Verification {
    /// Judges runs of the same references.
    pub fn of(references: Vec<Followed>) -> Self {
        let pooled = |error: fn(&Followed) -> Option<TrackingError>| {
            let squares = references.iter().map(|one| error(one).map(|error| error.rms_rad.powi(2)));
            let sum = squares.sum::<Option<f64>>()?;
            Some((sum / references.len().max(1) as f64).sqrt())
        };
        let before = pooled(|one| Some(one.before)).unwrap_or_default();
        let after = pooled(|one| one.after);
        let effect = after.map(|after| {
            if after > (1.0 + REPEATABILITY) * before {
                Effect::Worse
            } else if after < (1.0 - REPEATABILITY) * before {
                Effect::Better
            } else {
                Effect::Same
            }
        });
        Self { references, before_rms_rad: before, after_rms_rad: after, effect }
    }

    /// One line for people.
    pub fn in_words(&self) -> String {
        let before = 1e3 * self.before_rms_rad;
        match self.after_rms_rad.map(|rad| 1e3 * rad) {
            Some(after) => {
                let change = 100.0 * (after / before - 1.0);
                format!("tracking error {before:.2} mrad RMS before, {after:.2} mrad after ({change:+.0} %)")
            }
            None => format!("tracking error {before:.2} mrad RMS"),
        }
    }
}

/// The joint's encoder as a set of parameters says it is: errors are counted in one angle, whatever a recording was made with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointEncoder {
    zero_count: f64,
    direction: f64,
    eccentricity: Eccentricity,
}

impl JointEncoder {
    /// That of a set of parameters.
    ///
    /// # Errors
    /// [`LinkError::NoParameter`]
    pub fn of(parameters: &ParameterSet) -> Result<Self, LinkError> {
        let [_, eccentricity] = Eccentricity::of_both(&parameters.control());
        Ok(Self {
            zero_count: parameters.value("encoder.joint.zero")?,
            direction: parameters.value("encoder.joint.direction")?,
            eccentricity,
        })
    }

    /// The angle behind one that was recorded with the zero of `recorded`, rad.
    fn angle_rad(&self, recorded: &Self, shown_rad: f64) -> f64 {
        let counts = (recorded.zero_count - self.zero_count + 0.5 * COUNTS_PER_TURN)
            .rem_euclid(COUNTS_PER_TURN)
            - 0.5 * COUNTS_PER_TURN;
        let shown_rad = shown_rad + self.direction * counts * TAU / COUNTS_PER_TURN;
        self.eccentricity.corrected(Angle::from_f32(shown_rad as f32)).to_f32().into()
    }

    /// Reference and joint of a recording that was made with the parameters of `recorded`.
    ///
    /// # Errors
    /// A recording without one of them.
    pub fn motion(&self, recorded: &Self, recording: &Recording) -> Result<Motion, Failure> {
        let channel = |channel: Channel| {
            recording.channel(channel).ok_or_else(|| {
                let (source, role) = (recording.source(), channel.role());
                Failure::failed(format!("{source}: no column `{role}`; record it again"))
            })
        };
        let start_s = recording.t_s().first().copied().unwrap_or_default();
        Ok(Motion {
            t_s: recording.t_s().iter().map(|t_s| t_s - start_s).collect(),
            reference_rad: channel(Channel::ThetaRef)?.to_vec(),
            joint_rad: channel(Channel::ThetaOut)?
                .iter()
                .map(|shown| self.angle_rad(recorded, *shown))
                .collect(),
        })
    }
}

impl Motion {
    /// Error after the run-in.
    ///
    /// # Errors
    /// A run that ended within it.
    pub fn error(&self) -> Result<TrackingError, Failure> {
        let judged = self.t_s.partition_point(|t_s| *t_s < RUN_IN_S);
        let errors = self.reference_rad.iter().zip(&self.joint_rad).skip(judged);
        let (mut count, mut squares, mut largest_rad) = (0, 0.0, 0.0_f64);
        for (reference, joint) in errors {
            let error = joint - reference;
            count += 1;
            squares += error * error;
            largest_rad = largest_rad.max(error.abs());
        }
        if count == 0 {
            return Err(Failure::failed(format!(
                "the verification run is shorter than {RUN_IN_S} s; run it again"
            )));
        }
        Ok(TrackingError { rms_rad: (squares / f64::from(count)).sqrt(), largest_rad })
    }
}

#[cfg(test)]
mod tests {
    use bowden_control::parameters::Parameters;

    use super::*;

    fn encoder(zero_count: f64, amplitude: f32) -> JointEncoder {
        let mut parameters = Parameters::default();
        let own = &mut parameters.correction.joint_encoder;
        (own.enable, own.amplitude, own.phase, own.limit) = (1.0, amplitude, 0.3, 0.05);
        let [_, eccentricity] = Eccentricity::of_both(&parameters);
        JointEncoder { zero_count, direction: 1.0, eccentricity }
    }

    fn recording(error_rad: f64) -> Recording {
        let t_s: Vec<f64> = (0..3000).map(|k| 5.0 + f64::from(k) * 1e-3).collect();
        let reference: Vec<f64> = t_s.iter().map(|t_s| 0.3 * (TAU * 0.5 * t_s).sin()).collect();
        // Far off during the run-in, which does not count.
        let joint =
            t_s.iter().zip(&reference).map(|(t_s, angle)| angle + if *t_s < 5.9 { 1.0 } else { error_rad });
        let joint = joint.collect();
        Recording::new("run", t_s).with(Channel::ThetaRef, reference).with(Channel::ThetaOut, joint)
    }

    #[test]
    fn errors_count_from_the_end_of_the_run_in() {
        let own = encoder(1000.0, 0.0);
        let error = own.motion(&own, &recording(0.01)).unwrap().error().unwrap();
        assert!((error.rms_rad - 0.01).abs() < 1e-6 && (error.largest_rad - 0.01).abs() < 1e-6, "{error:?}");
    }

    #[test]
    fn a_recording_is_read_with_the_zero_that_is_right() {
        // Ten counts are 15.34 mrad; 4090 counts further is the same as 6 counts back.
        for (zero, expected_counts) in [(1010.0, -10.0), (990.0, 10.0), (5090.0, 6.0)] {
            let motion = encoder(zero, 0.0).motion(&encoder(1000.0, 0.0), &recording(0.0)).unwrap();
            let expected_rad = expected_counts * TAU / 4096.0;
            let error = motion.error().unwrap();
            assert!((error.rms_rad - f64::abs(expected_rad)).abs() < 1e-5, "{zero}: {error:?}");
            let last = motion.joint_rad.len() - 1;
            assert!((motion.joint_rad[last] - motion.reference_rad[last] - expected_rad).abs() < 1e-5);
        }
    }

    #[test]
    fn an_eccentric_encoder_is_read_as_the_board_reads_it() {
        let own = encoder(1000.0, 0.02);
        for shown in [-0.5, 0.0, 0.4_f64] {
            let expected = shown - 0.02 * ((shown + 0.3).sin() - 0.3_f64.sin());
            assert!((own.angle_rad(&own, shown) - expected).abs() < 1e-5, "{shown}");
        }
    }

    #[test]
    fn what_two_equal_runs_differ_by_is_no_change() {
        let run = |before: f64, after: f64| {
            let parameters = Parameters::default();
            let plan =
                super::super::plan::Plan::new(&parameters, &super::super::limits::Wishes::default()).unwrap();
            let error = |rms_rad| TrackingError { rms_rad, largest_rad: rms_rad };
            let followed = Followed {
                run: plan.runs[0].clone(),
                before: error(before),
                after: Some(error(after)),
                traces: Vec::new(),
            };
            Verification::of(vec![followed]).effect
        };
        assert_eq!(run(0.01, 0.005), Some(Effect::Better));
        assert_eq!(run(0.01, 0.0102), Some(Effect::Same));
        assert_eq!(run(0.01, 0.0104), Some(Effect::Worse));
    }
}
