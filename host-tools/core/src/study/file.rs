//! The study file `bowden-study/1`, as written.

use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

use super::{SCHEMA, is_same};
use crate::outcome::Failure;
use crate::rig::section::{FINITE, LocatedStr, Section, Source, advice};
use crate::rig::{Assignment, RigParameter, read_text};

/// A study file.
#[derive(Debug)]
pub(super) struct StudyFile {
    pub(super) name: String,
    pub(super) benches: Vec<ListedBench>,
    pub(super) recordings: Vec<ListedRecording>,
}

/// An entry of `[[bench]]`.
#[derive(Debug)]
pub(super) struct ListedBench {
    pub(super) name: String,
    pub(super) rig: PathBuf,
    /// Parameters, each with the place where it is named.
    pub(super) own: Vec<(RigParameter, String)>,
}

/// An entry of `[[recording]]`.
#[derive(Debug)]
pub(super) struct ListedRecording {
    pub(super) path: PathBuf,
    /// Index into the benches.
    pub(super) bench: usize,
    pub(super) heldout: bool,
    pub(super) set: Vec<Assignment>,
    /// Where `set` stands.
    pub(super) set_at: String,
}

impl StudyFile {
    pub(super) fn load(path: &Path) -> Result<Self, Failure> {
        let text = read_text(path)?;
        let folder = path.parent().unwrap_or_else(|| Path::new(""));
        Self::parse(&text, &path.display().to_string(), folder)
    }

    fn parse(text: &str, name: &str, folder: &Path) -> Result<Self, Failure> {
        let source = Source { name, text };
        let document = DeTable::parse(text).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            source.at(&span, format!("not TOML: {}; correct it", error.message()))
        })?;
        let file = Section::new(source, "", 0..0, document.get_ref());
        file.check_schema(SCHEMA)?;
        file.refuse_unknown("key", ["schema", "name", "bench", "recording"])?;
        let study_name = file.string("name")?.map_or("unnamed", |(name, _)| name);
        let listed = file.sections("bench", "bench")?;
        let mut benches: Vec<ListedBench> = Vec::new();
        for section in &listed {
            let bench = read_bench(section, folder)?;
            if benches.iter().any(|other| other.name == bench.name) {
                let reason = format!("bench `{}` is described twice; give each its own name", bench.name);
                return Err(source.at(&section.span, reason));
            }
            benches.push(bench);
        }
        if benches.is_empty() {
            return Err(source.at(&(0..0), "no [[bench]]; name at least one, with its `rig`"));
        }
        let mut recordings: Vec<ListedRecording> = Vec::new();
        for section in file.sections("recording", "recording")? {
            let recording = read_recording(&section, folder, &benches)?;
            if let Some(twice) = recordings.iter().find(|other| is_same(&other.path, &recording.path)) {
                let reason = if twice.heldout == recording.heldout {
                    "is listed twice; list it once"
                } else {
                    "is listed as held out and not; a judge must be another recording"
                };
                return Err(source.at(&section.span, format!("{} {reason}", recording.path.display())));
            }
            recordings.push(recording);
        }
        for (index, (bench, section)) in benches.iter().zip(&listed).enumerate() {
            if !recordings.iter().any(|recording| recording.bench == index && !recording.heldout) {
                let reason = format!(
                    "bench `{}` has no recording to learn from; add a [[recording]] that is not held out, or drop the \
                     bench",
                    bench.name
                );
                return Err(source.at(&section.span, reason));
            }
        }
        Ok(Self { name: study_name.to_owned(), benches, recordings })
    }
}

/// A required string.
fn required<'t>(section: &Section<'t>, key: &str, meaning: &str) -> Result<LocatedStr<'t>, Failure> {
    section.string(key)?.ok_or_else(|| section.lacks(key, meaning))
}

/// A path that exists, relative to `folder`.
fn existing(section: &Section, (path, span): LocatedStr, folder: &Path) -> Result<PathBuf, Failure> {
    let path = folder.join(path);
    if path.exists() {
        return Ok(path);
    }
    let reason = format!("{} does not exist; paths are relative to the study file", path.display());
    Err(section.source.at(&span, reason))
}

fn read_bench(section: &Section, folder: &Path) -> Result<ListedBench, Failure> {
    section.refuse_unknown("key", ["name", "rig", "own"])?;
    let (name, span) = required(section, "name", "name of the bench")?;
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.');
    if name.is_empty() || name.starts_with('.') || !name.chars().all(is_plain) {
        let reason = format!(
            "bench.name: got `{name}`; use letters, digits, `-`, `_` and `.`: it becomes part of a file's name"
        );
        return Err(section.source.at(&span, reason));
    }
    let rig = existing(section, required(section, "rig", "path of the bench's rig file")?, folder)?;
    let mut own: Vec<(RigParameter, String)> = Vec::new();
    for (path, span) in section.strings("own")?.unwrap_or_default() {
        let parameter = RigParameter::parse(path).map_err(|reason| section.source.at(&span, reason))?;
        if !parameter.can_be_fitted() {
            let reason = format!("`{path}` cannot be fitted; state it under `set` of the recordings");
            return Err(section.source.at(&span, reason));
        }
        if own.iter().any(|(other, _)| *other == parameter) {
            return Err(section.source.at(&span, format!("`{path}` is listed twice; list it once")));
        }
        own.push((parameter, section.source.place(&span)));
    }
    Ok(ListedBench { name: name.to_owned(), rig, own })
}

fn read_recording(
    section: &Section,
    folder: &Path,
    benches: &[ListedBench],
) -> Result<ListedRecording, Failure> {
    section.refuse_unknown("key", ["file", "bench", "heldout", "set"])?;
    let path = existing(section, required(section, "file", "path of the recording")?, folder)?;
    let bench = match section.string("bench")? {
        Some((name, span)) => benches.iter().position(|bench| bench.name == name).ok_or_else(|| {
            let known = benches.iter().map(|bench| bench.name.as_str());
            section.source.at(&span, format!("unknown bench `{name}`; {}", advice(name, known)))
        })?,
        None if benches.len() == 1 => 0,
        None => return Err(section.lacks("bench", "name of the bench that was recorded")),
    };
    let mut set = Vec::new();
    let mut set_at = section.source.place(&section.span);
    if let Some(table) = section.section("set", "recording.set")? {
        set_at = section.source.place(&table.span);
        read_assignments(&table, "", &mut set)?;
    }
    Ok(ListedRecording { path, bench, heldout: section.flag("heldout")?.unwrap_or(false), set, set_at })
}

/// Reads `"load.mass_kg" = 2.0`, and the same with nested tables, `load.mass_kg = 2.0`.
fn read_assignments(table: &Section, above: &str, set: &mut Vec<Assignment>) -> Result<(), Failure> {
    for (key, span, value) in table.entries() {
        let path = if above.is_empty() { key.to_owned() } else { format!("{above}.{key}") };
        if let DeValue::Table(nested) = value.get_ref() {
            let nested = Section::new(table.source, table.name, value.span(), nested);
            read_assignments(&nested, &path, set)?;
            continue;
        }
        let parameter = RigParameter::parse(&path).map_err(|reason| table.source.at(&span, reason))?;
        let number = table.number(key, FINITE)?;
        let value = number.ok_or_else(|| table.wrong_type(key, value, "a number"))?;
        set.push(Assignment { parameter, value });
    }
    Ok(())
}
