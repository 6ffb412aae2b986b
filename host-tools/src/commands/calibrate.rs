//! `bowden calibrate`: measures what a board has to know of its sensors, wires and motor, with somebody at the bench.

use std::io::{self, IsTerminal};
use std::path::PathBuf;

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_host_link::Session;
use bowden_host_link::calibrate::dialog::Dialog;
use bowden_host_link::calibrate::{Setup, calibrate, steps};
use bowden_host_link::evidence::utc_now;

use super::port::PortArguments;
use super::print;
use crate::interrupt;

/// Arguments of `bowden calibrate`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "One question at a time; `stop` ends it, and the same command goes on behind the step that was done last. Answers may come \
                  from standard input, one a line. Each step says what it measured, and refuses what cannot be with the reason. Parameters are \
                  shown and asked for before they are set. The joint moves in the last step only, at a quarter of limits.torque. At a simulated \
                  board a simulated hand does what is asked for; `sim:swap=f1-f3,reversed=motor` is one that is wired wrongly."
)]
pub struct CalibrateArguments {
    #[command(flatten)]
    port: PortArguments,
    /// Calibration to write (schema bowden-calibration/1); one that is not finished is gone on with
    #[arg(long, value_name = "FILE.toml")]
    out: PathBuf,
    /// Store the parameters in the board's flash at the end, without asking
    #[arg(long)]
    store: bool,
    /// Show the steps, and do nothing
    #[arg(long)]
    dry_run: bool,
}

/// Asks at the terminal, or takes the lines of standard input.
struct Lines {
    /// Answers come from a file or pipe: they are shown behind their questions.
    echo: bool,
}

impl Dialog for Lines {
    fn show(&mut self, text: &str) -> Result<(), Failure> {
        print(text)
    }

    fn ask(&mut self, question: &str) -> Result<Option<String>, Failure> {
        print(question)?;
        let line = interrupt::read_line()?;
        if self.echo {
            print(&format!("{}\n", line.as_deref().unwrap_or_default().trim_end()))?;
        }
        Ok(line)
    }
}

impl CalibrateArguments {
    /// Calibrates the board.
    ///
    /// # Errors
    /// As [`calibrate`]; also exit status 2 if the port or the file is not usable.
    pub fn run(&self) -> Result<Outcome, Failure> {
        output::check_file(&self.out, &[])?;
        if self.dry_run {
            print(&steps())?;
            return Ok(Outcome::done());
        }
        interrupt::catch()?;
        let (client, mut hand) = self.port.connect_with_hand()?;
        let mut session = Session::new(client)?;
        let setup = Setup {
            out: &self.out,
            tool: super::origin().tool,
            now: &utc_now,
            store: self.store,
            stop: &interrupt::requested,
        };
        let mut dialog = Lines { echo: !io::stdin().is_terminal() };
        calibrate(&setup, &mut session, hand.as_mut(), &mut dialog)
    }
}
