//! The slow side against a tick that only writes down what it is asked for.

use std::collections::VecDeque;

use bowden_control::correction::ripple_table::RippleTable;
use bowden_control::parameters::Parameters;
use bowden_control::service::{Identity, Port, Reply, Service, StoreError, View};
use bowden_control::tick::Command;
use bowden_link::message::{
    Boot, Chip, Goal, Mode, Provocation, Reference, Refusal, Shape, TABLE_CHUNK, TABLE_POINTS, TableReport,
};
use bowden_link::{Fault, FromBoard, PROTOCOL_VERSION, Request, Sample, State, ToBoard};

/// A tick that takes up to four commands and eight points.
#[derive(Default)]
struct Tick {
    view: View,
    commands: VecDeque<Command>,
    points: VecDeque<i32>,
    adopted: usize,
}

impl Port for Tick {
    fn command(&mut self, command: Command) -> bool {
        let room = self.commands.len() < 4;
        if room {
            self.commands.push_back(command);
        }
        room
    }

    fn stream_free(&self) -> usize {
        8 - self.points.len()
    }

    fn stream(&mut self, point_raw: i32) -> bool {
        let room = self.stream_free() > 0;
        if room {
            self.points.push_back(point_raw);
        }
        room
    }

    fn view(&self) -> View {
        self.view
    }

    fn snapshot(&self, _: u8) -> Option<(u32, Sample)> {
        None
    }

    fn adopt(&mut self, _: &Parameters) {
        self.adopted += 1;
    }
}

fn service() -> Service {
    let identity = Identity {
        firmware: "0.1.0",
        board: "test",
        revision: "0123456789ab",
        serial: "42",
        boot: Boot::Power,
        chip: Chip::EXPECTED,
    };
    Service::new(identity, Parameters::default(), "")
}

fn tick_in(state: State) -> Tick {
    Tick { view: View { state, ..View::default() }, ..Tick::default() }
}

fn asked(service: &mut Service, tick: &mut Tick, sequence: u16, message: ToBoard) -> Reply {
    service.handle(&Request { sequence, message }, 0, tick)
}

fn refused(refusal: Refusal) -> Reply {
    Reply::Say(FromBoard::Refused(refusal))
}

fn index_of(name: &str) -> u16 {
    Parameters::index_of(name).unwrap()
}

#[test]
fn the_greeting_says_who_is_there() {
    let reply = asked(&mut service(), &mut tick_in(State::Off), 1, ToBoard::Hello);
    let Reply::Say(FromBoard::Greeting(greeting)) = reply else { panic!("{reply:?}") };
    assert_eq!((greeting.protocol_version, greeting.parameters), (PROTOCOL_VERSION, Parameters::COUNT));
    assert_eq!((greeting.schema, greeting.board.as_str()), (bowden_link::SCHEMA, "test"));
}

#[test]
fn a_failure_is_suffered_only_where_the_parameters_allow_it() {
    let (mut service, mut tick) = (service(), tick_in(State::Run));
    let provoke = || ToBoard::Provoke(Provocation::Panic);
    let allow = index_of("supervisor.allow_provoke");
    assert_eq!(asked(&mut service, &mut tick, 1, provoke()), refused(Refusal::Forbidden(allow)));
    asked(&mut service, &mut tick, 2, ToBoard::WriteParameter { index: allow, value: 1.0 });
    assert_eq!(asked(&mut service, &mut tick, 3, provoke()), Reply::Suffer(Provocation::Panic));
}

#[test]
fn flash_is_written_with_the_bridge_off_only() {
    for state in [State::SelfTest, State::PretensionCheck, State::Ready, State::Homing, State::Run] {
        let reply = asked(&mut service(), &mut tick_in(state), 1, ToBoard::StoreParameters);
        assert_eq!(reply, refused(Refusal::WrongState(state)));
    }
    for state in [State::Off, State::Fault] {
        assert_eq!(asked(&mut service(), &mut tick_in(state), 1, ToBoard::StoreParameters), Reply::Store);
    }
}

