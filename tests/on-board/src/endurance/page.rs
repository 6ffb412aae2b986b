//! The page `tests/docs/endurance.md`. Each run has a section of its own; one that was not made again keeps its section.

use std::fmt::Write as _;

use super::check::table;
use super::drift::Span;
use super::emulated::EmulatedRun;
use super::native::NativeRun;
use crate::ticks::CYCLES_PER_US;

/// Headings of the sections.
const WRAP: &str = "## The end of every counter";
const NATIVE: &str = "## Control and services natively";
const EMULATED: &str = "## Release image on the emulated board";

/// Text of a section that was never written.
const NOT_RUN: &str = "Not run yet.\n";

/// The sections of a page.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Sections {
    /// The run in which the counters pass their ends.
    pub wrap: Option<String>,
    /// The long run natively.
    pub native: Option<String>,
    /// The run on the emulated board.
    pub emulated: Option<String>,
}

impl Sections {
    /// Those of a page.
    pub fn of(page: &str) -> Self {
        let section = |heading: &str| {
            let behind = page.split_once(&format!("{heading}\n\n"))?.1;
            let text = behind.split_once("\n## ").map_or(behind, |(text, _)| text);
            let text = format!("{}\n", text.trim_end());
            (text != NOT_RUN).then_some(text)
        };
        Self { wrap: section(WRAP), native: section(NATIVE), emulated: section(EMULATED) }
    }

    /// The page of them.
    pub fn page(&self) -> String {
        let mut page = String::from(
            "# Long runs\n\n\
             `cargo xtask endure` drives the joint for a day of board time with the board's control and services natively, then for ten\n\
             minutes with the release image on the emulated board, at 10 kHz with telemetry of every tick, and wrote this page. A day\n\
             natively has 864 million ticks; the counters that wrap later than that are started shortly before their ends in a run of its\n\
             own: ticks after 119 h, milliseconds after 49.7 days.\n\n\
             The error is the true angle of the joint less the reference of the same tick. The parts of a span are single periods of the\n\
             reference; spans may differ by four standard errors, which follow from how much the parts of the first one differ, or\n\
             by a two-hundredth of an encoder's step (0.0077 mrad), whichever is more.\n",
        );
        for (heading, text) in [(WRAP, &self.wrap), (NATIVE, &self.native), (EMULATED, &self.emulated)] {
            let _ = write!(page, "\n{heading}\n\n{}", text.as_deref().unwrap_or(NOT_RUN));
        }
        page
    }
}

fn errors(span: &Span) -> String {
    format!("{:.4} | {:+.4} | {:.3}", 1e3 * span.rms_rad, 1e3 * span.mean_rad, 1e3 * span.largest_rad)
}

/// Section of a native run, whose spans have this name.
pub fn native(run: &NativeRun, span: &str, provenance: &str) -> String {
    let mut text = format!(
        "{provenance}. {} ticks were driven, a sine of 7 rad at 0.05 Hz; both encoders crossed the border of a turn {} times. A tick took \
         {:.0} ns\nof this machine with control, services, joint, frames, client and session. Every sample was decoded and compared.\n\n{}\n\
         | {span} | RMS, mrad | mean, mrad | largest, mrad | memory, KiB |\n|---|---|---|---|---|\n",
        run.ticks,
        run.borders,
        run.tick_ns,
        table(&run.all_checks())
    );
    for (number, (span, kib)) in (1..).zip(run.spans.iter().zip(&run.memory_kib)) {
        let _ = writeln!(text, "| {number} | {} | {kib} |", errors(span));
    }
    text
}

/// Section of a run on the emulated board, whose spans have this name.
pub fn emulated(run: &EmulatedRun, span: &str, provenance: &str) -> String {
    let mut text = format!(
        "{provenance}. {} samples were received; a sine of 0.3 rad at 1 Hz. Cycles are a lower bound, without flash wait states.\n\n{}\n\
         | {span} | RMS, mrad | mean, mrad | largest, mrad | longest tick, us | mean tick, us | jitter, us | stack, bytes | memory of \
         the host, KiB |\n|---|---|---|---|---|---|---|---|---|\n",
        run.samples,
        table(&run.all_checks())
    );
    let us = |cycles: f64| cycles / CYCLES_PER_US;
    for (number, (span, upkeep)) in (1..).zip(run.spans.iter().zip(&run.upkeep)) {
        let _ = writeln!(
            text,
            "| {number} | {} | {:.2} | {:.2} | {:.2} | {} | {} |",
            errors(span),
            us(upkeep.busy.max as f64),
            us(upkeep.busy.mean()),
            us(upkeep.period.spread() as f64),
            upkeep.stack_bytes,
            upkeep.memory_kib
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_that_was_not_run_again_is_kept() {
        let empty = Sections::default();
        assert_eq!(empty.page().matches("Not run yet.").count(), 3);
        assert_eq!(Sections::of(&empty.page()), empty);
        let native = Some("Yesterday.\n\n| a |\n|---|\n".to_owned());
        let first = Sections { native: native.clone(), ..Sections::default() };
        let again = Sections { emulated: Some("Today.\n".to_owned()), ..Sections::of(&first.page()) };
        assert_eq!(Sections::of(&again.page()), again);
        assert_eq!(again.native, native);
    }
}
