//! The page of an investigation: what it came to, tracking before and after, parameters, diagnoses, plan, recordings.

use bowden_core::diagnose::verdict::{Trace, Verdict};
use bowden_core::report::page::document;
use bowden_core::report::{figures, names, physics, plots};
use maud::{Markup, html};

use crate::investigate::changes::{Changes, Reason, State};
use crate::investigate::driver::Recorded;
use crate::investigate::limits::Limits;
use crate::investigate::plan::{Plan, Purpose};
use crate::investigate::report::{Investigation, RESULT};
use crate::investigate::rounds::{Asked, Round};
use crate::investigate::verification::{Effect, Followed, Motion, Verification};

/// Style of what only this page has.
const CSS: &str = "
.outcome { display: flex; flex-wrap: wrap; gap: 14px; margin: 18px 0 0; }
.outcome > div { flex: 1 1 200px; border: 1px solid var(--rule); border-radius: 6px; padding: 10px 14px; }
.outcome .label { color: var(--quiet); font-size: 13px; } .outcome .value { font-size: 22px; font-weight: 650; }
table.plain { width: auto; } table.plain th, table.plain td { padding-right: 28px; }
";

/// Whole document.
pub fn page(investigation: &Investigation) -> Markup {
    let content = html! {
        (heading(investigation))
        (numbers(investigation))
        @if let Some(verification) = &investigation.verification { (tracking(verification)) }
        @if let Some(changes) = &investigation.parameters { (parameters(changes)) }
        @if !investigation.rounds.is_empty() { (diagnoses(&investigation.rounds)) }
        (plan(&investigation.plan))
        (recordings(&investigation.recordings))
        (provenance(investigation))
    };
    document(&format!("Investigation of {}", investigation.rig), CSS, &content)
}

fn heading(investigation: &Investigation) -> Markup {
    let state = investigation.parameters.as_ref().map(|changes| changes.state);
    let effect = investigation.verification.as_ref().and_then(|verification| verification.effect);
    let (class, mark, title) = match (&investigation.stopped, state, effect) {
        (Some(_), ..) => ("unexplained", "?", "Ended early"),
        (None, Some(State::Restored), _) if investigation.followed_worse() => {
            ("missing_physics", "!", "The joint followed worse: the old parameters are back")
        }
        (None, Some(State::Restored), _) => {
            ("recalibrate", "≈", "The joint followed no better: the old parameters are back")
        }
        (None, Some(State::Declined), _) => {
            ("recalibrate", "≈", "Diagnosed; the new parameters were declined")
        }
        (None, Some(State::Set), Some(Effect::Better)) => ("consistent", "✓", "The joint follows better"),
        (None, Some(State::Set), _) => ("recalibrate", "≈", "The joint follows as before"),
        (None, ..) => ("consistent", "✓", "Nothing to change on the board"),
    };
    html! {
        header #outcome class={ "verdict " (class) } {
            div.mark aria-hidden="true" { (mark) }
            div {
                p.eyebrow { "Investigation of " (investigation.rig) }
                h1 { (title) }
                @if let Some(round) = investigation.rounds.last() { p.summary { (round.diagnosis.summary) } }
                p.summary { (investigation.conclusion().replace('`', "")) }
            }
        }
    }
}

/// The few numbers that count.
fn numbers(investigation: &Investigation) -> Markup {
    let entry = |label: &str, value: String| {
        html! { div { div.label { (label) } div.value { (value) } } }
    };
    html! {
        div.outcome {
            @if let Some(round) = investigation.rounds.last() { (entry("Verdict", verdict(round))) }
            @if let Some(verification) = &investigation.verification {
                (entry("Tracking error before, RMS", mrad(verification.before_rms_rad)))
                @if let Some(after) = verification.after_rms_rad {
                    (entry("Tracking error after, RMS", mrad(after)))
                    (entry("Change", figures::change(verification.before_rms_rad, after)))
                }
            }
            (entry("Recordings", investigation.recordings.len().to_string()))
        }
    }
}

