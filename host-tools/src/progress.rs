//! Shows the progress of long work on stderr.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use bowden_core::progress::{Progress, Quiet};
use indicatif::{ProgressBar, ProgressStyle};

use crate::interrupt;

/// The progress display for this process: a bar on a terminal, else now and then a line, nothing when `quiet`.
pub fn for_stderr(quiet: bool) -> Box<dyn Progress> {
    if quiet {
        Box::new(Quiet)
    } else if std::io::stderr().is_terminal() {
        Box::new(Bar::new())
    } else {
        Box::new(Lines::new(LINE_INTERVAL))
    }
}

/// Shows that work without steps goes on, until it is done.
pub fn under_way<T>(quiet: bool, stage: &str, work: impl FnOnce() -> T) -> T {
    let progress = for_stderr(quiet);
    progress.stage(stage, 0);
    work()
}

/// Time between two lines where there is no terminal: short commands leave a log empty, long ones show life.
const LINE_INTERVAL: Duration = Duration::from_secs(10);

/// Another display, for work that Ctrl-C ends early; to be used after [`interrupt::catch`].
pub struct UntilInterrupted<'a>(pub &'a dyn Progress);

impl Progress for UntilInterrupted<'_> {
    fn stage(&self, name: &str, steps: u64) {
        self.0.stage(name, steps);
    }

    fn advance(&self, steps: u64) {
        self.0.advance(steps);
    }

    fn interrupted(&self) -> bool {
        interrupt::requested()
    }
}

/// A bar that is redrawn in place and vanishes at the end.
struct Bar(ProgressBar);

impl Bar {
    fn new() -> Self {
        let bar = ProgressBar::new_spinner();
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(bar)
    }
}

impl Progress for Bar {
    fn stage(&self, name: &str, steps: u64) {
        let template =
            if steps > 0 { "{msg} [{bar:30}] {pos}/{len} {elapsed}" } else { "{msg} {spinner} {elapsed}" };
        if let Ok(style) = ProgressStyle::with_template(template) {
            self.0.set_style(style.progress_chars("=> "));
        }
        self.0.set_length(steps);
        self.0.set_position(0);
        self.0.set_message(name.to_owned());
    }

    fn advance(&self, steps: u64) {
        self.0.inc(steps);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// One line at most every interval.
struct Lines {
    interval: Duration,
    state: Mutex<LineState>,
}

struct LineState {
    stage: String,
    steps: u64,
    done: u64,
    last: Instant,
}

impl Lines {
    fn new(interval: Duration) -> Self {
        let state = LineState { stage: String::new(), steps: 0, done: 0, last: Instant::now() };
        Self { interval, state: Mutex::new(state) }
    }

    fn update(&self, change: impl FnOnce(&mut LineState)) {
        let Ok(mut state) = self.state.lock() else { return };
        change(&mut state);
        if state.last.elapsed() >= self.interval {
            state.last = Instant::now();
            let line = state.line();
            // A closed stderr must not stop the work.
            let _ = writeln!(std::io::stderr(), "{line}");
        }
    }
}

impl LineState {
    fn line(&self) -> String {
        match self.steps {
            0 => format!("{} ...", self.stage),
            steps => format!("{}: {} of {steps}", self.stage, self.done),
        }
    }
}

impl Progress for Lines {
    fn stage(&self, name: &str, steps: u64) {
        self.update(|state| {
            name.clone_into(&mut state.stage);
            state.steps = steps;
            state.done = 0;
        });
    }

    fn advance(&self, steps: u64) {
        self.update(|state| state.done += steps);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_tells_stage_and_steps_and_a_new_stage_starts_at_zero() {
        let lines = Lines::new(Duration::MAX);
        lines.stage("fit", 8);
        lines.advance(3);
        lines.advance(2);
        assert_eq!(lines.state.lock().unwrap().line(), "fit: 5 of 8");
        lines.stage("report", 0);
        assert_eq!(lines.state.lock().unwrap().line(), "report ...");
    }
}
