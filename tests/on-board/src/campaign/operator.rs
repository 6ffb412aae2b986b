//! Who drives the joint: orders the usual things, watches the true joint, and does not mind a board that does not answer.

use std::collections::VecDeque;

use bowden_link::message::{Goal, Mode, Reference};
use bowden_link::{FromBoard, State, ToBoard};

use super::trouble::{Trouble, Underway};
use crate::Outcome;
use crate::host::Host;

/// Board time between two looks \[s\].
pub const LOOK_S: f64 = 1e-3;
/// Time between two signs of life \[s\]; the board waits for 0.5 s.
const ALIVE_S: f64 = 0.1;
/// Time in which the state is told: a flood of other requests waits before it \[s\].
const ANSWER_S: f64 = 0.5;
/// Time between two questions for the state \[s\].
const ASKED_S: f64 = 5e-3;

/// A moment of the true joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// How many times the bridge had closed.
    pub leg: u64,
    /// Time since it closed last \[s\].
    pub t_s: f64,
    /// Control tick that began last.
    pub tick: u32,
    /// Board time \[s\].
    pub at_s: f64,
    /// Angle of the joint \[rad\].
    pub angle_rad: f64,
}

/// How an order ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reached {
    /// The board is in the state that was asked for.
    State,
    /// It stopped: fault, or reset.
    Stopped,
    /// It said nothing of it in time.
    Nothing,
}

/// A host with its troubles.
pub struct Operator {
    /// Host and board.
    pub host: Host,
    /// Faults to come, with the board time at which they begin \[s\].
    pub due: VecDeque<(f64, Trouble)>,
    /// Faults that have begun.
    pub underway: Vec<Underway>,
    /// Board time at which the first one began \[s\].
    pub began_s: Option<f64>,
    /// What the joint did while the bridge was closed.
    pub looks: Vec<Look>,
    spoken_s: f64,
    /// Boots and openings of the bridge before the first fault.
    before: (u64, u64),
}

impl Operator {
    /// An operator of `host` without troubles.
    pub fn new(host: Host) -> Self {
        let before = (host.board.counters().boots, host.board.bridge_events().openings);
        Self {
            host,
            due: VecDeque::new(),
            underway: Vec::new(),
            began_s: None,
            looks: Vec::new(),
            spoken_s: 0.0,
            before,
        }
    }

    /// Board time \[s\].
    pub fn now_s(&self) -> f64 {
        self.host.board.time_s()
    }

    /// Lets the faults begin: the first one `instant_s` from now, the next one `apart_s` behind it.
    pub fn expect(&mut self, troubles: &[Trouble], instant_s: f64, apart_s: f64) {
        for (index, trouble) in troubles.iter().enumerate() {
            self.due.push_back((self.now_s() + instant_s + index as f64 * apart_s, trouble.clone()));
        }
    }

    /// Whether the bridge has opened, or the board started anew, since the first fault began.
    pub fn has_stopped(&self) -> bool {
        let (boots, openings) = self.before;
        let board = &self.host.board;
        self.began_s.is_some()
            && (board.counters().boots != boots || board.bridge_events().openings != openings)
    }

    /// Whether the board started anew since the first fault began.
    pub fn has_begun_anew(&self) -> bool {
        self.began_s.is_some() && self.host.board.counters().boots != self.before.0
    }

