//! Traces: recording and simulations over time, what is left of each, held-out stretches shaded.

use std::fmt::Write;

use maud::{Markup, html};

use crate::diagnose::verdict::{Findings, Trace};

use super::axis::{self, Axis};
use super::envelope::envelope;
use super::{figures, names};

/// Width of a figure, px.
const WIDTH: f64 = 1080.0;
/// Left end of the time axis, px; labels of values stand before it.
const LEFT: f64 = 58.0;
/// Right end of the time axis, px.
const RIGHT: f64 = 1070.0;
/// Room above each strip for its name and key, px.
const HEADING: f64 = 24.0;
/// Room below the last strip for labels of time, px.
const FOOT: f64 = 34.0;
/// Height of the strip with the signal, px, without room for names of onsets.
const SIGNAL_HEIGHT: f64 = 170.0;
/// Height of one name of an onset, px.
const ONSET: f64 = 17.0;
/// Enlargement from which on the rest after diagnosis gets a strip of its own.
const WORTH_ENLARGING: f64 = 2.0;

/// Section with one figure a channel.
pub(super) fn section(findings: &Findings) -> Markup {
    let traces = &findings.traces;
    let times = axis::range(traces.iter().flat_map(|trace| trace.t_s.iter().copied()));
    html! {
        section #traces {
            h2 { "Traces" }
            @if let Some((from_s, to_s)) = times {
                p.caption {
                    "Each column of pixels shows the lowest and the highest sample that fall into it, so short spikes "
                    "stay visible. Grey stretches were held out of the fit. Time runs alike in all figures."
                }
                @for trace in traces { (figure(findings, trace, &Axis::exact(from_s, to_s, 10))) }
            } @else {
                p { "No traces were kept." }
            }
        }
    }
}

/// Line or area of a figure: how it is drawn, and how the key calls it.
#[derive(Clone, Copy)]
struct Style {
    class: &'static str,
    name: &'static str,
}

/// What the three lines of a figure are called, and their differences.
#[derive(Clone, Copy)]
struct Words {
    measured: Style,
    before: Style,
    after: Style,
    difference: &'static str,
    enlarged: &'static str,
}

/// A recording and its simulations.
const SIMULATION: Words = Words {
    measured: Style { class: "measured", name: "measured" },
    before: Style { class: "before", name: "rig file" },
    after: Style { class: "after", name: "diagnosed" },
    difference: "Measured − simulated",
    enlarged: "Measured − diagnosed",
};
/// A reference, and the joint that follows it with two sets of parameters.
const TRACKING: Words = Words {
    measured: Style { class: "measured", name: "reference" },
    before: Style { class: "before", name: "before" },
    after: Style { class: "after", name: "after" },
    difference: "Reference − joint",
    enlarged: "Reference − joint after",
};
const NOISE: Style = Style { class: "noise", name: "±2 × noise" };
const HELD_OUT: Style = Style { class: "held-out", name: "held out" };
/// Bounds that are drawn for noise, in standard deviations: white noise is inside for 95 of 100 samples.
const NOISE_BAND: f64 = 2.0;

/// One strip of a figure.
struct Strip<'t> {
    heading: String,
    /// Drawn in this order.
    series: Vec<(Style, &'t [f64])>,
    axis: Axis,
    /// Whether the strip shows differences: then zero stands out.
    is_residual: bool,
    /// Noise floor, where the strip shows it.
    noise: Option<f64>,
    height: f64,
}

fn figure(findings: &Findings, trace: &Trace, time: &Axis) -> Markup {
    let name = names::channel(&trace.channel);
    let caption = html! { (name) " " code { (trace.channel) } };
    let noise = findings.diagnosis.fit.channels.get(&trace.channel).map(|rmse| rmse.noise_rmse);
    let onsets = onsets(findings, trace, time);
    lines(trace, time, &SIMULATION, &caption, noise, &onsets)
}

