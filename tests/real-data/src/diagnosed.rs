//! What a diagnosis says about recordings of a real bench, in a few lines.

use std::path::{Path, PathBuf};

use bowden_core::diagnose::diagnose;
use bowden_core::diagnose::verdict::Diagnosis;
use bowden_core::outcome::Failure;
use bowden_core::progress::Quiet;
use bowden_core::recording::Recording;
use bowden_core::study::Study;

use super::{RigFile, Table};

/// A diagnosis that is to be made: what `bowden diagnose` is given.
#[derive(Clone, Debug)]
pub struct Case<'a> {
    /// The rig.
    pub rig: RigFile,
    /// Recordings without `.csv`, in the folder of the data set.
    pub training: Vec<&'a str>,
    /// Recordings that judge; none holds out every third second.
    pub heldout: Vec<&'a str>,
}

impl Case<'_> {
    /// The command that makes the same diagnosis, without its output folder.
    #[must_use]
    pub fn command(&self) -> String {
        let mut words = vec![format!("bowden diagnose --rig rigs/{}", self.rig.name)];
        words.extend(self.training.iter().map(|name| format!("{name}.csv")));
        words.extend((!self.heldout.is_empty()).then(|| "--heldout".to_owned()));
        words.extend(self.heldout.iter().map(|name| format!("{name}.csv")));
        words.join(" ")
    }

    /// Makes the diagnosis.
    ///
    /// # Errors
    /// When a file is missing or cannot be used with the rig.
    pub fn diagnose(&self, folder: &Path) -> Result<Diagnosis, Failure> {
        let rig = self.rig.parse()?;
        let load = |names: &[&str]| -> Result<Vec<Recording>, Failure> {
            let paths = names.iter().map(|name| folder.join(format!("{name}.csv")));
            paths.map(|path: PathBuf| rig.load_recording(&path)).collect()
        };
        let (training, heldout) = (load(&self.training)?, load(&self.heldout)?);
        let study = Study::of_bench(rig, training, heldout);
        Ok(diagnose(&study, &[], &Quiet)?.findings.diagnosis)
    }

    /// Makes the diagnosis and writes command, verdict, named physics and held-out errors.
    ///
    /// # Errors
    /// See [`Self::diagnose`].
    pub fn print(&self, folder: &Path, print: &mut impl FnMut(String)) -> Result<Diagnosis, Failure> {
        let diagnosis = self.diagnose(folder)?;
        print(format!("{}\n{}", self.command(), said(&diagnosis)));
        Ok(diagnosis)
    }
}

/// Verdict, named physics and held-out errors of a diagnosis.
#[must_use]
pub fn said(diagnosis: &Diagnosis) -> String {
    let mut lines = vec![format!("  {}", diagnosis.summary)];
    for effect in &diagnosis.effects {
        let on = effect.channel.as_ref().map_or(String::new(), |channel| format!(" on {channel}"));
        let values: Vec<String> =
            effect.parameters.iter().map(|(name, value)| format!("{name} {:.4}", value.value)).collect();
        lines.push(format!(
            "  named: {}{on}, probability {:.2}, {}",
            effect.id,
            effect.probability,
            values.join(", ")
        ));
        for instance in &effect.further {
            let values: Vec<String> =
                instance.iter().map(|(name, value)| format!("{name} {:.4}", value.value)).collect();
            lines.push(format!("    and {}", values.join(", ")));
        }
    }
    if let Some(unexplained) = &diagnosis.unexplained {
        lines.push(format!("  unexplained: {}", unexplained.sentence));
    }
    let mut table = Table::new(&["held out, root mean square", "rig as given", "recalibrated", "diagnosed"]);
    for (channel, fit) in &diagnosis.fit.channels {
        let values = [fit.before_rmse, fit.recalibrated_rmse, fit.after_rmse];
        table.row([channel.clone()].into_iter().chain(values.map(|value| format!("{value:.4}"))));
    }
    format!("{}\n{table}", lines.join("\n"))
}
