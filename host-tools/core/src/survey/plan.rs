//! Which recordings a folder holds, and which rig each is of.

use std::cmp::Ordering;
use std::fs;
use std::path::{Path, PathBuf};

use super::task::{RIG_BESIDE, Task};
use crate::outcome::Failure;
use crate::output;
use crate::recording::Format;

/// A rig file for recordings below a folder: `FOLDER=RIG.toml`, or `RIG.toml` for all.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RigRule {
    /// Folder below the surveyed one; empty for all.
    pub below: String,
    /// The rig file.
    pub rig: PathBuf,
}

impl std::str::FromStr for RigRule {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (below, rig) = text.split_once('=').unwrap_or(("", text));
        if rig.is_empty() {
            return Err("expected RIG.toml, or FOLDER=RIG.toml".to_owned());
        }
        Ok(Self { below: below.trim_matches('/').to_owned(), rig: PathBuf::from(rig) })
    }
}

/// The recordings of a survey, bench by bench, each bench in the order of its files' names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Name of the surveyed folder.
    pub name: String,
    /// At least one.
    pub tasks: Vec<Task>,
}

impl Plan {
    /// Finds the recordings (`.csv`, `.csv.gz`, `.mcap`, `.parquet`) of a folder and of those below; `out` is passed over, and what begins with a dot.
    ///
    /// The rig of a recording is that of the longest folder among `rules` that it lies in, else the nearest `rig.toml` beside or above it, else
    /// that of the rule for all.
    ///
    /// # Errors
    /// A folder that cannot be read or has no recording; a rule for a folder that is not there.
    pub fn new(folder: &Path, rules: &[RigRule], out: &Path) -> Result<Self, Failure> {
        let shown = folder.display();
        if !folder.is_dir() {
            return Err(Failure::bad_input(format!(
                "{shown}: is no folder; name the folder of the recordings"
            )));
        }
        for rule in rules {
            if !folder.join(&rule.below).is_dir() {
                let below = &rule.below;
                return Err(Failure::bad_input(format!(
                    "--rig {below}=...: {shown} has no folder {below}; correct it"
                )));
            }
            if !rule.rig.is_file() {
                let rig = rule.rig.display();
                return Err(Failure::bad_input(format!("{rig}: no such rig file; check the path")));
            }
        }
        let name = folder
            .canonicalize()
            .ok()
            .and_then(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
        let name = name.unwrap_or_else(|| "recordings".to_owned());
        let mut found = Vec::new();
        collect(folder, &out.canonicalize().unwrap_or_else(|_| out.to_owned()), &mut found)?;
        let mut tasks: Vec<Task> = found.into_iter().map(|path| task(folder, &name, rules, path)).collect();
        tasks.sort_by(|a, b| natural(&a.bench, &b.bench).then_with(|| natural(&a.recording, &b.recording)));
        if tasks.is_empty() {
            return Err(Failure::bad_input(format!(
                "{shown}: no recording (.csv, .csv.gz, .mcap, .parquet) in it or below; name another folder"
            )));
        }
        Ok(Self { name, tasks })
    }
}

fn collect(folder: &Path, out: &Path, found: &mut Vec<PathBuf>) -> Result<(), Failure> {
    let unreadable = |error: &std::io::Error| {
        let reason = output::describe(error);
        Failure::bad_input(format!("{}: cannot be read: {reason}; check its permissions", folder.display()))
    };
    for entry in fs::read_dir(folder).map_err(|error| unreadable(&error))? {
        let path = entry.map_err(|error| unreadable(&error))?.path();
        let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if is_hidden || path.canonicalize().is_ok_and(|path| path == out) {
            continue;
        }
        if path.is_dir() {
            // A link to a folder could lead back to where it lies.
            if !path.is_symlink() {
                collect(&path, out, found)?;
            }
        } else if Format::of(&path).is_some() {
            found.push(path);
        }
    }
    Ok(())
}

fn task(folder: &Path, name: &str, rules: &[RigRule], path: PathBuf) -> Task {
    let below = path.strip_prefix(folder).unwrap_or(&path);
    let parts: Vec<String> = below.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    let recording = parts.join("/");
    let bench = parts[..parts.len().saturating_sub(1)].join("/");
    let is_in = |rule: &&RigRule| {
        !rule.below.is_empty() && (bench == rule.below || bench.starts_with(&format!("{}/", rule.below)))
    };
    let ruled = rules.iter().filter(is_in).max_by_key(|rule| rule.below.len());
    let beside = || {
        let above = path.ancestors().skip(1).take_while(|above| above.starts_with(folder));
        above.map(|above| above.join(RIG_BESIDE)).find(|rig| rig.is_file())
    };
    let for_all = || rules.iter().find(|rule| rule.below.is_empty());
    let rig =
        ruled.map(|rule| rule.rig.clone()).or_else(beside).or_else(|| for_all().map(|rule| rule.rig.clone()));
    Task { recording, path, bench: if bench.is_empty() { name.to_owned() } else { bench }, rig }
}

/// Order of names as people count: `run-9` before `run-10`.
fn natural(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a, b);
    loop {
        let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
        let order = match (digits(a), digits(b)) {
            (0, _) | (_, 0) => match (a.chars().next(), b.chars().next()) {
                (Some(one), Some(other)) => {
                    let order = one.cmp(&other);
                    (a, b) = (&a[one.len_utf8()..], &b[other.len_utf8()..]);
                    order
                }
                (one, other) => return one.is_some().cmp(&other.is_some()),
            },
            (of_a, of_b) => {
                let (one, other) = (a[..of_a].trim_start_matches('0'), b[..of_b].trim_start_matches('0'));
                let order = one.len().cmp(&other.len()).then_with(|| one.cmp(other)).then(of_a.cmp(&of_b));
                (a, b) = (&a[of_a..], &b[of_b..]);
                order
            }
        };
        if order.is_ne() {
            return order;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_ordered_as_people_count() {
        let mut names = ["run-10", "run-9", "run-09", "run", "a/2", "a/11", "b"];
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(names, ["a/2", "a/11", "b", "run", "run-9", "run-09", "run-10"]);
    }

    #[test]
    fn every_recording_has_the_nearest_rig_and_its_folder_for_a_bench() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let (left, right) = (folder.join("left"), folder.join("right"));
        for path in [left.join("old"), right.clone(), folder.join("out"), folder.join(".git")] {
            fs::create_dir_all(path).unwrap();
        }
        for file in [
            "left/rig.toml",
            "left/2.csv",
            "left/10.csv",
            "left/old/1.mcap",
            "right/1.csv.gz",
            "right/note.txt",
            "all.toml",
        ] {
            fs::write(folder.join(file), "").unwrap();
        }
        for file in ["out/1.csv", ".git/1.csv", "old.toml"] {
            fs::write(folder.join(file), "").unwrap();
        }
        let rules = |rules: &[(&str, &str)]| -> Vec<RigRule> {
            let rule =
                |(below, rig): &(&str, &str)| RigRule { below: (*below).to_owned(), rig: folder.join(rig) };
            rules.iter().map(rule).collect()
        };
        let plan =
            Plan::new(folder, &rules(&[("", "all.toml"), ("left/old", "old.toml")]), &folder.join("out"))
                .unwrap();
        let found: Vec<(&str, &str, PathBuf)> = plan
            .tasks
            .iter()
            .map(|task| (task.recording.as_str(), task.bench.as_str(), task.rig.clone().unwrap()))
            .collect();
        let beside = folder.join("left/rig.toml");
        assert_eq!(
            found,
            [
                ("left/2.csv", "left", beside.clone()),
                ("left/10.csv", "left", beside),
                ("left/old/1.mcap", "left/old", folder.join("old.toml")),
                ("right/1.csv.gz", "right", folder.join("all.toml")),
            ]
        );
        let lacking = Plan::new(folder, &rules(&[("middle", "all.toml")]), folder).unwrap_err();
        assert!(lacking.message().contains("has no folder middle"), "{lacking}");
        assert!(Plan::new(&right, &[], folder).unwrap().tasks[0].rig.is_none());
    }
}
