//! States, and which fault counts in which.
//!
//! ```text
//! Off ─ready→ SelfTest → PretensionCheck → Ready ─run→ Run
//!                                          Ready ─home→ Homing → Ready
//! every state ─off→ Off      every state ─detection→ Fault ─clear→ Off
//! ```
//!
//! | fault | off | self test | pretension check | ready | homing | run |
//! |---|---|---|---|---|---|---|
//! | encoder frames, jumps | | x | x | x | x | x |
//! | encoder stuck, tension stuck, restless or swapped, joint speed | | | | | x | x |
//! | open motor lead, surplus of current | | | | | x | x |
//! | joint range, tracking error: position mode | | | | | | x |
//! | tension at a rail | | x | x | x | x | x |
//! | slack, over-tension, tensions that contradict each other or the stretch | | | | x | x | x |
//! | over-current, bus voltage, bridge | | x | x | x | x | x |
//! | self test timeout | | x | | | | |
//! | pretension off | | | x | | | |
//! | homing timeout | | | | | x | |
//! | tick overrun, host silent, store, watchdog, panic (as [`crate::tick::Command::Trip`]) | x | x | x | x | x | x |
//!
//! Off is left alone because benches are wired, powered and loosened then.
//! The gate driver is switched on with the self test and off in off and fault; what its fault line says while it wakes does not
//! count. In the self test and the pretension check a
//! slack tendon is told as [`Fault::PretensionOff`], which says what to do. Stuck encoders need motion.

pub mod rest;

use bowden_link::message::{Goal, Mode};
use bowden_link::{Fault, FaultRecord, State};

use crate::detection::Detection;
use crate::scale::{Angle, Current, Tension};
use crate::sheath::Fitted;
use crate::tension::TensionChecks;

/// Whether a goal can be asked for in this state.
///
/// | goal | from |
/// |---|---|
/// | off | every state but fault: a fault is cleared on purpose |
/// | ready | off; ready, to check once more |
/// | home, run | ready |
/// | clear fault | fault |
#[must_use]
pub const fn allows(state: State, goal: Goal) -> bool {
    match goal {
        Goal::Off => !matches!(state, State::Fault),
        Goal::Ready => matches!(state, State::Off | State::Ready),
        Goal::Home | Goal::Run(_) => matches!(state, State::Ready),
        Goal::ClearFault => matches!(state, State::Fault),
    }
}

/// Times and bands of the states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SupervisorConfig {
    /// Ticks of a look at the sensors at rest.
    pub rest_ticks: u16,
    /// Ticks that the gate driver needs to wake, which it does in the self test.
    pub wake_ticks: u32,
    /// Ticks in which the self test has to pass.
    pub self_test_ticks: u32,
    /// Largest variance of a tension at rest, codes², in 2⁻⁸.
    pub noise_limit: [u32; 4],
    /// Which tensions are measured.
    pub fitted: Fitted,
    /// Largest mean current with the bridge off.
    pub rest_current: Current,
    /// Pretension.
    pub pretension: Tension,
    /// How far the mean tension at rest may be from it.
    pub pretension_band: Tension,
    /// How near to angle zero homing ends.
    pub homing_band: Angle,
    /// Ticks for which the joint has to stay there.
    pub homing_dwell_ticks: u16,
    /// Ticks in which homing has to end.
    pub homing_ticks: u32,
    /// Length of a tick, s; for reports.
    pub period_s: f32,
}

/// State of the supervisor.
#[derive(Clone, Copy, Debug, Default)]
pub struct Supervisor {
    state: State,
    mode: Mode,
    fault: Option<FaultRecord>,
    /// Ticks since this state was entered.
    elapsed: u32,
    dwell: u16,
    rest: rest::RestLook,
}

/// What the supervisor looks at.
#[derive(Clone, Copy, Debug)]
pub struct Situation {
    /// Codes of f1 to f4.
    pub tension_raw: [u16; 4],
    /// Tensions f1 to f4.
    pub tensions: [Tension; 4],
    /// Positions of both encoders.
    pub counts: [i32; 2],
    /// Motor current.
    pub current: Current,
    /// Angle of the joint.
    pub theta_out: Angle,
    /// The reference has arrived at its goal.
    pub arrived: bool,
}

impl Supervisor {
    /// State.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }

    /// What the reference of a run means.
    #[must_use]
    pub const fn mode(&self) -> Mode {
        self.mode
    }

    /// Fault that waits to be cleared.
    #[must_use]
    pub const fn fault(&self) -> Option<FaultRecord> {
        self.fault
    }

