//! `bowden effect`: effects of the catalogue, made from what diagnoses have found.

use std::io::Write;
use std::path::PathBuf;

use bowden_core::effect_source::{effect_source, laws_of, registration};
use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::rig::Rig;

use super::print;

/// Rig file that a diagnosis leaves in its folder.
const DIAGNOSED: &str = "rig.diagnosed.toml";

/// Arguments of `bowden effect`.
#[derive(Clone, Debug, clap::Args)]
pub struct EffectArguments {
    #[command(subcommand)]
    command: EffectCommand,
}

#[derive(Clone, Debug, clap::Subcommand)]
enum EffectCommand {
    /// Write a law that a diagnosis has found as an effect file, with its test, ready to join the catalogue
    New(NewArguments),
}

/// Arguments of `bowden effect new`.
#[derive(Clone, Debug, clap::Args)]
struct NewArguments {
    /// Folder of a diagnosis, the one that its --out named
    #[arg(long, value_name = "DIR")]
    from: PathBuf,
    /// Name of the effect in rig files and reports, for example `joint_oil_drag`
    #[arg(long, value_name = "NAME")]
    id: String,
    /// Which law of the diagnosis, where it has found several
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    law: u16,
    /// File to write [default: NAME.rs]
    #[arg(long, value_name = "FILE.rs")]
    out: Option<PathBuf>,
}

impl EffectArguments {
    /// Writes the file and prints how to register it.
    ///
    /// # Errors
    /// When the diagnosis holds no such law, the name is none for an effect, or the file cannot be written.
    pub fn run(&self) -> Result<Outcome, Failure> {
        let EffectCommand::New(NewArguments { from, id, law, out }) = &self.command;
        let file = from.join(DIAGNOSED);
        let laws = laws_of(&Rig::load(&file)?);
        let (found, active) = laws.get(usize::from(*law) - 1).ok_or_else(|| {
            let held = match laws.len() {
                0 => "no law; run `bowden diagnose` on a bench with physics that has no name".to_owned(),
                count => format!("{count}; give --law 1 to {count}"),
            };
            Failure::bad_input(format!("{}: law {law} is asked for, the file holds {held}", file.display()))
        })?;
        let source = effect_source(found, active, id)?;
        let out = out.clone().unwrap_or_else(|| PathBuf::from(format!("{id}.rs")));
        output::check_file(&out, &[&file])?;
        output::write_file(&out, |file| file.write_all(source.as_bytes()))?;
        print(&format!("{}: {}\n{}", out.display(), found.formula(), registration(id)))?;
        Ok(Outcome::done())
    }
}
