//! Calibration of a board and its bench: one question at a time, each answer checked by what the board then measures.
//!
//! | step | tendons | module |
//! |---|---|---|
//! | zeros of tensions and current | off | `zeros` |
//! | order of the tension channels | off | `channel_order` |
//! | gains with a weight | off | `gains` |
//! | directions and zeros of the encoders | off, then on | `encoders` |
//! | pretension, and the board's own checks | on | `pretension` |
//! | direction of the motor, resistance | on | `motor` |
//!
//! Each step has a table of what it accepts. It is written to the [`sheet`] when it is done, so that a calibration that was stopped goes
//! on behind it. The [`dialog`] asks, the [`hand`] acts at the bench; a simulated hand moves a simulated bench and tells nothing.

mod bench;
mod channel_order;
pub mod dialog;
mod encoders;
mod gains;
pub mod hand;
mod look;
mod motor;
mod pretension;
pub mod sheet;
mod zeros;

use std::path::Path;

use bowden_core::outcome::{Failure, Outcome};

use crate::session::{Session, Stop};
use bench::Bench;
use dialog::{Dialog, ask, yes};
use hand::Hand;
use sheet::{BoardName, Sheet, SignedOff};

/// Why a step did not come to its end.
#[derive(Debug)]
enum Trouble {
    /// What was measured is not possible.
    Refused(String),
    /// The user stops.
    Stopped,
    /// No answers come any more; this question stands.
    NoAnswer(String),
    /// Link or medium.
    Failed(Failure),
}

/// What is to be calibrated, and where it is written.
pub struct Setup<'s> {
    /// File of the calibration; one that is not finished is gone on with.
    pub out: &'s Path,
    /// This program, as the file names it.
    pub tool: String,
    /// Time now, UTC.
    pub now: &'s dyn Fn() -> String,
    /// Store the parameters in the board's flash without asking.
    pub store: bool,
    /// Whether the user wants to stop.
    pub stop: Stop<'s>,
}

/// Measures into the sheet.
type Run = fn(&mut Bench, &mut Sheet, &str) -> Result<(), Trouble>;

/// A step: what it is called, whether it is done, and how.
struct Step {
    title: &'static str,
    done: fn(&Sheet) -> bool,
    run: Run,
}

const STEPS: [Step; 6] = [
    Step {
        title: "zeros of the tension channels and of the current",
        done: |sheet| sheet.zeros.is_some(),
        run: zeros::run,
    },
    Step {
        title: "order of the tension channels",
        done: |sheet| sheet.channel_order.is_some(),
        run: channel_order::run,
    },
    Step { title: "gains, with a weight", done: |sheet| sheet.gains.is_some(), run: gains::run },
    Step {
        title: "directions and zeros of the encoders",
        done: |sheet| sheet.encoders.is_some(),
        run: encoders::run,
    },
    Step { title: "pretension", done: |sheet| sheet.pretension.is_some(), run: pretension::run },
    Step {
        title: "direction and resistance of the motor",
        done: |sheet| sheet.motor.is_some(),
        run: motor::run,
    },
];

/// The steps, one line each.
#[must_use]
pub fn steps() -> String {
    let lines: Vec<String> =
        STEPS.iter().enumerate().map(|(index, step)| format!("{} {}\n", index + 1, step.title)).collect();
    lines.concat()
}

/// Calibrates a board: the steps that the file does not have yet, then sets what was found and signs it off.
///
/// # Errors
/// Exit status 2: the file is of another board, signed off, or no calibration; no answers come any more. 1: a measurement that is not possible
/// and not repeated, the user stops, or a broken link or medium. What was done until then stands in the file.
pub fn calibrate(
    setup: &Setup,
    session: &mut Session,
    hand: &mut dyn Hand,
    dialog: &mut dyn Dialog,
) -> Result<Outcome, Failure> {
    let (greeting, _) = session.board();
    let board = BoardName {
        name: greeting.board.as_str().to_owned(),
        serial: greeting.serial.as_str().to_owned(),
        firmware: greeting.firmware.as_str().to_owned(),
        tool: setup.tool.clone(),
    };
    let mut sheet = Sheet::open(setup.out, board)?;
    let mut bench = Bench { session, hand, dialog, stop: setup.stop, file: setup.out, tendons_on: None };
    for (index, step) in STEPS.iter().enumerate() {
        let head = format!("{} of {}: {}", index + 1, STEPS.len(), step.title);
        if (step.done)(&sheet) {
            bench.dialog.show(&format!("{head}: done before\n"))?;
            continue;
        }
        bench.dialog.show(&format!("{head}\n"))?;
        carry_out(&mut bench, &mut sheet, step, setup)?;
        sheet.save(setup.out)?;
    }
    let signed =
        sign_off(&mut bench, &sheet, setup).map_err(|trouble| ended(trouble, "the sign-off", setup))?;
    sheet.signed_off = Some(signed);
    sheet.save(setup.out)?;
    bench.dialog.show(&format!("{}: signed off\n", setup.out.display()))?;
    Ok(Outcome::done())
}

/// Runs a step until it is done or given up.
fn carry_out(bench: &mut Bench, sheet: &mut Sheet, step: &Step, setup: &Setup) -> Result<(), Failure> {
    loop {
        let mut tried = sheet.clone();
        let reason = match (step.run)(bench, &mut tried, &(setup.now)()) {
            Ok(()) => {
                *sheet = tried;
                return Ok(());
            }
            Err(Trouble::Refused(reason)) => reason,
            Err(trouble) => return Err(ended(trouble, step.title, setup)),
        };
        bench.dialog.show(&format!("  refused: {reason}\n"))?;
        // Whatever was corrected, the tendons may be where they were not.
        bench.tendons_on = None;
        match dialog::done(bench.dialog, "Measure this step again?") {
            Ok(()) => {}
            Err(Trouble::Failed(failure)) => return Err(failure),
            Err(_) => {
                let kept = kept(setup);
                return Err(Failure::failed(format!("{}: {reason}; {kept}", step.title)));
            }
        }
    }
}

/// Where what was done can be gone on with.
fn kept(setup: &Setup) -> String {
    if setup.out.exists() {
        format!("the same command goes on behind what stands in {}", setup.out.display())
    } else {
        "nothing is done yet; the same command begins again".to_owned()
    }
}

/// A calibration that ended before its end.
fn ended(trouble: Trouble, during: &str, setup: &Setup) -> Failure {
    let kept = kept(setup);
    match trouble {
        Trouble::Refused(reason) => Failure::failed(format!("{during}: {reason}; {kept}")),
        Trouble::Stopped => Failure::failed(format!("stopped by the user during {during}; {kept}")),
        Trouble::NoAnswer(question) => {
            Failure::bad_input(format!("standard input: no answer to `{question}`; {kept}"))
        }
        Trouble::Failed(failure) => failure.with_note(&kept),
    }
}

/// Sets what was found, has it stored and signed.
fn sign_off(bench: &mut Bench, sheet: &Sheet, setup: &Setup) -> Result<SignedOff, Trouble> {
    let values = sheet.parameters();
    bench.set(&values)?;
    let stored = setup.store
        || yes(bench.dialog, "Store the parameters in the board's flash, for the time after a power cut?")?;
    if stored {
        bench.session.client().store_parameters()?;
    }
    let by = ask(bench.dialog, "Signed off by (name): ", |answer| {
        if answer.is_empty() { Err("a name".to_owned()) } else { Ok(answer.to_owned()) }
    })?;
    Ok(SignedOff { at: (setup.now)(), by, stored, parameters: values })
}

#[cfg(test)]
mod tests;