#[test]
fn a_parameter_changes_only_if_the_tick_takes_it() {
    let (mut service, mut tick) = (service(), tick_in(State::Off));
    let index = index_of("limits.speed");
    let before = service.parameters().get(index);
    while tick.command(Command::Enter(Goal::Off)) {}
    let write = || ToBoard::WriteParameter { index, value: 2.5 };
    assert_eq!(asked(&mut service, &mut tick, 1, write()), refused(Refusal::Busy));
    assert_eq!((service.parameters().get(index), tick.adopted), (before, 0));
    tick.commands.clear();
    assert_eq!(asked(&mut service, &mut tick, 2, write()), Reply::Say(FromBoard::Done));
    assert_eq!((service.parameters().get(index), tick.adopted), (Some(2.5), 1));
    assert!(matches!(tick.commands.as_slices().0, [Command::Configure(_)]));
}

#[test]
fn what_would_jump_is_not_changed_while_moving() {
    let (mut service, mut tick) = (service(), tick_in(State::Run));
    let zero = ToBoard::WriteParameter { index: index_of("encoder.joint.zero"), value: 5.0 };
    assert_eq!(asked(&mut service, &mut tick, 1, zero), refused(Refusal::Moving));
    assert_eq!(asked(&mut service, &mut tick, 2, ToBoard::DefaultParameters), refused(Refusal::Moving));
    assert!(tick.commands.is_empty());
}

/// Every limit, by its name: a step to the wider side is taken with the bridge off only, one to the narrower side always.
#[test]
fn limits_are_narrowed_while_driving_and_widened_with_the_bridge_off_only() {
    for (name, narrow, wide) in [
        ("limits.current", 2.0, 3.5),
        ("limits.speed", 2.0, 3.5),
        ("limits.angle_maximum", 1.0, 1.3),
        ("limits.angle_minimum", -1.0, -1.3),
        ("limits.torque", 0.5, 0.7),
        ("bridge.duty_limit", 0.9, 0.96),
        ("tension.over", 80.0, 95.0),
        ("tension.slack", 2.0, 0.5),
        ("supervisor.over_current", 7.0, 9.0),
        ("supervisor.bus_minimum", 19.0, 17.0),
        ("supervisor.bus_maximum", 29.0, 31.0),
        ("supervisor.joint_speed", 30.0, 50.0),
        ("supervisor.tracking_error", 0.2, 0.4),
        ("supervisor.angle_margin", 0.05, 0.2),
        ("supervisor.host_timeout", 0.3, 0.7),
        ("motor.continuous_current", 3.5, 4.5),
        ("motor.winding_time", 20.0, 40.0),
        ("tension.debounce", 0.0005, 0.002),
        ("tension.exponent_margin", 0.1, 0.2),
        ("tension.margin", 3.0, 5.0),
        ("tension.consistency_time", 0.04, 0.06),
        ("tension.stretch_margin", 10.0, 20.0),
        ("tension.stuck_travel", 4.0, 6.0),
        ("tension.stuck_time", 0.2, 0.4),
        ("limits.acceleration", 200.0, 400.0),
        ("limits.jerk", 15_000.0, 25_000.0),
        ("limits.torque_rate", 4.0, 6.0),
        ("supervisor.over_current_time", 0.000_15, 0.0003),
        ("supervisor.bus_debounce", 0.004, 0.006),
        ("supervisor.tracking_time", 0.5, 2.0),
    ] {
        let (mut service, mut tick) = (service(), tick_in(State::Run));
        let write = |value| ToBoard::WriteParameter { index: index_of(name), value };
        assert_eq!(asked(&mut service, &mut tick, 1, write(wide)), refused(Refusal::Moving), "{name}");
        assert!(tick.commands.is_empty());
        assert_eq!(asked(&mut service, &mut tick, 2, write(narrow)), Reply::Say(FromBoard::Done), "{name}");
        // Back to where it was is wider, too.
        let default = Parameters::specification(index_of(name)).unwrap().default;
        assert_eq!(asked(&mut service, &mut tick, 3, write(default)), refused(Refusal::Moving), "{name}");
        tick.view.state = State::Ready;
        assert_eq!(asked(&mut service, &mut tick, 4, write(wide)), Reply::Say(FromBoard::Done), "{name}");
        tick.view.state = State::Homing;
        assert_eq!(asked(&mut service, &mut tick, 5, write(narrow)), Reply::Say(FromBoard::Done), "{name}");
    }
}

