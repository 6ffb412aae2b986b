//! Files of an investigation: numbers and page.

use std::io::Write;
use std::path::{Path, PathBuf};

use bowden_core::outcome::Failure;
use bowden_core::output;

use super::page::page;
use super::report::{Investigation, PAGE, RESULT};

/// Writes numbers and page; returns where the page is.
///
/// # Errors
/// When the medium refuses.
pub(super) fn save(investigation: &Investigation, folder: &Path) -> Result<PathBuf, Failure> {
    let result = folder.join(RESULT);
    let json = serde_json::to_string_pretty(investigation)
        .map_err(|error| Failure::failed(format!("{}: {error}", result.display())))?;
    output::write_file(&result, |file| writeln!(file, "{json}"))?;
    let html = page(investigation).into_string();
    let page = folder.join(PAGE);
    output::write_file(&page, |file| file.write_all(html.as_bytes()))?;
    Ok(page)
}
