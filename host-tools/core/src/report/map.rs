//! The map: differences of every channel over position, speed, tension and time, before and after.

use std::fmt::Write;

use maud::{Markup, html};

use crate::diagnose::verdict::{Findings, MapAxis, MapChannel};

use super::axis::{self, Axis};
use super::{figures, names};

/// Width of one picture, px.
const WIDTH: f64 = 260.0;
/// Left end of the bins, px; the scale stands before it.
const LEFT: f64 = 40.0;
/// Right end of the bins, px.
const RIGHT: f64 = 252.0;
/// Top of the bins, px; their name stands above.
const TOP: f64 = 20.0;
/// Bottom of the bins, px.
const BOTTOM: f64 = 84.0;
/// Height of a picture, px.
const HEIGHT: f64 = 102.0;

/// Part of the section on proof.
pub(super) fn part(findings: &Findings) -> Markup {
    let map = &findings.diagnosis.residual_map;
    html! {
        @if !map.axes.is_empty() && !map.channels.is_empty() {
            h3 { "Difference by position, speed, tension and time" }
            p.caption {
                "Root mean square difference of each channel over the bins of a variable. The four pictures of a channel "
                "share a scale; a gap is where the recordings hardly went."
                span.key {
                    svg viewBox="0 0 28 12" width="28" height="12" aria-hidden="true" {
                        line.before x1="0" x2="28" y1="6" y2="6" {}
                    }
                    "rig file"
                    svg viewBox="0 0 28 12" width="28" height="12" aria-hidden="true" {
                        rect.area x="0" y="3" width="28" height="9" {}
                        line.after x1="0" x2="28" y1="3" y2="3" {}
                    }
                    "diagnosed"
                }
            }
            @for channel in &map.channels { (row(channel, &map.axes)) }
        }
    }
}

/// One channel over all variables.
fn row(channel: &MapChannel, axes: &[MapAxis]) -> Markup {
    let stages = [&channel.before_rmse, &channel.after_rmse];
    let values = || stages.into_iter().flatten().flatten().filter_map(|value| *value);
    let (_, highest) = axis::range(values()).unwrap_or((0.0, 1.0));
    // A rig file far off must not press the rest flat.
    let (_, after) =
        axis::range(channel.after_rmse.iter().flatten().filter_map(|value| *value)).unwrap_or((0.0, 1.0));
    let top = if after > 0.0 { highest.min(20.0 * after) } else { highest };
    let scale = Axis::exact(0.0, if top > 0.0 { 1.05 * top } else { 1.0 }, 4);
    let unit = scale.unit(&channel.unit);
    html! {
        figure.map {
            figcaption {
                (names::channel(&channel.channel)) " " code { (channel.channel) }
                @if !unit.is_empty() { ", " (unit) }
            }
            div.maps { @for (index, axis) in axes.iter().enumerate() {
                @let of = |stage: &Vec<Vec<Option<f64>>>| stage.get(index).cloned().unwrap_or_default();
                (picture(channel, axis, &of(&channel.before_rmse), &of(&channel.after_rmse), &scale))
            } }
        }
    }
}

fn picture(
    channel: &MapChannel,
    variable: &MapAxis,
    before: &[Option<f64>],
    after: &[Option<f64>],
    scale: &Axis,
) -> Markup {
    let ends = axis::range(variable.edges.iter().copied()).unwrap_or((0.0, 1.0));
    let over = Axis::exact(ends.0, ends.1, 5);
    let x = |value: f64| over.place(value, LEFT, RIGHT);
    let y = |value: f64| scale.place(value.clamp(0.0, scale.high), BOTTOM, TOP);
    let name = names::variable(&variable.variable);
    html! {
        svg viewBox=(format!("0 0 {WIDTH} {HEIGHT}")) role="img" {
            title { "Difference over " (name) ", " (names::channel(&channel.channel)) }
            desc {
                "Largest " (figures::quantity(largest(before), &channel.unit)) " with the rig file, "
                (figures::quantity(largest(after), &channel.unit)) " with the diagnosed physics."
            }
            text.heading x=(px(LEFT)) y=(px(TOP - 7.0)) { (name) ", " (over.unit(&variable.unit)) }
            @for (value, label) in scale.ticks() {
                line.grid x1=(px(LEFT)) x2=(px(RIGHT)) y1=(px(y(value))) y2=(px(y(value))) {}
                text.end x=(px(LEFT - 5.0)) y=(px(y(value) + 4.0)) { (label) }
            }
            @for (from, to, value) in bins(variable, after) {
                rect.area x=(px(x(from))) width=(px(x(to) - x(from))) y=(px(y(value))) height=(px(BOTTOM - y(value))) {}
            }
            path.after d=(steps(variable, after, x, y)) {}
            path.before d=(steps(variable, before, x, y)) {}
            rect.frame x=(px(LEFT)) y=(px(TOP)) width=(px(RIGHT - LEFT)) height=(px(BOTTOM - TOP)) {}
            @for (value, label) in over.ticks() {
                text.middle x=(px(x(value))) y=(px(BOTTOM + 14.0)) { (label) }
            }
        }
    }
}

/// Ends and value of every bin that has one.
fn bins(variable: &MapAxis, values: &[Option<f64>]) -> Vec<(f64, f64, f64)> {
    let ends = variable.edges.windows(2).map(|pair| (pair[0], pair[1]));
    let told = ends.zip(values).filter_map(|((from, to), value)| Some((from, to, (*value)?)));
    told.filter(|(_, _, value)| axis::is_drawable(*value)).collect()
}

/// One horizontal line a bin, joined where bins touch.
fn steps(
    variable: &MapAxis,
    values: &[Option<f64>],
    x: impl Fn(f64) -> f64,
    y: impl Fn(f64) -> f64,
) -> String {
    let mut path = String::new();
    let mut end = f64::NAN;
    for (from, to, value) in bins(variable, values) {
        let command = if from == end { 'L' } else { 'M' };
        // Writing to a String cannot fail.
        let _ = write!(path, "{command}{:.1} {:.1}H{:.1}", x(from), y(value), x(to));
        end = to;
    }
    path
}

fn largest(values: &[Option<f64>]) -> f64 {
    values.iter().flatten().copied().fold(0.0, f64::max)
}

/// Position, to a tenth of a pixel.
fn px(position: f64) -> String {
    format!("{position:.1}")
}