    /// Whether faults of sensors, supply and bridge count.
    #[must_use]
    pub const fn watches(&self) -> bool {
        !matches!(self.state, State::Off | State::Fault)
    }

    /// Whether the gate driver is on: from the self test on, so that it is awake long before the first duty.
    #[must_use]
    pub const fn wakes_driver(&self) -> bool {
        self.watches()
    }

    /// Whether its fault line counts: not while it wakes.
    #[must_use]
    pub const fn hears_driver(&self, config: &SupervisorConfig) -> bool {
        self.watches() && !(matches!(self.state, State::SelfTest) && self.elapsed < config.wake_ticks)
    }

    /// Which faults of the tensions count.
    #[must_use]
    pub const fn tension_checks(&self) -> TensionChecks {
        TensionChecks {
            rail: self.watches(),
            load: matches!(self.state, State::Ready | State::Homing | State::Run),
        }
    }

    /// Follows an order, if this state allows it; whether it did.
    pub fn enter(&mut self, goal: Goal) -> bool {
        if !allows(self.state, goal) {
            return false;
        }
        let state = match goal {
            Goal::Off => State::Off,
            Goal::ClearFault => {
                self.fault = None;
                State::Off
            }
            Goal::Ready => State::SelfTest,
            Goal::Home => {
                self.mode = Mode::Position;
                State::Homing
            }
            Goal::Run(mode) => {
                self.mode = mode;
                State::Run
            }
        };
        self.change(state);
        true
    }

    /// Records a fault; `None` if there is one already. What the fault line of the gate driver was is told behind the stop:
    /// [`Fault::DriverWarning`] takes the place of a [`Fault::BridgeFault`], and of nothing else.
    pub fn trip(&mut self, found: Detection, tick: u32) -> Option<FaultRecord> {
        let is_warning = found.fault == Fault::DriverWarning;
        let may_be_named = match self.fault {
            None => !is_warning,
            Some(before) => is_warning && before.fault == Fault::BridgeFault,
        };
        if !may_be_named {
            return None;
        }
        let Detection { fault, channel, got, limit } = found;
        let record = FaultRecord { fault, channel, tick, got, limit };
        self.fault = Some(record);
        self.change(State::Fault);
        Some(record)
    }

    fn change(&mut self, state: State) {
        self.state = state;
        self.elapsed = 0;
        self.dwell = 0;
        self.rest = rest::RestLook::default();
    }

    /// One tick of the present state: goes on to the next one, or finds that it cannot. A run does not ask for the situation.
    #[inline]
    pub fn step(
        &mut self,
        config: &SupervisorConfig,
        situation: impl FnOnce() -> Situation,
    ) -> Option<Detection> {
        self.elapsed = self.elapsed.saturating_add(1);
        match self.state {
            State::Off | State::Ready | State::Run | State::Fault => None,
            State::SelfTest | State::PretensionCheck | State::Homing => self.look(config, &situation()),
        }
    }

    /// Out of line: a run does not come by.
    #[inline(never)]
    fn look(&mut self, config: &SupervisorConfig, situation: &Situation) -> Option<Detection> {
        match self.state {
            State::SelfTest => {
                let verdict = self.rest.look(config, situation)?;
                self.rest = rest::RestLook::default();
                match verdict.restless {
                    None if self.elapsed >= config.wake_ticks => self.change(State::PretensionCheck),
                    Some(channel) if self.elapsed >= config.self_test_ticks => {
                        let seconds = |ticks: u32| ticks as f32 * config.period_s;
                        return Some(Detection::new(
                            Fault::SelfTestTimeout,
                            channel,
                            seconds(self.elapsed),
                            seconds(config.self_test_ticks),
                        ));
                    }
                    _ => {}
                }
                None
            }
            State::PretensionCheck => {
                let verdict = self.rest.look(config, situation)?;
                let off = verdict.pretension_off(config);
                if off.is_none() {
                    self.change(State::Ready);
                }
                off
            }
            State::Homing => {
                let there = situation.arrived && situation.theta_out.magnitude() <= config.homing_band;
                self.dwell = if there { self.dwell.saturating_add(1) } else { 0 };
                if self.dwell >= config.homing_dwell_ticks {
                    self.change(State::Ready);
                    return None;
                }
                (self.elapsed >= config.homing_ticks).then(|| {
                    let seconds = |ticks: u32| ticks as f32 * config.period_s;
                    Detection::new(
                        Fault::HomingTimeout,
                        0,
                        seconds(self.elapsed),
                        seconds(config.homing_ticks),
                    )
                })
            }
            State::Off | State::Ready | State::Run | State::Fault => None,
        }
    }
}
