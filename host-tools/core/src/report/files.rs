//! Files of a diagnosis in its folder.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::diagnose::Diagnosed;
use crate::outcome::Failure;
use crate::output;
use crate::rig::RigDocument;
use crate::study::Study;

/// The result of a diagnosis, in its folder.
pub const RESULT: &str = "diagnosis.json";

/// Its report.
pub const REPORT: &str = "report.html";

/// The rig file with what was found, where there is one bench.
pub const RIG: &str = "rig.diagnosed.toml";

/// Writes result, report, rigs and references of a diagnosis into its folder, in place of an earlier one's; returns where the
/// report is. `rigs` are the rig files that were diagnosed, one a bench, under the names to write; they get the physics
/// that was found.
///
/// # Errors
/// When the medium refuses, or a rig file cannot take a value.
pub fn save(
    diagnosed: &Diagnosed,
    rigs: &mut [(&str, &mut RigDocument)],
    folder: &Path,
) -> Result<PathBuf, Failure> {
    let [result, page] = [RESULT, REPORT].map(|name| folder.join(name));
    let json = serde_json::to_string_pretty(&diagnosed.findings.diagnosis)
        .map_err(|error| Failure::failed(format!("{}: {error}", result.display())))?;
    output::write_file(&result, |file| writeln!(file, "{json}"))?;
    output::write_file(&page, |file| file.write_all(super::render(&diagnosed.findings).as_bytes()))?;
    for (bench, (name, document)) in rigs.iter_mut().enumerate() {
        diagnosed.write_into(bench, document)?;
        document.save(&folder.join(name))?;
    }
    for earlier in earlier_experiments(folder) {
        output::remove_file(&folder.join(earlier))?;
    }
    for experiment in &diagnosed.experiments {
        experiment.reference.save(&folder.join(&experiment.file))?;
    }
    Ok(page)
}

/// Names of the rig files that a diagnosis writes, one a bench.
pub fn rig_files(study: &Study) -> Vec<String> {
    match &study.benches[..] {
        [_] => vec![RIG.to_owned()],
        benches => benches.iter().map(|bench| format!("rig.diagnosed.{}.toml", bench.name)).collect(),
    }
}

/// Names of the references that an earlier diagnosis left in `folder`: they ask for what may be settled by now.
pub fn earlier_experiments(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| {
            let reference = name.strip_suffix(".csv").and_then(|name| name.strip_prefix("separate-"));
            reference.is_some_and(|pair| pair.contains("-from-"))
        })
        .collect();
    names.sort_unstable();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_of_an_earlier_diagnosis_are_found_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let ours = ["separate-a-from-b.csv", "separate-joint_spring-from-payload_change.csv"];
        for name in
            ours.into_iter().chain(["separate.csv", "from-a.csv", "separate-a-from-b.mcap", "report.html"])
        {
            fs::write(folder.path().join(name), "").unwrap();
        }
        assert_eq!(earlier_experiments(folder.path()), ours);
        assert_eq!(earlier_experiments(&folder.path().join("not there")), [""; 0]);
    }
}
