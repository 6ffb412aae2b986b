//! A bench run as a file: home, pretension checks, motions, pauses; a recording each, a summary, and going on after a stop.
//!
//! Everything that the plan asks for is checked against its own limits and the board's before anything moves. What is done stands in
//! [`ledger::LEDGER`] in the folder of the run, written behind every step, so that the same command goes on behind the last one.

pub mod excitation;
pub mod ledger;
pub mod plan_file;

use std::path::Path;
use std::time::Duration;

use bowden_control::parameters::{Parameters, Reach};
use bowden_core::outcome::Failure;
use bowden_core::progress::Progress;
use bowden_core::recording::Format;

use crate::capture::{Capture, PROGRESS_STEPS};
use crate::course::Course;
use crate::error::LinkError;
use crate::evidence::Origin;
use crate::rig_file::Weight;
use crate::session::{RunEnd, Session, Stop};
use ledger::{Done, Ledger};
use plan_file::{Motion, Plan, Step};

/// Longest wait for something from the board during a pause.
const LOOK: Duration = Duration::from_millis(20);

/// One thing to do, with the name of what it leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Number and kind: `03-sine-2`.
    pub name: String,
    /// What is done.
    pub action: Action,
}

/// What is done.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Bridge off, then self test and pretension check.
    PretensionCheck,
    /// The joint at angle zero.
    Home,
    /// Nothing, for a time, the bridge off.
    Pause(Duration),
    /// A motion, recorded.
    Follow(Box<Motion>),
}

/// What a run needs beside the plan.
pub struct Setting<'s> {
    /// Folder of recordings, ledger and summary.
    pub folder: &'s Path,
    /// Ending of recordings: `csv`, `csv.gz`, `mcap`.
    pub ending: &'s str,
    /// What recordings say of themselves; plan and step are added.
    pub origin: &'s Origin,
    /// Weight on the arm, for the rig in the recordings.
    pub load: Option<Weight>,
    /// Text of the plan.
    pub text: &'s str,
    /// Whether the user wants to stop.
    pub stop: Stop<'s>,
    /// Display.
    pub progress: &'s dyn Progress,
}

/// Everything that a plan does on a joint with these parameters, in order, checked.
///
/// # Errors
/// Exit status 2, with file, line and column: a limit above the board's, a motion that the joint cannot do, or one beyond the plan's
/// limits.
pub fn items(plan: &Plan, parameters: &Parameters) -> Result<Vec<Item>, Failure> {
    let reach = Reach::new(parameters);
    plan.check_limits(&reach)?;
    let mut actions: Vec<(String, Action)> = Vec::new();
    for step in &plan.steps {
        match step {
            Step::PretensionCheck => actions.push(("pretension-check".to_owned(), Action::PretensionCheck)),
            Step::Home => actions.push(("home".to_owned(), Action::Home)),
            Step::Pause(pause) => actions.push(("pause".to_owned(), Action::Pause(*pause))),
            Step::Follow { motion, repeat, place } => {
                motion
                    .check(parameters, &reach, &plan.limits)
                    .map_err(|what| Failure::bad_input(format!("{place}: {what}")))?;
                for turn in 1..=*repeat {
                    let turn = if *repeat == 1 { String::new() } else { format!("-{turn}") };
                    actions
                        .push((format!("{}{turn}", motion.form()), Action::Follow(Box::new(motion.clone()))));
                }
            }
            Step::Excite { rig, seconds, place } => {
                let motions = excitation::choose(rig, *seconds, parameters, &plan.limits)
                    .map_err(|failure| Failure::bad_input(format!("{place}: {}", failure.message())))?;
                for motion in motions {
                    actions.push((format!("excite-{}", motion.form()), Action::Follow(Box::new(motion))));
                }
            }
        }
    }
    let digits = actions.len().to_string().len().max(2);
    let name = |(number, (kind, action)): (usize, (String, Action))| Item {
        name: format!("{:0digits$}-{kind}", number + 1),
        action,
    };
    Ok(actions.into_iter().enumerate().map(name).collect())
}

/// Does what is not done yet. The bridge is off at the end, also after an error.
///
/// # Errors
/// A fault, Ctrl-C, a refusal, a broken link, or the medium; what is done stands in the ledger, what was recorded of the step is kept
/// beside as `NAME.stopped-N`.
pub fn carry_out(
    session: &mut Session,
    items: &[Item],
    ledger: &mut Ledger,
    setting: &Setting,
) -> Result<(), Failure> {
    for item in items.iter().skip(ledger.done().len()) {
        let done = match do_item(session, item, setting) {
            Ok(done) => done,
            Err(failure) => {
                // Over a broken link this fails too, and the board stops by itself: what ended the step is what there is to say.
                let _ = session.off();
                let is_in_fault = session.client().status().is_ok_and(|status| status.fault.is_some());
                return Err(failure.with_note(&format!(
                    "{} of {} steps are done; {}the same command goes on with {}",
                    ledger.done().len(),
                    items.len(),
                    if is_in_fault { "after `bowden faults --clear` " } else { "" },
                    item.name
                )));
            }
        };
        ledger.add(done)?;
    }
    session.off()?;
    Ok(())
}

