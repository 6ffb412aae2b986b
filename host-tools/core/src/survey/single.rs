//! The diagnosis of one recording of a survey.

use super::store::{PROGRAM, Surveyed, key_of};
use super::task::{RIG_BESIDE, Task};
use crate::diagnose::diagnose;
use crate::guarded::{Panicked, guarded};
use crate::outcome::Failure;
use crate::progress::Progress;
use crate::study::LoadedStudy;

impl Task {
    /// Diagnoses the recording on one thread; every third second of it judges.
    ///
    /// # Errors
    /// No rig, or what makes rig or recording unusable; a panic of the diagnosis, which is a defect of this program and prints nothing, so
    /// that other recordings go on.
    pub fn diagnose(&self, progress: &dyn Progress) -> Result<Surveyed, Failure> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let pool = pool.map_err(|error| Failure::failed(format!("a thread cannot be started: {error}")))?;
        // Guarded within the pool, because the thread that panics is the one that would print.
        let result = pool.install(|| guarded(|| self.diagnose_here(progress)));
        result.unwrap_or_else(|panicked| Err(self.fault(&panicked)))
    }

    fn fault(&self, panicked: &Panicked) -> Failure {
        let at = panicked.place.as_ref().map(|place| format!(" at {place}")).unwrap_or_default();
        // Messages of assertions have several lines.
        let text = panicked.text.split_whitespace().collect::<Vec<_>>().join(" ");
        Failure::failed(format!(
            "{}: the diagnosis panicked{at} ({text}), a fault of bowden and not of the recording; report it with the recording and the rig file",
            self.path.display()
        ))
    }

    fn diagnose_here(&self, progress: &dyn Progress) -> Result<Surveyed, Failure> {
        let rig = self.rig.as_ref().ok_or_else(|| {
            let shown = self.path.display();
            Failure::bad_input(format!(
                "{shown}: no rig: name one with --rig, or put a {RIG_BESIDE} beside the recording or above"
            ))
        })?;
        let key = key_of(&self.path, rig, PROGRAM)?;
        let loaded = LoadedStudy::of_one_bench(rig, std::slice::from_ref(&self.path), &[])?;
        let recording = &loaded.study.recordings[0].recording;
        let (samples, duration_s, notes) =
            (recording.len(), recording.duration_s(), recording.notes().to_vec());
        let diagnosis = diagnose(&loaded.study, &[], progress)?.findings.diagnosis;
        Ok(Surveyed::new(self, key, (samples, duration_s), notes, diagnosis))
    }
}
