//! `bowden params`: the parameters of a board.

use std::io::Write;
use std::path::PathBuf;

use super::print;
use crate::link::{ParameterSet, PortArguments};
use crate::outcome::{Failure, Outcome};
use crate::output;

/// Arguments of `bowden params`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Changes act at once and last until the board is switched off; `store` writes them to its flash. Some \
                  parameters, and `store`, need the bridge off."
)]
pub struct ParamsArguments {
    #[command(flatten)]
    port: PortArguments,
    #[command(subcommand)]
    action: Option<Action>,
}

#[derive(Clone, Debug, clap::Subcommand)]
enum Action {
    /// All parameters with unit, range and default; this is done without an action too
    List,
    /// One parameter
    Get {
        /// Name, as in the list
        name: String,
    },
    /// Set parameters
    Set {
        /// Name, as in the list, and new value
        #[arg(required = true, value_name = "NAME=VALUE", allow_hyphen_values = true)]
        assignments: Vec<String>,
    },
    /// Set the parameters that a file names
    Load {
        /// File to read, as `save` writes it
        #[arg(value_name = "FILE.toml")]
        file: PathBuf,
    },
    /// Write all parameters to a file
    Save {
        /// File to write
        #[arg(value_name = "FILE.toml")]
        file: PathBuf,
    },
    /// Write the parameters to the board's flash
    Store,
    /// Set all parameters to their defaults
    Default,
}

impl ParamsArguments {
    /// Does what the action says.
    ///
    /// # Errors
    /// Exit status 2, if a name, value, file or the port is not usable; 1, if the board refused or the link broke.
    pub fn run(&self) -> Result<Outcome, Failure> {
        if let Some(Action::Save { file }) = &self.action {
            output::check_file(file, &[])?;
        }
        let mut client = self.port.connect()?;
        let parameters = ParameterSet::read(&mut client)?;
        match self.action.as_ref().unwrap_or(&Action::List) {
            Action::List => print(&ParameterSet::table(parameters.all()))?,
            Action::Get { name } => print(&ParameterSet::table([parameters.find(name)?]))?,
            Action::Set { assignments } => {
                let values = assignments
                    .iter()
                    .map(|assignment| parameters.assignment(assignment))
                    .collect::<Result<Vec<_>, _>>()?;
                parameters.write(&mut client, &values)?;
            }
            Action::Load { file } => {
                let values = parameters.load(file)?;
                parameters.write(&mut client, &values)?;
            }
            Action::Save { file } => {
                let text = parameters.to_toml();
                output::write_file(file, |file| file.write_all(text.as_bytes()))?;
            }
            Action::Store => client.store_parameters()?,
            Action::Default => client.default_parameters()?,
        }
        Ok(Outcome::done())
    }
}