    /// Lets a look's time pass; faults begin and go on.
    pub fn look(&mut self) -> Outcome {
        let end_s = self.now_s() + LOOK_S;
        while let Some((at_s, _)) = self.due.front()
            && *at_s < end_s
        {
            let ahead_s = *at_s - self.now_s();
            if ahead_s > 0.0 {
                self.host.pass(ahead_s)?;
            }
            if let Some((_, trouble)) = self.due.pop_front() {
                if self.began_s.is_none() {
                    self.began_s = Some(self.now_s());
                    self.host.board.take_peaks();
                    let board = &self.host.board;
                    self.before = (board.counters().boots, board.bridge_events().openings);
                }
                self.underway.push(Underway::begin(&mut self.host, &trouble)?);
            }
        }
        for trouble in &mut self.underway {
            trouble.attend(&mut self.host)?;
        }
        if self.now_s() - self.spoken_s > ALIVE_S && self.host.board.usb_ready() {
            self.spoken_s = self.now_s();
            self.host.send(ToBoard::Alive)?;
        }
        let left_s = end_s - self.now_s();
        if left_s > 0.0 {
            self.host.pass(left_s)?;
        }
        let (board, events) = (&self.host.board, self.host.board.bridge_events());
        if board.pwm().duty.is_some() {
            self.looks.push(Look {
                leg: events.closings,
                t_s: board.time_s() - events.closed_s,
                tick: self.host.ticks.begun.wrapping_sub(1),
                at_s: board.time_s(),
                angle_rad: board.bench().theta_out_rad(),
            });
        }
        Ok(())
    }

    /// Lets `seconds` pass, less if the board stops.
    pub fn drive(&mut self, seconds: f64) -> Outcome {
        let end_s = self.now_s() + seconds;
        while self.now_s() < end_s && !self.has_stopped() {
            self.look()?;
        }
        Ok(())
    }

    /// Asks for the state; `None` without an answer in time, or if the board stops meanwhile.
    fn state(&mut self) -> Outcome<Option<State>> {
        self.host.forget_answers();
        let number = self.host.send(ToBoard::ReadStatus)?;
        let end_s = self.now_s() + ANSWER_S;
        while self.now_s() < end_s {
            if let Some(FromBoard::Status(status)) = self.host.answer_to(number) {
                return Ok(Some(status.state));
            }
            self.look()?;
            if self.has_stopped() {
                break;
            }
        }
        Ok(None)
    }

    /// Waits for `state`, at most `limit_s`.
    pub fn reach(&mut self, state: State, limit_s: f64) -> Outcome<Reached> {
        let end_s = self.now_s() + limit_s;
        while self.now_s() < end_s {
            match self.state()? {
                Some(found) if found == state => return Ok(Reached::State),
                Some(State::Fault) => return Ok(Reached::Stopped),
                _ if self.has_stopped() => return Ok(Reached::Stopped),
                _ => {}
            }
            let next_s = self.now_s() + ASKED_S;
            while self.now_s() < next_s {
                self.look()?;
            }
        }
        Ok(Reached::Nothing)
    }

    /// Orders something, and gives it a moment to arrive.
    pub fn order(&mut self, message: ToBoard) -> Outcome {
        self.host.send(message)?;
        for _ in 0..3 {
            self.look()?;
        }
        Ok(())
    }

    /// Follows `reference` from ready.
    pub fn follow(&mut self, reference: Reference) -> Outcome<Reached> {
        self.order(ToBoard::SetReference(reference))?;
        self.order(ToBoard::Enter(Goal::Run(Mode::Position)))?;
        self.reach(State::Run, ANSWER_S)
    }

    /// From off to ready.
    pub fn make_ready(&mut self) -> Outcome<Reached> {
        self.order(ToBoard::Enter(Goal::Ready))?;
        // The self test ends after 2 s at the latest.
        self.reach(State::Ready, 2.6)
    }

    /// From ready to zero, where the bridge opens.
    pub fn home(&mut self) -> Outcome<Reached> {
        self.order(ToBoard::Enter(Goal::Home))?;
        let reached = self.reach(State::Homing, ANSWER_S)?;
        if reached != Reached::State {
            return Ok(reached);
        }
        let end_s = self.now_s() + 3.0;
        while self.host.board.pwm().duty.is_some() && !self.has_begun_anew() {
            if self.now_s() > end_s {
                return Ok(Reached::Nothing);
            }
            self.look()?;
        }
        let (boots, openings) = self.before;
        // Asked for as of an opening that was expected.
        self.before.1 = self.host.board.bridge_events().openings;
        let reached = self.reach(State::Ready, ANSWER_S)?;
        if reached != Reached::State {
            self.before = (boots, openings);
        }
        Ok(reached)
    }
}