fn verdict(round: &Round) -> String {
    let effects: Vec<String> =
        round.diagnosis.effects.iter().map(|effect| names::phrase(&effect.id)).collect();
    match round.diagnosis.verdict {
        Verdict::Consistent => "Consistent".to_owned(),
        Verdict::Recalibrate => "Recalibrate".to_owned(),
        Verdict::Unexplained => "Unexplained".to_owned(),
        Verdict::MissingPhysics => effects.join(", "),
    }
}

fn mrad(value_rad: f64) -> String {
    format!("{} mrad", figures::number(1e3 * value_rad))
}

fn tracking(verification: &Verification) -> Markup {
    html! {
        section #tracking {
            h2 { "Tracking before and after" }
            p.caption {
                "The same reference with the board's old parameters and with the new ones. The first second, in which the "
                "reference is blended in, does not count. The angle is that of the joint's encoder, read in both runs as the new "
                "parameters read it."
            }
            table.plain {
                thead { tr {
                    th scope="col" { "Reference" }
                    th.number scope="col" { "RMS before" } th.number scope="col" { "RMS after" }
                    th.number scope="col" { "Largest before" } th.number scope="col" { "Largest after" }
                } }
                tbody { @for followed in &verification.references {
                    @let after = followed.after;
                    tr {
                        th scope="row" { (followed.run.in_words()) }
                        td.number { (mrad(followed.before.rms_rad)) }
                        td.number { (after.map_or("–".to_owned(), |error| mrad(error.rms_rad))) }
                        td.number { (mrad(followed.before.largest_rad)) }
                        td.number { (after.map_or("–".to_owned(), |error| mrad(error.largest_rad))) }
                    }
                } }
            }
            @for followed in &verification.references { (figure(followed)) }
        }
    }
}

/// Reference and joint over time; without a second run there is one line.
fn figure(followed: &Followed) -> Markup {
    let Some(before) = followed.traces.first() else { return html! {} };
    let after = followed.traces.get(1).unwrap_or(before);
    // Both runs count their time from their own start; a tick more or less at the end is left out.
    let length = before.t_s.len().min(after.t_s.len());
    let cut = |values: &[f64]| values[..length].to_vec();
    let Motion { t_s, reference_rad, joint_rad } = before;
    let trace = Trace {
        channel: "theta_out_rad".to_owned(),
        unit: "rad".to_owned(),
        t_s: cut(t_s),
        measured: cut(reference_rad),
        before: cut(joint_rad),
        after: cut(&after.joint_rad),
        held_out: vec![false; length],
    };
    plots::tracking(&trace, &followed.run.in_words())
}

fn parameters(changes: &Changes) -> Markup {
    let state = match changes.state {
        State::Unchanged => html! { "Nothing changes." },
        State::Declined => html! { "Declined: the board has its old values." },
        State::Set => {
            html! { "Set until the board is switched off; " code { "bowden params store" } " keeps them." }
        }
        State::Restored => html! { "Set and taken back: the board has its old values." },
    };
    let reasons = |title: &str, reasons: &[Reason]| {
        html! {
            @if !reasons.is_empty() {
                h3 { (title) }
                ul { @for Reason { source, reason } in reasons { li { code { (source) } ": " (reason) } } }
            }
        }
    };
    html! {
        section #parameters {
            h2 { "Parameters of the board" }
            p { (state) }
            @if !changes.changes.is_empty() {
                table.plain {
                    thead { tr {
                        th scope="col" { "Parameter" } th.number scope="col" { "Old" } th.number scope="col" { "New" }
                        th scope="col" { "Unit" } th scope="col" { "From" }
                    } }
                    tbody { @for change in &changes.changes { tr {
                        th scope="row" { code { (change.parameter) } }
                        td.number { (figures::number(change.old)) } td.number { (figures::number(change.new)) }
                        td { (figures::unit_text(&change.unit)) } td { code { (change.from) } }
                    } } }
                }
            }
            (reasons("Left as it is", &changes.left))
            (reasons("Not used", &changes.unused))
            (reasons("Cut by a limit of the board", &changes.limited))
        }
    }
}

