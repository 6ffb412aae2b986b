//! Requests and answers over a wire that loses, damages, delays and repeats.

use std::time::Duration;

use bowden_host_link::{CommsError, LinkError, ParameterSet};
use bowden_link::message::{Goal, Mode, Refusal};
use bowden_link::{SCHEMA, State, ToBoard};

use crate::fake::Fake;
use crate::mishaps::Mishaps;
use crate::wires::{TIMEOUT, connect, connect_again};

fn message(error: &LinkError) -> String {
    error.to_string()
}

#[test]
fn a_board_says_who_it_is_and_what_it_has() {
    let (client, fake) = connect(Fake::new(Mishaps::default()));
    let mut client = client.unwrap();
    assert_eq!((client.greeting().firmware.as_str(), client.greeting().board.as_str()), ("9.8.7", "fake"));
    let parameter = client.parameter(1).unwrap();
    assert_eq!(
        (parameter.name.as_str(), parameter.value, parameter.maximum),
        ("bridge.current_zero", 2047.5, 4095.0)
    );
    assert_eq!(client.status().unwrap().longest_tick_cycles, 4321);
    assert_eq!(fake.borrow().violations, [""; 0]);
}

#[test]
fn what_is_lost_or_damaged_is_asked_for_again() {
    let mishaps = Mishaps {
        lose_answers: Some(3),
        damage_answers: Some(5),
        lose_requests: Some(7),
        ..Mishaps::default()
    };
    let (client, fake) = connect(Fake::new(mishaps));
    let mut client = client.unwrap();
    let count = client.greeting().parameters;
    for index in 0..count {
        assert_eq!(client.parameter(index).unwrap().index, index);
    }
    let losses = client.losses();
    assert!(losses.damaged_frames >= 8, "{losses:?}");
    // A damaged frame is missing in the count of frames as well.
    assert!(losses.frames >= losses.damaged_frames + 15, "{losses:?}");
    assert_eq!(fake.borrow().violations, [""; 0]);
}

#[test]
fn parameters_are_read_and_set_over_a_lossy_wire() {
    let mishaps = Mishaps {
        lose_answers: Some(3),
        damage_answers: Some(5),
        lose_requests: Some(7),
        ..Mishaps::default()
    };
    let (client, fake) = connect(Fake::new(mishaps));
    let mut client = client.unwrap();
    let parameters = ParameterSet::read(&mut client).unwrap();
    let index = |name: &str| parameters.find(name).unwrap().index;
    // The new lower limit is above the old upper one, which follows.
    let values =
        [(index("tension.slack"), 95.0), (index("tension.over"), 120.0), (index("tendon.pretension"), 25.5)];
    parameters.write(&mut client, &values).unwrap();
    let fake = fake.borrow();
    let names = ["tension.slack", "tension.over", "tendon.pretension", "motor.resistance"];
    assert_eq!(names.map(|name| fake.value(name)), [95.0, 120.0, 25.5, 2.0]);
    assert_eq!(fake.violations, [""; 0]);
}

#[test]
fn a_late_answer_is_not_taken_for_that_to_another_request() {
    let mishaps = Mishaps { delay_answers: Some((2, Duration::from_millis(120))), ..Mishaps::default() };
    let (client, fake) = connect(Fake::new(mishaps));
    let mut client = client.unwrap();
    let count = client.greeting().parameters;
    for index in 0..count {
        assert_eq!(client.parameter(index).unwrap().index, index);
    }
    assert!(fake.borrow().carried_out.len() > usize::from(count) + 1, "nothing was repeated");
    assert_eq!(fake.borrow().violations, [""; 0]);
}

#[test]
fn a_silent_board_is_given_up_in_time() {
    let (client, fake) = connect(Fake::new(Mishaps { silent: true, ..Mishaps::default() }));
    let error = client.err().unwrap();
    assert_eq!(
        message(&error),
        "fake: no greeting within 0.5 s, expected a bowden driver board; check the port and the board's supply, or reset \
         the board"
    );
    let waited = fake.borrow().now();
    assert!(waited >= TIMEOUT && waited < TIMEOUT + Duration::from_millis(20), "{waited:?}");
}

