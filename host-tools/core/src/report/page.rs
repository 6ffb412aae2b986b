//! What all pages share, and the page of a diagnosis: order of its sections, verdict, provenance.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::diagnose::verdict::{Diagnosis, Findings, Verdict};

use super::{names, physics, place, plots, proof, style};

/// An HTML document with `content` in its body; `css` is added to the style of all pages.
pub fn document(title: &str, css: &str, content: &Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(style::CSS)) (PreEscaped(css)) }
            }
            body { main { (content) } }
        }
    }
}

/// Whole document.
pub(super) fn page(findings: &Findings) -> Markup {
    let diagnosis = &findings.diagnosis;
    let content = html! {
        (verdict(findings))
        (place::section(findings))
        (physics::section(findings))
        (proof::section(findings))
        (plots::section(findings))
        (provenance(diagnosis))
    };
    document(&format!("Diagnosis of {}", diagnosis.rig), "", &content)
}

fn verdict(findings: &Findings) -> Markup {
    let diagnosis = &findings.diagnosis;
    // The mark tells the verdicts apart where colour does not.
    let (class, mark) = match diagnosis.verdict {
        Verdict::Consistent => ("consistent", "✓"),
        Verdict::Recalibrate => ("recalibrate", "≈"),
        Verdict::MissingPhysics => ("missing_physics", "!"),
        Verdict::Unexplained => ("unexplained", "?"),
    };
    html! {
        header #verdict class={ "verdict " (class) } {
            div.mark aria-hidden="true" { (mark) }
            div {
                p.eyebrow { "Diagnosis of " (diagnosis.rig) }
                h1 { (names::verdict(findings)) }
                p.summary { (diagnosis.summary) }
            }
        }
    }
}

fn provenance(diagnosis: &Diagnosis) -> Markup {
    let list = |entries: &[String], none: &str| {
        html! {
            @if entries.is_empty() { (none) }
            @else { ul { @for entry in entries { li { (entry) } } } }
        }
    };
    html! {
        section #provenance {
            h2 { "Provenance" }
            dl {
                dt { "Rig" } dd { (diagnosis.rig) }
                dt { "Fitted to" } dd { (list(&diagnosis.recordings, "nothing")) }
                dt { "Held out" } dd { (list(&diagnosis.heldout, "nothing")) }
                dt { "Written by" } dd { (diagnosis.written_by) }
                dt { "Format" } dd { code { (diagnosis.schema) } }
            }
        }
    }
}