/// Figure of a reference (`measured`) and a joint that follows it with the old (`before`) and the new parameters (`after`).
pub fn tracking(trace: &Trace, caption: &str) -> Markup {
    let Some((from_s, to_s)) = axis::range(trace.t_s.iter().copied()) else { return html! {} };
    lines(trace, &Axis::exact(from_s, to_s, 10), &TRACKING, &html! { (caption) }, None, &[])
}

fn lines(
    trace: &Trace,
    time: &Axis,
    words: &Words,
    caption: &Markup,
    noise: Option<f64>,
    onsets: &[(f64, &str)],
) -> Markup {
    let name = names::channel(&trace.channel);
    let caption = html! { figcaption { (caption) } };
    let n = [trace.t_s.len(), trace.measured.len(), trace.before.len(), trace.after.len()];
    let n = n.into_iter().min().unwrap_or(0);
    if n == 0 {
        return html! { figure.trace { (caption) p { "No samples." } } };
    }
    let rest = |simulated: &[f64]| -> Vec<f64> {
        trace.measured.iter().zip(simulated).map(|(measured, simulated)| measured - simulated).collect()
    };
    let (rest_before, rest_after) = (rest(&trace.before), rest(&trace.after));
    let noise = noise.filter(|noise| noise.is_finite() && *noise > 0.0);
    let strips = strips(trace, &rest_before, &rest_after, words, noise, onsets.len());

    let foot = strips.iter().fold(0.0, |foot, strip| foot + HEADING + strip.height);
    let tops = strips.iter().scan(0.0, |next, strip| {
        let top = *next;
        *next += HEADING + strip.height;
        Some(top)
    });
    let height = foot + FOOT;
    html! {
        figure.trace {
            (caption)
            svg viewBox=(format!("0 0 {WIDTH} {height}")) role="img" {
                title { (name) " over time" }
                desc {
                    (names::words(words.measured.name)) ", " (words.before.name) " and " (words.after.name) ", from "
                    (figures::seconds(time.low)) " to " (figures::seconds(time.high)) "; below it: " (words.difference) "."
                }
                @for (strip, top) in strips.iter().zip(tops) { (draw(strip, trace, time, top)) }
                (draw_onsets(onsets, time, HEADING, foot))
                (time_labels(time, foot))
            }
        }
    }
}

/// Part of the simulation with the rig file that the axes make room for, as range of signal and of difference: a rig
/// far from the truth, or a replay that ran away, must not press the other lines flat. `None`: all of it.
fn room_for_before(trace: &Trace) -> Option<[(f64, f64); 2]> {
    // In lengths of what measurement and diagnosed simulation span.
    const REACH: f64 = 2.0;
    let (low, high) = axis::range(trace.measured.iter().chain(&trace.after).copied())?;
    let length = high - low;
    let room = (low - REACH * length, high + REACH * length);
    let is_beyond = |value: &f64| *value < room.0 || *value > room.1;
    (length > 0.0 && trace.before.iter().any(is_beyond))
        .then_some([room, (-(1.0 + REACH) * length, (1.0 + REACH) * length)])
}