/// Ceilings of the image: no message lifts them, bridge on or off, and a set that was stored with more is not taken.
#[test]
fn no_message_lifts_a_ceiling() {
    for (name, ceiling) in [
        ("limits.current", 13.0),
        ("supervisor.over_current", 13.0),
        ("motor.continuous_current", 13.0),
        ("bridge.duty_limit", 0.98),
        ("limits.speed", 100.0),
        ("supervisor.joint_speed", 200.0),
        ("limits.angle_maximum", 100.0),
        ("supervisor.angle_margin", 1.0),
        ("tension.over", 2000.0),
        ("supervisor.host_timeout", 60.0),
        ("supervisor.homing_timeout", 600.0),
        ("supervisor.tracking_time", 60.0),
        ("tension.stuck_time", 60.0),
    ] {
        let index = index_of(name);
        let beyond = ceiling * (1.0 + 1e-6);
        for state in [State::Off, State::Ready, State::Run, State::Fault] {
            let (mut service, mut tick) = (service(), tick_in(state));
            let before = service.parameters().get(index);
            let answer = asked(&mut service, &mut tick, 1, ToBoard::WriteParameter { index, value: beyond });
            assert!(
                matches!(answer, Reply::Say(FromBoard::Refused(Refusal::OutOfRange { maximum, .. })) if maximum == ceiling)
                    || answer == refused(Refusal::Moving),
                "{name}: {answer:?}"
            );
            assert_eq!((service.parameters().get(index), tick.commands.len()), (before, 0), "{name}");
        }
        let mut stored = Parameters::default();
        stored.set_unchecked(index, beyond);
        assert!(matches!(stored.validate(), Err(Refusal::OutOfRange { .. })), "{name}");
    }
}

#[test]
fn a_repeated_request_appends_its_points_once() {
    let (mut service, mut tick) = (service(), tick_in(State::Run));
    let points = |values: &[f32]| ToBoard::StreamPoints(values.iter().copied().collect());
    for sequence in [7, 7, 8] {
        asked(&mut service, &mut tick, sequence, points(&[0.5, -0.25]));
    }
    assert_eq!(tick.points, [1 << 19, -(1 << 18), 1 << 19, -(1 << 18)]);
    // All or none: five points where four fit.
    assert_eq!(asked(&mut service, &mut tick, 9, points(&[0.0; 5])), refused(Refusal::StreamFull));
    assert_eq!(tick.points.len(), 4);
    assert!(matches!(
        asked(&mut service, &mut tick, 10, points(&[f32::NAN])),
        Reply::Say(FromBoard::Refused(Refusal::OutOfRange { .. }))
    ));
}

#[test]
fn points_under_a_number_that_was_used_long_ago_are_appended() {
    let (mut service, mut tick) = (service(), tick_in(State::Run));
    let points = || ToBoard::StreamPoints([0.5].into_iter().collect());
    asked(&mut service, &mut tick, 7, points());
    // The numbers of requests wrap.
    for sequence in (8..=u16::MAX).chain(0..7) {
        asked(&mut service, &mut tick, sequence, ToBoard::Alive);
    }
    asked(&mut service, &mut tick, 7, points());
    assert_eq!(tick.points, [1 << 19, 1 << 19]);
}

#[test]
fn a_silent_host_stops_a_joint_that_moves() {
    let (mut service, mut tick) = (service(), tick_in(State::Run));
    let limit_ms = (service.parameters().host_timeout_s() * 1e3) as u32;
    // The clock may wrap between the last word and now.
    let heard_ms = u32::MAX - 10;
    service.handle(&Request { sequence: 1, message: ToBoard::Alive }, heard_ms, &mut tick);
    service.supervise(heard_ms.wrapping_add(limit_ms), &mut tick);
    assert!(tick.commands.is_empty());
    tick.view.state = State::Ready;
    service.supervise(heard_ms.wrapping_add(limit_ms + 1), &mut tick);
    assert!(tick.commands.is_empty());
    tick.view.state = State::Run;
    service.supervise(heard_ms.wrapping_add(limit_ms + 1), &mut tick);
    assert!(matches!(tick.commands[0], Command::Trip(Fault::HostSilent, 0, silent, limit) if silent > limit));
}

