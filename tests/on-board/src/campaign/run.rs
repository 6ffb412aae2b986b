//! One case, from power-on to what the board says of it afterwards.

use bowden_board::{Board, Peaks};
use bowden_link::message::{Boot, Goal, Reference};
use bowden_link::{FaultRecord, State, ToBoard};

use super::case::Case;
use super::healthy::Healthy;
use super::operator::{Look, Operator, Reached};
use super::phase::Phase;
use super::trouble::Act;
use crate::host::Host;
use crate::trial::STEPS_PER_UNIT;
use crate::{Failure, Outcome, fail};

/// Time that the joint is watched behind a stop, nobody ordering anything \[s\].
const AFTER_S: f64 = 0.2;
/// Time in which homing has to end, set on the board: 0.2 rad take 0.5 s \[s\].
const HOMING_TIMEOUT_S: f32 = 2.5;
/// Time for which a joint that is off its reference is driven on, for the board to find it \[s\].
const LONGER_S: f64 = 3.0;
/// Time for a store of parameters \[s\].
const STORE_S: f64 = 0.05;
/// Angle that homing comes back from \[rad\].
const AWAY_RAD: f32 = 0.2;

/// What a run showed.
#[derive(Debug, Clone)]
pub struct Run {
    /// Board time of the first fault \[s\]; `None` in a healthy run.
    pub began_s: Option<f64>,
    /// Where each fault was noticed: counts of the emulated chip.
    pub effects: Vec<u64>,
    /// What the board says.
    pub record: Option<FaultRecord>,
    /// State that it says it is in; `None` in a healthy run.
    pub state: Option<State>,
    /// What started the board anew, if it did.
    pub boot: Option<Boot>,
    /// Whether the bridge opened behind the fault, or the board started anew while it was open.
    pub stopped: bool,
    /// Whether the bridge is closed at the end.
    pub drives: bool,
    /// From the first fault to the open bridge \[s\], if it was closed.
    pub off_after_s: Option<f64>,
    /// From the beginning of the tick in the record to the open bridge \[s\]; 0 where hardware was faster, `None` where the record is
    /// not of this run of the firmware.
    pub off_behind_s: Option<f64>,
    /// Whether the bridge closed again behind the stop.
    pub restarted: bool,
    /// Largest values behind the first fault.
    pub peaks: Peaks,
    /// What the joint did while it was driven.
    pub looks: Vec<Look>,
    /// Reference of each tick while it was driven \[rad\]; in a healthy run only.
    pub references: Vec<(u32, f64)>,
}

/// Parameters of the campaign, stored, so that every start has them.
pub fn stored(elf: &[u8]) -> Outcome<Vec<u8>> {
    let mut host = Host::connect(Board::builder(elf).build()?)?;
    host.set("supervisor.homing_timeout", HOMING_TIMEOUT_S)?;
    host.order(&ToBoard::StoreParameters)?;
    Ok(host.board.flash_image().to_vec())
}

/// Runs the phase without a fault.
pub fn healthy(elf: &[u8], flash: &[u8], phase: Phase, bench_seed: u64, instant_s: f64) -> Outcome<Run> {
    let mut operator = operator(elf, flash, bench_seed)?;
    operator.host.board.take_peaks();
    session(&mut operator, phase, None, instant_s)?;
    ended(operator, None)
}

/// Runs `case`; a joint that is off the reference of the healthy runs is driven on, for the board to find it.
pub fn run(elf: &[u8], flash: &[u8], case: &Case, healthy: &Healthy) -> Outcome<Run> {
    let mut operator = operator(elf, flash, case.bench_seed)?;
    session(&mut operator, case.phase, Some(case), case.instant_s)?;
    if let Some(began_s) = operator.began_s
        && operator.host.board.pwm().duty.is_some()
        && healthy.is_off(case.phase, case.bench_seed, &operator.looks, began_s)
    {
        let looks = operator.looks.len();
        operator.drive(LONGER_S)?;
        operator.looks.truncate(looks);
    }
    ended(operator, Some(case))
}

fn operator(elf: &[u8], flash: &[u8], bench_seed: u64) -> Outcome<Operator> {
    let mut board = Board::builder(elf).seed(bench_seed).flash_image(flash).build()?;
    board.deliver_faults(true);
    Ok(Operator::new(Host::new(board)))
}

/// Lets the faults of `case` come `instant_s` from now.
fn expect(operator: &mut Operator, case: Option<&Case>, instant_s: f64) {
    if let Some(case) = case {
        operator.expect(&case.troubles, instant_s, case.apart_s);
    }
}

/// Drives the joint through `phase`, the faults coming on the way, until it stops or the window is over.
fn session(operator: &mut Operator, phase: Phase, case: Option<&Case>, instant_s: f64) -> Outcome {
    if phase == Phase::Start {
        // A store is read once, within milliseconds.
        let torn = case.is_some_and(|case| matches!(case.troubles[0].act, Act::TearStore(_)));
        expect(operator, case, if torn { 0.0 } else { instant_s });
    }
    if !greeted(operator)? {
        return Ok(());
    }
    operator.order(ToBoard::Telemetry(true))?;
    if phase == Phase::SelfTest {
        // A store waits for the bridge to be off, and for the state off.
        let stores = case.is_some_and(|case| matches!(case.troubles[0].act, Act::CutStore(..)));
        expect(operator, case, if stores { 0.0 } else { instant_s });
        if stores {
            operator.drive(STORE_S)?;
        }
    }
    if operator.make_ready()? != Reached::State {
        return Ok(());
    }
    match phase {
        Phase::Start | Phase::SelfTest => {
            if operator.follow(phase.reference())? == Reached::State {
                operator.drive(phase.window_s())?;
            }
        }
        Phase::Homing => {
            away(operator)?;
            expect(operator, case, instant_s);
            if operator.home()? == Reached::State && operator.follow(phase.reference())? == Reached::State {
                operator.drive(phase.window_s())?;
            }
        }
        Phase::Hold | Phase::Slow | Phase::Fast | Phase::Reversal => {
            if operator.follow(phase.reference())? != Reached::State {
                return fail(format!("{phase} was not reached"));
            }
            // From the closing of the bridge on.
            let since_s = operator.now_s() - operator.host.board.bridge_events().closed_s;
            expect(operator, case, instant_s - since_s);
            operator.drive(instant_s - since_s + phase.window_s())?;
        }
    }
    Ok(())
}