/// Signal, difference, and the difference after diagnosis enlarged where it would else be a flat line.
fn strips<'t>(
    trace: &'t Trace,
    rest_before: &'t [f64],
    rest_after: &'t [f64],
    words: &Words,
    noise: Option<f64>,
    onsets: usize,
) -> Vec<Strip<'t>> {
    let heading = |what: &str, axis: &Axis| match axis.unit(&trace.unit) {
        unit if unit.is_empty() => what.to_owned(),
        unit => format!("{what}, {unit}"),
    };
    let all = |series: [&'t [f64]; 2]| series.into_iter().flatten().copied();

    let room = room_for_before(trace);
    let in_room = |series: &'t [f64], which: usize| {
        series.iter().map(move |value| room.map_or(*value, |room| value.clamp(room[which].0, room[which].1)))
    };
    let note =
        if room.is_some() { format!("; {} leaves the scale", words.before.name) } else { String::new() };

    let signal = Axis::around(all([&trace.measured, &trace.after]).chain(in_room(&trace.before, 0)), 7);
    // Names of onsets stand above the lines, not on them.
    let above = ONSET * onsets as f64;
    let signal = Axis::exact(signal.low, signal.high + signal.length() * above / SIGNAL_HEIGHT, 7);
    let band = noise.map_or([0.0; 2], |noise| [-1.2 * NOISE_BAND * noise, 1.2 * NOISE_BAND * noise]);
    let difference = Axis::around(all([rest_after, &[]]).chain(band).chain(in_room(rest_before, 1)), 5);
    let enlarged = Axis::around(all([rest_after, &[]]).chain(band), 4);
    let times = difference.length() / enlarged.length();
    let is_enlarged = times >= WORTH_ENLARGING;

    let mut strips = vec![
        Strip {
            heading: heading("Signal", &signal) + &note,
            series: vec![
                (words.measured, &trace.measured),
                (words.after, &trace.after),
                (words.before, &trace.before),
            ],
            axis: signal,
            is_residual: false,
            noise: None,
            height: SIGNAL_HEIGHT + above,
        },
        Strip {
            heading: heading(words.difference, &difference) + &note,
            series: vec![(words.before, rest_before), (words.after, rest_after)],
            axis: difference,
            is_residual: true,
            noise: noise.filter(|_| !is_enlarged),
            height: 84.0,
        },
    ];
    if is_enlarged {
        strips.push(Strip {
            heading: heading(&format!("{}, enlarged {times:.0} times", words.enlarged), &enlarged),
            series: vec![(words.after, rest_after)],
            axis: enlarged,
            is_residual: true,
            noise,
            height: 66.0,
        });
    }
    strips
}

fn draw(strip: &Strip, trace: &Trace, time: &Axis, top: f64) -> Markup {
    let (high, low) = (top + HEADING, top + HEADING + strip.height);
    let y = |value: f64| px(strip.axis.place(value, low, high));
    let x = |t_s: f64| px(time.place(t_s, LEFT, RIGHT));
    html! {
        text.heading x=(px(LEFT)) y=(px(high - 8.0)) { (strip.heading) }
        (key(strip, !strip.is_residual && trace.held_out.contains(&true), high - 12.0))
        @for (from_s, to_s) in held_out(trace) {
            rect.held-out x=(x(from_s)) y=(px(high)) height=(px(strip.height))
                width=(px((to_s - from_s) / time.length() * (RIGHT - LEFT))) {}
        }
        @for (t_s, _) in time.ticks() { line.grid x1=(x(t_s)) x2=(x(t_s)) y1=(px(high)) y2=(px(low)) {} }
        @for (value, label) in strip.axis.ticks() {
            line class=(if strip.is_residual && value == 0.0 { "zero" } else { "grid" })
                x1=(px(LEFT)) x2=(px(RIGHT)) y1=(y(value)) y2=(y(value)) {}
            text.end x=(px(LEFT - 6.0)) y=(px(strip.axis.place(value, low, high) + 4.0)) { (label) }
        }
        @for (style, values) in &strip.series {
            polyline class=(style.class) points=(points(trace, values, time, &strip.axis, (low, high))) {}
        }
        @for bound in strip.noise.iter().flat_map(|noise| [-NOISE_BAND * noise, NOISE_BAND * noise]) {
            line.noise x1=(px(LEFT)) x2=(px(RIGHT)) y1=(y(bound)) y2=(y(bound)) {}
        }
        rect.frame x=(px(LEFT)) y=(px(high)) width=(px(RIGHT - LEFT)) height=(px(strip.height)) {}
    }
}

