//! The board's request handler and its control, under any sequence of requests, with a joint behind it.
//!
//! Bytes become requests, ticks and mishaps of sensors, in any order. What has to hold in every tick:
//!
//! | property | by what is it judged |
//! |---|---|
//! | duty within `bridge.duty_limit`, and that within 0.98 | the values that the host was told are set |
//! | the bridge is on in homing and run only, and these are reached only along the states of `firmware/control` | the orders that the tick took up |
//! | a fault stays, to the bit, with the bridge off, until the host orders it cleared | the record of the tick that found it |
//! | the reference stays within the limits that were set when the bridge went on, in range and in rate | as above, and where the joint stood |
//! | the motor's current stays within `limits.current` where the host has not changed what the motor, the sensors and the bridge are | the joint's own current |
//! | a joint that moves while the host is silent is stopped within `supervisor.host_timeout` | the time of the last request |

mod script;
mod watch;

use std::collections::VecDeque;

use bowden_control::controller::Controller;
use bowden_control::parameters::Parameters;
use bowden_control::service::{Identity, Port, Reply, Service, View};
use bowden_control::snapshot::Snapshot;
use bowden_control::tick::{Command, Inbox};
use bowden_control::tick_config;
use bowden_link::message::{Boot, Chip, Goal, Provocation};
use bowden_link::{Fault, FromBoard, Request, Sample, State, ToBoard};

use crate::joint::{Joint, Mishap};
use script::{Action, Script};
use watch::{Order, Settings, Watch};

pub use script::seeds;

/// Commands that wait for a tick, and points of a streamed reference, at most.
const COMMANDS: usize = 4;
const POINTS: usize = 256;

/// Ticks of one sequence, at most.
const TICKS: u32 = 60_000;

/// What a sequence did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Ticks with the bridge on.
    pub driven: u32,
    /// Faults found.
    pub faults: u32,
    /// Requests refused.
    pub refused: u32,
    /// Largest angle of the joint, rad.
    pub farthest_rad: f64,
    /// Largest excess of the motor's current over its limit, A; below zero while there was none.
    pub excess_a: f64,
}

/// Any bytes as a sequence.
pub fn run(bytes: &[u8]) {
    carry_out(bytes);
}

/// Carries out what bytes say.
///
/// # Panics
/// Where a property does not hold.
pub fn carry_out(bytes: &[u8]) -> Tally {
    let mut board = Board::new();
    let mut script = Script::new(bytes);
    while let Some(action) = script.action()
        && board.watch.ticks < TICKS
    {
        board.act(action);
    }
    board.watch.tally
}

/// Commands on their way to the tick, each with the settings that act from it on.
#[derive(Default)]
struct Queues {
    commands: VecDeque<(Command, Option<Settings>)>,
    points: VecDeque<i32>,
    /// What the tick took up.
    taken: Option<(Order, Option<Settings>)>,
}

impl Inbox for Queues {
    fn command<R>(&mut self, act: impl FnOnce(&Command) -> R) -> Option<R> {
        let (command, settings) = self.commands.pop_front()?;
        self.taken = Some((Order::of(&command), settings));
        Some(act(&command))
    }

    fn stream_point(&mut self) -> Option<i32> {
        self.points.pop_front()
    }
}

/// What the service reaches of the tick.
struct Reach<'b> {
    queues: &'b mut Queues,
    snapshot: &'b Snapshot,
    view: View,
    divider: &'b mut u16,
}

impl Port for Reach<'_> {
    fn command(&mut self, command: Command) -> bool {
        let room = self.queues.commands.len() < COMMANDS;
        if room {
            self.queues.commands.push_back((command, None));
        }
        room
    }

    fn stream_free(&self) -> usize {
        POINTS - self.queues.points.len()
    }

    fn stream(&mut self, point_raw: i32) -> bool {
        let room = self.stream_free() > 0;
        if room {
            self.queues.points.push_back(point_raw);
        }
        room
    }

    fn view(&self) -> View {
        self.view
    }

    fn snapshot(&self, index: u8) -> Option<(u32, Sample)> {
        self.snapshot.get(index.into())
    }

    fn adopt(&mut self, parameters: &Parameters) {
        *self.divider = parameters.rate_divider();
    }
}

/// Control, service and joint.
struct Board {
    controller: Controller,
    service: Service,
    queues: Queues,
    snapshot: Snapshot,
    divider: u16,
    joint: Joint,
    mishap: Option<(Mishap, u32)>,
    /// Ticks for which the host goes on being silent.
    silent: u32,
    number: u16,
    now_ns: u64,
    supervised_ns: u64,
    watch: Watch,
}

impl Board {
    fn new() -> Self {
        let parameters = Parameters::default();
        let config = tick_config(&parameters).expect("default parameters fit together");
        let identity = Identity {
            firmware: "",
            board: "",
            revision: "",
            serial: "",
            boot: Boot::Power,
            chip: Chip::EXPECTED,
        };
        Self {
            controller: Controller::new(config),
            divider: parameters.rate_divider(),
            service: Service::new(identity, parameters, ""),
            queues: Queues::default(),
            snapshot: Snapshot::new(),
            joint: Joint::default(),
            mishap: None,
            silent: 0,
            number: 0,
            now_ns: 0,
            supervised_ns: 0,
            watch: Watch::default(),
        }
    }

