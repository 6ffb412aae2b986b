//! Where simulation and recording differ: parts of the joint, then each place by its share.

use maud::{Markup, html};

use crate::diagnose::verdict::Findings;

use super::{figures, names};

/// Width of a bar that stands for the whole, in units of its picture.
const FULL: f64 = 160.0;
/// Parts that every report shows, motor to sensors.
const PARTS: [&str; 4] = ["motor", "transmission", "joint", "sensors"];

/// Section on place.
pub(super) fn section(findings: &Findings) -> Markup {
    let mismatch = &findings.diagnosis.mismatch;
    html! {
        section #place {
            h2 { "Where simulation and recording differ" }
            (chain(findings))
            @if mismatch.is_empty() {
                p { "No place stands out." }
            } @else {
                table {
                    caption {
                        "Places where the recalibrated simulation and the recording differ, by their share of the "
                        "whole difference."
                    }
                    thead { tr {
                        th scope="col" { "Part" }
                        th scope="col" { "Channel" }
                        th scope="col" { "Regime" }
                        th.number scope="col" { "Stands out" }
                        th scope="col" colspan="2" { "Share" }
                    } }
                    tbody { @for place in mismatch { tr {
                        td { (names::component(&place.component)) }
                        td { (names::channel(&place.channel)) " " code { (place.channel) } }
                        td { (names::words(&place.regime)) }
                        td.number { (figures::seconds(place.t_start_s)) " to " (figures::seconds(place.t_end_s)) }
                        td.number { (figures::share(place.share)) }
                        td { (bar(place.share)) }
                    } } }
                }
            }
        }
    }
}

/// The joint from motor to sensors, each part with its share of the difference and the effects named there.
fn chain(findings: &Findings) -> Markup {
    let diagnosis = &findings.diagnosis;
    let others = diagnosis.mismatch.iter().map(|m| m.component.as_str());
    let others = others.chain(diagnosis.effects.iter().map(|e| e.component.as_str()));
    let left = diagnosis.unexplained.as_ref().map(|left| left.component.as_str());
    let others = others.chain(left);
    let mut parts = PARTS.to_vec();
    for other in others {
        if !parts.contains(&other) {
            parts.push(other);
        }
    }
    html! {
        ol.chain aria-label="Parts of the joint" { @for part in parts {
            @let places: Vec<f64> =
                diagnosis.mismatch.iter().filter(|m| m.component == part).map(|m| m.share).collect();
            @let share: f64 = places.iter().sum();
            @let effects = names::once_each(diagnosis.effects.iter().filter(|e| e.component == part));
            @let is_left = left == Some(part);
            li class=(if effects.is_empty() && !is_left { "part" } else { "part named" }) {
                strong { (names::component(part)) }
                (bar(share))
                span.share {
                    @if places.is_empty() { "no difference stands out" }
                    @else { (figures::share(share)) " of the difference" }
                }
                @for effect in effects { span.effect { (names::words(effect)) } }
                @if is_left { span.effect { "Unexplained" } }
            }
        } }
    }
}

fn bar(share: f64) -> Markup {
    let length = if share.is_finite() { FULL * share.clamp(0.0, 1.0) } else { 0.0 };
    html! {
        svg.bar viewBox=(format!("0 0 {FULL} 8")) aria-hidden="true" preserveAspectRatio="none" {
            rect.track x="0" y="0" width=(FULL) height="8" {}
            rect.filled x="0" y="0" width=(format!("{length:.1}")) height="8" {}
        }
    }
}