/// Names of what a strip shows, at its right end.
fn key(strip: &Strip, has_held_out: bool, y: f64) -> Markup {
    // Wide enough for the longest name beside its sample of the line.
    const ENTRY: f64 = 108.0;
    let mut entries: Vec<Style> = strip.series.iter().map(|(style, _)| *style).collect();
    // As the story goes, not as the lines are stacked.
    entries
        .sort_by_key(|style| ["measured", "before", "after"].iter().position(|class| *class == style.class));
    entries.extend(strip.noise.map(|_| NOISE));
    entries.extend(has_held_out.then_some(HELD_OUT));
    let start = RIGHT - ENTRY * entries.len() as f64;
    html! { @for (i, style) in entries.iter().enumerate() {
        @let x = start + ENTRY * i as f64;
        @if style.class == HELD_OUT.class {
            rect class=(style.class) x=(px(x)) y=(px(y - 6.0)) width="28" height="12" {}
        } @else {
            line class=(style.class) x1=(px(x)) x2=(px(x + 28.0)) y1=(px(y)) y2=(px(y)) {}
        }
        text x=(px(x + 34.0)) y=(px(y + 4.0)) { (style.name) }
    } }
}

/// Moments at which effects began, where the trace is of the recording whose clock they are on.
fn onsets<'f>(findings: &'f Findings, trace: &Trace, time: &Axis) -> Vec<(f64, &'f str)> {
    let is_fitted_recording =
        findings.diagnosis.recordings.len() == 1 && !trace.held_out.iter().all(|held| *held);
    let onsets =
        findings.diagnosis.effects.iter().filter_map(|effect| Some((effect.onset_s?, effect.id.as_str())));
    onsets.filter(|(onset_s, _)| is_fitted_recording && (time.low..=time.high).contains(onset_s)).collect()
}

fn draw_onsets(onsets: &[(f64, &str)], time: &Axis, top: f64, bottom: f64) -> Markup {
    html! { @for (i, (onset_s, id)) in onsets.iter().enumerate() {
        @let x = time.place(*onset_s, LEFT, RIGHT);
        // A name at the right end stands before its line.
        @let is_late = x > 0.75 * WIDTH;
        // A later line starts below the names before it, so that none is struck through.
        line.onset x1=(px(x)) x2=(px(x)) y1=(px(top + ONSET * i as f64)) y2=(px(bottom)) {}
        text class=(if is_late { "onset end" } else { "onset" }) x=(px(if is_late { x - 5.0 } else { x + 5.0 }))
            y=(px(top + ONSET * (i as f64 + 0.75))) { (names::words(id)) " from " (figures::seconds(*onset_s)) }
    } }
}

fn time_labels(time: &Axis, top: f64) -> Markup {
    html! {
        @for (t_s, label) in time.ticks() {
            text.middle x=(px(time.place(t_s, LEFT, RIGHT))) y=(px(top + 15.0)) { (label) }
        }
        text.middle x=(px(f64::midpoint(LEFT, RIGHT))) y=(px(top + 30.0)) { "Time, " (time.unit("s")) }
    }
}

/// Stretches of samples that the fit did not see, from first to last sample of each.
fn held_out(trace: &Trace) -> Vec<(f64, f64)> {
    let mut stretches: Vec<(f64, f64)> = Vec::new();
    let mut is_open = false;
    for (&t_s, &held) in trace.t_s.iter().zip(&trace.held_out) {
        match stretches.last_mut() {
            Some(stretch) if held && is_open => stretch.1 = t_s,
            _ if held => stretches.push((t_s, t_s)),
            _ => {}
        }
        is_open = held;
    }
    stretches
}

/// Points of a line, thinned to the width of the plot.
fn points(trace: &Trace, values: &[f64], time: &Axis, axis: &Axis, (low, high): (f64, f64)) -> String {
    let columns = (RIGHT - LEFT) as usize;
    let thinned = envelope(&trace.t_s, values, (time.low, time.high), columns);
    let mut text = String::with_capacity(13 * thinned.len());
    for (t_s, value) in thinned {
        let x = time.place(t_s, LEFT, RIGHT);
        // What leaves the scale runs along the frame; `high` is the smaller of the two.
        let y = axis.place(value, low, high).clamp(high, low);
        // Writing to a String cannot fail.
        let _ = write!(text, "{x:.1},{y:.1} ");
    }
    text.truncate(text.trim_end().len());
    text
}

/// Position, to a tenth of a pixel.
fn px(position: f64) -> String {
    format!("{position:.1}")
}
