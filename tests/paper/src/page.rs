//! The page `host-tools/docs/paper.md` and its figures.

pub mod gaps;
pub mod lift;
pub mod position;
pub mod segments;
pub mod tracking;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// One experiment on the page.
#[derive(Debug, Clone)]
pub struct Section {
    /// Heading.
    pub heading: String,
    /// What was run.
    pub setting: String,
    /// First line of the table.
    pub columns: Vec<&'static str>,
    /// The table's other lines.
    pub rows: Vec<Vec<String>>,
    /// What it means, differences from the paper among it.
    pub reading: String,
    /// Figures: name of the file without its ending, caption, SVG.
    pub figures: Vec<(&'static str, &'static str, String)>,
}

impl Section {
    /// The table in Markdown.
    #[must_use]
    pub fn table(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let columns: Vec<String> = self.columns.iter().map(|&name| name.to_owned()).collect();
        let mut table = line(&columns);
        table += &line(&vec!["---".to_owned(); columns.len()]);
        for row in &self.rows {
            table += &line(row);
        }
        table
    }
}

/// The page; figures lie in the folder `folder` beside it.
#[must_use]
pub fn render(sections: &[Section], provenance: &str, folder: &str) -> String {
    let mut page = format!(
        "# The paper's experiments, reproduced\n\n\
         `cargo xtask paper` writes this page: {provenance}.\n\n\
         The paper is Wu, Yin, Xu, Zhao, Han, Sensors 2020, 20(5), 1301. The driver board's own fixed-point controller drives\n\
         the virtual bench at 10 kHz, behind 12-bit encoders (AMT22 frames, one tick old) and 12-bit converters with noise. The\n\
         bench has masses, springs and bristles along each sheath and knows none of the paper's equations.\n\n\
         Columns: *paper* is what the text of the paper says; *equations* are those of\n\
         [derivation.md](../../model/docs/derivation.md); *reproduction* is read from the bench's true tensions and angles. The\n\
         paper gives neither friction coefficient nor tendon length, arm or amplitudes; what was chosen for them is named.\n"
    );
    for section in sections {
        // Writing to a string cannot fail.
        let _ = write!(page, "\n## {}\n\n{}\n\n{}\n", section.heading, section.setting, section.table());
        for (name, caption, _) in &section.figures {
            let _ = write!(page, "![{caption}]({folder}/{name}.svg)\n\n");
        }
        let _ = writeln!(page, "{}", section.reading);
    }
    page
}

/// Writes the page and its figures.
///
/// # Errors
/// Which file cannot be written, and why.
pub fn write(sections: &[Section], provenance: &str, page: &Path) -> Result<(), String> {
    let folder = page.with_extension("");
    let told = |path: &Path, error: &std::io::Error| format!("{}: {error}", path.display());
    fs::create_dir_all(&folder).map_err(|error| told(&folder, &error))?;
    let name = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    for (figure, _, svg) in sections.iter().flat_map(|section| &section.figures) {
        let path = folder.join(format!("{figure}.svg"));
        fs::write(&path, svg).map_err(|error| told(&path, &error))?;
    }
    fs::write(page, render(sections, provenance, &name)).map_err(|error| told(page, &error))
}

/// Writes the page of [`crate::beyond`].
///
/// # Errors
/// When the file cannot be written, and why.
pub fn write_tracking(table: &str, provenance: &str, page: &Path) -> Result<(), String> {
    let text = format!(
        "# Tracking while the sheaths are moved, without retuning\n\n\
         What a joint reaches when its controller follows the friction of the sheaths\n\
         ([how](../../firmware/control/docs/sheath-observer.md)). Task, loads and motions of the sheaths are those of section \
         5.2 of\n[the paper's experiments](paper.md): the firmware's own code drives the virtual bench while K wanders between \
         pi/2 and 3 pi/2.\n\n\
         `cargo xtask paper --beyond` wrote this page: {provenance}.\n\n\
         *Removed* is the part of the error without compensation that is gone, seed by seed. Parameters are the same for \
         both loads;\nthose of a sensor set were chosen on seeds 101 to 110, the figures come from seeds {} on. The first two \
         sets run in position\nmode with `compensator.source` 3, the last in torque mode. A run that the supervisor stops counts \
         as nothing removed. Position mode and steps of K follow below.\n\n{table}",
        crate::beyond::FIRST_SEED
    );
    fs::write(page, text).map_err(|error| format!("{}: {error}", page.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_shows_its_table_and_its_figure() {
        let section = Section {
            heading: "Fig. 0".to_owned(),
            setting: "At rest.".to_owned(),
            columns: vec!["what", "paper"],
            rows: vec![vec!["torque".to_owned(), "0".to_owned()]],
            reading: "Nothing moves.".to_owned(),
            figures: vec![("fig-0", "Nothing", String::new())],
        };
        assert_eq!(section.table(), "| what | paper |\n| --- | --- |\n| torque | 0 |\n");
        let page = render(&[section], "2026-01-01, commit 0", "paper");
        let parts = ["2026-01-01, commit 0", "## Fig. 0", "At rest.", "| torque | 0 |", "](paper/fig-0.svg)"];
        let places: Vec<_> = parts.iter().map(|part| page.find(part)).collect();
        assert!(places.is_sorted() && places.iter().all(Option::is_some), "{places:?}\n{page}");
    }
}