fn diagnoses(rounds: &[Round]) -> Markup {
    html! {
        section #diagnosis {
            h2 { "Diagnosis" }
            @for (index, round) in rounds.iter().enumerate() {
                @if rounds.len() > 1 { h3 { "Round " (index + 1) } }
                p { (round.diagnosis.summary) " " a href={ (round.folder) "/report.html" } { "Full report" } }
                @for effect in &round.diagnosis.effects { (physics::card(effect)) }
                @if !round.experiments.is_empty() {
                    h4 { "Experiments that separate hypotheses" }
                    ul { @for Asked { motion, not_done, separation, .. } in &round.experiments { li {
                        (motion) " (separation " (figures::number(*separation)) "): "
                        @match not_done { Some(reason) => { "not done: " (reason) }, None => "done, see the next round" }
                    } } }
                }
            }
        }
    }
}

fn plan(plan: &Plan) -> Markup {
    let Limits { angle_rad: [low, high], torque_nm, speed_rad_s, time_s } = plan.limits;
    let purpose = |purpose: Purpose| match purpose {
        Purpose::Training => "training",
        Purpose::Validation => "validation, held out",
        Purpose::Verification => "verification, before and after",
    };
    html! {
        section #plan {
            h2 { "Plan and limits" }
            p {
                "Angle " (figures::number(low)) " to " (figures::quantity(high, "rad")) ", torque "
                (figures::quantity(torque_nm, "N m")) ", speed " (figures::quantity(speed_rad_s, "rad/s")) ", "
                (figures::quantity(time_s, "s")) " in all."
            }
            table.plain {
                thead { tr {
                    th scope="col" { "For" } th scope="col" { "Reference" } th.number scope="col" { "Angle, rad" }
                    th.number scope="col" { "Speed, rad/s" } th.number scope="col" { "Torque, N·m" }
                } }
                tbody { @for run in &plan.runs { tr {
                    th scope="row" { (purpose(run.purpose)) } td { (run.in_words()) }
                    td.number { (figures::number(run.demand.angle_rad)) }
                    td.number { (figures::number(run.demand.speed_rad_s)) }
                    td.number { (figures::number(run.demand.torque_nm)) }
                } } }
            }
            @if !plan.left_out.is_empty() { ul { @for left_out in &plan.left_out { li { "Left out: " (left_out) } } } }
        }
    }
}

fn recordings(recordings: &[Recorded]) -> Markup {
    html! {
        section #recordings {
            h2 { "Recordings" }
            table.plain {
                thead { tr {
                    th scope="col" { "File" } th scope="col" { "For" } th scope="col" { "Reference" }
                    th.number scope="col" { "Length" } th.number scope="col" { "Rows" }
                } }
                tbody { @for recorded in recordings { tr {
                    th scope="row" { a href=(recorded.file) { (recorded.file) } }
                    td { (recorded.purpose) }
                    td { (recorded.reference) @if !recorded.complete { " " span.flag { "ended early" } } }
                    td.number { (figures::seconds(recorded.seconds)) }
                    td.number { (figures::fixed(recorded.rows as f64, 0)) }
                } } }
            }
        }
    }
}

fn provenance(investigation: &Investigation) -> Markup {
    html! {
        section #provenance {
            h2 { "Provenance" }
            dl {
                dt { "Rig" } dd { (investigation.rig) }
                dt { "Board" } dd { (investigation.board) }
                dt { "Numbers" } dd { a href=(RESULT) { (RESULT) } }
                dt { "Written by" } dd { (investigation.written_by) }
                dt { "Format" } dd { code { (investigation.schema) } }
            }
        }
    }
}