#[test]
fn states_that_do_not_follow_are_refused() {
    let run = ToBoard::Enter(Goal::Run(Mode::Position));
    let mut tick = tick_in(State::Fault);
    assert_eq!(asked(&mut service(), &mut tick, 1, run.clone()), refused(Refusal::WrongState(State::Fault)));
    tick.view.state = State::Ready;
    assert_eq!(asked(&mut service(), &mut tick, 2, run), Reply::Say(FromBoard::Done));
    assert_eq!(tick.commands, [Command::Enter(Goal::Run(Mode::Position))]);
}

#[test]
fn a_reference_that_the_joint_cannot_do_is_refused_before_the_run() {
    let sine = |amplitude, frequency_hz| {
        let shape = Shape::Sine;
        ToBoard::SetReference(Reference::Generated { shape, amplitude, offset: 0.0, frequency_hz })
    };
    let run = |mode| ToBoard::Enter(Goal::Run(mode));
    let out_of_range = |reply: Reply, value: f32| match reply {
        Reply::Say(FromBoard::Refused(Refusal::OutOfRange { got, minimum, maximum })) => {
            assert_eq!((got, minimum), (value, -maximum));
            maximum
        }
        reply => panic!("{reply:?}"),
    };
    let (mut service, mut tick) = (service(), tick_in(State::Ready));
    // Beyond the range in both modes.
    let largest = out_of_range(asked(&mut service, &mut tick, 1, sine(99.0, 0.5)), 99.0);
    assert!((0.5..1.2).contains(&largest), "{largest}");
    assert!(tick.commands.is_empty());
    // 0.8 rad, but not 0.8 N·m: only the run says which.
    assert_eq!(asked(&mut service, &mut tick, 2, sine(0.8, 0.5)), Reply::Say(FromBoard::Done));
    tick.commands.clear();
    let largest = out_of_range(asked(&mut service, &mut tick, 3, run(Mode::Torque)), 0.8);
    assert!((0.3..0.65).contains(&largest), "{largest}");
    assert!(tick.commands.is_empty());
    assert_eq!(asked(&mut service, &mut tick, 4, run(Mode::Position)), Reply::Say(FromBoard::Done));
    // A running joint knows: 0.8 rad once more at another frequency, of which there is too much at 5 Hz.
    tick.view.state = State::Run;
    assert_eq!(asked(&mut service, &mut tick, 5, sine(0.8, 0.4)), Reply::Say(FromBoard::Done));
    let largest = out_of_range(asked(&mut service, &mut tick, 6, sine(0.8, 5.0)), 0.8);
    assert_eq!(asked(&mut service, &mut tick, 7, sine(largest, 5.0)), Reply::Say(FromBoard::Done));
    assert_eq!(tick.commands.len(), 3);
}

fn table() -> RippleTable {
    RippleTable::new(0.5, 0.25, &std::array::from_fn(|point| 100 * point.cast_signed() as i16)).unwrap()
}

/// Sends all points; the answers.
fn send_points(service: &mut Service, tick: &mut Tick) -> Vec<Reply> {
    let table = table();
    let parts = table.points_raw().chunks(TABLE_CHUNK).map(|part| part.iter().copied().collect());
    (0..)
        .step_by(TABLE_CHUNK)
        .zip(parts.collect::<Vec<_>>())
        .map(|(first, points_raw)| {
            asked(service, tick, first, ToBoard::WriteTablePoints { first, points_raw })
        })
        .collect()
}

