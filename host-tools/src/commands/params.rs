//! `bowden params`: the parameters of a board.

mod table;

use std::io::Write;
use std::path::PathBuf;

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::rig::Rig;
use bowden_host_link::from_rig::Transfer;
use bowden_host_link::{Client, ParameterSet, Unnoticed};
use serde::Serialize;
use table::TableArguments;

use super::port::PortArguments;
use super::{print, print_json};
use crate::cli::say;

/// Arguments of `bowden params`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Changes act at once and last until the board is switched off; `store` writes them to its flash. Some \
                  parameters, and `store`, need the bridge off.",
    // `--port` may stand behind the action too. A global argument cannot be required; it is missed all the same.
    mut_arg("port", |port| port.global(true).required(false)),
    mut_arg("timeout", |timeout| timeout.global(true))
)]
pub struct ParamsArguments {
    #[command(flatten)]
    port: PortArguments,
    /// Print JSON: `list` and `get` one array, one object a parameter; `from-rig` one object; `table` one object, or null
    #[arg(long, global = true)]
    json: bool,
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
        #[arg(required = true, value_name = "NAME=VALUE")]
        assignments: Vec<String>,
    },
    /// Set the parameters that a file names
    Load {
        /// File to read, as `save` writes it
        #[arg(value_name = "FILE.toml")]
        file: PathBuf,
    },
    /// Set the parameters to what a rig file says, such as the `rig.diagnosed.toml` of a diagnosis
    FromRig(FromRig),
    /// Write all parameters to a file
    Save {
        /// File to write
        #[arg(value_name = "FILE.toml")]
        file: PathBuf,
    },
    /// The table of the motor's torque ripple: show it, write it from a file, save it to one, or clear it
    Table(TableArguments),
    /// Write the parameters and the ripple table to the board's flash
    Store,
    /// Set all parameters to their defaults
    Default,
}

#[derive(Clone, Debug, clap::Args)]
struct FromRig {
    /// Rig file
    #[arg(value_name = "RIG.toml")]
    rig: PathBuf,
    /// Parameters under which the rig's recordings were made, if the board's are others by now: errors of sensors are
    /// relative to them
    #[arg(long, value_name = "FILE.toml")]
    recorded_with: Option<PathBuf>,
    /// Show what would be set, and change nothing
    #[arg(long)]
    dry_run: bool,
}

/// What a rig changes.
#[derive(Serialize)]
struct Transferred {
    /// Whether it is on the board.
    set: bool,
    #[serde(flatten)]
    transfer: Transfer,
}

impl FromRig {
    /// Shows what the rig changes, then sets it, all or nothing.
    fn run(&self, client: &mut Client, parameters: &ParameterSet, json: bool) -> Result<(), Failure> {
        let rig = Rig::load(&self.rig)?;
        let recorded = match &self.recorded_with {
            Some(file) => parameters.load(file)?,
            None => Vec::new(),
        };
        let transfer = Transfer::new(&rig, &self.rig.display().to_string(), parameters, &recorded)?;
        let values = transfer.values();
        self.transfer(client, parameters, transfer, &values, json)?;
        warn(&parameters.with(&values));
        Ok(())
    }

    /// Shows the changes and sets them.
    fn transfer(
        &self,
        client: &mut Client,
        parameters: &ParameterSet,
        transfer: Transfer,
        values: &[(u16, f32)],
        json: bool,
    ) -> Result<(), Failure> {
        if json {
            if !self.dry_run {
                parameters.replace(client, values)?;
            }
            return print_json(&Transferred { set: !self.dry_run, transfer });
        }
        print(&transfer.table())?;
        let count = match values.len() {
            1 => "1 parameter".to_owned(),
            count => format!("{count} parameters"),
        };
        if self.dry_run {
            return print(&format!("{count} would be set\n"));
        }
        parameters.replace(client, values)?;
        print(&format!("{count} set until the board is switched off; `store` keeps them\n"))
    }
}

/// Says on stderr what a set of parameters keeps the board from noticing; the exit status stays.
fn warn(parameters: &ParameterSet) {
    if let Some(Unnoticed { found, next }) = parameters.unnoticed() {
        say(&format!("warning: {found}; {next}"));
    }
}

impl ParamsArguments {
    /// Does what the action says.
    ///
    /// # Errors
    /// Exit status 2, if a name, value, file or the port is not usable; 1, if the board refused or the link broke.
    pub fn run(&self) -> Result<Outcome, Failure> {
        let tells = match &self.action {
            None | Some(Action::List | Action::Get { .. } | Action::FromRig(_)) => true,
            Some(Action::Table(table)) => table.only_shows(),
            _ => false,
        };
        if self.json && !tells {
            return Err(Failure::bad_input(
                "--json: only `list`, `get`, `from-rig` and `table` by itself print facts; leave it out",
            ));
        }
        match &self.action {
            Some(Action::Save { file }) => output::check_file(file, &[])?,
            Some(Action::Table(table)) => table.check()?,
            _ => {}
        }
        let mut client = self.port.connect()?;
        let parameters = ParameterSet::read(&mut client)?;
        match self.action.as_ref().unwrap_or(&Action::List) {
            Action::List if self.json => print_json(&parameters.all())?,
            Action::Get { name } if self.json => print_json(&[parameters.find(name)?])?,
            Action::List => print(&ParameterSet::table(parameters.all()))?,
            Action::Get { name } => print(&ParameterSet::table([parameters.find(name)?]))?,
            Action::Set { assignments } => {
                let values = assignments
                    .iter()
                    .map(|assignment| parameters.assignment(assignment))
                    .collect::<Result<Vec<_>, _>>()?;
                parameters.write(&mut client, &values)?;
                warn(&parameters.with(&values));
            }
            Action::Load { file } => {
                let values = parameters.load(file)?;
                parameters.write(&mut client, &values)?;
                warn(&parameters.with(&values));
            }
            Action::FromRig(from_rig) => from_rig.run(&mut client, &parameters, self.json)?,
            Action::Save { file } => {
                let text = parameters.to_toml();
                output::write_file(file, |file| file.write_all(text.as_bytes()))?;
            }
            Action::Table(table) => table.run(&mut client, &parameters, self.json)?,
            Action::Store => {
                client.store_parameters()?;
                warn(&parameters);
            }
            Action::Default => client.default_parameters()?,
        }
        Ok(Outcome::done())
    }
}
