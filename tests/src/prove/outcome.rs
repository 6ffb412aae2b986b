//! What one case came to: kept as one line of JSON, so that an interrupted run goes on where it stopped.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::sync::Mutex;

use serde::{Deserialize, Serialize};

use super::plan::Group;
use super::truth::Truth;

/// Number that a diagnosis states.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stated {
    /// Value, SI.
    pub value: f64,
}

/// Effect that could not be excluded beside a named one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rival {
    /// Id.
    pub id: String,
    /// Probability that it is this one.
    pub probability: f64,
}

/// Effect that a diagnosis names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SaidEffect {
    /// Id.
    pub id: String,
    /// Part of the joint.
    pub component: String,
    /// Probability that it is there.
    pub probability: f64,
    /// When it began, s.
    pub onset_s: Option<f64>,
    /// Channel of a sensor's effect.
    pub channel: Option<String>,
    /// Fitted parameters.
    pub parameters: BTreeMap<String, Stated>,
    /// Part of the held-out loss that it removes.
    #[serde(default)]
    pub heldout_improvement: f64,
    /// What it could be instead.
    #[serde(default)]
    pub rivals: Vec<Rival>,
}

/// A nominal parameter after recalibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recalibrated {
    /// `section.name`.
    pub parameter: String,
    /// Value that fits.
    pub fitted: f64,
}

/// Structure that a diagnosis leaves unexplained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    /// Part of the joint.
    pub component: String,
    /// Channel in which it is strongest.
    pub channel: String,
}

/// A law that a diagnosis states.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SaidLaw {
    /// Where it acts.
    pub port: String,
    /// On what it depends.
    pub variables: Vec<String>,
    /// Channel, for a sensor.
    pub channel: Option<String>,
    /// Formula.
    pub formula: String,
    /// Fitted coefficients.
    pub coefficients: BTreeMap<String, Stated>,
}

/// What is scored of a `diagnosis.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Said {
    /// The diagnosis in one word.
    pub verdict: String,
    /// Effects, most certain first.
    pub effects: Vec<SaidEffect>,
    /// Nominal parameters that were fitted.
    pub recalibrated: Vec<Recalibrated>,
    /// What no named effect explains.
    pub unexplained: Option<Unexplained>,
    /// Laws that describe it, the first the largest.
    #[serde(default)]
    pub laws: Vec<SaidLaw>,
}

/// Root mean square error of each predicted channel on the held-out recording, in its unit.
pub type Errors = BTreeMap<String, f64>;

/// Held-out errors of four rigs, all replayed alike.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Replays {
    /// The rig file that the user has.
    pub believed: Errors,
    /// The diagnosed rig file.
    pub diagnosed: Errors,
    /// True physics with the true parameters.
    pub truth: Errors,
    /// True parameters without the effects.
    pub truth_without_effects: Errors,
}

/// Time and memory of one diagnosis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// From start to end, s.
    pub seconds: f64,
    /// Processor time of all threads, s.
    pub cpu_seconds: f64,
    /// Largest resident memory, MB.
    pub peak_mb: f64,
}

/// One case with what was said of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Name of the case.
    pub name: String,
    /// Kind.
    pub group: Group,
    /// Seed of the case.
    pub seed: u64,
    /// Hash of the program that diagnosed, and of the case as it was drawn.
    pub key: String,
    /// What is concealed.
    pub truth: Truth,
    /// What was said; `None` where there is no diagnosis.
    pub said: Option<Said>,
    /// Why there is none, or no replay.
    pub failure: Option<String>,
    /// Held-out errors.
    pub replays: Replays,
    /// Time and memory.
    pub cost: Cost,
}

/// What a [`Log`] keeps.
pub trait Kept: Serialize + for<'de> Deserialize<'de> {
    /// Whether it is the result of this name, made with the program and the case of this key.
    fn is(&self, name: &str, key: &str) -> bool;
}

impl Kept for Outcome {
    fn is(&self, name: &str, key: &str) -> bool {
        self.name == name && self.key == key
    }
}

/// File of outcomes, one JSON line each, appended as they come.
#[derive(Debug)]
pub struct Log<T = Outcome> {
    file: Mutex<File>,
    known: Vec<T>,
}