#[test]
fn a_table_reaches_the_tick_only_whole() {
    let (mut service, mut tick) = (service(), tick_in(State::Off));
    let activate = || ToBoard::ActivateTable(table().head());
    assert_eq!(asked(&mut service, &mut tick, 1, activate()), refused(Refusal::TableDiffers));
    assert!(send_points(&mut service, &mut tick).iter().all(|reply| *reply == Reply::Say(FromBoard::Done)));
    // Another period or scale than the checksum was made of, and one that there cannot be.
    let mut other = table().head();
    other.period_rad = 0.25;
    assert_eq!(
        asked(&mut service, &mut tick, 2, ToBoard::ActivateTable(other)),
        refused(Refusal::TableDiffers)
    );
    other.full_scale_nm = f32::NAN;
    let reply = asked(&mut service, &mut tick, 3, ToBoard::ActivateTable(other));
    assert!(matches!(reply, Reply::Say(FromBoard::Refused(Refusal::OutOfRange { .. }))), "{reply:?}");
    // A tick without room leaves things as they are.
    while tick.command(Command::Enter(Goal::Off)) {}
    assert_eq!(asked(&mut service, &mut tick, 4, activate()), refused(Refusal::Busy));
    assert_eq!(service.table(), None);
    tick.commands.clear();
    assert_eq!(asked(&mut service, &mut tick, 5, activate()), Reply::Say(FromBoard::Done));
    assert_eq!(
        (service.table(), tick.commands.pop_front()),
        (Some(&table()), Some(Command::Table(Some(table()))))
    );
    let report = Reply::Say(FromBoard::Table(TableReport::Whole(table().head())));
    assert_eq!(asked(&mut service, &mut tick, 6, ToBoard::ReadTable), report);
    // Read back from anywhere; the last part is short.
    let last = asked(&mut service, &mut tick, 7, ToBoard::ReadTablePoints(TABLE_POINTS as u16 - 2));
    let points_raw = [25_400, 25_500].into_iter().collect();
    assert_eq!(last, Reply::Say(FromBoard::TablePoints(points_raw)));
    let beyond = asked(&mut service, &mut tick, 8, ToBoard::ReadTablePoints(TABLE_POINTS as u16));
    assert_eq!(beyond, refused(Refusal::NoSuchIndex));
    // While the joint moves it stays.
    tick.view.state = State::Run;
    assert!(send_points(&mut service, &mut tick).iter().all(|reply| *reply == refused(Refusal::Moving)));
    for message in [activate(), ToBoard::ClearTable] {
        assert_eq!(asked(&mut service, &mut tick, 9, message), refused(Refusal::Moving));
    }
    tick.view.state = State::Ready;
    assert_eq!(asked(&mut service, &mut tick, 10, ToBoard::ClearTable), Reply::Say(FromBoard::Done));
    assert_eq!((service.table(), tick.commands.pop_front()), (None, Some(Command::Table(None))));
}

#[test]
fn a_fault_stays_while_the_stored_table_cannot_be_read() {
    for message in [ToBoard::ActivateTable(table().head()), ToBoard::ClearTable] {
        let mut service = service().with_table(&Err(StoreError::Unusable));
        let mut tick = tick_in(State::Fault);
        let clear = || ToBoard::Enter(Goal::ClearFault);
        assert_eq!(asked(&mut service, &mut tick, 1, clear()), refused(Refusal::TableUnreadable));
        let report = Reply::Say(FromBoard::Table(TableReport::Unreadable));
        assert_eq!(asked(&mut service, &mut tick, 2, ToBoard::ReadTable), report);
        send_points(&mut service, &mut tick);
        assert_eq!(asked(&mut service, &mut tick, 3, message), Reply::Say(FromBoard::Done));
        assert!(!service.table_is_unreadable());
        assert_eq!(asked(&mut service, &mut tick, 4, clear()), Reply::Say(FromBoard::Done));
    }
}

#[test]
fn the_boot_loader_is_left_for_with_the_bridge_off_only() {
    for state in [State::Off, State::Fault] {
        assert_eq!(
            asked(&mut service(), &mut tick_in(state), 1, ToBoard::EnterBootLoader),
            Reply::BootLoader
        );
    }
    for state in [State::SelfTest, State::PretensionCheck, State::Ready, State::Homing, State::Run] {
        let reply = asked(&mut service(), &mut tick_in(state), 1, ToBoard::EnterBootLoader);
        assert_eq!(reply, refused(Refusal::WrongState(state)));
    }
}
