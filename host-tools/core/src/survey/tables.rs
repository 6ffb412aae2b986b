//! The tables of a survey.

use std::path::Path;

use super::drift::drifts;
use super::occurrences::{Since, effect_name, law_name, occurrences};
use super::parquet_file::{NamedColumn, Values, write as write_table};
use super::rows::{Status, SurveyRow};
use super::store::Surveyed;
use crate::diagnose::verdict::{Diagnosis, Estimate};
use crate::outcome::Failure;

/// Writes all tables into the folder of the survey.
pub(super) fn write(rows: &[SurveyRow<'_>], folder: &Path) -> Result<(), Failure> {
    for (name, columns) in [
        ("recordings.parquet", recordings(rows)),
        ("effects.parquet", effects(rows)),
        ("parameters.parquet", parameters(rows)),
        ("drifts.parquet", of_drifts(rows)),
    ] {
        write_table(&folder.join(name), &columns)?;
    }
    Ok(())
}

fn text<T>(all: &[T], value: impl Fn(&T) -> Option<String>) -> Values {
    Values::Text(all.iter().map(value).collect())
}

fn number<T>(all: &[T], value: impl Fn(&T) -> Option<f64>) -> Values {
    Values::Number(all.iter().map(value).collect())
}

fn whole(count: usize) -> Option<i64> {
    i64::try_from(count).ok()
}

/// The verdict as files write it.
pub(super) fn verdict(diagnosis: &Diagnosis) -> String {
    let said = serde_json::to_value(diagnosis.verdict).unwrap_or_default();
    said.as_str().unwrap_or_default().to_owned()
}

fn recordings(rows: &[SurveyRow<'_>]) -> Vec<NamedColumn> {
    let of = |row: &SurveyRow<'_>, value: &dyn Fn(&Surveyed) -> f64| row.surveyed.as_ref().map(value);
    let message = |row: &SurveyRow<'_>| match &row.status {
        Status::Failed(message) => Some(message.clone()),
        Status::Done => row.surveyed.as_ref().map(|s| s.notes.join("\n")).filter(|notes| !notes.is_empty()),
        Status::Left => None,
    };
    let samples = |row: &SurveyRow<'_>| row.surveyed.as_ref().and_then(|surveyed| whole(surveyed.samples));
    vec![
        ("recording", text(rows, |row| Some(row.task.recording.clone()))),
        ("bench", text(rows, |row| Some(row.task.bench.clone()))),
        ("status", text(rows, |row| Some(row.status.name().to_owned()))),
        ("message", text(rows, message)),
        ("samples", Values::Whole(rows.iter().map(samples).collect())),
        ("duration_s", number(rows, |row| of(row, &|s| s.duration_s))),
        ("verdict", text(rows, |row| row.surveyed.as_ref().map(|s| verdict(&s.diagnosis)))),
        ("summary", text(rows, |row| row.surveyed.as_ref().map(|s| s.diagnosis.summary.clone()))),
        ("heldout_loss_before", number(rows, |row| of(row, &|s| s.diagnosis.heldout_loss.before))),
        (
            "heldout_loss_recalibrated",
            number(rows, |row| of(row, &|s| s.diagnosis.heldout_loss.recalibrated)),
        ),
        ("heldout_loss_after", number(rows, |row| of(row, &|s| s.diagnosis.heldout_loss.after))),
    ]
}

/// An effect or law of a recording.
struct Found<'r> {
    surveyed: &'r Surveyed,
    /// Recording from which on all of the bench name it.
    since: Option<&'r str>,
    id: &'r str,
    component: &'r str,
    channel: Option<&'r String>,
    probability: Option<f64>,
    onset_s: Option<f64>,
    formula: Option<&'r String>,
    heldout_improvement: f64,
    sentence: &'r str,
}