#[test]
fn another_version_is_told_with_what_to_do() {
    let (client, _) = connect(Fake::new(Mishaps { protocol_version: Some(0), ..Mishaps::default() }));
    assert_eq!(
        message(&client.err().unwrap()),
        "fake: firmware 9.8.7 speaks protocol version 0, expected 2; flash the firmware that belongs to this bowden"
    );
    let (client, _) = connect(Fake::new(Mishaps { protocol_version: Some(3), ..Mishaps::default() }));
    assert_eq!(
        message(&client.err().unwrap()),
        "fake: firmware 9.8.7 speaks protocol version 3, expected 2; use the bowden that belongs to this firmware"
    );
    let (client, _) =
        connect(Fake::new(Mishaps { schema: Some([0, 1, 2, 3, 4, 5, 6, 7]), ..Mishaps::default() }));
    let expected: String = SCHEMA.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"));
    assert_eq!(
        message(&client.err().unwrap()),
        format!(
            "fake: firmware 9.8.7 has message schema 0001020304050607, expected {expected}; flash the firmware that \
             belongs to this bowden"
        )
    );
}

#[test]
fn a_refusal_is_no_trouble_with_the_wire() {
    let (client, fake) = connect(Fake::new(Mishaps::default()));
    let mut client = client.unwrap();
    match client.set_parameter(1, 5000.0) {
        Err(LinkError::Refused { refusal, .. }) => {
            assert_eq!(refusal, Refusal::OutOfRange { got: 5000.0, minimum: 0.0, maximum: 4095.0 });
        }
        other => panic!("{other:?}"),
    }
    match client.enter(Goal::Home) {
        Err(LinkError::Refused { refusal, .. }) => assert_eq!(refusal, Refusal::WrongState(State::Off)),
        other => panic!("{other:?}"),
    }
    // Refused once, not asked again.
    assert_eq!(fake.borrow().count(|message| matches!(message, ToBoard::Enter(_))), 0);
    assert_eq!(fake.borrow().violations, [""; 0]);
}

#[test]
fn a_state_whose_confirmation_is_lost_is_entered_once() {
    // Answers: greeting 1, then ready and states; every second one is lost, so each order loses some.
    for every in [2, 3] {
        let (client, fake) = connect(Fake::new(Mishaps { lose_answers: Some(every), ..Mishaps::default() }));
        let mut client = client.unwrap();
        client.enter(Goal::Ready).unwrap();
        while client.status().unwrap().state != State::Ready {
            client.listen(Duration::from_millis(5)).unwrap();
        }
        client.enter(Goal::Run(Mode::Position)).unwrap();
        assert_eq!(client.status().unwrap().state, State::Run);
        client.enter(Goal::Off).unwrap();
        let fake = fake.borrow();
        for goal in [Goal::Ready, Goal::Run(Mode::Position)] {
            let entered = fake.count(|message| *message == ToBoard::Enter(goal));
            assert_eq!(entered, 1, "every {every}: {goal:?}");
        }
        assert_eq!(fake.violations, [""; 0]);
    }
}

#[test]
fn a_slow_board_is_waited_for() {
    // Every answer takes longer than the host waits before it asks again, but less than it waits in all.
    let mishaps = Mishaps { delay_answers: Some((1, Duration::from_millis(110))), ..Mishaps::default() };
    let (client, fake) = connect(Fake::new(mishaps));
    let mut client = client.unwrap();
    match client.enter(Goal::Home) {
        Err(LinkError::Refused { refusal, .. }) => assert_eq!(refusal, Refusal::WrongState(State::Off)),
        other => panic!("{other:?}"),
    }
    client.enter(Goal::Ready).unwrap();
    assert_eq!(client.parameter(3).unwrap().index, 3);
    assert_eq!(fake.borrow().count(|message| *message == ToBoard::Enter(Goal::Ready)), 1);
    assert_eq!(fake.borrow().violations, [""; 0]);
}

