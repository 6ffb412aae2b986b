//! What each correction of the board gains: the joint with an effect, without and with what `bowden params from-rig` sets.
//!
//! [`cases`] lists effects and references. A [`Case`] is run on a board whose flash holds its parameters: as they are, after
//! `from-rig` with a rig that states the true physics, after `from-rig` with a rig that `bowden diagnose` wrote.

pub mod cases;
pub mod diagnosis;
pub mod page;
pub mod record;

use std::fs;
use std::path::Path;

use bowden_board::Board;
use bowden_control::parameters::Parameters;
use bowden_link::ToBoard;
use bowden_link::message::{Mode, Reference};
use virtual_bench::ConcealedEffect;

use crate::host::Host;
use crate::tool::Plugged;
use crate::trial::{Moment, Trial, error_of};
use crate::{Failure, Outcome, fail};

/// An effect, what a rig file says of it, and the run that shows it.
#[derive(Debug, Clone)]
pub struct Case {
    /// Name, for tables and folders.
    pub name: &'static str,
    /// The effect on the virtual bench.
    pub effect: ConcealedEffect,
    /// The same in the keys of a rig file.
    pub rig: String,
    /// Run that shows it, the effect left out.
    pub trial: Trial,
    /// Error that is measured.
    pub error: fn(&Moment) -> f64,
    /// Unit of that error, a thousandth of it, and what is followed.
    pub shown: &'static str,
}

/// Parameters of a board, stored.
#[derive(Debug, Clone)]
pub struct Stored {
    /// Content of the flash.
    pub flash: Vec<u8>,
    /// The values in it.
    pub parameters: Parameters,
}

/// Errors of a case with one set of parameters, root of the mean square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// With the image on the emulated board.
    pub on_image: f64,
    /// With the control code alone.
    pub natively: f64,
}

impl Case {
    /// The same with less time to settle and one period measured.
    #[must_use]
    pub fn brief(mut self) -> Self {
        // In torque mode the joint swings up to 1.8 s after homing, by how much hangs on the noise of the sensors.
        self.trial.settle_s = if self.trial.mode == Mode::Torque { 2.0 } else { 0.6 };
        if let Reference::Generated { frequency_hz, .. } = self.trial.reference {
            self.trial.measured_s = 1.0 / f64::from(frequency_hz);
        }
        self
    }

    /// The rig file of the joint without the effect.
    pub fn rig_without(&self) -> String {
        self.trial.bench.rig_toml(self.name)
    }

    /// The rig file that states the effect.
    pub fn rig_with(&self) -> Outcome<String> {
        let (before, none) = (self.rig_without(), "effects = []");
        let id = self.effect.id();
        let stated = before.replace(none, &format!("effects = [\"{id}\"]\n\n[effects.{id}]\n{}", self.rig));
        if stated == before {
            fail(format!("{}: the rig has no line `{none}`", self.name))
        } else {
            Ok(stated)
        }
    }

    /// Parameters of the case, stored.
    pub fn stored(&self, elf: &[u8]) -> Outcome<Stored> {
        let mut host = Host::connect(Board::builder(elf).bench(&self.trial.bench, &[]).build()?)?;
        host.set_all(&self.trial.parameters)?;
        host.order(&ToBoard::StoreParameters)?;
        let parameters = self.trial.parameters.clone();
        Ok(Stored { flash: host.board.flash_image().to_vec(), parameters })
    }

    /// What `bowden params from-rig` makes of `stored` with this rig file.
    pub fn from_rig(&self, elf: &[u8], stored: &Stored, rig: &Path) -> Outcome<Stored> {
        let board = Board::builder(elf).bench(&self.trial.bench, &[]).flash_image(&stored.flash).build()?;
        let mut plugged = Plugged::new(board)?;
        let rig = rig.to_str().ok_or_else(|| Failure(format!("{}: not UTF-8", rig.display())))?;
        for arguments in [["from-rig", rig].as_slice(), &["store"]] {
            let ran = plugged.run("params", arguments)?;
            if ran.status != Some(0) {
                return fail(format!("{}: params {arguments:?}: {}", self.name, ran.errors.trim()));
            }
        }
        let mut host = Host::connect(plugged.board)?;
        let mut parameters = Parameters::default();
        for (index, value) in host.all_values()?.into_iter().enumerate() {
            parameters
                .set(index as u16, value)
                .map_err(|refusal| Failure(format!("{}: parameter {index}: {refusal}", self.name)))?;
        }
        Ok(Stored { flash: host.board.flash_image().to_vec(), parameters })
    }

    /// What the true physics make of `stored`; the rig file is written to `folder`.
    pub fn truly_corrected(&self, elf: &[u8], stored: &Stored, folder: &Path) -> Outcome<Stored> {
        let rig = folder.join(format!("{}.true.toml", self.name));
        write(&rig, &self.rig_with()?)?;
        self.from_rig(elf, stored, &rig)
    }

    /// Error of the joint without the effect, with the control code alone.
    pub fn without(&self) -> Outcome<f64> {
        Ok(error_of(&self.trial.natively()?, self.error).rms)
    }

    /// The run with the effect and these parameters.
    fn trial_with(&self, stored: &Stored) -> Trial {
        let effects = vec![self.effect.clone()];
        Trial { effects, parameters: stored.parameters.clone(), ..self.trial.clone() }
    }

    fn named(&self) -> impl Fn(Failure) -> Failure {
        let name = self.name;
        move |Failure(text)| Failure(format!("{name}: {text}"))
    }

    /// Error of the joint with its effect and these parameters, with the control code alone.
    pub fn natively(&self, stored: &Stored) -> Outcome<f64> {
        let course = self.trial_with(stored).natively().map_err(self.named())?;
        Ok(error_of(&course, self.error).rms)
    }

    /// Errors of the joint with its effect and these parameters.
    pub fn errors(&self, elf: &[u8], stored: &Stored) -> Outcome<Errors> {
        let natively = self.natively(stored)?;
        let trial = self.trial_with(stored);
        let board = Board::builder(elf)
            .bench(&trial.bench, &trial.effects)
            .seed(trial.seed)
            .flash_image(&stored.flash);
        let mut host = Host::connect(board.build()?)?;
        host.make_ready().map_err(self.named())?;
        if trial.homes {
            host.home().map_err(self.named())?;
        }
        let on_image = error_of(&trial.follow(&mut host).map_err(self.named())?, self.error).rms;
        Ok(Errors { on_image, natively })
    }
}

/// Writes a file, its folder included.
pub fn write(path: &Path, text: &str) -> Outcome {
    let told = |error: std::io::Error| Failure(format!("{}: {error}", path.display()));
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(told)?;
    }
    fs::write(path, text).map_err(told)
}
