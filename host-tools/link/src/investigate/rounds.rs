//! Diagnosis of what was recorded, and the experiments that it asks for.

use std::path::{Path, PathBuf};

use bowden_control::parameters::{Parameters, Reach};
use bowden_core::diagnose::verdict::{Diagnosis, Findings, Verdict};
use bowden_core::diagnose::{Allowed, Experiment, diagnose_within};
use bowden_core::outcome::Failure;
use bowden_core::progress::Progress;
use bowden_core::recording::Recording;
use bowden_core::report::files::{RIG, save};
use bowden_core::rig::Rig;
use bowden_core::study::{LoadedStudy, Role};
use serde::Serialize;

use super::demand::{Demand, demand_of};
use super::limits::Limits;
use crate::course::Track;

/// Samples a second at which a track is looked at, Hz.
const RATE_HZ: f64 = 1000.0;

/// Factor by which a track may exceed a limit: it was planned from recordings, which have noise.
const TOLERANCE: f64 = 1.02;

/// Part of its time that an experiment may rest. At rest friction is what the way there has left of it: a staircase that was
/// to separate `gear_load_friction` from an error of the current's gain (`sim:gear_load_friction:1,seed=702`, 90 s) made
/// the second diagnosis name `motor_coulomb_friction`.
const MOST_REST: f64 = 0.2;

/// A motion that separates two hypotheses, and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Asked {
    /// File with its reference in the folder of the diagnosis.
    pub file: String,
    /// The motion in words.
    pub motion: String,
    /// Difference of the mean losses of the two hypotheses; 1 is what noise and an ordinary bench leave.
    pub separation: f64,
    /// Why it was not done; `None` if it was.
    pub not_done: Option<String>,
}

/// One diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Round {
    /// Folder with its results, in that of the investigation.
    pub folder: String,
    /// Recordings that it learned from.
    pub recordings: Vec<String>,
    /// Recordings of experiments: it learned from two thirds of each and was judged by every third second.
    pub partly_heldout: Vec<String>,
    /// Recordings that judged it.
    pub heldout: Vec<String>,
    /// Result; the whole of it stands in the folder.
    pub diagnosis: Summary,
    /// Experiments that it asked for.
    pub experiments: Vec<Asked>,
}

/// What an investigation tells of a diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// In one word.
    pub verdict: Verdict,
    /// In two sentences.
    pub summary: String,
    /// Effects, most certain first.
    pub effects: Vec<bowden_core::diagnose::verdict::NamedEffect>,
    /// Loss on held-out data.
    pub heldout_loss: bowden_core::diagnose::verdict::StageLoss,
}

impl From<&Diagnosis> for Summary {
    fn from(diagnosis: &Diagnosis) -> Self {
        Self {
            verdict: diagnosis.verdict,
            summary: diagnosis.summary.clone(),
            effects: diagnosis.effects.clone(),
            heldout_loss: diagnosis.heldout_loss,
        }
    }
}

/// A diagnosis with what follows from it.
pub struct Diagnosed {
    /// Account of it.
    pub round: Round,
    /// The bench as it is now.
    pub rig: Rig,
    /// What would separate hypotheses that are left.
    pub experiments: Vec<Experiment>,
    /// Plots and numbers.
    pub findings: Findings,
    /// What was lost or repaired in the recordings.
    pub notes: Vec<String>,
}

/// What a diagnosis works on.
pub struct Case<'c> {
    /// Rig file.
    pub rig: &'c Path,
    /// Recordings to learn from.
    pub training: &'c [PathBuf],
    /// Recordings of experiments: to learn from, and every third second to judge by.
    pub experiments: &'c [PathBuf],
    /// Recordings to judge by.
    pub heldout: &'c [PathBuf],
    /// Folder of the investigation.
    pub folder: &'c Path,
    /// Name of the folder for the results in it.
    pub name: &'c str,
    /// Which experiments the joint may do.
    pub allowed: Allowed<'c>,
}

