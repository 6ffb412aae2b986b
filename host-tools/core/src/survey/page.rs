//! The overview of a survey: one self-contained page, benches side by side.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::drift::{Drift, drifts};
use super::occurrences::{Since, occurrences};
use super::rows::{Status, SurveyRow};
use super::tables;
use crate::report::{figures, page};

/// Benches that are drawn, most troubled first; the others stand in the tables only, so that a browser can open the page.
const DRAWN_BENCHES: usize = 200;

/// Recordings of a bench that get a mark of their own; of more, every n-th.
const DRAWN_RECORDINGS: usize = 120;

/// Size of a bench's pictures, px.
const WIDTH: f64 = 320.0;
const LINE_HEIGHT: f64 = 46.0;
const STRIP_HEIGHT: f64 = 12.0;

/// Style beyond that of all pages: colours of the verdicts are those of the reports.
const CSS: &str = "
.benches { display: grid; grid-template-columns: repeat(auto-fill, minmax(350px, 1fr)); gap: 14px; }
.bench { border: 1px solid var(--rule); border-radius: 6px; padding: 10px 14px; }
.bench.troubled { border-left: 5px solid #963f00; }
.bench h3 { margin: 0 0 4px; font-size: 15px; overflow-wrap: anywhere; } .bench p { margin: 0; font-size: 13px; }
.bench svg { display: block; width: 100%; } .bench svg text { font-size: 11px; fill: var(--quiet); }
.consistent { fill: #00614a; } .recalibrate { fill: #004f7c; } .missing_physics { fill: #963f00; }
.unexplained { fill: #743a5c; } .failed { fill: #fff; stroke: #1f2328; } .left { fill: #d8dee4; }
.legend span { display: inline-block; width: 11px; height: 11px; margin: 0 5px 0 14px; }
.trend { fill: none; stroke: var(--after); stroke-width: 1.5; } .point { fill: var(--ink); } .error { stroke: var(--quiet); }
";

/// The page.
pub(super) fn render(name: &str, rows: &[SurveyRow<'_>]) -> String {
    let found = drifts(rows);
    let mut benches: Vec<BenchCard<'_, '_>> =
        SurveyRow::benches(rows).map(|(name, rows)| BenchCard::new(name, rows, &found)).collect();
    // Stable: benches of equal trouble stay in the order of their names.
    benches.sort_by_key(|bench| std::cmp::Reverse(bench.trouble()));
    let count = |status: &str| rows.iter().filter(|row| row.status.name() == status).count();
    let content = html! {
        header {
            h1 { "Survey of " (name) }
            p {
                (rows.len()) " recordings of " (benches.len()) " benches: " (count("done")) " diagnosed, "
                (count("failed")) " failed, " (count("left")) " still to do. Order is that of the files' names."
            }
        }
        (first_looks(&benches))
        (failures(rows))
        section {
            h2 { "Benches" }
            (legend())
            @if benches.len() > DRAWN_BENCHES {
                p { "Drawn are the " (DRAWN_BENCHES) " benches with most to look at; the tables have all." }
            }
            div.benches { @for bench in benches.iter().take(DRAWN_BENCHES) { (bench.card()) } }
        }
    };
    page::document(&format!("Survey of {name}"), CSS, &content).into_string()
}

/// A bench with its recordings and what drifts.
struct BenchCard<'p, 'r> {
    name: &'p str,
    rows: &'r [SurveyRow<'p>],
    drifting: Vec<&'r Drift>,
    /// Recordings in which each effect was named.
    effects: BTreeMap<String, Vec<usize>>,
}

impl<'p, 'r> BenchCard<'p, 'r> {
    fn new(name: &'p str, rows: &'r [SurveyRow<'p>], found: &'r [Drift]) -> Self {
        let drifting = found.iter().filter(|drift| drift.bench == name && drift.drifts()).collect();
        Self { name, rows, drifting, effects: occurrences(rows) }
    }

    /// How much there is to look at: drifts, then recordings with named effects.
    fn trouble(&self) -> (usize, usize) {
        (self.drifting.len(), self.effects.values().map(Vec::len).sum())
    }

    fn file(&self, place: usize) -> &str {
        let recording = self.rows[place].task.recording.as_str();
        recording.rsplit('/').next().unwrap_or(recording)
    }

    /// Since when, in words.
    fn since(&self, places: &[usize]) -> String {
        match Since::of(places, self.rows) {
            None => String::new(),
            Some(Since::Always(_)) => "in every recording".to_owned(),
            Some(Since::From(first)) => format!("since {}", self.file(first)),
            Some(Since::Once(only)) => format!("in {} alone", self.file(only)),
            Some(Since::Sometimes { count, diagnosed, first, last }) => {
                format!("in {count} of {diagnosed}, from {} to {}", self.file(first), self.file(last))
            }
        }
    }

    fn card(&self) -> Markup {
        let troubled = self.trouble() > (0, 0);
        let done = self.rows.iter().filter(|row| row.surveyed.is_some()).count();
        html! {
            article.bench.troubled[troubled] {
                h3 { (self.name) }
                p { (done) " of " (self.rows.len()) " recordings diagnosed" }
                (self.strip("verdicts", &|place| Some(class(&self.rows[place]))))
                @for (id, places) in &self.effects {
                    p { code { (id) } " " (self.since(places)) }
                    (self.strip(id, &|place| {
                        places.binary_search(&place).is_ok().then(|| "missing_physics".to_owned())
                    }))
                }
                @for drift in &self.drifting {
                    p {
                        code { (drift.parameter) } " drifts by " (figures::change(drift.first, drift.last)) ": "
                        (figures::quantity(drift.first, &drift.unit)) " → " (figures::quantity(drift.last, &drift.unit))
                    }
                    (self.line(drift))
                }
            }
        }
    }

    /// Where a recording stands, px.
    fn x(&self, place: usize) -> f64 {
        (place as f64 + 0.5) / self.rows.len() as f64 * WIDTH
    }

    /// One mark a recording, of the class that `class` gives it.
    fn strip(&self, title: &str, class: &dyn Fn(usize) -> Option<String>) -> Markup {
        let every = self.rows.len().div_ceil(DRAWN_RECORDINGS);
        let width = (WIDTH * every as f64 / self.rows.len() as f64 - 1.0).clamp(1.5, STRIP_HEIGHT);
        html! {
            svg viewBox=(format!("0 0 {WIDTH} {STRIP_HEIGHT}")) role="img" {
                title { (title) " by recording" }
                @for (place, row) in self.rows.iter().enumerate().step_by(every) {
                    @if let Some(class) = class(place) {
                        rect class=(class) x=(px(self.x(place) - width / 2.0)) y="1" width=(px(width)) height="10" {
                            title { (row.task.recording) ": " (said(row)) }
                        }
                    }
                }
            }
        }
    }

    /// A parameter over the recordings, with the line through it.
    fn line(&self, drift: &Drift) -> Markup {
        let every = drift.points.len().div_ceil(DRAWN_RECORDINGS);
        let ends = drift.points.iter().flat_map(|(_, value, std)| [value - std, value + std]);
        let (low, high) =
            ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), end| (low.min(end), high.max(end)));
        let y = |value: f64| 3.0 + (high - value) / (high - low).max(f64::MIN_POSITIVE) * (LINE_HEIGHT - 6.0);
        let (first, last) = (drift.points[0].0, drift.points[drift.points.len() - 1].0);
        html! {
            svg viewBox=(format!("0 0 {WIDTH} {LINE_HEIGHT}")) role="img" {
                title { (drift.parameter) " by recording" }
                @for (place, value, std) in drift.points.iter().step_by(every) {
                    line.error x1=(px(self.x(*place))) x2=(px(self.x(*place))) y1=(px(y(value - std))) y2=(px(y(value + std))) {}
                    circle.point cx=(px(self.x(*place))) cy=(px(y(*value))) r="2" {
                        title { (self.file(*place)) ": " (figures::quantity(*value, &drift.unit)) }
                    }
                }
                line.trend x1=(px(self.x(first))) x2=(px(self.x(last))) y1=(px(y(drift.first))) y2=(px(y(drift.last))) {}
            }
        }
    }
}

/// What to look at first: what drifts, and which effect is where.
fn first_looks(benches: &[BenchCard<'_, '_>]) -> Markup {
    let troubled: Vec<&BenchCard<'_, '_>> =
        benches.iter().filter(|bench| bench.trouble() > (0, 0)).take(DRAWN_BENCHES).collect();
    html! {
        section {
            h2 { "What to look at first" }
            @if troubled.is_empty() { p { "No bench drifts, and no recording lacks physics." } }
            @else { table {
                thead { tr {
                    th scope="col" { "Bench" } th scope="col" { "Drifts" } th scope="col" { "Effects, and since when" }
                } }
                tbody { @for bench in troubled { tr {
                    th scope="row" { (bench.name) }
                    td { @for drift in &bench.drifting {
                        div { code { (drift.parameter) } " " (figures::change(drift.first, drift.last)) }
                    } }
                    td { @for (id, places) in &bench.effects { div { code { (id) } " " (bench.since(places)) } } }
                } } }
            } }
        }
    }
}

fn failures(rows: &[SurveyRow<'_>]) -> Markup {
    let failed: Vec<&SurveyRow<'_>> =
        rows.iter().filter(|row| matches!(row.status, Status::Failed(_))).collect();
    html! {
        @if !failed.is_empty() { section {
            h2 { "What could not be diagnosed" }
            ul { @for row in failed.iter().take(DRAWN_BENCHES) { li { code { (row.task.recording) } " " (said(row)) } } }
        } }
    }
}

fn legend() -> Markup {
    let marks = [
        ("consistent", "consistent"),
        ("recalibrate", "recalibrate"),
        ("missing_physics", "missing physics"),
        ("unexplained", "unexplained"),
        ("failed", "failed"),
        ("left", "still to do"),
    ];
    html! {
        p.legend {
            @for (class, word) in marks {
                span { svg viewBox="0 0 11 11" { rect class=(class) x="0.5" y="0.5" width="10" height="10" {} } } (word)
            }
        }
    }
}

/// Class of a recording's mark.
fn class(row: &SurveyRow<'_>) -> String {
    match (&row.status, &row.surveyed) {
        (Status::Done, Some(surveyed)) => tables::verdict(&surveyed.diagnosis),
        (status, _) => status.name().to_owned(),
    }
}

fn said(row: &SurveyRow<'_>) -> String {
    match (&row.status, &row.surveyed) {
        (_, Some(surveyed)) => surveyed.diagnosis.summary.clone(),
        (Status::Failed(message), _) => message.clone(),
        _ => "still to do".to_owned(),
    }
}

/// Position, to a tenth of a pixel.
fn px(position: f64) -> String {
    format!("{position:.1}")
}
