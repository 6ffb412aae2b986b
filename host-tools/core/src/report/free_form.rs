//! What is left unexplained: where, what it varies with, and a free form of it.

use std::fmt::Write;

use maud::{Markup, html};

use crate::diagnose::verdict::{FreeForm, Unexplained};

use super::axis::{self, Axis};
use super::{figures, names};

/// Width of the picture, px.
const WIDTH: f64 = 520.0;
/// Left end of the axis, px.
const LEFT: f64 = 52.0;
/// Right end of the axis, px.
const RIGHT: f64 = 508.0;
/// Top of the picture's frame, px.
const TOP: f64 = 24.0;
/// Bottom of the picture's frame, px.
const BOTTOM: f64 = 164.0;
/// Height of the picture, px.
const HEIGHT: f64 = 200.0;

/// Card of what no effect explains.
pub(super) fn card(left: &Unexplained) -> Markup {
    html! {
        article.card.left {
            h3 { "Left unexplained" }
            p { (left.sentence) }
            p.facts {
                (names::component(&left.component)) ", strongest in "
                (names::channel(&left.channel)) " " code { (left.channel) }
                @if !left.depends_on.is_empty() {
                    "; varies with "
                    @for (i, variable) in left.depends_on.iter().enumerate() {
                        @if i > 0 { ", " }
                        code { (variable) }
                    }
                }
                "."
            }
            @if left.period_rad.is_some() || left.frequency_hz.is_some() || left.free_form.is_some() {
                dl.facts {
                    @if let Some(period_rad) = left.period_rad {
                        div { dt { "Period" } dd { (figures::quantity(period_rad, "rad")) } }
                        div { dt { "Periods a turn" } dd { (figures::number(std::f64::consts::TAU / period_rad)) } }
                    }
                    @if let Some(frequency_hz) = left.frequency_hz {
                        div { dt { "Frequency" } dd { (figures::quantity(frequency_hz, "Hz")) } }
                    }
                    @if let Some(form) = &left.free_form {
                        div { dt { (if form.heldout { "Held-out difference" } else { "Difference on every third second" }) } dd {
                            (figures::quantity(form.heldout_rms_before, &form.unit)) " → "
                            (figures::quantity(form.heldout_rms_after, &form.unit)) " with the free form"
                        } }
                    }
                }
            }
            @if let Some(form) = &left.free_form { (picture(left, form)) }
        }
    }
}

fn picture(left: &Unexplained, form: &FreeForm) -> Markup {
    let all = || form.points.iter().chain(&form.points_backwards);
    let drawable = all().filter(|point| axis::is_drawable(point[0]) && axis::is_drawable(point[1]));
    if drawable.count() < 2 {
        return html! {};
    }
    let (low, high) = axis::range(all().map(|point| point[0])).unwrap_or((0.0, 1.0));
    let over = Axis::exact(low, high, 8);
    let scale = Axis::around(all().map(|point| point[1]).chain([0.0]), 5);
    let x = |value: f64| over.place(value, LEFT, RIGHT);
    let y = |value: f64| scale.place(value, BOTTOM, TOP);
    let line = |points: &[[f64; 2]]| {
        let mut text = String::new();
        for [at, value] in points.iter().filter(|p| axis::is_drawable(p[0]) && axis::is_drawable(p[1])) {
            // Writing to a String cannot fail.
            let _ = write!(text, "{:.1},{:.1} ", x(*at), y(*value));
        }
        text
    };
    let unit = if form.per_ampere { format!("{}/A", form.unit) } else { form.unit.clone() };
    let turns = !form.points_backwards.is_empty();
    let period = if left.period_rad.is_some() || left.frequency_hz.is_some() { ", one period" } else { "" };
    html! {
        figure.free-form {
            svg viewBox=(format!("0 0 {WIDTH} {HEIGHT}")) role="img" {
                title { "Free form of what is left in " (names::channel(&left.channel)) }
                text.heading x=(px(LEFT)) y=(px(TOP - 9.0)) { "Free form, " (scale.unit(&unit)) }
                @if turns {
                    line.after x1="330" x2="358" y1="11" y2="11" {}
                    text x="363" y="15" { "forwards" }
                    line.before x1="424" x2="452" y1="11" y2="11" {}
                    text x="457" y="15" { "back" }
                }
                @for (value, label) in scale.ticks() {
                    line class=(if value == 0.0 { "zero" } else { "grid" })
                        x1=(px(LEFT)) x2=(px(RIGHT)) y1=(px(y(value))) y2=(px(y(value))) {}
                    text.end x=(px(LEFT - 6.0)) y=(px(y(value) + 4.0)) { (label) }
                }
                @for (value, label) in over.ticks() {
                    line.grid x1=(px(x(value))) x2=(px(x(value))) y1=(px(TOP)) y2=(px(BOTTOM)) {}
                    text.middle x=(px(x(value))) y=(px(BOTTOM + 15.0)) { (label) }
                }
                polyline.after points=(line(&form.points)) {}
                @if turns { polyline.before points=(line(&form.points_backwards)) {} }
                rect.frame x=(px(LEFT)) y=(px(TOP)) width=(px(RIGHT - LEFT)) height=(px(BOTTOM - TOP)) {}
                text.middle x=(px(f64::midpoint(LEFT, RIGHT))) y=(px(BOTTOM + 31.0)) {
                    (names::variable(&form.variable)) ", " (over.unit(&form.variable_unit)) (period)
                }
            }
        }
    }
}

/// Position, to a tenth of a pixel.
fn px(position: f64) -> String {
    format!("{position:.1}")
}
