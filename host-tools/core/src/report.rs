//! The diagnosis as one HTML page: verdict first, then place, physics, proof on held-out data, traces, provenance.
//!
//! The page is a single file without scripts and without anything fetched from elsewhere: style and plots are inline.
//! Same findings, same bytes. Plots are SVG written directly with the HTML: series stay single paths that CSS can
//! dash, scale and print, with titles for screen readers, at a tenth of a pixel; a plotting crate's SVG output rounds
//! to whole pixels and cuts a dashed line into one element a dash.

mod axis;
mod envelope;
pub mod figures;
pub mod files;
mod free_form;
mod laws;
mod map;
pub mod names;
pub mod page;
pub mod physics;
mod place;
pub mod plots;
mod proof;
mod style;

#[cfg(test)]
pub(crate) mod example;
#[cfg(test)]
mod tests;

use crate::diagnose::verdict::Findings;

/// HTML page of a diagnosis, complete in itself.
///
/// Text from files is escaped. Values that are not finite read as a dash and leave a gap in a plot. A page for eight
/// channels of 40 000 samples stays below 3 MB (test `page_of_eight_long_channels_is_small`).
#[must_use]
pub fn render(findings: &Findings) -> String {
    page::page(findings).into_string()
}
