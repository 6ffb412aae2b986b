//! Draws a case, writes its files, and lets the program work on them.

use std::fs::{self, File};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::BufWriter;
use std::path::Path;
use std::thread;

use virtual_bench::{BenchError, Case, MotionKind, Recording};

use super::outcome::{Cost, Outcome, Replays, Said};
use super::plan::Plan;
use super::tool::{Tool, write_inputs};
use super::truth::{HELDOUT_S, TRAINING_S, Truth, believed_rig, true_rig, true_rig_without_effects};

/// Key of a result: the binary and everything that the case was drawn with.
#[must_use]
pub fn key(tool: &Tool, plan: &Plan, case: &Case) -> String {
    format!("{:016x}-{}", tool.hash(), key_of_case(plan, case))
}

/// The part of the key that is the same for every program.
#[must_use]
pub fn key_of_case(plan: &Plan, case: &Case) -> String {
    let mut hasher = DefaultHasher::new();
    format!("{case:?} {} {:?}", plan.lumped, plan.group.recorded()).hash(&mut hasher);
    format!("{:016x}", hasher.finish())
}

/// Runs one case in `folder`, which is made.
///
/// # Errors
/// When the bench refuses the case or a file cannot be written; what goes wrong in the program under test is part of the
/// outcome.
pub fn run(tool: &Tool, plan: &Plan, case: &Case, folder: &Path) -> Result<Outcome, String> {
    let heldout = write_case(plan, case, folder)?;
    let mut outcome = Outcome {
        name: plan.name.clone(),
        group: plan.group,
        seed: plan.seed,
        key: key(tool, plan, case),
        truth: Truth::of(plan, case),
        said: None,
        failure: None,
        replays: Replays::default(),
        cost: Cost::default(),
    };
    if let Err(reason) = examine(tool, folder, &heldout, &mut outcome) {
        outcome.failure = Some(reason);
    }
    Ok(outcome)
}

fn examine(tool: &Tool, folder: &Path, heldout: &Recording, outcome: &mut Outcome) -> Result<(), String> {
    let out = folder.join("out");
    // A diagnosis of an earlier run must not stand in for one that fails now.
    if out.exists() {
        fs::remove_dir_all(&out).map_err(|error| format!("{}: {error}", out.display()))?;
    }
    outcome.cost = tool.diagnose(folder)?;
    let path = out.join("diagnosis.json");
    let text = fs::read_to_string(&path).map_err(|error| format!("diagnosis.json: {error}"))?;
    let said: Said = serde_json::from_str(&text).map_err(|error| format!("diagnosis.json: {error}"))?;
    outcome.said = Some(said);
    let replay = |rig: &str| tool.replay(folder, rig, heldout);
    outcome.replays = Replays {
        believed: replay("rig.toml")?,
        diagnosed: replay("out/rig.diagnosed.toml")?,
        truth: replay("truth.toml")?,
        truth_without_effects: replay("truth-without-effects.toml")?,
    };
    Ok(())
}

/// Records the case and writes all its files; the held-out recording is returned.
///
/// # Errors
/// When the bench refuses the case or a file cannot be written.
pub fn write_case(plan: &Plan, case: &Case, folder: &Path) -> Result<Recording, String> {
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", folder.display());
    fs::create_dir_all(folder).map_err(|error| failed(&error))?;
    let bench = |error: BenchError| format!("{}: {error}", plan.name);
    let (train, heldout) = thread::scope(|scope| {
        let train = scope.spawn(|| case.train(MotionKind::Lab, TRAINING_S));
        let heldout = case.heldout(MotionKind::LabHeldout, HELDOUT_S, TRAINING_S);
        (train.join(), heldout)
    });
    let train = train.map_err(|_| format!("{}: the bench panicked", plan.name))?.map_err(bench)?;
    let heldout = heldout.map_err(bench)?;
    let train = plan.group.recorded().of(train, plan.seed);
    for (name, recording) in [("train.csv", &train), ("heldout.csv", &heldout)] {
        let file = File::create(folder.join(name)).map_err(|error| failed(&error))?;
        recording.write_csv(BufWriter::new(file)).map_err(|error| failed(&error))?;
    }
    for (name, text) in [
        ("rig.toml", believed_rig(plan, case)),
        ("truth.toml", true_rig(case)),
        ("truth-without-effects.toml", true_rig_without_effects(plan, case)),
        ("truth.json", case.truth_json()),
    ] {
        fs::write(folder.join(name), text).map_err(|error| failed(&error))?;
    }
    write_inputs(&folder.join("inputs.csv"), &heldout)?;
    Ok(heldout)
}