/// Waits for the port and greets the board; whether it answered. A board that fell silent meanwhile is asked again.
fn greeted(operator: &mut Operator) -> Outcome<bool> {
    for _ in 0..4 {
        let end_s = operator.now_s() + 0.5;
        while !operator.host.board.usb_ready() && operator.now_s() < end_s {
            operator.look()?;
        }
        if !operator.host.board.usb_ready() {
            continue;
        }
        // Ends whatever the board may have kept of a frame.
        operator.host.board.usb_write(&[0]);
        let number = operator.host.send(ToBoard::Hello)?;
        while operator.now_s() < end_s {
            operator.look()?;
            if operator.host.answer_to(number).is_some() {
                return Ok(true);
            }
        }
    }
    Ok(false)
}

/// Brings the joint away from zero and to ready again.
fn away(operator: &mut Operator) -> Outcome {
    let reached = operator.follow(Reference::Hold(AWAY_RAD))?;
    operator.drive(0.6)?;
    operator.order(ToBoard::Enter(Goal::Off))?;
    operator.drive(0.1)?;
    if reached != Reached::State || operator.make_ready()? != Reached::State {
        return fail("the joint did not come away from zero");
    }
    operator.looks.clear();
    Ok(())
}

/// Watches what comes behind the stop, then asks the board.
fn ended(mut operator: Operator, case: Option<&Case>) -> Outcome<Run> {
    let stopped = operator.has_stopped();
    let references = if case.is_none() { references(&mut operator)? } else { Vec::new() };
    let events = operator.host.board.bridge_events();
    let at_stop_s = operator.now_s();
    if case.is_some() && (stopped || operator.host.board.pwm().duty.is_none()) {
        while operator.now_s() < at_stop_s + AFTER_S {
            operator.look()?;
        }
    }
    let after = operator.host.board.bridge_events();
    let drives = operator.host.board.pwm().duty.is_some();
    let restarted = stopped && (after.closings > events.closings || drives);
    let peaks = operator.host.board.take_peaks();
    let effects = operator.underway.iter().map(|trouble| trouble.effect(&operator.host)).collect();
    let Some(began_s) = operator.began_s else {
        return Ok(Run {
            began_s: None,
            effects,
            record: None,
            state: None,
            boot: None,
            stopped,
            drives,
            off_after_s: None,
            off_behind_s: None,
            restarted,
            peaks,
            looks: operator.looks,
            references,
        });
    };
    let opened_s = (stopped && events.openings > 0 && events.opened_s >= began_s).then_some(events.opened_s);
    let (state, record, boot) = asked(&mut operator)?;
    let same_run = boot.is_none();
    let off_behind_s = match (record, opened_s) {
        (Some(record), Some(opened_s)) if same_run => {
            operator.host.ticks.beginning_s(record.tick).map(|found_s| (opened_s - found_s).max(0.0))
        }
        _ => None,
    };
    Ok(Run {
        began_s: Some(began_s),
        effects,
        record,
        state: Some(state),
        boot,
        stopped,
        drives,
        off_after_s: opened_s.map(|opened_s| opened_s - began_s),
        off_behind_s,
        restarted,
        peaks,
        looks: operator.looks,
        references,
    })
}

/// Asks the board what happened, over a link that works again: its state, its fault, and what started it anew.
fn asked(operator: &mut Operator) -> Outcome<(State, Option<FaultRecord>, Option<Boot>)> {
    for trouble in &mut operator.underway {
        trouble.mend_link(&mut operator.host);
    }
    let began_anew = operator.has_begun_anew();
    let host = &mut operator.host;
    // A cable that was plugged in a moment ago.
    host.pass(0.03)?;
    let mut reason = String::new();
    for _ in 0..3 {
        let told = host.reconnect().and_then(|greeting| Ok((greeting, host.status()?)));
        match told {
            Ok((greeting, status)) => {
                if status.state == State::Fault && status.fault.is_none() {
                    return fail("state fault without a record");
                }
                return Ok((status.state, status.fault, began_anew.then_some(greeting.boot)));
            }
            Err(Failure(text)) => reason = text,
        }
    }
    fail(format!("the board cannot be asked: {reason}"))
}

/// References that the board followed, tick by tick \[rad\].
fn references(operator: &mut Operator) -> Outcome<Vec<(u32, f64)>> {
    // What is still on its way.
    operator.host.pass(0.02)?;
    let samples = operator.host.telemetry.take();
    let driven = |state| matches!(state, State::Run | State::Homing);
    Ok(samples
        .into_iter()
        .filter(|(_, sample)| driven(sample.state))
        .map(|(tick, sample)| (tick, f64::from(sample.reference_raw) / STEPS_PER_UNIT))
        .collect())
}
