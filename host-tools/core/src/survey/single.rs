//! The diagnosis of one recording of a survey.

use super::store::{Surveyed, key_of};
use super::task::{RIG_BESIDE, Task};
use crate::diagnose::diagnose;
use crate::outcome::Failure;
use crate::progress::Progress;
use crate::study::LoadedStudy;

impl Task {
    /// Diagnoses the recording; every third second of it judges.
    ///
    /// # Errors
    /// No rig, or what makes rig or recording unusable.
    pub fn diagnose(&self, progress: &dyn Progress) -> Result<Surveyed, Failure> {
        let rig = self.rig.as_ref().ok_or_else(|| {
            let shown = self.path.display();
            Failure::bad_input(format!(
                "{shown}: no rig: name one with --rig, or put a {RIG_BESIDE} beside the recording or above"
            ))
        })?;
        let key = key_of(&self.path, rig)?;
        let loaded = LoadedStudy::of_one_bench(rig, std::slice::from_ref(&self.path), &[])?;
        let recording = &loaded.study.recordings[0].recording;
        let (samples, duration_s, notes) =
            (recording.len(), recording.duration_s(), recording.notes().to_vec());
        let diagnosis = diagnose(&loaded.study, &[], progress)?.findings.diagnosis;
        Ok(Surveyed::new(self, key, (samples, duration_s), notes, diagnosis))
    }
}
