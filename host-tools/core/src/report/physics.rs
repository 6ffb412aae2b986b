//! What explains the difference: effects, recalibrated parameters, what cannot be told apart, what is left.

use bowden_model::effects::find;
use maud::{Markup, html};

use crate::diagnose::verdict::{Diagnosis, Findings, NamedEffect};

use super::{figures, free_form, laws, names};

/// Section on physics.
pub(super) fn section(findings: &Findings) -> Markup {
    let diagnosis = &findings.diagnosis;
    html! {
        section #physics {
            h2 { "What explains it" }
            @if diagnosis.effects.is_empty() {
                p { "No effect of the catalogue is named." }
            }
            @for effect in &diagnosis.effects { (card(effect)) }
            @for law in &diagnosis.laws { (laws::card(law)) }
            @for tried in &diagnosis.hypotheses { (laws::hypothesis(tried)) }
            @if let Some(left) = diagnosis.unexplained.as_ref().filter(|left| !left.modelled) {
                (free_form::card(left))
            }
            (recalibrated(diagnosis))
            @if !diagnosis.indistinguishable.is_empty() {
                h3 { "Parameters that these data cannot tell apart" }
                ul { @for group in &diagnosis.indistinguishable {
                    li { @for (i, name) in group.iter().enumerate() {
                        @if i > 0 { " with " }
                        code { (name) }
                    } }
                } }
            }
        }
    }
}

/// A named effect with its parameters and rivals.
pub fn card(effect: &NamedEffect) -> Markup {
    html! {
        article.card {
            h3 {
                (names::words(&effect.id)) " " code { (effect.id) }
                @if let Some(bench) = &effect.bench { " on bench " (bench) }
            }
            p { (effect.sentence) }
            dl.facts {
                div { dt { "Probability" } dd { (figures::share(effect.probability)) } }
                div { dt { "Part" } dd { (names::component(&effect.component)) } }
                @if let Some(channel) = &effect.channel {
                    div { dt { "Channel" } dd { (names::channel(channel)) " " code { (channel) } } }
                }
                div { dt { "Present" } dd {
                    @match effect.onset_s {
                        Some(onset_s) => { "from " (figures::seconds(onset_s)) " on" }
                        None => { "all the time" }
                    }
                } }
                div { dt { "Removes" } dd { (figures::share(effect.heldout_improvement)) " of the held-out loss" } }
            }
            @if !effect.further.is_empty() {
                (instances(effect))
            } @else if !effect.parameters.is_empty() {
                table.parameters {
                    thead { tr {
                        th scope="col" { "Parameter" }
                        th scope="col" { "Value ± standard deviation" }
                        th scope="col" { "Remark" }
                    } }
                    tbody { @for (name, estimate) in &effect.parameters { tr {
                        th scope="row" { code { (name) } }
                        td { (figures::estimate(estimate.value, estimate.std, &estimate.unit)) }
                        td { @match values_tried(&effect.id, name) {
                            Some(values) => { "best of " (values) ", not fitted" }
                            None => { (remark(estimate.at_bound, estimate.std)) }
                        } }
                    } } }
                }
            }
            @if !effect.rivals.is_empty() {
                h4 { "Not excluded" }
                ul.rivals { @for rival in &effect.rivals { li {
                    strong { (names::words(&rival.id)) } " " code { (rival.formula.as_ref().unwrap_or(&rival.id)) } ", "
                    (figures::share(rival.probability))
                    ". To tell them apart: " (rival.separating_experiment)
                } } }
            }
        }
    }
}

/// Values of a parameter that a search tries one by one; `None` for a parameter that it fits.
fn values_tried(effect: &str, parameter: &str) -> Option<String> {
    let spec = find(effect)?.descriptor().parameters.iter().find(|spec| spec.name == parameter)?;
    let values: Vec<String> = spec.forms.iter().map(f64::to_string).collect();
    (!values.is_empty()).then(|| values.join(" and "))
}

/// Parameters of an effect that the part has several times, strongest first.
fn instances(effect: &NamedEffect) -> Markup {
    html! {
        table {
            thead { tr { @for name in effect.parameters.keys() { th.number scope="col" { code { (name) } } } } }
            tbody { @for instance in std::iter::once(&effect.parameters).chain(&effect.further) { tr {
                @for estimate in instance.values() { td.number {
                    (figures::estimate(estimate.value, estimate.std, &estimate.unit))
                    @if estimate.at_bound { " " (remark(true, None)) }
                } }
            } } }
        }
    }
}

fn recalibrated(diagnosis: &Diagnosis) -> Markup {
    if diagnosis.recalibrated.is_empty() {
        return html! { p { "No nominal parameter was recalibrated." } };
    }
    html! {
        h3 { "Recalibrated parameters" }
        table {
            thead { tr {
                th scope="col" { "Parameter" }
                th.number scope="col" { "Rig file" }
                th.number scope="col" { "Fitted ± standard deviation" }
                th.number scope="col" { "Change" }
                th scope="col" { "Remark" }
            } }
            tbody { @for row in &diagnosis.recalibrated { tr {
                th scope="row" { code { (row.name()) } }
                td.number { (figures::quantity(row.nominal, &row.unit)) }
                td.number { (figures::estimate(row.fitted, row.std, &row.unit)) }
                td.number { (figures::change(row.nominal, row.fitted)) }
                td { (remark(row.at_bound, row.std)) }
            } } }
        }
    }
}

fn remark(at_bound: bool, std: Option<f64>) -> Markup {
    html! {
        @if at_bound { span.flag { "▲ at the end of its range" } }
        @else if std.is_none() { "no deviation known" }
    }
}
