//! Failures of the firmware itself, provoked by the host: panic, processor fault, stack overflow, hang, late tick.

use bowden_board::{Board, ResetCause};
use bowden_link::message::{Boot, Goal, Mode, Provocation, Refusal};
use bowden_link::{Fault, FromBoard, State, ToBoard};
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::{Outcome, fail, image};

use crate::stop::{PERIOD_S, moving, stopped, until_open};
use crate::switched_on;

/// A moving joint whose board may be provoked.
fn provocable() -> Outcome<Host> {
    let mut host = moving()?;
    host.set("supervisor.allow_provoke", 1.0)?;
    host.board.deliver_faults(true);
    Ok(host)
}

#[test]
fn nobody_provokes_a_board_by_mistake() -> Outcome {
    let mut host = switched_on(1)?;
    for provocation in [
        Provocation::Panic,
        Provocation::ProcessorFault,
        Provocation::Hang,
        Provocation::LateTick,
        Provocation::StackOverflow,
    ] {
        let answer = host.ask(&ToBoard::Provoke(provocation))?;
        let index = Host::index("supervisor.allow_provoke")?;
        assert_eq!(answer, FromBoard::Refused(Refusal::Forbidden(index)));
    }
    host.run(0.3)?;
    assert_eq!((host.board.counters().boots, host.status()?.fault), (1, None));
    Ok(())
}

#[test]
fn a_late_tick_is_a_fault() -> Outcome {
    let mut host = provocable()?;
    host.order(&ToBoard::Provoke(Provocation::LateTick))?;
    let (record, _) = stopped(&mut host, 0.02)?;
    assert_eq!(record.fault, Fault::TickOverrun, "{record}");
    // More than a period on purpose.
    assert!((1.2..5.0).contains(&record.got) && record.limit == 1.0, "{record}");
    assert_eq!(host.board.counters().boots, 1);
    Ok(())
}

/// The core stands for a while, beginning in a tick and at several places between two: the tick behind it begins when the core goes on, and is
/// one and a half periods behind the one before or more. With the bridge off nothing is driven, and nothing stops, unless a tick begins or ends
/// too late for the next one; nor does a tick that is late by less than half a period.
#[test]
fn ticks_that_are_missed_while_the_bridge_is_on_are_a_fault() -> Outcome {
    let stands = |host: &mut Host, periods_behind: f64, lasts_periods: f64| -> Outcome {
        let ticks = host.ticks.begun;
        while host.ticks.begun == ticks {
            host.pass(1e-6)?;
        }
        host.pass(periods_behind * PERIOD_S)?;
        host.board.stall_core(true);
        host.pass(lasts_periods * PERIOD_S)?;
        host.board.stall_core(false);
        Ok(())
    };
    let mut host = moving()?;
    for (behind, lasts) in [(0.05, 10.0), (0.3, 10.0), (0.5, 1.1), (0.5, 10.0), (0.7, 10.0), (0.95, 10.0)] {
        stands(&mut host, 0.5, 0.9)?;
        host.run(0.01)?;
        assert_eq!(host.status()?.state, State::Run, "{behind}");
        stands(&mut host, behind, lasts)?;
        let (record, opening) = stopped(&mut host, 0.02)?;
        assert_eq!(record.fault, Fault::TickOverrun, "{behind}: {record}");
        // A microsecond of looking for the tick; a tick that was under way goes on first.
        let rest = if behind < 0.2 { 0.2 } else { 0.02 };
        let more = f64::from(record.got) - (behind + lasts);
        assert!((0.0..rest).contains(&more) && record.limit == 1.0, "{behind}: {record}");
        assert!(opening.after_s < 2.0 * PERIOD_S, "{behind}: {opening:?}");
        if (0.2..0.8).contains(&behind) {
            stands(&mut host, behind, lasts)?;
            host.run(0.01)?;
            assert_eq!(host.status()?.fault, None, "{behind}");
        }
        host.make_ready()?;
        host.order(&ToBoard::Enter(Goal::Run(Mode::Position)))?;
        host.reach(State::Run, 0.1)?;
        host.run(0.1)?;
    }
    Ok(())
}

/// Provokes a failure that ends the run; the bridge is open within a tick of it, and the board comes back with `fault`.
///
/// Returns the text that it kept.
fn end_of_run(provocation: Provocation, boot: Boot, fault: Fault) -> Outcome<String> {
    let mut host = provocable()?;
    host.order(&ToBoard::Provoke(provocation))?;
    let opening = until_open(&mut host, 0.05)?;
    let greeting = host.await_reset(1, 0.3)?;
    assert_eq!(greeting.boot, boot);
    let status = host.status()?;
    let Some(record) = status.fault else { return fail(format!("no fault behind the reset: {status:?}")) };
    assert_eq!((status.state, record.fault), (State::Fault, fault), "{record}");
    println!("{record}");
    // The last 64 ticks of the run before are there, the joint moving in them; behind the last one that drove, the bridge
    // was open within a tick.
    let snapshot = host.snapshot()?;
    assert_eq!(snapshot.len(), 64);
    assert!(snapshot.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1));
    let driving = snapshot.iter().filter(|(_, sample)| sample.state == State::Run).map(|(tick, _)| *tick);
    let last = driving.max().expect("ticks that drove");
    assert!(last + 1 >= opening.ticks.saturating_sub(1) && last <= opening.ticks, "{last}, {opening:?}");
    assert!(opening.after_s < 0.05, "{opening:?}");
    let text = host.panic_text()?;
    println!("{text}");
    // It is kept until it is cleared.
    assert!(host.order(&ToBoard::Enter(Goal::Ready)).is_err());
    assert_eq!(host.board.pwm().duty, None);
    host.order(&ToBoard::Enter(Goal::ClearFault))?;
    host.reach(State::Off, 0.01)?;
    host.make_ready()?;
    // Power-on forgets.
    host.reset(ResetCause::PowerOn)?;
    assert_eq!((host.status()?.fault, host.status()?.snapshot < 64), (None, false));
    assert_eq!(host.panic_text()?, "");
    Ok(text)
}

