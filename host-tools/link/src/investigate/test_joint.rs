//! The simulated joint under an investigation, for tests: virtual time, nothing concealed.

use std::path::Path;
use std::time::Duration;

use bowden_core::outcome::Failure;
use bowden_core::progress::Quiet;
use bowden_core::rig::Rig;

use super::driver::Driver;
use super::limits::Wishes;
use super::plan::Plan;
use super::report::Investigation;
use super::{Diagnose, Dialog, Setup, Work};
use crate::Client;
use crate::evidence::Origin;
use crate::session::Session;
use crate::sim::SimTransport;

/// Gives one answer to every question.
struct Answers(bool);

impl Dialog for Answers {
    fn show(&self, _text: &str) -> Result<(), Failure> {
        Ok(())
    }

    fn may(&self, _question: &str) -> Result<bool, Failure> {
        Ok(self.0)
    }
}

/// The bench of the data sheet with `effects`, text of the rig format, that it does not have.
pub(super) fn rig(pretension_n: f64, effects: &str) -> Rig {
    let nominal = virtual_bench::nominal_rig_toml("bench");
    let text = nominal
        .replace("pretension_n = 30.0", &format!("pretension_n = {pretension_n:?}"))
        .replace("effects = []", effects);
    Rig::parse(&text, "rig.toml").unwrap()
}

/// An investigation of the simulated joint, before anything moved.
pub(super) fn with_work<T>(
    wishes: Wishes,
    answer: bool,
    diagnose: Diagnose,
    act: impl FnOnce(&mut Work, &mut Investigation) -> T,
) -> T {
    let folder = tempfile::tempdir().unwrap();
    let client = Client::connect(Box::new(SimTransport::new()), "sim", Duration::from_secs(1)).unwrap();
    let session = Session::new(client).unwrap();
    let parameters = session.parameters().clone();
    let plan = Plan::new(&parameters.control(), &wishes).unwrap();
    let mut account = Investigation::new("bench", &parameters, plan);
    let (rig_file, folder) = (Path::new("rig.toml"), folder.path());
    let setup = Setup {
        rig: rig_file,
        folder,
        wishes,
        ending: "csv",
        every: 10,
        origin: Origin::default(),
        dry_run: false,
    };
    let driver = Driver {
        session,
        folder,
        origin: Origin::default(),
        ending: "csv",
        every: 10,
        stop: &|| false,
        progress: &Quiet,
        recorded: Vec::new(),
        notes: Vec::new(),
    };
    let given = rig(30.0, "effects = []");
    let mut work = Work { setup: &setup, given, driver, dialog: &Answers(answer), diagnose };
    act(&mut work, &mut account)
}