fn do_item(session: &mut Session, item: &Item, setting: &Setting) -> Result<Done, Failure> {
    let Setting { stop, progress, .. } = *setting;
    let done = |seconds: f64| Done { name: item.name.clone(), seconds, ..Done::default() };
    match &item.action {
        Action::PretensionCheck => {
            progress.stage(&format!("{}: self test and pretension check", item.name), 0);
            session.off()?;
            session.ready(stop)?;
            Ok(done(0.0))
        }
        Action::Home => {
            progress.stage(&format!("{}: homing", item.name), 0);
            session.ready(stop)?;
            session.home(stop)?;
            Ok(done(0.0))
        }
        Action::Pause(pause) => {
            progress.stage(&format!("{}: pause of {} s", item.name, pause.as_secs_f64()), 0);
            session.off()?;
            let end = session.client().now() + *pause;
            while session.client().now() < end {
                if stop() {
                    return Err(LinkError::Interrupted.into());
                }
                let left = end.saturating_sub(session.client().now());
                session.idle(LOOK.min(left))?;
            }
            Ok(done(pause.as_secs_f64()))
        }
        Action::Follow(motion) => follow(session, item, motion, setting),
    }
}

fn follow(session: &mut Session, item: &Item, motion: &Motion, setting: &Setting) -> Result<Done, Failure> {
    let Setting { folder, ending, origin, load, text, stop, progress } = *setting;
    let name = format!("{}.{ending}", item.name);
    let out = folder.join(&name);
    // `kill -9` and a power cut leave rows that no entry of the ledger tells of, perhaps in another format. Before anything moves.
    put_aside(folder, &item.name)?;
    progress.stage(&format!("{}: pretension check and homing", item.name), 0);
    session.ready(stop)?;
    session.home(stop)?;
    progress.stage(&item.name, PROGRESS_STEPS);
    let origin = Origin {
        reference: Some(motion.words()),
        plan: Some((text.to_owned(), item.name.clone())),
        ..origin.clone()
    };
    let capture = Capture {
        out: &out,
        format: Format::for_rows(&out)?,
        mode: motion.mode,
        every: motion.every,
        seconds: Some(motion.seconds),
        origin: &origin,
        rig: Some((&item.name, load)),
        replug: None,
    };
    let (tally, end) = capture.run(session, &Course::OnBoard(motion.reference()), stop, progress)?;
    let kept = |what: String| match put_aside(folder, &item.name) {
        Ok(number) => Failure::failed(format!(
            "{what} ({} after {:.3} s); {} rows are kept in {}",
            item.name,
            tally.duration_s(),
            tally.rows,
            folder.join(aside(&item.name, number, ending)).display()
        )),
        Err(failure) => failure,
    };
    match end {
        Ok(RunEnd::Complete) => {
            let losses = *session.client().losses();
            let loss = tally.loss(&losses);
            let file = Some(name);
            Ok(Done { name: item.name.clone(), seconds: tally.duration_s(), file, rows: tally.rows, loss })
        }
        Ok(RunEnd::Interrupted) => Err(kept("stopped by the user".to_owned())),
        Ok(RunEnd::Fault(fault)) => Err(kept(fault.to_string())),
        Ok(RunEnd::Left(state)) => Err(kept(format!("the board went to state {state}; see `bowden faults`"))),
        Err(error) => Err(kept(error.to_string())),
    }
}

/// Name of what was left of a step that did not end, by the number of its start.
fn aside(step: &str, number: u32, ending: &str) -> String {
    format!("{step}.stopped-{number}.{ending}")
}

/// Renames all that was left of a step that did not end, a recording of any format and what stands beside it; the step is done again. Every
/// start has a number of its own, which is returned, so that nothing is overwritten.
fn put_aside(folder: &Path, step: &str) -> Result<u32, Failure> {
    let failed = |path: &Path, what: &str, error: &std::io::Error| {
        let reason = bowden_core::output::describe(error);
        Failure::failed(format!("{}: cannot be {what}: {reason}; it is kept as it is", path.display()))
    };
    let entries = std::fs::read_dir(folder).map_err(|error| failed(folder, "read", &error))?;
    let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
    let endings: Vec<String> =
        names.filter_map(|name| name.strip_prefix(step)?.strip_prefix('.').map(str::to_owned)).collect();
    let number_of =
        |ending: &str| -> Option<u32> { ending.strip_prefix("stopped-")?.split_once('.')?.0.parse().ok() };
    let number = endings.iter().filter_map(|ending| number_of(ending)).max().unwrap_or(0) + 1;
    for ending in endings.iter().filter(|ending| number_of(ending).is_none()) {
        let left = folder.join(format!("{step}.{ending}"));
        std::fs::rename(&left, folder.join(aside(step, number, ending)))
            .map_err(|error| failed(&left, "renamed", &error))?;
    }
    Ok(number)
}
