//! A law that was found: port, formula and coefficients.

use maud::{Markup, html};

use crate::diagnose::verdict::FoundLaw;

use super::{figures, names};

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