#[test]
fn a_panic_stops_the_motor_and_leaves_its_words() -> Outcome {
    let text = end_of_run(Provocation::Panic, Boot::Software, Fault::Panic)?;
    assert!(text.contains("provoked") && text.contains(".rs:"), "{text}");
    Ok(())
}

#[test]
fn a_processor_fault_stops_the_motor_and_says_where() -> Outcome {
    let text = end_of_run(Provocation::ProcessorFault, Boot::Software, Fault::HardFault)?;
    // UNDEFINSTR of CFSR.
    assert!(text.contains("0x08") && text.contains("0x00010000"), "{text}");
    Ok(())
}

/// The stack ends where the RAM begins: nothing is overwritten, so that the last ticks and the words are there.
#[test]
fn a_stack_that_runs_over_its_end_stops_the_motor_and_is_a_named_fault() -> Outcome {
    let text = end_of_run(Provocation::StackOverflow, Boot::Software, Fault::StackOverflow)?;
    assert!(text.contains("stack pointer 0x"), "{text}");
    Ok(())
}

#[test]
fn a_hang_ends_with_the_watchdog_and_the_motor_is_off_long_before() -> Outcome {
    let text = end_of_run(Provocation::Hang, Boot::Watchdog, Fault::Watchdog)?;
    assert_eq!(text, "");
    Ok(())
}

/// Holds the core until the watchdog bites, nobody being there to hear of it.
fn bitten(board: &mut Board) -> Outcome {
    let boots = board.counters().boots;
    board.stall_core(true);
    while board.counters().boots == boots {
        board.run_for(1e-3)?;
    }
    board.stall_core(false);
    Ok(board.run_for(0.02)?)
}

#[test]
fn three_restarts_without_a_host_end_in_safe_mode() -> Outcome {
    let mut board = Board::builder(&image::firmware()?).build()?;
    board.set_usb_plugged(false);
    board.run_for(0.02)?;
    for _ in 0..3 {
        bitten(&mut board)?;
    }
    board.set_usb_plugged(true);
    let mut host = Host::connect(board)?;
    assert!(host.greet()?.chip.is_safe());
    let status = host.status()?;
    let record = status.fault.expect("a fault");
    assert_eq!((status.state, record.fault, record.got), (State::Fault, Fault::RestartLoop, 3.0), "{record}");
    // The timer of the bridge was not even switched on, and nothing reaches tick or flash.
    assert_eq!((host.board.pwm().duty, host.board.pwm().enabled, host.ticks.begun), (None, false, 0));
    for order in [
        ToBoard::Enter(Goal::ClearFault),
        ToBoard::Enter(Goal::Ready),
        ToBoard::WriteParameter { index: 0, value: 4.0 },
        ToBoard::StoreParameters,
    ] {
        assert_eq!(host.ask(&order)?, FromBoard::Refused(Refusal::SafeMode), "{order:?}");
    }
    assert_eq!(host.board.flash_operations(), 0);
    // The watchdog is content, and a host was there: the next reset starts the board as usual.
    host.run(0.5)?;
    assert_eq!(host.board.counters().boots, 4);
    let greeting = host.reset(ResetCause::Pin)?;
    assert_eq!((greeting.chip.restarts, host.status()?.fault), (0, None));
    host.make_ready()
}

#[test]
fn restarts_that_a_host_saw_do_not_add_up() -> Outcome {
    let mut host = switched_on(1)?;
    for boots in 1..5 {
        host.board.stall_core(true);
        while host.board.counters().boots == boots {
            host.pass(1e-3)?;
        }
        host.board.stall_core(false);
        assert_eq!(host.await_reset(boots, 0.1)?.chip.restarts, 1);
        assert_eq!(host.status()?.fault.map(|record| record.fault), Some(Fault::Watchdog));
    }
    Ok(())
}

#[test]
fn the_watchdog_bites_in_time() -> Outcome {
    let mut host = provocable()?;
    host.order(&ToBoard::Provoke(Provocation::Hang))?;
    let opening = until_open(&mut host, 0.05)?;
    // The encoders stand with all the rest: 5 ms for the answer, four ticks without a frame and what is under way.
    assert!(opening.after_s < 5e-3 + 7.0 * PERIOD_S, "{opening:?}");
    let hung_s = host.board.time_s();
    host.await_reset(1, 0.3)?;
    // 150 ms behind the last sign of life.
    assert!(host.board.time_s() - hung_s < 0.2, "{} s", host.board.time_s() - hung_s);
    Ok(())
}