impl Case<'_> {
    /// Diagnoses as `bowden diagnose --heldout` does, and writes its files.
    ///
    /// # Errors
    /// As `bowden diagnose`; also if the user stopped it, with its files written.
    pub fn diagnose(&self, progress: &dyn Progress) -> Result<Diagnosed, Failure> {
        let LoadedStudy { study, mut documents, .. } =
            LoadedStudy::of_one_bench(self.rig, self.training, self.heldout)?;
        let document = &mut documents[0];
        let rig = &study.benches[0].rig;
        let experiments: Result<Vec<_>, Failure> =
            self.experiments.iter().map(|path| rig.load_recording(path)).collect();
        let study = study.with(experiments?, Role::Experiment);
        let diagnosed = diagnose_within(&study, &[], self.allowed, progress)?;
        let folder = self.folder.join(self.name);
        bowden_core::output::prepare_folder(&folder, &[], &[])?;
        save(&diagnosed, &mut [(RIG, &mut *document)], &folder)?;
        let diagnosis = &diagnosed.findings.diagnosis;
        if !diagnosis.complete {
            return Err(Failure::failed("stopped by the user during the diagnosis"));
        }
        let names = |paths: &[PathBuf]| -> Vec<String> {
            paths.iter().filter_map(|path| Some(path.file_name()?.to_string_lossy().into_owned())).collect()
        };
        let round = Round {
            folder: self.name.to_owned(),
            recordings: names(self.training),
            partly_heldout: names(self.experiments),
            heldout: names(self.heldout),
            diagnosis: Summary::from(diagnosis),
            experiments: Vec::new(),
        };
        Ok(Diagnosed {
            round,
            rig: document.rig()?,
            notes: study.recordings.iter().flat_map(|r| r.recording.notes().iter().cloned()).collect(),
            experiments: diagnosed.experiments,
            findings: diagnosed.findings,
        })
    }
}

/// The reference of an experiment, if the joint can do it within the limits and the time that is left.
///
/// # Errors
/// The reason why not.
pub fn track_within(
    reference: &Recording,
    limits: &Limits,
    spare_s: f64,
    parameters: &Parameters,
) -> Result<Track, String> {
    let track = Track::of_angle(reference).ok_or("it has no reference angle")?;
    let seconds = track.duration_s();
    if seconds > spare_s {
        return Err(format!("it takes {seconds:.0} s, {:.0} s are left of --time", spare_s.max(0.0)));
    }
    let angles = track.values_at(RATE_HZ);
    let resting = angles.windows(2).filter(|pair| pair[0] == pair[1]).count();
    if resting as f64 > MOST_REST * angles.len() as f64 {
        return Err("it rests, and friction at rest depends on how the joint came there".to_owned());
    }
    let [low, high] = limits.angle_rad;
    if let Some(angle) = angles.iter().find(|angle| **angle < TOLERANCE * low || **angle > TOLERANCE * high) {
        return Err(format!("it goes to {angle:.3} rad, allowed are {low:.3} to {high:.3} rad"));
    }
    let Demand { speed_rad_s, torque_nm, .. } =
        demand_of(&angles, 1.0 / RATE_HZ, parameters, &Reach::new(parameters));
    if speed_rad_s > limits.speed_rad_s {
        return Err(format!(
            "it moves at {speed_rad_s:.2} rad/s, allowed are {:.2} rad/s",
            limits.speed_rad_s
        ));
    }
    if torque_nm > limits.torque_nm {
        return Err(format!("it takes {torque_nm:.3} N·m, allowed are {:.3} N·m", limits.torque_nm));
    }
    Ok(track)
}

#[cfg(test)]
mod tests {
    use bowden_core::recording::Recording;
    use bowden_model::channel::Channel;

    use super::*;

    #[test]
    fn experiments_beyond_the_limits_are_left_out_with_the_reason() {
        let parameters = Parameters::default();
        let t_s: Vec<f64> = (0..12_000).map(|k| f64::from(k) * 1e-3).collect();
        let sine = |amplitude: f64, hz: f64| {
            let angles = t_s.iter().map(|t_s| amplitude * (std::f64::consts::TAU * hz * t_s).sin()).collect();
            Experiment {
                file: "separate-a-from-b.csv".to_owned(),
                words: "a sine".to_owned(),
                reference: Recording::new("experiment", t_s.clone()).with(Channel::ThetaRef, angles),
                separation: 1.0,
            }
        };
        let limits = Limits { angle_rad: [-0.5, 0.5], torque_nm: 0.5, speed_rad_s: 1.0, time_s: 100.0 };
        let verdict = |experiment: &Experiment, spare_s| {
            track_within(&experiment.reference, &limits, spare_s, &parameters).map(|track| track.duration_s())
        };
        assert!(verdict(&sine(0.4, 0.25), 20.0).is_ok_and(|seconds| (seconds - 12.0).abs() < 0.01));
        for (experiment, spare_s, expected) in [
            (sine(0.4, 0.25), 5.0, "it takes 12 s, 5 s are left"),
            (sine(0.6, 0.25), 20.0, "it goes to 0.51"),
            (sine(0.4, 0.8), 20.0, "it moves at 2.01 rad/s"),
            (sine(0.0, 0.8), 20.0, "it rests"),
        ] {
            let reason = verdict(&experiment, spare_s).unwrap_err();
            assert!(reason.starts_with(expected), "{reason}");
        }
    }
}