#[test]
fn reference_points_arrive_once_each() {
    let mishaps = Mishaps { lose_answers: Some(2), lose_requests: Some(5), ..Mishaps::default() };
    let (client, fake) = connect(Fake::new(mishaps));
    let mut client = client.unwrap();
    let points: Vec<f32> = (0..90_u8).map(f32::from).collect();
    let mut free = 100;
    for chunk in points.chunks(30) {
        free = client.stream(chunk).unwrap();
    }
    assert_eq!(free, 10);
    match client.stream(&points[..20]) {
        Err(LinkError::Refused { refusal, .. }) => assert_eq!(refusal, Refusal::StreamFull),
        other => panic!("{other:?}"),
    }
    assert_eq!(fake.borrow().streamed, points);
    assert_eq!(fake.borrow().violations, [""; 0]);
}

#[test]
fn telemetry_comes_in_order_with_its_gaps_counted() {
    let mishaps = Mishaps {
        lose_batches: Some(10),
        damage_batches: Some(7),
        repeat_batches: Some(4),
        ..Mishaps::default()
    };
    let (client, fake) = connect(Fake::new(mishaps));
    let mut client = client.unwrap();
    client.switch_telemetry(true).unwrap();
    let mut ticks = Vec::new();
    while ticks.len() < 2000 {
        client.listen(Duration::from_millis(5)).unwrap();
        while let Some(telemetry) = client.telemetry() {
            for (tick, sample) in (telemetry.first_tick..).zip(&telemetry.batch.samples) {
                assert_eq!(sample.tension_raw[0], 1400 + (tick % 100) as u16, "tick {tick}");
                ticks.push(tick);
            }
        }
    }
    let missing: u64 = ticks.windows(2).map(|pair| pair[1].checked_sub(pair[0] + 1).expect("order")).sum();
    let losses = client.losses();
    assert!(missing >= 20 * 24, "{missing} samples are missing");
    assert_eq!(losses.samples, missing);
    assert!(losses.late_batches >= 15, "{losses:?}");
    assert!(losses.damaged_frames >= 12, "{losses:?}");
    assert_eq!(fake.borrow().violations, [""; 0]);
}

#[test]
fn a_count_that_wraps_while_the_board_is_away_is_no_restart() {
    let away = Duration::from_secs(3);
    // Not at all, at once, and late.
    for restart_after in [None, Some(Duration::from_millis(100)), Some(Duration::from_millis(2500))] {
        let mut fake = Fake::new(Mishaps::default());
        fake.tick = u32::MAX - 20_000;
        let (before, fake) = connect(fake);
        let mut before = before.unwrap();
        before.switch_telemetry(true).unwrap();
        while before.telemetry().is_none() {
            before.listen(Duration::from_millis(5)).unwrap();
        }
        let now = before.now();
        if let Some(after) = restart_after {
            fake.borrow_mut().advance_to(now + after);
            fake.borrow_mut().switch_off_and_on();
        }
        fake.borrow_mut().advance_to(now + away);
        assert!(fake.borrow().tick < 30_000, "wrapped or anew");
        let mut client = connect_again(&fake).unwrap();
        assert_eq!(client.continue_from(&before, away), Ok(restart_after.is_some()));
        // The count goes on either way.
        client.switch_telemetry(true).unwrap();
        client.listen(Duration::from_millis(5)).unwrap();
        let first_tick = client.telemetry().unwrap().first_tick;
        let expected = u64::from(u32::MAX) - 20_000 + 30_000;
        assert!((expected..expected + 1000).contains(&first_tick), "{first_tick}, expected {expected}");
    }
}

#[test]
fn a_board_that_stops_answering_is_told_by_request() {
    let (client, fake) = connect(Fake::new(Mishaps::default()));
    let mut client = client.unwrap();
    fake.borrow_mut().mishaps.silent = true;
    match client.status() {
        Err(LinkError::Comms(CommsError::NoAnswer { request, attempts, waited, .. })) => {
            assert_eq!((request, attempts, waited), ("the status", 10, TIMEOUT));
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn telemetry_that_another_program_left_on_is_switched_off_and_passed_over() {
    let mut left = Fake::new(Mishaps::default());
    left.leave_telemetry_on(Duration::from_millis(50));
    let (client, fake) = connect(left);
    let mut client = client.unwrap();
    assert_eq!(fake.borrow().carried_out, [ToBoard::Hello, ToBoard::Telemetry(false)]);
    client.listen(Duration::from_millis(20)).unwrap();
    assert_eq!(client.telemetry(), None);
    assert_eq!((client.losses().samples, client.losses().damaged_frames), (0, 0));
}