    fn act(&mut self, action: Action) {
        match action {
            Action::Ask(message) => self.ask(message),
            Action::Prepare => {
                self.ask(ToBoard::Enter(Goal::ClearFault));
                self.ask(ToBoard::Enter(Goal::Off));
                self.tick();
                self.tick();
                self.ask(ToBoard::Enter(Goal::Ready));
                for _ in 0..2500 {
                    self.tick();
                    if matches!(self.controller.state(), State::Ready | State::Fault | State::Off) {
                        break;
                    }
                }
            }
            Action::Ticks(count) => (0..count).for_each(|_| self.tick()),
            Action::Mishap(mishap, ticks) => self.mishap = Some((mishap, ticks)),
            Action::Silence(ticks) => self.silent = ticks,
        }
    }

    /// Sends a request, and keeps by the answer what is set.
    fn ask(&mut self, message: ToBoard) {
        self.number = self.number.wrapping_add(1);
        let before = self.queues.commands.len();
        let request = Request { sequence: self.number, message };
        let now_ms = self.now_ms();
        let (service, mut reach) = self.parts();
        let reply = service.handle(&request, now_ms, &mut reach);
        self.watch.heard_ns = self.now_ns;
        let at_rest = !self.controller.state().drives();
        match reply {
            Reply::Say(FromBoard::Done) => {
                let changed = match request.message {
                    ToBoard::WriteParameter { index, value } => self.watch.told.write(index, value),
                    ToBoard::DefaultParameters => self.watch.told.write_defaults(),
                    _ => false,
                };
                if changed {
                    assert_eq!(
                        self.queues.commands.len(),
                        before + 1,
                        "a value that is set reaches the tick"
                    );
                    let settings = self.watch.told.settings();
                    self.queues.commands[before].1 = Some(settings);
                }
            }
            Reply::Say(FromBoard::Refused(refusal)) => {
                self.watch.tally.refused += 1;
                crate::judge::is_one_line(&refusal.to_string());
                assert_eq!(self.queues.commands.len(), before, "what is refused does not reach the tick");
            }
            Reply::Say(_) => {}
            Reply::Store => assert!(at_rest, "the flash is written while the bridge is on"),
            Reply::BootLoader => assert!(at_rest, "the firmware is left while the bridge is on"),
            Reply::Suffer(provocation) => {
                assert!(self.watch.told.allows_provocation(), "provoked without leave");
                let fault = match provocation {
                    Provocation::Panic => Fault::Panic,
                    Provocation::ProcessorFault => Fault::HardFault,
                    Provocation::Hang => Fault::Watchdog,
                    Provocation::LateTick => Fault::TickOverrun,
                    Provocation::StackOverflow => Fault::StackOverflow,
                };
                if self.queues.commands.len() < COMMANDS {
                    self.queues.commands.push_back((Command::Trip(fault, 0, 1.0, 0.0), None));
                }
            }
        }
        for index in 0..Parameters::COUNT {
            assert_eq!(
                self.service.parameters().get(index),
                Some(self.watch.told.value(index)),
                "parameter {index}"
            );
        }
    }

    fn tick(&mut self) {
        const ALIVE_NS: u64 = 20_000_000;
        const SUPERVISION_NS: u64 = 5_000_000;
        if self.silent > 0 {
            self.silent -= 1;
        } else if self.now_ns - self.watch.heard_ns >= ALIVE_NS.min(self.watch.told.timeout_ns() / 4) {
            self.ask(ToBoard::Alive);
        }
        let mishaps: Vec<Mishap> = self.mishap.iter().map(|(mishap, _)| *mishap).collect();
        self.mishap = self.mishap.and_then(|(mishap, left)| left.checked_sub(1).map(|left| (mishap, left)));
        let input = self.joint.measure(&mishaps);
        let before = (self.controller.state(), self.controller.fault());
        let tick = self.controller.tick_count();
        self.queues.taken = None;
        let output = self.controller.tick(&input, &mut self.queues);
        self.snapshot.push(tick, &output.sample);
        let after = (self.controller.state(), self.controller.fault());
        let period_ns = u64::from(self.divider) * 50_000;
        self.watch.tick(
            self.queues.taken.take(),
            before,
            after,
            &output,
            &self.joint,
            !mishaps.is_empty(),
            self.now_ns,
            period_ns,
        );
        let wired = self.watch.in_force().bridge_direction;
        self.joint.advance(
            period_ns as f64 * 1e-9,
            wired * f64::from(output.duty_raw) / 32_767.0,
            output.bridge_on,
        );
        self.now_ns += period_ns;
        if self.now_ns - self.supervised_ns >= SUPERVISION_NS {
            self.supervised_ns = self.now_ns;
            let now_ms = self.now_ms();
            let (service, mut reach) = self.parts();
            service.supervise(now_ms, &mut reach);
        }
    }

    fn now_ms(&self) -> u32 {
        (self.now_ns / 1_000_000) as u32
    }

    fn parts(&mut self) -> (&mut Service, Reach<'_>) {
        let view = View {
            state: self.controller.state(),
            fault: self.controller.fault(),
            limits: self.controller.limits(),
            tick: self.controller.tick_count(),
            longest_tick_cycles: 0,
            lost: 0,
            snapshot: self.snapshot.len() as u8,
            bus_errors: 0,
        };
        let reach =
            Reach { queues: &mut self.queues, snapshot: &self.snapshot, view, divider: &mut self.divider };
        (&mut self.service, reach)
    }
}
