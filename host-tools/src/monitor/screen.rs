//! The terminal: taken over, drawn on, and given back as it was.

use std::io::{self, IsTerminal, Stdout};
use std::panic::PanicHookInfo;
use std::sync::Arc;

use bowden_core::outcome::Failure;
use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::cursor::{Hide, Show};
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{
    Clear, ClearType, EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use ratatui::{Frame, Terminal};

/// A terminal that was taken over; it is given back when this is dropped, and before a panic says its line.
pub struct Screen {
    terminal: Terminal<CrosstermBackend<Stdout>>,
}

impl Screen {
    /// Whether standard input and output are a terminal.
    ///
    /// # Errors
    /// Exit status 2, if they are none.
    pub fn check() -> Result<(), Failure> {
        if !io::stdin().is_terminal() || !io::stdout().is_terminal() {
            return Err(Failure::bad_input(
                "monitor: standard input and output are no terminal, which it reads keys from and draws on; run it in one, \
                 or use `bowden record`",
            ));
        }
        Ok(())
    }

    /// Takes over the terminal.
    ///
    /// # Errors
    /// Exit status 2, if it cannot be drawn on.
    pub fn open() -> Result<Self, Failure> {
        Self::take_over().map_err(|error| {
            give_back();
            Failure::bad_input(format!("monitor: the terminal cannot be drawn on: {error}; use another one"))
        })
    }

    fn take_over() -> io::Result<Self> {
        let before: Arc<dyn Fn(&PanicHookInfo) + Send + Sync> = std::panic::take_hook().into();
        std::panic::set_hook(Box::new(move |panic| {
            give_back();
            before(panic);
        }));
        enable_raw_mode()?;
        // `Terminal::clear` would ask where the cursor is, which not every terminal answers.
        execute!(io::stdout(), EnterAlternateScreen, Hide, Clear(ClearType::All))?;
        Ok(Self { terminal: Terminal::new(CrosstermBackend::new(io::stdout()))? })
    }

    /// Draws a picture.
    ///
    /// # Errors
    /// When the terminal is gone.
    pub fn draw(&mut self, picture: impl FnOnce(&mut Frame)) -> io::Result<()> {
        self.terminal.draw(picture)?;
        Ok(())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        give_back();
    }
}

/// A terminal that is gone needs nothing back.
fn give_back() {
    let _ = disable_raw_mode();
    let _ = execute!(io::stdout(), LeaveAlternateScreen, Show);
}
