//! A law that was found: port, formula and coefficients.

use maud::{Markup, html};

use crate::diagnose::verdict::{FoundLaw, RivalLoss, TriedHypothesis};

use super::{figures, names};
use crate::diagnose::words::short;

/// Card of a hypothesis of the user: what it does by itself, against what else does best.
pub(super) fn hypothesis(tried: &TriedHypothesis) -> Markup {
    let curve = format!("Free curve over {}", tried.free_curve.as_ref().map_or("", |curve| &curve.id));
    let rivals: [(String, &Option<RivalLoss>); 3] = [
        (named("Best effect of the catalogue", tried.catalogue.as_ref()), &tried.catalogue),
        (named("Best closed form", tried.closed_form.as_ref()), &tried.closed_form),
        (curve, &tried.free_curve),
    ];
    html! {
        article.card {
            h3 { "Hypothesis " code { (tried.name) } " at " code { (tried.port) } }
            p { (tried.sentence) }
            table.parameters {
                thead { tr {
                    th scope="col" { "Beside the recalibrated rig" }
                    th scope="col" { "Held-out loss" }
                } }
                tbody {
                    tr { th scope="row" { "Nothing" } td { (short(tried.heldout_loss_without)) } }
                    tr { th scope="row" { "The hypothesis" } td { (short(tried.heldout_loss)) } }
                    @for (what, rival) in &rivals { @if let Some(rival) = rival {
                        tr { th scope="row" { (what) } td { (short(rival.heldout_loss)) } }
                    } }
                }
            }
            table.parameters {
                thead { tr {
                    th scope="col" { "Coefficient" }
                    th scope="col" { "Value ± standard deviation" }
                } }
                tbody { @for (name, estimate) in &tried.coefficients { tr {
                    th scope="row" { code { (name) } }
                    td { (figures::estimate(estimate.value, estimate.std, &estimate.unit)) }
                } } }
            }
        }
    }
}

fn named(what: &str, rival: Option<&RivalLoss>) -> String {
    rival.map_or_else(|| what.to_owned(), |rival| format!("{what}, {}", names::words(&rival.id)))
}

/// Card of one law.
pub(super) fn card(law: &FoundLaw) -> Markup {
    html! {
        article.card.left {
            h3 { "A law that no name covers " code { (law.port) } }
            p { (law.sentence) }
            p { code { (law.port) " = " (law.formula) } }
            dl.facts {
                div { dt { "Part" } dd { (names::component(&law.component)) } }
                @if let Some(channel) = &law.channel {
                    div { dt { "Channel" } dd { (names::channel(channel)) " " code { (channel) } } }
                }
                div { dt { "Removes" } dd { (figures::share(law.heldout_improvement)) " of the held-out loss" } }
            }
            table.parameters {
                thead { tr {
                    th scope="col" { "Coefficient" }
                    th scope="col" { "Value ± standard deviation" }
                } }
                tbody { @for (name, estimate) in &law.coefficients { tr {
                    th scope="row" { code { (name) } }
                    td { (figures::estimate(estimate.value, estimate.std, &estimate.unit)) }
                } } }
            }
        }
    }
}
