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

use bowden_control::parameters::Parameters;
use bowden_control::service::Reply;
use bowden_host_link::native_board::NativeBoard;
use bowden_link::message::Goal;
use bowden_link::{FromBoard, Request, State, ToBoard};

use crate::joint::{Joint, Mishap};
use script::{Action, Script};
use watch::{Order, Settings, Watch};

pub use script::seeds;

/// Ticks of one sequence, at most.
const TICKS: u32 = 60_000;

/// What a sequence did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Ticks with the bridge on.
    pub driven: u32,
    /// Ticks with the duty at its limit.
    pub at_duty_limit: u32,
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

/// Control, services and joint.
struct Board {
    /// Tags are the settings that act from an order on, where it changes them.
    native: NativeBoard<Option<Settings>>,
    joint: Joint,
    mishap: Option<(Mishap, u32)>,
    /// Ticks for which the host goes on being silent.
    silent: u32,
    number: u16,
    watch: Watch,
}

impl Board {
    fn new() -> Self {
        Self {
            native: NativeBoard::new("", ""),
            joint: Joint::default(),
            mishap: None,
            silent: 0,
            number: 0,
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
                    if matches!(self.native.controller().state(), State::Ready | State::Fault | State::Off) {
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
        let before = self.native.waiting().len();
        let request = Request { sequence: self.number, message };
        let reply = self.native.handle(&request, None);
        self.watch.heard_ns = self.now_ns();
        let at_rest = !self.native.controller().state().drives();
        match reply {
            Reply::Say(FromBoard::Done) => {
                let changed = match request.message {
                    ToBoard::WriteParameter { index, value } => self.watch.told.write(index, value),
                    ToBoard::DefaultParameters => self.watch.told.write_defaults(),
                    _ => false,
                };
                if changed {
                    assert_eq!(
                        self.native.waiting().len(),
                        before + 1,
                        "a value that is set reaches the tick"
                    );
                    let settings = self.watch.told.settings();
                    self.native.waiting()[before].1 = Some(settings);
                }
            }
            Reply::Say(FromBoard::Refused(refusal)) => {
                self.watch.tally.refused += 1;
                crate::judge::is_one_line(&refusal.to_string());
                assert_eq!(self.native.waiting().len(), before, "what is refused does not reach the tick");
            }
            Reply::Say(_) => {}
            Reply::Store => assert!(at_rest, "the flash is written while the bridge is on"),
            Reply::BootLoader => assert!(at_rest, "the firmware is left while the bridge is on"),
            Reply::Suffer(provocation) => {
                assert!(self.watch.told.allows_provocation(), "provoked without leave");
                self.native.suffer(provocation, None);
            }
        }
        for index in 0..Parameters::COUNT {
            assert_eq!(
                self.native.service().parameters().get(index),
                Some(self.watch.told.value(index)),
                "parameter {index}"
            );
        }
    }

    fn tick(&mut self) {
        const ALIVE_NS: u64 = 20_000_000;
        if self.silent > 0 {
            self.silent -= 1;
        } else if self.now_ns() - self.watch.heard_ns >= ALIVE_NS.min(self.watch.told.timeout_ns() / 4) {
            self.ask(ToBoard::Alive);
        }
        let mishaps: Vec<Mishap> = self.mishap.iter().map(|(mishap, _)| *mishap).collect();
        self.mishap = self.mishap.and_then(|(mishap, left)| left.checked_sub(1).map(|left| (mishap, left)));
        let input = self.joint.measure(&mishaps);
        let before = (self.native.controller().state(), self.native.controller().fault());
        let output = self.native.tick(&input);
        let after = (self.native.controller().state(), self.native.controller().fault());
        let period_ns = self.native.period_ns();
        let taken = self.native.taken().command;
        self.watch.tick(
            taken.map(|(command, settings)| (Order::of(&command), settings)),
            before,
            after,
            &output,
            &self.joint,
            !mishaps.is_empty(),
            self.now_ns(),
            period_ns,
        );
        let wired = self.watch.in_force().bridge_direction;
        self.joint.advance(
            period_ns as f64 * 1e-9,
            wired * f64::from(output.duty_raw) / 32_767.0,
            output.bridge_on,
        );
        self.native.pass(None);
    }

    fn now_ns(&self) -> u64 {
        self.native.now().as_nanos() as u64
    }
}
