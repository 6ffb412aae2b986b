//! `bowden rig` and `bowden export`: rigs from other simulators' models, and what was found back to them.

use std::io::Write;
use std::path::{Path, PathBuf};

use bowden_core::neighbours::{Imported, Mapped, from_mjcf, from_urdf, into_mjcf, to_mjcf};
use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::rig::{Rig, RigDocument};

use super::print;

/// Arguments of `bowden rig`.
#[derive(Clone, Debug, clap::Args)]
pub struct RigArguments {
    #[command(subcommand)]
    command: RigCommand,
}

#[derive(Clone, Debug, clap::Subcommand)]
enum RigCommand {
    /// Make a rig of what a MuJoCo model says of a joint; prints every statement and what became of it
    FromMujoco(FromArguments),
    /// Make a rig of what a URDF says of a joint; prints every statement and what became of it
    FromUrdf(FromArguments),
}

/// Arguments of `bowden rig from-...`.
#[derive(Clone, Debug, clap::Args)]
struct FromArguments {
    /// Model to read
    model: PathBuf,
    /// Which joint of it, a hinge
    #[arg(long, value_name = "NAME")]
    joint: String,
    /// Rig with what such a model does not know: motor, pulleys, tendon, sheath, sensors
    #[arg(long, value_name = "RIG.toml")]
    base: PathBuf,
    /// Rig file to write
    #[arg(long, value_name = "RIG.toml")]
    out: PathBuf,
}

impl RigArguments {
    /// Writes the rig and says line by line what it is made of.
    ///
    /// # Errors
    /// What makes the model unusable or the output impossible.
    pub fn run(&self) -> Result<Outcome, Failure> {
        match &self.command {
            RigCommand::FromMujoco(arguments) => arguments.write(from_mjcf),
            RigCommand::FromUrdf(arguments) => arguments.write(from_urdf),
        }
    }
}

impl FromArguments {
    fn write(&self, read: fn(&Path, &str) -> Result<Imported, Failure>) -> Result<Outcome, Failure> {
        output::check_file(&self.out, &[&self.model, &self.base])?;
        let imported = read(&self.model, &self.joint)?;
        let document = imported.document(RigDocument::load(&self.base)?)?;
        document.save(&self.out)?;
        say(&imported.mapped)?;
        let (out, base) = (self.out.display(), self.base.display());
        print(&format!("{out}: {base} with the load of {}\n", self.joint))?;
        Ok(Outcome::done())
    }
}

/// Arguments of `bowden export`.
#[derive(Clone, Debug, clap::Args)]
pub struct ExportArguments {
    #[command(subcommand)]
    command: ExportCommand,
}

#[derive(Clone, Debug, clap::Subcommand)]
enum ExportCommand {
    /// Write a rig as a MuJoCo model, or its joint's values into one
    Mujoco(MujocoArguments),
}

/// Arguments of `bowden export mujoco`.
#[derive(Clone, Debug, clap::Args)]
struct MujocoArguments {
    /// Rig, for example the diagnosed one
    rig: PathBuf,
    /// MuJoCo model whose joint gets damping, frictionloss, armature and stiffness; without it a model of the rig itself is written
    #[arg(long, value_name = "MODEL.xml", requires = "joint")]
    into: Option<PathBuf>,
    /// Which joint of that model
    #[arg(long, value_name = "NAME", requires = "into")]
    joint: Option<String>,
    /// Model to write
    #[arg(long, value_name = "MODEL.xml")]
    out: PathBuf,
}

impl ExportArguments {
    /// Writes the model and says what became of every value of the rig.
    ///
    /// # Errors
    /// What makes rig or model unusable or the output impossible.
    pub fn run(&self) -> Result<Outcome, Failure> {
        let ExportCommand::Mujoco(MujocoArguments { rig, into, joint, out }) = &self.command;
        let inputs: Vec<&Path> = std::iter::once(rig).chain(into).map(PathBuf::as_path).collect();
        output::check_file(out, &inputs)?;
        let loaded = Rig::load(rig)?;
        let (text, mapped) = match (into, joint) {
            (Some(model), Some(joint)) => into_mjcf(&loaded, model, joint)?,
            _ => to_mjcf(&loaded)?,
        };
        output::write_file(out, |file| file.write_all(text.as_bytes()))?;
        say(&mapped)?;
        print(&format!("{}: MuJoCo model of {}\n", out.display(), rig.display()))?;
        Ok(Outcome::done())
    }
}

fn say(mapped: &[Mapped]) -> Result<(), Failure> {
    mapped.iter().try_for_each(|one| print(&format!("{one}\n")))
}