impl<T: Kept> Log<T> {
    /// Opens or makes the file. A line that is no outcome, such as the half one of an interrupted run, is passed over.
    ///
    /// # Errors
    /// When the file cannot be read or written.
    pub fn open(path: &Path) -> Result<Self, String> {
        let failed = |error: std::io::Error| format!("{}: {error}", path.display());
        let mut file = OpenOptions::new().create(true).append(true).read(true).open(path).map_err(failed)?;
        let mut known = Vec::new();
        let mut whole = true;
        for line in BufReader::new(&file).lines() {
            let parsed = serde_json::from_str(&line.map_err(failed)?);
            whole = parsed.is_ok();
            known.extend(parsed);
        }
        if !whole {
            // The next outcome begins a line of its own.
            writeln!(file).map_err(failed)?;
        }
        Ok(Self { file: Mutex::new(file), known })
    }

    /// The last outcome of this name with this key.
    #[must_use]
    pub fn find(&self, name: &str, key: &str) -> Option<&T> {
        self.known.iter().rfind(|outcome| outcome.is(name, key))
    }

    /// Appends an outcome.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn append(&self, outcome: &T) -> Result<(), String> {
        let line = serde_json::to_string(outcome).map_err(|error| format!("results: {error}"))?;
        let mut file = self.file.lock().map_err(|_| "the file of results is in use".to_owned())?;
        writeln!(file, "{line}").map_err(|error| format!("results: {error}"))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::prove::truth::{TrueEffect, TrueValue};
    use serde_json::json;

    /// An outcome made by hand: what is concealed, and a diagnosis as the program writes it.
    pub(crate) fn outcome(group: Group, concealed: &[(&str, &str)], diagnosis: serde_json::Value) -> Outcome {
        let effects = concealed.iter().map(|(id, component)| TrueEffect {
            id: (*id).to_owned(),
            component: (*component).to_owned(),
            onset_s: None,
            channel: None,
            parameters: BTreeMap::new(),
        });
        Outcome {
            name: format!("{}/by-hand", group.name()),
            group,
            seed: 7,
            key: "key".to_owned(),
            truth: Truth { effects: effects.collect(), ..Truth::default() },
            said: Some(serde_json::from_value(diagnosis).unwrap()),
            failure: None,
            replays: Replays::default(),
            cost: Cost { seconds: 10.0, cpu_seconds: 18.0, peak_mb: 50.0 },
        }
    }

    /// `diagnosis.json` with effects of a probability, and keys that nobody scores.
    pub(crate) fn diagnosis(verdict: &str, effects: &[(&str, &str, f64)]) -> serde_json::Value {
        let effects: Vec<_> = effects
            .iter()
            .map(|(id, component, probability)| {
                json!({ "id": id, "component": component, "probability": probability, "onset_s": null,
                        "channel": null, "parameters": {}, "heldout_improvement": 0.5, "sentence": "…",
                        "rivals": [] })
            })
            .collect();
        json!({ "schema": "bowden-diagnosis/1", "verdict": verdict, "effects": effects, "recalibrated": [],
                "mismatch": [], "unexplained": null, "fit": { "heldout": true, "channels": {} } })
    }

    #[test]
    fn a_log_gives_back_what_was_appended_and_passes_over_half_a_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.jsonl");
        let mut first = outcome(Group::Single, &[("joint_spring", "joint")], diagnosis("consistent", &[]));
        first.truth.effects[0]
            .parameters
            .insert("stiffness_nm_per_rad".to_owned(), TrueValue { value: 0.35, neutral: 0.0 });
        Log::open(&path).unwrap().append(&first).unwrap();
        let mut file = OpenOptions::new().append(true).open(&path).unwrap();
        write!(file, "{{\"name\":\"cut").unwrap();
        let second = Outcome { name: "other".to_owned(), ..first.clone() };
        Log::open(&path).unwrap().append(&second).unwrap();
        let log = Log::open(&path).unwrap();
        assert_eq!(log.find("single/by-hand", "key"), Some(&first));
        assert_eq!(log.find("other", "key"), Some(&second));
        assert_eq!(log.find("single/by-hand", "another binary"), None);
    }
}