fn effects(rows: &[SurveyRow<'_>]) -> Vec<NamedColumn> {
    let all: Vec<Found<'_>> = SurveyRow::benches(rows).flat_map(|(_, rows)| found(rows)).collect();
    vec![
        ("recording", text(&all, |found| Some(found.surveyed.recording.clone()))),
        ("bench", text(&all, |found| Some(found.surveyed.bench.clone()))),
        ("id", text(&all, |found| Some(found.id.to_owned()))),
        ("component", text(&all, |found| Some(found.component.to_owned()))),
        ("channel", text(&all, |found| found.channel.cloned())),
        ("probability", number(&all, |found| found.probability)),
        ("onset_s", number(&all, |found| found.onset_s)),
        ("formula", text(&all, |found| found.formula.cloned())),
        ("heldout_improvement", number(&all, |found| Some(found.heldout_improvement))),
        ("sentence", text(&all, |found| Some(found.sentence.to_owned()))),
        ("since", text(&all, |found| found.since.map(str::to_owned))),
    ]
}

/// All effects and laws of a bench.
fn found<'r>(rows: &'r [SurveyRow<'_>]) -> Vec<Found<'r>> {
    let occurrences = occurrences(rows);
    let since = |name: &str| {
        let place = Since::of(occurrences.get(name)?, rows)?.place()?;
        Some(rows[place].task.recording.as_str())
    };
    let mut all = Vec::new();
    for surveyed in rows.iter().filter_map(|row| row.surveyed.as_ref()) {
        all.extend(surveyed.diagnosis.effects.iter().map(|effect| Found {
            surveyed,
            since: since(&effect_name(effect)),
            id: &effect.id,
            component: &effect.component,
            channel: effect.channel.as_ref(),
            probability: Some(effect.probability),
            onset_s: effect.onset_s,
            formula: None,
            heldout_improvement: effect.heldout_improvement,
            sentence: &effect.sentence,
        }));
        all.extend(surveyed.diagnosis.laws.iter().map(|law| Found {
            surveyed,
            since: since(&law_name(law)),
            id: "law",
            component: &law.component,
            channel: law.channel.as_ref(),
            probability: None,
            onset_s: None,
            formula: Some(&law.formula),
            heldout_improvement: law.heldout_improvement,
            sentence: &law.sentence,
        }));
    }
    all
}

/// A parameter of a recording: name, where from, value in the rig file, and the estimate.
type Parameter<'r> = (&'r Surveyed, String, &'r str, Option<f64>, Estimate);

fn parameters(rows: &[SurveyRow<'_>]) -> Vec<NamedColumn> {
    let mut all: Vec<Parameter<'_>> = Vec::new();
    for surveyed in rows.iter().filter_map(|row| row.surveyed.as_ref()) {
        for found in &surveyed.diagnosis.recalibrated {
            let (value, std, unit, at_bound) = (found.fitted, found.std, found.unit.clone(), found.at_bound);
            let estimate = Estimate { value, std, unit, at_bound };
            all.push((surveyed, found.parameter.clone(), "recalibrated", Some(found.nominal), estimate));
        }
        for effect in &surveyed.diagnosis.effects {
            for (name, estimate) in &effect.parameters {
                all.push((
                    surveyed,
                    format!("effects.{}.{name}", effect.id),
                    "effect",
                    None,
                    estimate.clone(),
                ));
            }
        }
        for law in &surveyed.diagnosis.laws {
            for (name, estimate) in &law.coefficients {
                all.push((surveyed, format!("law.{}.{name}", law.port), "law", None, estimate.clone()));
            }
        }
    }
    vec![
        ("recording", text(&all, |(surveyed, ..)| Some(surveyed.recording.clone()))),
        ("bench", text(&all, |(surveyed, ..)| Some(surveyed.bench.clone()))),
        ("parameter", text(&all, |(_, name, ..)| Some(name.clone()))),
        ("of", text(&all, |(_, _, of, ..)| Some((*of).to_owned()))),
        ("nominal", number(&all, |(_, _, _, nominal, _)| *nominal)),
        ("value", number(&all, |(.., estimate)| Some(estimate.value))),
        ("std", number(&all, |(.., estimate)| estimate.std)),
        ("unit", text(&all, |(.., estimate)| Some(estimate.unit.clone()))),
        ("at_bound", Values::Flag(all.iter().map(|(.., estimate)| Some(estimate.at_bound)).collect())),
    ]
}

fn of_drifts(rows: &[SurveyRow<'_>]) -> Vec<NamedColumn> {
    let all = drifts(rows);
    vec![
        ("bench", text(&all, |drift| Some(drift.bench.clone()))),
        ("parameter", text(&all, |drift| Some(drift.parameter.clone()))),
        ("unit", text(&all, |drift| Some(drift.unit.clone()))),
        ("nominal", number(&all, |drift| Some(drift.nominal))),
        ("recordings", Values::Whole(all.iter().map(|drift| whole(drift.points.len())).collect())),
        ("first", number(&all, |drift| Some(drift.first))),
        ("last", number(&all, |drift| Some(drift.last))),
        ("change_std", number(&all, |drift| Some(drift.change_std))),
        ("drifts", Values::Flag(all.iter().map(|drift| Some(drift.drifts())).collect())),
    ]
}
