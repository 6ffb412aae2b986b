//! Whole runs over the wire without a real clock.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::time::Duration;

use bowden_host_link::course::{Course, Track};
use bowden_host_link::hub::Hub;
use bowden_host_link::{CommsError, LinkError, RunEnd, Session};
use bowden_link::message::{Goal, Mode, Reference, Shape};
use bowden_link::{Fault, State, ToBoard};

use crate::fake::Fake;
use crate::mishaps::Mishaps;
use crate::wires::{connect, connect_again};

const SINE: Reference =
    Reference::Generated { shape: Shape::Sine, amplitude: 0.3, offset: 0.0, frequency_hz: 0.5 };

fn never() -> bool {
    false
}

#[test]
fn a_run_gives_every_tick_once_and_ends_with_the_bridge_off() {
    let (client, fake) = connect(Fake::new(Mishaps::default()));
    let mut session = Session::new(client.unwrap()).unwrap();
    session.ready(&never).unwrap();
    session.home(&never).unwrap();
    assert_eq!(fake.borrow().state, State::Ready);
    let mut ticks = Vec::new();
    let end = session
        .run(Mode::Position, &Course::OnBoard(SINE), &never, &mut |tick| {
            assert_eq!(tick.sample.state, State::Run);
            ticks.push(tick.tick);
            if ticks.len() == 20_000 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
        .unwrap();
    assert_eq!(end, RunEnd::Complete);
    assert!(ticks.windows(2).all(|pair| pair[1] == pair[0] + 1));
    let fake = fake.borrow();
    assert_eq!(fake.state, State::Off);
    assert_eq!(fake.count(|message| *message == ToBoard::SetReference(SINE)), 1);
    assert_eq!(fake.carried_out.last(), Some(&ToBoard::Telemetry(false)));
    assert_eq!(fake.violations, [""; 0]);
}

#[test]
fn a_board_that_started_again_runs_as_before() {
    let (client, fake) = connect(Fake::new(Mishaps::default()));
    let mut session = Session::new(client.unwrap()).unwrap();
    session.watch(Hub::default()).unwrap();
    while session.client().losses().next_tick().is_none() {
        session.idle(Duration::from_millis(5)).unwrap();
    }
    let now = session.client().now();
    fake.borrow_mut().switch_off_and_on();
    fake.borrow_mut().advance_to(now + Duration::from_secs(1));
    assert_eq!(session.adopt(connect_again(&fake).unwrap(), Duration::from_secs(2)), Ok(true));
    session.ready(&never).unwrap();
    let mut count = 0;
    let end = session.run(Mode::Position, &Course::OnBoard(SINE), &never, &mut |_| {
        count += 1;
        if count == 5000 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert_eq!((end, count), (Ok(RunEnd::Complete), 5000));
}

#[test]
fn a_host_that_may_not_be_silent_for_long_keeps_talking() {
    // The fake trips when nothing comes for 20 ms; losses cost some of what is sent.
    let mishaps = Mishaps { lose_requests: Some(3), ..Mishaps::default() };
    let (client, fake) = connect(Fake::new(mishaps).with_host_timeout(0.02));
    let mut session = Session::new(client.unwrap()).unwrap();
    session.ready(&never).unwrap();
    let mut count = 0;
    let end = session.run(Mode::Torque, &Course::OnBoard(Reference::Hold(0.1)), &never, &mut |_| {
        count += 1;
        if count == 5000 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert_eq!(end, Ok(RunEnd::Complete));
    assert_eq!(fake.borrow().violations, [""; 0]);
}

#[test]
fn a_track_is_sent_in_time_and_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ref.csv");
    // One second, up to 1 rad and back.
    std::fs::write(&path, "t_s,theta_ref_rad\n0,0\n0.5,1\n1,0\n").unwrap();
    let track = Track::load(&path, Mode::Position).unwrap();
    let (client, fake) = connect(Fake::new(Mishaps { lose_answers: Some(4), ..Mishaps::default() }));
    let mut session = Session::new(client.unwrap()).unwrap();
    session.ready(&never).unwrap();
    let mut count = 0;
    let end = session.run(Mode::Position, &Course::Streamed(track), &never, &mut |_| {
        count += 1;
        if count == 12_000 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert_eq!(end, Ok(RunEnd::Complete));
    let fake = fake.borrow();
    assert_eq!(fake.streamed.len(), 1001);
    for (index, got) in fake.streamed.iter().enumerate() {
        let t_s = index as f32 * 1e-3;
        let expected = if t_s < 0.5 { 2.0 * t_s } else { 2.0 - 2.0 * t_s };
        assert!((got - expected).abs() < 1e-5, "point {index}: {got}");
    }
    assert_eq!(fake.violations, [""; 0]);
}

#[test]
fn the_user_stops_a_run_and_the_bridge_goes_off() {
    let (client, fake) = connect(Fake::new(Mishaps::default()));
    let mut session = Session::new(client.unwrap()).unwrap();
    session.ready(&never).unwrap();
    let count = Cell::new(0);
    let end = session.run(Mode::Position, &Course::OnBoard(SINE), &|| count.get() > 3000, &mut |_| {
        count.set(count.get() + 1);
        ControlFlow::Continue(())
    });
    assert_eq!(end, Ok(RunEnd::Interrupted));
    assert_eq!(fake.borrow().state, State::Off);
}

#[test]
fn a_fault_ends_a_run_with_its_numbers() {
    let (client, fake) = connect(Fake::new(Mishaps { slack_after: Some(700), ..Mishaps::default() }));
    let mut session = Session::new(client.unwrap()).unwrap();
    session.ready(&never).unwrap();
    let mut states = Vec::new();
    let end = session.run(Mode::Position, &Course::OnBoard(SINE), &never, &mut |tick| {
        states.push(tick.sample.state);
        ControlFlow::Continue(())
    });
    let Ok(RunEnd::Fault(record)) = end else { panic!("{end:?}") };
    assert_eq!((record.fault, record.channel, record.got, record.limit), (Fault::Slack, 2, 0.25, 1.0));
    assert_eq!(states.iter().filter(|state| **state == State::Run).count(), 699);
    assert_eq!(states.last(), Some(&State::Fault));
    // A fault waits for a person: nothing clears it by itself.
    match session.ready(&never) {
        Err(LinkError::Fault(fault)) => assert_eq!(fault, record),
        other => panic!("{other:?}"),
    }
    assert_eq!(fake.borrow().state, State::Fault);
}

#[test]
fn a_board_that_starts_again_or_stands_still_is_told() {
    let cases = [
        Mishaps { restart_after: Some(500), ..Mishaps::default() },
        Mishaps { stand_still_after: Some(500), ..Mishaps::default() },
    ];
    let mut told = Vec::new();
    for mishaps in cases {
        let (client, _) = connect(Fake::new(mishaps));
        let mut session = Session::new(client.unwrap()).unwrap();
        session.ready(&never).unwrap();
        let end =
            session.run(Mode::Position, &Course::OnBoard(SINE), &never, &mut |_| ControlFlow::Continue(()));
        match end {
            Err(LinkError::Comms(error)) => told.push(error),
            other => panic!("{other:?}"),
        }
    }
    assert!(matches!(told[0], CommsError::Restarted { .. }), "{told:?}");
    assert!(matches!(told[1], CommsError::TicksStandStill { .. }), "{told:?}");
}

#[test]
fn an_error_in_the_middle_leaves_the_bridge_off() {
    let (client, fake) = connect(Fake::new(Mishaps::default()));
    let mut session = Session::new(client.unwrap()).unwrap();
    session.ready(&never).unwrap();
    let far = Reference::Hold(50.0);
    let end = session.run(Mode::Position, &Course::OnBoard(far), &never, &mut |_| ControlFlow::Continue(()));
    assert!(matches!(end, Err(LinkError::Refused { .. })), "{end:?}");
    assert_eq!(fake.borrow().state, State::Off);
    assert_eq!(fake.borrow().count(|message| *message == ToBoard::Enter(Goal::Off)), 1);
}
